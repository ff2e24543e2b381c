"""sb3-contrib's RecurrentPPO. A policy with a memory is no policy file, but a function that evaluation can name.

python examples/learners/sb3_recurrent.py --out recurrent.safetensors
cd examples/learners && RECURRENT=../../recurrent.safetensors springfoot evaluate sb3_recurrent:act
Tried with sb3-contrib 2.9.2. Weights and statistics are kept as plain arrays: sb3's own files run code when read.
"""

import os
from functools import cache
from typing import Any

import numpy as np

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import torch
    import tyro
    from safetensors.torch import load_file, save_file
    from sb3_contrib import RecurrentPPO
    from stable_baselines3.common.vec_env import VecNormalize

    from springfoot.agents import SegmentedFootBipedVecEnv

HOW: dict[str, Any] = {"n_steps": 64, "batch_size": 256, "n_epochs": 4, "learning_rate": 1e-3, "gamma": 0.98}
NETWORK = {"net_arch": [64], "lstm_hidden_size": 32, "log_std_init": -0.9}
TASK: dict[str, Any] = {"episode_seconds": 10.0, "push_newton": 150.0}
STATISTICS = ("mean", "var")
LAST_ACTION = slice(34, 38)  # of the observation, all 0 at the start of an episode


def _untrained(num_envs: int, seed: int = 0) -> tuple[Any, Any]:
    envs = VecNormalize(SegmentedFootBipedVecEnv(num_envs, **TASK), gamma=0.98)
    return RecurrentPPO("MlpLstmPolicy", envs, seed=seed, policy_kwargs=NETWORK, **HOW), envs


def main(out: str = "recurrent.safetensors", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write weights and statistics."""
    torch.set_num_threads(1)
    model, envs = _untrained(16, seed)
    model.learn(timesteps)
    save_file(model.policy.state_dict() | {name: torch.tensor(getattr(envs.obs_rms, name)) for name in STATISTICS}, out)


@cache
def _trained() -> tuple[Any, Any]:
    (model, envs), arrays = _untrained(1), load_file(os.environ["RECURRENT"])
    envs.obs_rms.mean, envs.obs_rms.var = (arrays.pop(name).numpy() for name in STATISTICS)
    model.policy.load_state_dict(arrays)
    return model, envs


def act(observation: np.ndarray) -> np.ndarray:
    """Return actions (N, 4) for observations (N, D) of the same N episodes, step after step."""
    model, statistics = _trained()
    starts, seen = ~observation[:, LAST_ACTION].any(axis=1), statistics.normalize_obs(observation)
    known = act.memory if act.memory is not None and act.memory[0].shape[1] == len(observation) else None
    action, act.memory = model.predict(seen, known, episode_start=starts, deterministic=True)
    return action


act.settings, act.memory = TASK, None
if __name__ == "__main__":
    tyro.cli(main)
