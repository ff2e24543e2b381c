"""Mean and spread of curves over many strides."""

from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.people.gait_events import PERCENT


@dataclass(kw_only=True, eq=False)
class StrideCurves:
    """Mean and spread over strides of C curves, added block by block; NaN before the first stride."""

    names: tuple[str, ...]
    """Names of the C curves."""
    count: int = 0
    """Strides so far."""
    total: NDArray | float = 0.0
    """(101, C) sum over the strides."""
    squares: NDArray | float = 0.0
    """(101, C) sum of squares over the strides."""

    def add(self, curves: NDArray) -> None:
        """Add strides' curves (S, 101, C)."""
        self.count += len(curves)
        self.total = self.total + curves.sum(axis=0)
        self.squares = self.squares + np.square(curves).sum(axis=0)

    def mean(self, name: str) -> NDArray:
        """Return the mean of a curve over strides (101,)."""
        return self._pick(np.asarray(self.total) / max(self.count, 1), name) if self.count else self._missing()

    def sd(self, name: str) -> NDArray:
        """Return the standard deviation of a curve over strides (101,), with n - 1; NaN for fewer than two strides."""
        if self.count < 2:
            return self._missing()
        total = np.asarray(self.total)
        squares = np.asarray(self.squares)
        variance = (squares - total**2 / self.count) / (self.count - 1)
        return self._pick(np.sqrt(np.maximum(variance, 0.0)), name)

    def _pick(self, values: NDArray, name: str) -> NDArray:
        return values[:, self.names.index(name)]

    def _missing(self) -> NDArray:
        return np.full(len(PERCENT), np.nan)
