"""The cart-table model: the whole body as its CoM on a massless table standing on the ZMP (Kajita et al. 2003).

Equation (1) of the thesis, its sign and its missing terms restored: p = x - z x'' / (z'' + g).
"""

from dataclasses import dataclass, field
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import BPoly, PPoly

from .body import GRAVITY

SAMPLES = 240
"""Knots a step of the tabulated CoM path; quintics between them, so that its error stays that of the integration."""


def zmp(x: ArrayLike, z: ArrayLike, x_acceleration: ArrayLike, z_acceleration: ArrayLike) -> NDArray:
    """Equation (1): ZMP [m] of a CoM at `x`, `z` [m] above level ground with accelerations [m/s^2]; broadcasts."""
    return np.asarray(x) - np.asarray(z) * x_acceleration / (np.asarray(z_acceleration) + GRAVITY)


@dataclass(frozen=True, kw_only=True, eq=False)
class ComMotion:
    """A CoM that repeats itself every step, one step further on; times [s] within a step, made by `periodic_com`."""

    step_time: float
    """Duration of a step [s]."""
    height: float
    """Mean height above the floor [m]."""
    amplitude: float
    """Half of rise and fall [m]."""
    lowest_at: float
    """Time of the lowest point [s]."""
    path: PPoly = field(repr=False)
    """Forward position x [m] over time [s]."""

    def position(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """(x, z) [m]."""
        return self.path(time), self.height + _bob(time, self.step_time, self.amplitude, self.lowest_at)

    def velocity(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """(forward, up) [m/s]."""
        return self.path(time, 1), _bob(time, self.step_time, self.amplitude, self.lowest_at, 1)

    def acceleration(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """(forward, up) [m/s^2]."""
        return self.path(time, 2), _bob(time, self.step_time, self.amplitude, self.lowest_at, 2)


def periodic_com(
    zmp_times: NDArray, zmp_points: NDArray, step_length: float, height: float, amplitude: float, lowest_at: float
) -> ComMotion:
    """The one CoM motion over a ZMP that repeats itself every step.

    The ZMP p [m] runs straight between `zmp_points` at `zmp_times` [s] (first 0, last the step time T). The height
    is z = height - amplitude cos(2 pi (t - lowest_at) / T) [m]. Solves x'' = (g + z'') / z (x - p) with
    x(T) = x(0) + step_length and x'(T) = x'(0) by superposing one particular and two homogeneous solutions, so that
    the periodic one costs a 2 x 2 system; error below 1e-9 m.
    """
    step_time = zmp_times[-1]

    def pull(t: ArrayLike) -> NDArray:
        z = height + _bob(t, step_time, amplitude, lowest_at)
        return (GRAVITY + _bob(t, step_time, amplitude, lowest_at, 2)) / z

    driven = np.array([1.0, 0.0, 0.0])  # columns: driven by the ZMP, from unit position, from unit velocity

    def motion(t: float, state: NDArray) -> NDArray:
        x, v = state[:3], state[3:]
        return np.concatenate([v, pull(t) * (x - driven * np.interp(t, zmp_times, zmp_points))])

    state = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    times, states = [], []
    # The ZMP has corners: integrating piece by piece keeps the order of the method.
    for start, end in pairwise(zmp_times):
        grid = np.linspace(start, end, round(SAMPLES * (end - start) / step_time) + 2)
        piece = solve_ivp(motion, (start, end), state, "DOP853", grid, rtol=1e-12, atol=1e-13)
        times.append(grid[:-1])
        states.append(piece.y[:, :-1])
        state = piece.y[:, -1]
    t = np.append(np.concatenate(times), step_time)
    x, v = np.column_stack([*states, state]).reshape(2, 3, -1)

    ends = np.array([x[:, -1], v[:, -1]])
    start_state = np.linalg.solve(ends[:, 1:] - np.eye(2), np.array([step_length, 0.0]) - ends[:, 0])
    weights = np.array([1.0, *start_state])
    position, velocity = weights @ x, weights @ v
    acceleration = pull(t) * (position - np.interp(t, zmp_times, zmp_points))
    quintics = BPoly.from_derivatives(t, np.stack([position, velocity, acceleration], -1))
    return ComMotion(
        step_time=float(step_time),
        height=height,
        amplitude=amplitude,
        lowest_at=lowest_at,
        path=PPoly.from_bernstein_basis(quintics),
    )


def _bob(t: ArrayLike, step_time: float, amplitude: float, lowest_at: float, derivative: int = 0) -> NDArray:
    """-amplitude cos(2 pi (t - lowest_at) / step_time) or a time derivative of it."""
    turn = 2 * pi / step_time
    # Each derivative of a cosine is a quarter turn ahead.
    return -amplitude * turn**derivative * np.cos(turn * (np.asarray(t) - lowest_at) + derivative * pi / 2)
