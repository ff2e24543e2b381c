"""Measure the returns of a policy on fixed seeds, for the periodic evaluations of a training."""

from collections.abc import Callable
from typing import Any

import numpy as np

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.walk import walked_steps

EVALUATION_SEED = 2**30
"""Seed of the first episode of every periodic evaluation; the following episodes count on."""


def evaluation_of(biped: Biped, policy: Callable[[np.ndarray], np.ndarray]) -> dict[str, Any]:
    """Run one episode of the policy in each environment of `biped`, from the evaluations' seeds.

    Returns the summary that run.json keeps of a periodic evaluation: mean and spread of the return [-], falls, mean
    length [s].
    """
    returns, seconds, fell = evaluate_returns(biped, policy, EVALUATION_SEED)
    return {
        "return_mean": float(returns.mean()),
        "return_sd": float(returns.std()),
        "episodes": len(returns),
        "falls": int(fell.sum()),
        "seconds_mean": float(seconds.mean()),
    }


def evaluate_returns(
    biped: Biped, policy: Callable[[np.ndarray], np.ndarray], seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run one episode of the policy in each environment of `biped`, seeded `seed`, `seed` + 1 and so on.

    Returns of each of the N episodes, (N,): the return [-], the length [s], and whether it ended in a fall.
    """
    episodes = biped.num_envs
    returns = np.zeros(episodes)
    seconds = np.zeros(episodes)
    fell = np.zeros(episodes, bool)
    biped.reset(np.arange(episodes), [seed + k for k in range(episodes)])
    for active, result in walked_steps(biped, policy):
        returns += np.where(active, result.reward, 0.0)
        seconds += np.where(active, biped.dt, 0.0)
        fell |= active & result.terminated
    return returns, seconds, fell
