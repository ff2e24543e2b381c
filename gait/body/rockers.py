"""Turn a foot over the ground: pitches that rise with time, and the path of the ankle of a turning foot."""

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray

from .body import Body


def turned(pitch: ArrayLike, forward: float, up: float) -> tuple[NDArray, NDArray]:
    """Return x and z (...) of a flat foot's vector (forward, up) turned by `pitch` (...) [rad], toes up positive."""
    cosine = np.cos(pitch)
    sine = np.sin(pitch)
    return forward * cosine - up * sine, forward * sine + up * cosine


def pitch_rise(top: float, phase: ArrayLike, start: float, end: float, shape: float | tuple[float, float]) -> NDArray:
    """Return a pitch that is 0 until phase `start` and then rises to `top` at `end`, and its two phase derivatives.

    The result is (3, ...) [rad] for a `phase` of shape (...). `shape` is a power of the time since `start`, or of a
    polynomial of 2nd to 4th order a pair: the fraction of `top` half-way, and the rate at the end over the mean rate.
    """
    duration = end - start
    progress = np.maximum((np.asarray(phase) - start) / duration, 0.0)
    if isinstance(shape, tuple):
        half_way, end_rate = shape
        # Of a u^2 + b u^3 + c u^4: a + b + c = 1 at the end u = 1, a / 4 + b / 8 + c / 16 = half_way at u = 1/2, and
        # the rate 2 a + 3 b + 4 c = end_rate at the end.
        a = 16 * half_way - 5 + end_rate
        b = 14 - 32 * half_way - 3 * end_rate
        coefficients = [0.0, 0.0, a, b, 1 - a - b]
        return top * np.stack([polyval(progress, polyder(coefficients, n)) / duration**n for n in range(3)])
    power = shape
    # top * progress^power and its derivatives.
    rate = top * power / duration * progress ** (power - 1)
    return np.stack([top * progress**power, rate, top * power * (power - 1) / duration**2 * progress ** (power - 2)])


def ankle_about_pivot(pitch: NDArray, pivot: tuple[float, float], body: Body) -> NDArray:
    """Return the ankle's x, z [m] and pitch [rad] while a foot turns about a fixed `pivot`, and two phase derivatives.

    The result is (derivative, coordinate, ...), (3, 3, ...). `pitch` (3, ...) [rad] has two phase derivatives too;
    `pivot` (x, z) [m] is in the frame of the flat foot.
    """
    ankle = turned_jet(pitch, -pivot[0], body.ankle_height - pivot[1])
    # The ankle's place, not its derivatives, is from the frame's origin instead of the pivot.
    ankle[0, 0] += pivot[0]
    ankle[0, 1] += pivot[1]
    return np.concatenate([ankle, pitch[:, None]], axis=1)


def turned_jet(pitch: NDArray, forward: float, up: float) -> NDArray:
    """Turn a vector (forward, up) [m] of a flat foot by a pitch: return it, (x, z) [m], and two phase derivatives.

    The result is (derivative, coordinate, ...), (3, 2, ...). `pitch` (3, ...) [rad] has two phase derivatives too.
    """
    angle, rate, curvature = pitch
    # The vector's derivative to the angle is (-z, x), and the second one -(x, z); then the chain rule.
    x, z = turned(angle, forward, up)
    return np.stack([[x, z], [-z * rate, x * rate], [-z * curvature - x * rate**2, x * curvature - z * rate**2]])
