"""Stride phases, and curves over the stride that are tabulated once and read at many phases."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..physics.kernel import kernel

SAMPLES = 1000
"""Samples of a stride, between which curves are linear; chosen."""
GRID = np.arange(SAMPLES) / SAMPLES
"""Stride phases of the samples, (SAMPLES,)."""


def leg_phases(left: NDArray) -> NDArray:
    """(N,) stride phase of the left leg -> (N, side) of both, half a stride apart, in [0, 1)."""
    return np.stack([left, (left + 0.5) % 1.0], axis=-1)


PLACE = np.dtype([("row", np.int64), ("weight", float)])
"""Where an environment reads a table of several rows: between `row` and the next one, which has `weight` in [0, 1)."""
_FIRST = np.zeros(1, PLACE)


class PhaseTable:
    """Periodic curves on `GRID`; a reading has the same bits for any number of bodies.

    Args:
        curves: (SAMPLES, C), or (R, SAMPLES, C) for R rows.
    """

    def __init__(self, curves: NDArray):
        curves = curves.reshape(-1, SAMPLES, curves.shape[-1])
        rise = np.roll(curves, -1, axis=1) - curves
        self._table = np.stack([curves, rise], axis=2).astype(float)  # (R, SAMPLES, value and rise, C)

    def at(self, phase: ArrayLike, place: NDArray = _FIRST) -> NDArray:
        """Curves (..., C) at phases (...) in [0, 1); with `place` (N,) of dtype `PLACE`, phases are (N, ...)."""
        phase = np.asarray(phase, float, order="C")
        curves = np.empty((*phase.shape, self._table.shape[-1]))
        _read(self._table, place, phase, curves)
        return curves


@kernel
def _read(table, place, phases, all_curves):
    phase, curves = phases.reshape(-1), all_curves.reshape(-1, table.shape[-1])
    each = max(len(phase) // len(place), 1)
    for i in range(len(phase)):
        spot = phase[i] * SAMPLES
        index = 0
        if spot >= SAMPLES - 1:
            index = SAMPLES - 1
        elif spot > 0.0:
            index = int(spot)
        where = place[i // each]
        row = table[where.row, index]
        for column in range(row.shape[1]):
            curves[i, column] = row[0, column] + (spot - index) * row[1, column]
        if where.weight > 0.0:
            above = table[where.row + 1, index]
            for column in range(row.shape[1]):
                value = above[0, column] + (spot - index) * above[1, column]
                curves[i, column] += where.weight * (value - curves[i, column])
