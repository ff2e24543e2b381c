"""Mean and spread of curves over many strides."""

from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.people.gait_events import PERCENT


@dataclass(kw_only=True, eq=False)
class StrideCurves:
    """Mean and spread over strides of C curves over percent of the stride; strides are added block by block."""

    names: tuple[str, ...]
    """Names of the C curves."""
    count: int = 0
    """Strides so far."""
    total: NDArray | float = 0.0
    """(101, C) sum over the strides."""
    squares: NDArray | float = 0.0
    """(101, C) sum of squares over the strides."""

    def add(self, curves: NDArray) -> None:
        """Add the C curves of S strides, (S, 101, C) over percent of the stride, to the sums."""
        self.count += len(curves)
        self.total = self.total + curves.sum(axis=0)
        self.squares = self.squares + np.square(curves).sum(axis=0)

    def mean(self, name: str) -> NDArray:
        """Return the mean of the curve `name` over strides (101,); NaN before the first stride."""
        return self._pick(np.asarray(self.total) / self.count, name) if self.count else self._missing()

    def sd(self, name: str) -> NDArray:
        """Return the standard deviation (n - 1) of the curve `name` over strides (101,); NaN for fewer than two
        strides."""
        if self.count < 2:
            return self._missing()
        total = np.asarray(self.total)
        squares = np.asarray(self.squares)
        # Rounding can make the variance of equal strides negative.
        variance = (squares - total**2 / self.count) / (self.count - 1)
        return self._pick(np.sqrt(np.maximum(variance, 0.0)), name)

    def _pick(self, values: NDArray, name: str) -> NDArray:
        """Return that column (101,) of `values` (101, C) which belongs to the curve `name`."""
        return values[:, self.names.index(name)]

    def _missing(self) -> NDArray:
        """Return NaN (101,), for a curve of too few strides."""
        return np.full(len(PERCENT), np.nan)
