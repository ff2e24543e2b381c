"""sb3-contrib's RecurrentPPO. A policy with a memory is no policy file, but a function that `evaluate.py` can name.

python examples/learners/sb3_recurrent.py --out recurrent.zip
cd examples/learners && RECURRENT=../../recurrent.zip python ../../evaluate.py sb3_recurrent:act
Tried with sb3-contrib 2.9.2. Its files are pickles, which run code when read: read only your own.
"""

import os
from functools import cache
from typing import Any

import numpy as np
import torch
import tyro
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.vec_env import VecNormalize

from springfoot.agents import SegmentedFootBipedVecEnv

TASK: dict[str, Any] = {"episode_seconds": 10.0, "push_newton": 150.0}
LAST_ACTION = slice(34, 38)  # of the observation, all 0 at the start of an episode


def main(out: str = "recurrent.zip", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write the model and, beside it, its statistics."""
    torch.set_num_threads(1)
    envs = VecNormalize(SegmentedFootBipedVecEnv(16, **TASK), gamma=0.98)
    network = {"net_arch": [64], "lstm_hidden_size": 32, "log_std_init": -0.9}
    schedule: dict[str, Any] = {"n_steps": 64, "batch_size": 256, "n_epochs": 4, "learning_rate": 1e-3, "gamma": 0.98}
    model = RecurrentPPO("MlpLstmPolicy", envs, policy_kwargs=network, seed=seed, **schedule)
    model.learn(timesteps)
    model.save(out)
    envs.save(f"{out}.statistics")


@cache
def _trained() -> tuple[Any, Any]:
    out, envs = os.environ["RECURRENT"], SegmentedFootBipedVecEnv(1, **TASK)
    return RecurrentPPO.load(out), VecNormalize.load(f"{out}.statistics", envs)


memory: Any = None


def act(observation: np.ndarray) -> np.ndarray:
    """Actions (N, 4) for observations (N, D) of the same N episodes, step after step."""
    global memory
    model, statistics = _trained()
    starts = ~observation[:, LAST_ACTION].any(axis=1)
    if memory is not None and memory[0].shape[1] != len(observation):
        memory = None
    seen = statistics.normalize_obs(observation)
    action, memory = model.predict(seen, memory, episode_start=starts, deterministic=True)
    return action


act.settings = TASK
if __name__ == "__main__":
    tyro.cli(main)
