"""Phases of the stride, and curves over it, tabulated once and read at many: the same bits for any number of bodies."""

import numpy as np
from numpy.typing import NDArray

SAMPLES = 1000
"""Samples of a stride; between them curves are linear."""
GRID = np.arange(SAMPLES) / SAMPLES
"""Their phases, (SAMPLES,)."""


def leg_phases(left: NDArray) -> NDArray:
    """(N,) stride phase of the left leg -> (N, side) of both, half a stride apart, in [0, 1)."""
    return np.stack([left, (left + 0.5) % 1.0], axis=-1)


class PhaseTable:
    """Periodic curves on `GRID`.

    Args:
        curves: (SAMPLES, C), or (V, SAMPLES, C) for V variants.
    """

    def __init__(self, curves: NDArray):
        curves = curves.reshape(-1, SAMPLES, curves.shape[-1])
        self._columns = curves.shape[-1]
        both = np.concatenate([curves, np.roll(curves, -1, axis=1) - curves], axis=-1)
        self._rows = np.ascontiguousarray(both.reshape(-1, 2 * self._columns))

    def at(self, phase: NDArray, variant: NDArray | int = 0) -> NDArray:
        """Curves at `phase` in [0, 1) of any shape: (..., C). `variant` broadcasts against it."""
        place = phase * SAMPLES
        index = place.astype(np.intp)
        rows = self._rows[np.minimum(index, SAMPLES - 1) + variant * SAMPLES]
        return rows[..., : self._columns] + (place - index)[..., None] * rows[..., self._columns :]
