"""stable-baselines3's PPO and SAC, and sb3-contrib's TQC.

python examples/learners/sb3.py --algorithm ppo --out sb3.safetensors
Tried with stable-baselines3 2.9.2 and sb3-contrib 2.9.2.
"""

import time
from importlib import import_module
from typing import Any, Literal

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import torch
    import tyro
    from stable_baselines3.common.vec_env import VecNormalize

    from springfoot.agents import SegmentedFootBipedVecEnv, policy_from_sb3, save_policy
    from springfoot.tasks import TASKS

TASK: dict[str, Any] = {"episode_seconds": 10.0, "push_newton": 150.0}
NETWORK = {"net_arch": [64, 64], "activation_fn": torch.nn.Tanh}


def main(
    out: str = "sb3.safetensors",
    algorithm: Literal["ppo", "sac", "tqc"] = "ppo",
    timesteps: int = 131_072,
    seed: int = 0,
    task: str | None = None,
) -> None:
    """Train, on a frozen task such as Walk-v0 where one is given; write the deterministic action as a policy file."""
    torch.set_num_threads(1)
    with exiting_if_missing():
        library = import_module("sb3_contrib" if algorithm == "tqc" else "stable_baselines3")
    settings = TASK if task is None else TASKS[task]
    envs = VecNormalize(SegmentedFootBipedVecEnv(64 if algorithm == "ppo" else 16, **settings), gamma=0.98)
    own: dict[str, Any] = {"learning_starts": 2000, "gradient_steps": 4, "policy_kwargs": NETWORK}
    if algorithm == "ppo":
        noise = {"log_std_init": -0.9}  # gentle: a walker that falls at once learns little
        own = {"n_steps": 32, "batch_size": 256, "n_epochs": 8, "policy_kwargs": NETWORK | noise}
    learner = getattr(library, algorithm.upper())
    model = learner("MlpPolicy", envs, learning_rate=1e-3, gamma=0.98, seed=seed, device="cpu", **own)
    if timesteps:
        model.learn(timesteps)
    save_policy(out, policy_from_sb3(model, ignore_unvaried=True))  # without body and speed where neither varied
    print(f"{timesteps:,} steps took {time.process_time():.0f} s of a processor")


if __name__ == "__main__":
    tyro.cli(main)
