"""Turn a foot over the ground: pitches that rise with time, and the path of the ankle of a turning foot."""

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray

from .body import Body


def turned(pitch: ArrayLike, forward: float, up: float) -> tuple[NDArray, NDArray]:
    """Turn a vector (forward, up) of a flat foot by `pitch` [rad], toes up positive."""
    return forward * np.cos(pitch) - up * np.sin(pitch), forward * np.sin(pitch) + up * np.cos(pitch)


def rising(top: float, phase: ArrayLike, start: float, end: float, shape: float | tuple[float, float]) -> NDArray:
    """Return a pitch that is 0 until phase `start` and then rises to `top` at `end`, and its two phase derivatives.

    The result is (3, ...). The rise is a power of the time since `start`, `shape`; or, with a pair, a polynomial of 2nd
    to 4th order with that fraction of `top` half-way and that rate at the end over the mean rate.
    """
    duration = end - start
    progress = np.maximum((np.asarray(phase) - start) / duration, 0.0)
    if isinstance(shape, tuple):
        half_way, end_rate = shape
        # a + b + c = 1, 4 a + 2 b + c = 16 half, 2 a + 3 b + 4 c = fast
        a = 16 * half_way - 5 + end_rate
        b = 14 - 32 * half_way - 3 * end_rate
        curve = Polynomial([0.0, 0.0, a, b, 1 - a - b])
        return top * np.stack([curve.deriv(n)(progress) / duration**n for n in range(3)])
    power = shape
    rate = top * power / duration * progress ** (power - 1)
    return np.stack([top * progress**power, rate, top * power * (power - 1) / duration**2 * progress ** (power - 2)])


def rolling(pitch: NDArray, pivot: tuple[float, float], body: Body) -> NDArray:
    """Return the ankle's x, z [m] and pitch [rad] while a foot turns about a fixed `pivot`, and two phase derivatives.

    The result is (derivative, coordinate, ...), (3, 3, ...). `pitch` (3, ...) [rad] has two phase derivatives too;
    `pivot` (x, z) [m] is in the frame of the flat foot.
    """
    ankle = turning(pitch, -pivot[0], body.ankle_height - pivot[1])
    ankle[0, 0] += pivot[0]
    ankle[0, 1] += pivot[1]
    return np.concatenate([ankle, pitch[:, None]], axis=1)


def turning(pitch: NDArray, forward: float, up: float) -> NDArray:
    """Turn the vector (forward, up) of a flat foot by a pitch: return it, (x, z), and two phase derivatives.

    The result is (derivative, coordinate, ...), (3, 2, ...). `pitch` (3, ...) [rad] has two phase derivatives too.
    """
    angle, rate, curvature = pitch
    x, z = turned(angle, forward, up)
    return np.stack([[x, z], [-z * rate, x * rate], [-z * curvature - x * rate**2, x * curvature - z * rate**2]])
