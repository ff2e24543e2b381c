"""Interpolate periodic samples by cubic splines with the same knots again and again."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import PPoly
from scipy.linalg import get_lapack_funcs

from springfoot.arrays import NDArray

(_solve_tridiagonal,) = get_lapack_funcs(("gtsv",))


def periodic_spline(knots: NDArray) -> Callable[[NDArray], PPoly]:
    """Return the function from values (n,) at all `knots` (n + 1,) but the last to their periodic cubic spline.

    `knots` ascend; the value at the last one is that at the first; n is 3 or more. The bits are those of SciPy's
    `CubicSpline`, which solves for the knots' part, too, in each call, and takes five times as long.
    """
    width = np.diff(knots)
    width_before = _shifted(width)
    # The slopes solve a cyclic tridiagonal system. Without the last slope, its rows but the last are tridiagonal; they
    # are solved without the last slope, and, here, for a last slope of 1.
    diagonal = 2 * (width_before + width)
    tridiagonal = width[1:-1], diagonal[:-1], width_before[:-2]
    of_last = np.zeros(len(width) - 1)
    of_last[0] = -width[0]
    of_last[-1] = -width[-3]
    effect = _solved(tridiagonal, of_last)
    closing = diagonal[-1] + width[-2] * effect[0] + width[-1] * effect[-1]

    def spline(values: NDArray) -> PPoly:
        """Return the periodic cubic spline through `values` (n,)."""
        chord = np.diff(values, append=values[0]) / width
        right_side = 3 * (width * _shifted(chord) + width_before * chord)
        without = _solved(tridiagonal, right_side[:-1])
        last = (right_side[-1] - width[-2] * without[0] - width[-1] * without[-1]) / closing
        slope = np.append(without + last * effect, last)
        bend = (slope + np.append(slope[1:], slope[0]) - 2 * chord) / width
        return PPoly.construct_fast(
            np.stack([bend / width, (chord - slope) / width - bend, slope, values]), knots, "periodic"
        )

    return spline


def _shifted(values: NDArray) -> NDArray:
    """Return `values` (n,) one place later, the last in front."""
    return np.concatenate([values[-1:], values[:-1]])


def _solved(tridiagonal: tuple[NDArray, NDArray, NDArray], right_side: NDArray) -> NDArray:
    """Return the solution (n,) of a system with the matrix `tridiagonal`: its lower, middle and upper diagonal."""
    return _solve_tridiagonal(*tridiagonal, right_side[:, None])[3][:, 0]
