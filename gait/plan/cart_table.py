"""Solve the cart-table model: the whole body as its CoM on a massless table standing on the ZMP (Kajita et al. 2003).

Equation (1) of the thesis, its sign and its missing terms restored: p = x - z x'' / (z'' + g). On a slope a the frame
leans with the ground, x along it and z at right angles to it, so that gravity has a part along it: p = x - z (x'' + g
sin a) / (z'' + g cos a).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from math import comb, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.interpolate import PPoly

from springfoot.arrays import NDArray

from ..body.body import gravity

STEP_SAMPLES = 240
"""Knots of the tabulated CoM path in a step; quintics between the knots add no error to that of the integration."""


def zmp(
    x: ArrayLike, z: ArrayLike, x_acceleration: ArrayLike, z_acceleration: ArrayLike, slope: float = 0.0
) -> NDArray:
    """Compute the ZMP [m] by equation (1) from a CoM at `x`, `z` [m] with accelerations [m/s^2]; broadcasts.

    On a `slope` [rad], uphill positive, x is along the ground and z at right angles to it.
    """
    back, down = -gravity(slope)  # parts of g along the ground, against x, and into the ground
    return np.asarray(x) - np.asarray(z) * (np.asarray(x_acceleration) + back) / (np.asarray(z_acceleration) + down)


@dataclass(frozen=True, kw_only=True, eq=False)
class HyperbolicPath:
    """x(t) of a CoM at constant height over a piecewise polynomial ZMP, in closed form; made by `closed_form`.

    In each piece x is a polynomial plus a cosh and a sinh, kept as exp(-rate (t - start)) and exp(rate (t - end)):
    both are at most 1, so a long piece loses no digits.
    """

    polynomial: PPoly
    """The particular solution [m], which follows the ZMP."""
    rate: float
    """sqrt(g cos a / z) [1/s], a the slope."""
    fading: NDArray
    """(pieces,) coefficients of exp(-rate (t - start)) [m]."""
    growing: NDArray
    """(pieces,) coefficients of exp(rate (t - end)) [m]."""

    def __call__(self, time: ArrayLike, derivative: int = 0) -> NDArray:
        """Return the position [m] at `time` [s] on the ZMP's course, or its time derivative of order `derivative`."""
        time = np.asarray(time, float)
        knots = self.polynomial.x
        piece = np.clip(np.searchsorted(knots, time, "right") - 1, 0, len(knots) - 2)
        fading = self.fading[piece] * np.exp(-self.rate * (time - knots[piece]))
        growing = self.growing[piece] * np.exp(self.rate * (time - knots[piece + 1]))
        return self.polynomial(time, derivative) + self.rate**derivative * (growing + (-1) ** derivative * fading)


@dataclass(frozen=True, kw_only=True)
class Bob:
    """Rise and fall of the CoM about its mean height, the same in every step."""

    step_time: float
    """Duration of a step [s]."""
    amplitude: float
    """Amplitude of the cosine [m]: half of the rise and fall of a CoM without a second harmonic."""
    lowest_at: float
    """Time at which the cosine is lowest [s]."""
    second: tuple[float, float] = (0.0, 0.0)
    """Second harmonic over `amplitude`: cosine and sine of twice the turn since `lowest_at` [-]."""

    def __call__(self, time: ArrayLike, derivative: int = 0) -> NDArray:
        """Return -amplitude (cos u + second[0] cos 2u + second[1] sin 2u), u = 2 pi (t - lowest_at) / T [m], or its
        time derivative of order `derivative`; T is the step time."""
        turn = 2 * pi / self.step_time
        # A number stays a number: NumPy takes twice as long with an array of one.
        angle = turn * ((time if isinstance(time, float) else np.asarray(time)) - self.lowest_at)
        # Each derivative of a cosine is a quarter turn ahead.
        ahead = derivative * pi / 2
        first_harmonic = -self.amplitude * turn**derivative * np.cos(angle + ahead)
        if self.second == (0.0, 0.0):
            return first_harmonic
        c, s = self.second
        scale = -self.amplitude * (2 * turn) ** derivative
        return first_harmonic + scale * (c * np.cos(2 * angle + ahead) + s * np.sin(2 * angle + ahead))


