"""A walk window by window: what the tests of feet look at."""

from typing import Any

import numpy as np

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick


def walked_ticks(biped: Biped, steps: int = 60, actions: Any = 0.3) -> list[Tick]:
    """Steps of everybody still on their feet; the ticks of every control window."""
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    biped.reset(np.arange(biped.num_envs), range(biped.num_envs))
    active = np.ones(biped.num_envs, bool)
    for _ in range(steps):
        active = active & ~biped.step(np.broadcast_to(actions, (biped.num_envs, 4)), active).terminated
    return ticks
