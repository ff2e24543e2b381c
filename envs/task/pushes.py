"""Push the trunk, with forces in proportion to the body's mass."""

from collections.abc import Sequence

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import REFERENCE_MASS

from ..control.subjects import Subjects
from ..settings.settings import BipedSettings


class Pushes:
    """Push each environment once in each interval, at a random time, forward or backward at random.

    Args:
        settings: size, duration and interval of pushes.
        subjects: bodies, for their masses.
        rows: (N,) of `TASK_ROW`.
    """

    def __init__(self, settings: BipedSettings, subjects: Subjects, rows: NDArray):
        self._scale = subjects.scale
        self._size = settings.push_newton * (settings.mass / REFERENCE_MASS)
        self._latest = settings.push_interval - settings.push_seconds
        self._interval = settings.push_interval
        self._duration = settings.push_seconds
        self._step = settings.step_seconds
        self._begin, self._force, self._ends = (rows["push"][name] for name in ("begin", "force", "ends"))  # see `PUSH`

    def reset(self, index: int, random: np.random.Generator) -> None:
        """Begin an episode of environment `index`, and draw its first push."""
        self._ends[index] = 0.0
        self._draw(index, random)

    def force(self, steps: NDArray, random: Sequence[np.random.Generator | None], running: NDArray) -> NDArray:
        """Return (N,) the push on each trunk [N], forward positive, after `steps` (N,) of its episode.

        Environments that are `running` (N,) with an ended interval draw their next push by their generators
        `random`.
        """
        time = steps * self._step
        for index in np.flatnonzero(running & (time >= self._ends)).tolist():
            generator = random[index]
            if generator is not None:
                self._draw(index, generator)
        since_begin = time - self._begin
        pushed = (since_begin >= 0) & (since_begin < self._duration)
        return np.where(pushed, self._force * self._scale["mass"], 0.0)

    def _draw(self, index: int, random: np.random.Generator) -> None:
        """Draw time and direction of the next push of environment `index`, in the interval that begins at `_ends`."""
        self._begin[index] = self._ends[index] + random.uniform(0.0, self._latest)
        self._force[index] = self._size * (-1.0, 1.0)[random.integers(2)]
        self._ends[index] += self._interval
