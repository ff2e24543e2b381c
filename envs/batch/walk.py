"""Walk a batch to the end of its episodes: the loop of recordings, searches, training's evaluations and the live
page.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from springfoot.arrays import NDArray

from .biped_batch import Biped
from .step_result import StepResult


class Walked(NamedTuple):
    """One step of a walk."""

    active: NDArray
    """(N,) environments that took the step."""
    result: StepResult


def walked_steps(biped: Biped, act: Callable[[NDArray], NDArray], steps: int | None = None) -> Iterator[Walked]:
    """Step `biped`, which was reset, until every episode has ended; yield after each step.

    Args:
        biped: N environments. Its `on_tick` is called after every control window.
        act: observations (N, D) -> actions (N, A), as `Biped.step` takes them.
        steps: most steps of an episode, in place of the length in the settings.
    """
    active = np.ones(biped.num_envs, bool)
    observation = biped.observe()
    taken = 0
    while active.any() and (steps is None or taken < steps):
        result = biped.step(act(observation), active)
        yield Walked(active, result)
        truncates = steps is None  # else `steps` replaces the length at which the settings truncate
        ended = result.terminated | result.truncated if truncates else result.terminated
        active = active & ~ended
        observation = result.observation
        taken += 1
