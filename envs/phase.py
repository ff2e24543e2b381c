"""Phases of the stride, and curves over it, tabulated once and read at many: the same bits for any number of bodies."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .kernel import kernel

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
        variant: (N,) which of the V curves row i of the phases asked for takes; all take the first without it.
    """

    def __init__(self, curves: NDArray, variant: NDArray | None = None):
        curves = curves.reshape(-1, SAMPLES, curves.shape[-1])
        rise = np.roll(curves, -1, axis=1) - curves
        self._table = np.stack([curves, rise], axis=2).astype(float)  # (V, SAMPLES, value and rise, C)
        self._variant = np.zeros(1, np.int64) if variant is None else np.asarray(variant, np.int64)

    def at(self, phase: ArrayLike) -> NDArray:
        """Curves at `phase` in [0, 1) of any shape, (N, ...) where variants differ: (..., C)."""
        phase = np.asarray(phase, float)
        curves = np.empty((*phase.shape, self._table.shape[-1]))
        _read(self._table, self._variant, phase.reshape(-1), curves.reshape(-1, curves.shape[-1]))
        return curves


@kernel
def _read(table, variant, phase, curves):
    each = max(len(phase) // len(variant), 1)
    for i in range(len(phase)):
        place = phase[i] * SAMPLES
        index = 0
        if place >= SAMPLES - 1:
            index = SAMPLES - 1
        elif place > 0.0:
            index = int(place)
        row = table[variant[i // each], index]
        for column in range(row.shape[1]):
            curves[i, column] = row[0, column] + (place - index) * row[1, column]
