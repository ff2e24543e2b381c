"""Tabulate curves over the stride once, and read them at many phases, which `stride_phase` advances and resets."""

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
        table: (R, SAMPLES, 2, C) of a `PhaseTable`: value at each sample, and rise to the next sample.
        place: one `PLACE`, the row and the weight of the next row [-].
        phase: stride phase in [0, 1).
        curves: (C,), which is filled.
    """
    position = phase * SAMPLES
    index = 0  # of the sample before; also for NaN
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
    """Fill `curves` (M, C) with the curves at `phase` (M,) in [0, 1).

    Each of the P places has M / P consecutive phases: the first M / P belong to `place[0]`, and so on. `table` is (R,
    SAMPLES, 2, C) of a `PhaseTable`; `place` (P,) of `PLACE`.
    """
    phases_per_place = max(len(phase) // len(place), 1)  # 1 without phases, as 0 is no divisor
    for i in range(len(phase)):
        read(table, place[i // phases_per_place], phase[i], curves[i])


class PhaseTable:
    """C periodic curves on `GRID` in each of R rows; a reading has the same bits for any number of bodies.

    The rows are most often those of `reference_walk.rows`: variants of the leg constants x tabulated speeds.

    Args:
        curves: (SAMPLES, C), or (R, SAMPLES, C) for R rows.
    """

    def __init__(self, curves: NDArray):
        curves = curves.reshape(-1, SAMPLES, curves.shape[-1])
        rise = np.roll(curves, -1, axis=1) - curves
        self.table = np.stack([curves, rise], axis=2).astype(float)
        """(R, SAMPLES, 2, C): value at each sample, and rise to the next sample; do not write to it."""

    def at(self, phase: ArrayLike, place: NDArray = _FIRST) -> NDArray:
        """Return the curves (..., C) at phases (...) in [0, 1), linear between samples and between two rows.

        `place` (N,) of dtype `PLACE` says the rows to read for phases (N, ...); by default all are of the first row.
        """
        phase = np.asarray(phase, float, order="C")
        curves = np.empty((*phase.shape, self.table.shape[-1]))
        _read_all(self.table, place, phase.reshape(-1), curves.reshape(-1, curves.shape[-1]))
        return curves
