"""Returns of a policy on fixed seeds: what training evaluates from time to time, and searches pay by."""

from collections.abc import Callable

import numpy as np

from springfoot.envs.batch.biped_batch import Biped


def evaluate_returns(
    biped: Biped, policy: Callable[[np.ndarray], np.ndarray], seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run one episode in each environment of `biped`, seeded `seed`, `seed` + 1, …

    Returns: (N,) return [-], length [s], and whether the episode ended in a fall.
    """
    episodes = biped.num_envs
    returns, seconds, fell = np.zeros(episodes), np.zeros(episodes), np.zeros(episodes, bool)
    active = np.ones(episodes, bool)
    biped.reset(np.arange(episodes), [seed + k for k in range(episodes)])
    observation = biped.observe()
    while active.any():
        result = biped.step(policy(observation), active=active)
        returns += np.where(active, result.reward, 0.0)
        seconds += np.where(active, biped.dt, 0.0)
        fell |= active & result.terminated
        active &= ~(result.terminated | result.truncated)
        observation = result.observation
    return returns, seconds, fell