@dataclass(frozen=True, kw_only=True, eq=False)
class ComMotion:
    """Motion of a CoM that repeats every step, one step length further on; made by `periodic_com` or `pivoted_com`.

    Times [s] are within a step.
    """

    step_time: float
    """Duration of a step [s]."""
    height: float
    """Mean height above the floor [m]."""
    bob: Bob
    """Rise and fall of the CoM."""
    slope: float = 0.0
    """Slope of the ground [rad], uphill positive: x is along the ground, z at right angles to it."""
    path: PPoly | HyperbolicPath = field(repr=False)
    """Forward position x [m] over time [s]; `path(time, n)` is its n-th derivative."""
    ahead: PPoly | None = field(default=None, repr=False)
    """Forward from the CoM to the pivot of the ground reaction force [m] over time [s] (`leg_spin`); None: 0."""

    def position(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return (x, z) [m]."""
        return self.path(time), self.height + self.bob(time)

    def velocity(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return (forward, up) [m/s]."""
        return self.path(time, 1), self.bob(time, 1)

    def acceleration(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return (forward, up) [m/s^2]."""
        return self.path(time, 2), self.bob(time, 2)

    def pivot(self, time: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return the point (x, z) [m] through which the ground reaction force acts."""
        x, z = self.position(time)
        return (x if self.ahead is None else x + self.ahead(time)), z

    def zmp(self, time: ArrayLike) -> NDArray:
        """Return the ZMP [m] by equation (1), of the pivot."""
        return zmp(*self.pivot(time), *self.acceleration(time), self.slope)


def periodic_com(
    zmp_times: NDArray,
    zmp_points: NDArray,
    step_length: float,
    height: float,
    bob: Bob,
    slope: float = 0.0,
) -> ComMotion:
    """Compute the only periodic CoM motion over a ZMP that repeats every step.

    The ZMP p [m] runs straight between `zmp_points` at strictly ascending `zmp_times` [s] (first 0, last the step
    time T). The height is z = height + bob(t) [m]. Solves x'' = (g cos a + z'') / z (x - p) - g sin a, a the `slope`
    [rad], with x(T) = x(0) + step_length and x'(T) = x'(0): in closed form where `bob.amplitude` is 0, else with an
    error below 1e-9 m.
    """
    if bob.amplitude == 0:
        lines = PPoly(np.stack([np.diff(zmp_points) / np.diff(zmp_times), zmp_points[:-1]]), zmp_times)
        path = closed_form(lines, step_length, height, slope)
    else:
        path = _path_by_integration(zmp_times, zmp_points, step_length, height, bob, slope)
    return ComMotion(step_time=float(zmp_times[-1]), height=height, bob=bob, slope=slope, path=path)


def closed_form(zmp: PPoly, step_length: float, height: float, slope: float = 0.0) -> HyperbolicPath:
    """Solve for the periodic CoM path at constant `height` [m] over a piecewise polynomial ZMP of any degree.

    `zmp` [m] over the time of one step [s] starts again `step_length` [m] further on; jumps are allowed. The polynomial
    p + p''/w^2 + p''''/w^4 + ... + height tan a, w^2 = g cos a / height, solves x'' = w^2 (x - p) - g sin a; one
    exponential that fades and one that grows in each piece make x and x' continuous, from step to step too.
    """
    back, down = -gravity(slope)  # g sin a along the slope, g cos a across it
    rate = sqrt(down / height)
    coefficients = np.array(zmp.c, float)
    for order in range(2, len(coefficients), 2):
        # An even derivative has `order` coefficients fewer, those of the highest powers, which come first.
        coefficients[order:] += zmp.derivative(order).c / rate**order
    # The constant terms, which are also the values at the starts of the pieces.
    coefficients[-1] += height * back / down
    polynomial = PPoly(coefficients, zmp.x)

    # Jumps of the polynomials, in x and in x' / rate, from the end of each piece to the start of the next: the
    # exponentials have to close them.
    durations = np.diff(zmp.x)
    velocity = polynomial.derivative().c
    jump = np.roll(coefficients[-1], -1) - np.polyval(coefficients, durations)
    jump[-1] += step_length
    rate_jump = (np.roll(velocity[-1], -1) - np.polyval(velocity, durations)) / rate
    # In x' / rate a growing exponential counts as in x, a fading one with the opposite sign. So the sum of both jumps
    # is twice that of the growing ones, the difference twice that of the fading ones: one linear system each, over
    # all pieces, the last one followed by the first.
    decay = np.exp(-rate * durations)
    this_piece = np.eye(len(durations))
    next_piece = np.roll(this_piece, 1, axis=1)
    return HyperbolicPath(
        polynomial=polynomial,
        rate=rate,
        fading=np.linalg.solve(this_piece * decay - next_piece, (jump - rate_jump) / 2),
        growing=np.linalg.solve(this_piece - next_piece * decay, (jump + rate_jump) / 2),
    )


def _path_by_integration(
    zmp_times: NDArray,
    zmp_points: NDArray,
    step_length: float,
    height: float,
    bob: Bob,
    slope: float,
) -> PPoly:
    """Return the path of `periodic_com` by numerical integration.

    The equation is linear: the path is the sum of one particular and two homogeneous solutions that is periodic.
    """
    step_time = zmp_times[-1]
    back, down = -gravity(slope)

    def squared_rate(t: ArrayLike) -> NDArray:
        # (g cos a + z'') / z
        z = height + bob(t)
        return (down + bob(t, 2)) / z

    def motion(t: float, state: NDArray) -> list[float]:
        """Return the derivative of `state`: x of three solutions, then their x'. The first is driven by ZMP and slope
        from rest at 0; the others are undriven, from unit position and from unit velocity."""
        # One number after another: for six of them NumPy's arrays take several times as long.
        x, x_position, x_velocity, *velocities = state.tolist()
        rate = squared_rate(t)
        driven = rate * (x - np.interp(t, zmp_times, zmp_points)) - back
        return [*velocities, driven, rate * x_position, rate * x_velocity]

    state = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    times = []
    states = []
    # The ZMP has corners: integrating piece by piece keeps the order of the method.
    for start, end in pairwise(zmp_times):
        grid = np.linspace(start, end, round(STEP_SAMPLES * (end - start) / step_time) + 2)
        piece = solve_ivp(motion, (start, end), state, "DOP853", grid, rtol=1e-12, atol=1e-13)
        times.append(grid[:-1])
        states.append(piece.y[:, :-1])
        state = piece.y[:, -1]
    t = np.append(np.concatenate(times), step_time)
    x, v = np.column_stack([*states, state]).reshape(2, 3, -1)  # each (solution, time)

    # Weights of the homogeneous solutions, x(0) and x'(0), that make x and x' periodic.
    ends = np.array([x[:, -1], v[:, -1]])
    start_state = np.linalg.solve(ends[:, 1:] - np.eye(2), np.array([step_length, 0.0]) - ends[:, 0])
    weights = np.array([1.0, *start_state])
    position = weights @ x
    velocity = weights @ v
    acceleration = squared_rate(t) * (position - np.interp(t, zmp_times, zmp_points)) - back
    return _quintics(t, position, velocity, acceleration)


def _quintics(t: NDArray, x: NDArray, v: NDArray, a: NDArray) -> PPoly:
    """Return the quintics between knots at `t` (n,) that have position, velocity and acceleration (n,) there.

    The bits are those of `BPoly.from_derivatives`, which goes from piece to piece: a third of the time of a plan.
    """
    duration = np.diff(t)
    first, last = x[:-1], x[1:]
    second = v[:-1] / 5 * duration + first
    third = a[:-1] / 20 * duration**2 - first + 2 * second
    fifth = -v[1:] / 5 * duration + last
    fourth = a[1:] / 20 * duration**2 + 2 * fifth - last
    return PPoly.construct_fast(_bernstein_to_powers(duration)([first, second, third, fourth, fifth, last]), t)


def pivoted_com(
    zmp_times: NDArray, zmp_points: NDArray, step_length: float, bob: Bob, slope: float = 0.0
) -> Callable[[float, PPoly], ComMotion]:
    """Return the function (height, ahead) -> CoM motion of `periodic_com`, with a pivot `ahead` of the CoM.

    `ahead` [m] is a function of the time [s] (`ComMotion`): x + ahead replaces x on the right-hand side of the
    equation. Terms that depend on neither argument are computed once. The equation is linear, so each of about
    `STEP_SAMPLES` intervals in a step of the walk is a matrix on (x, x', 1), by the method of Runge and Kutta. The
    product of these matrices gives the periodic start.
    """
    step_time = zmp_times[-1]
    back, down = -gravity(slope)  # g sin a along and g cos a across a slope a
    pieces = [
        np.linspace(start, end, round(STEP_SAMPLES * (end - start) / step_time) + 2)[:-1]
        for start, end in pairwise(zmp_times)
    ]
    t = np.append(np.concatenate(pieces), step_time)
    times = np.concatenate([t, 0.5 * (t[1:] + t[:-1])])  # ends, then middles of the intervals
    bob_height = bob(times)
    fall = down + bob(times, 2)
    zmp_at = np.interp(times, zmp_times, zmp_points)
    duration = np.diff(t)
    tick = duration[:, None, None]
    to_powers = _bernstein_to_powers(duration)
    unit = np.eye(3)

    def motion_at(height: float, ahead: PPoly) -> ComMotion:
        """Compute the CoM motion at a mean `height` [m] with a pivot `ahead` of the CoM [m]."""
        # The matrices A (times, 3, 3) of d/dt (x, x', 1) = A (x, x', 1), with the ZMP p:
        # x'' = (down + z'') / z (x + ahead - p) - back.
        squared_rate = fall / (height + bob_height)
        matrices = np.zeros((len(times), 3, 3))
        matrices[:, 0, 1] = 1.0
        matrices[:, 1, 0] = squared_rate
        matrices[:, 1, 2] = squared_rate * (ahead(times) - zmp_at) - back
        ends = matrices[: len(t)]
        middle = matrices[len(t) :]
        # The classical Runge-Kutta method, for all steps at once: each `rate` is the matrix of one of its four slopes.
        rate_start = ends[:-1]
        rate_middle = middle @ (unit + tick / 2 * rate_start)
        rate_middle_again = middle @ (unit + tick / 2 * rate_middle)
        rate_end = ends[1:] @ (unit + tick * rate_middle_again)
        step_matrices = unit + tick / 6 * (rate_start + 2 * rate_middle + 2 * rate_middle_again + rate_end)
        products = [unit]
        for step in step_matrices:
            products.append(step.dot(products[-1]))
        whole_step = products[-1][:2]  # rows of x and x'; the third stays 1
        # Solve x(T) = x(0) + step_length, x'(T) = x'(0) for the start (x, x').
        start = np.linalg.solve(whole_step[:, :2] - np.eye(2), np.array([step_length, 0.0]) - whole_step[:, 2])
        state = np.concatenate(products).reshape(-1, 3, 3) @ np.append(start, 1.0)
        x = state[:, 0]
        v = state[:, 1]
        a = (ends @ state[..., None])[:, 1, 0]
        # Quintics by position, velocity and acceleration at their ends, as Bernstein coefficients.
        first, last = x[:-1], x[1:]
        second = first + duration * v[:-1] / 5
        third = first + 2 * duration * v[:-1] / 5 + duration**2 * a[:-1] / 20
        fourth = last - 2 * duration * v[1:] / 5 + duration**2 * a[1:] / 20
        fifth = last - duration * v[1:] / 5
        path = PPoly.construct_fast(to_powers([first, second, third, fourth, fifth, last]), t)
        return ComMotion(step_time=float(step_time), height=height, bob=bob, slope=slope, path=path, ahead=ahead)

    return motion_at


def _bernstein_to_powers(duration: NDArray) -> Callable[[list[NDArray]], NDArray]:
    """Return the function from Bernstein coefficients of quintics, (pieces,) each, to those of powers (6, pieces).

    The powers are of the time since a piece began, highest first; `duration` (pieces,) [s] is that of each piece. The
    bits are those of `PPoly.from_bernstein_basis`, which takes fifteen times as long.
    """
    order = 5
    signs = (-1.0) ** np.arange(order + 1)[:, None]
    divisors = np.stack([duration**power for power in range(order + 1)])
    # Coefficient i adds these to powers i and above, before the division by the power of the duration.
    weights = [
        np.array([comb(order - i, power - i) for power in range(i, order + 1)])[:, None] * signs[i:]
        for i in range(order + 1)
    ]

    def to_powers(bernstein: list[NDArray]) -> NDArray:
        """Return the coefficients (6, pieces) of powers."""
        powers = np.zeros_like(divisors)  # lowest first
        for i, coefficient in enumerate(bernstein):
            powers[i:] += signs[i] * comb(order, i) * coefficient * weights[i] / divisors[i:]
        return powers[::-1].copy()

    return to_powers
