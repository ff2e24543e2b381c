"""Tabulate curves over the stride once, and read them at many phases."""

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray

from ..physics.kernel import kernel, part
from .state import PLACE

SAMPLES = 1000
"""Samples of a stride, between which curves are linear; chosen."""
GRID = np.arange(SAMPLES) / SAMPLES
"""Stride phases of the samples, (SAMPLES,)."""


def leg_phases(left: NDArray) -> NDArray:
    """Return (N, side) stride phases of both legs, half a stride apart, in [0, 1), from those of the left leg (N,)."""
    return np.stack([left, (left + 0.5) % 1.0], axis=-1)


_FIRST = np.zeros(1, PLACE)


@part
def read(table, place, phase, curves) -> None:
    """Read the curves of a table at one phase, linear between samples and between two rows.

    Args:
        table: (R, SAMPLES, value and rise, C) of a `PhaseTable`.
        place: one `PLACE`, the row and the weight of the next row.
        phase: stride phase in [0, 1).
        curves: (C,), which is filled.
    """
    position = phase * SAMPLES
    index = 0
    if position >= SAMPLES - 1:
        index = SAMPLES - 1
    elif position > 0.0:
        index = int(position)
    row = table[place.row, index]
    for column in range(row.shape[1]):
        curves[column] = row[0, column] + (position - index) * row[1, column]
    if place.weight > 0.0:
        next_row = table[place.row + 1, index]
        for column in range(row.shape[1]):
            value = next_row[0, column] + (position - index) * next_row[1, column]
            curves[column] += place.weight * (value - curves[column])


@kernel
def _read_all(table, place, phase, curves):
    """Read the curves at `phase` (M,) in [0, 1) into `curves` (M, C), the same number of phases at each place in turn.

    `table` is (R, SAMPLES, value and rise, C); `place` (P,) of `PLACE`.
    """
    phases_per_place = max(len(phase) // len(place), 1)
    for i in range(len(phase)):
        read(table, place[i // phases_per_place], phase[i], curves[i])


class PhaseTable:
    """Periodic curves on `GRID`; a reading has the same bits for any number of bodies.

    Args:
        curves: (SAMPLES, C), or (R, SAMPLES, C) for R rows.
    """

    def __init__(self, curves: NDArray):
        curves = curves.reshape(-1, SAMPLES, curves.shape[-1])
        rise = np.roll(curves, -1, axis=1) - curves
        self.table = np.stack([curves, rise], axis=2).astype(float)
        """(R, SAMPLES, value and rise, C); do not write to it."""

    def at(self, phase: ArrayLike, place: NDArray = _FIRST) -> NDArray:
        """Return curves (..., C) at phases (...) in [0, 1); with `place` (N,) of dtype `PLACE`, phases are (N, ...)."""
        phase = np.asarray(phase, float, order="C")
        curves = np.empty((*phase.shape, self.table.shape[-1]))
        _read_all(self.table, place, phase.reshape(-1), curves.reshape(-1, curves.shape[-1]))
        return curves
