"""The CoM of a walking bout: step lengths, ZMP, height, and the motion over them from rest to rest (see `bout`).

Where its functions ask for a `plan`, it is the steady walk in the bout's middle. Times [s] are from the start of the
bout, places x [m] forward of the ankles in standing there.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PPoly
from scipy.linalg import solve_banded

from springfoot.arrays import NDArray

from .body.body import GRAVITY
from .plan.plan import WalkPlan

BEFORE, AFTER = 2, 2
"""Step times from the start to the first heel strike, and from the closing foot's landing to the end; chosen."""
RAMP_STEPS = 3
"""First steps, and last ones, that are shorter than the walk's: people are at speed after one (Breniere & Do, J Biomech
19 (1986) 1035) to three steps (Mann et al., Acta Orthop Scand 50 (1979) 761)."""
FIRST_STEP = 0.55
"""Length of the first and of the last step beyond the ZMP's travel along the foot, over that of a step of the walk;
chosen: of the values tried, the body has to come down least with this one."""
STANDING_COM = 0.03
"""Distance of CoM and ZMP ahead of the ankles in standing [m at 1.70 m]; chosen: people's is 0.03 to 0.06."""
EASE = 1.5
"""Step times in which the CoM comes down from standing to the height of the walk, and goes up again; chosen."""


def step_lengths_of(plan: WalkPlan, steps: int) -> NDArray:
    """Lengths (steps,) [m]. What the first ones lack shrinks from step to step as a cart-table's lack of speed does."""
    shrinks = 1 / np.cosh(plan.step_time * np.sqrt(GRAVITY / plan.motion.height))
    from_end = np.minimum(np.arange(steps), np.arange(steps)[::-1])
    _, (_, zmp_from, zmp_to) = zmp_of_walk(plan)
    lacks = np.where(from_end < RAMP_STEPS, (1 - FIRST_STEP) * shrinks**from_end, 0.0)
    return plan.step_length - (plan.step_length - (zmp_to - zmp_from)) * lacks


def zmp_of_walk(plan: WalkPlan) -> tuple[NDArray, NDArray]:
    """Times [s] and places [m] of the walk's ZMP knots, in its step's frame."""
    times = np.array([0.0, plan.double_support, plan.step_time])
    return times, plan.zmp(times / plan.step_time * [1, 1, 1 - 1e-15])


def zmp_knots(plan: WalkPlan, step_lengths: NDArray) -> tuple[NDArray, NDArray]:
    """Times (K,) [s] and places (K, 3) [m]: of the ZMP, and what a unit of each of the two shifts adds to it."""
    step, double_support = plan.step_time, plan.double_support
    times, (_, zmp_from, zmp_to) = zmp_of_walk(plan)
    standing = STANDING_COM * plan.body.length_scale
    heel_off = plan.feet.heel_off * plan.stride_time
    at_heel_off = np.interp(heel_off, times[1:], [zmp_from, zmp_to])
    single = (BEFORE - 1) * step
    knots = [
        (0.0, standing, 0, 0),
        (single / 2, standing, 1, 0),
        (single + double_support, standing, 1, 0),
        (single + heel_off, at_heel_off, 0, 0),
        (single + step, zmp_to, 0, 0),
    ]
    hold = 0.0
    for k, length in enumerate(step_lengths):
        strike = (BEFORE + k) * step
        hold += length
        knots += [(strike + double_support, hold + zmp_from, 0, 0), (strike + step, hold + zmp_to, 0, 0)]
    closing, end = (BEFORE + len(step_lengths)) * step, (BEFORE + len(step_lengths) + AFTER) * step
    knots[-1] = (closing, hold + standing, 0, 1)
    knots += [((closing + end) / 2, hold + standing, 0, 1), (end, hold + standing, 0, 0)]
    table = np.array(knots)
    return table[:, 0], table[:, 1:]


def _eased(time: NDArray, start: float, end: float) -> NDArray:
    """(3, T): from 0 at `start` to 1 at `end`, both [s], with its two time derivatives, which are 0 at both."""
    lasts = end - start
    u = np.clip((time - start) / lasts, 0.0, 1.0)
    return np.stack(
        [
            u**3 * (10 - 15 * u + 6 * u**2),
            30 * (u * (1 - u)) ** 2 / lasts,
            60 * u * (1 - u) * (1 - 2 * u) / lasts**2,
        ]
    )


def _product(a: NDArray, b: NDArray) -> NDArray:
    """Product (3, T) of two functions (3, T), all given by value and two derivatives."""
    return np.stack([a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]])


def _height(plan: WalkPlan, time: NDArray, standing: float, dips: NDArray) -> NDArray:
    """(3, T) CoM height [m] and its two derivatives: standing, the walk, and back, less the dips at each step time."""
    step, within = plan.step_time, np.mod(time, plan.step_time)
    motion = plan.motion
    walk = np.stack([motion.position(within)[1], motion.velocity(within)[1], motion.acceleration(within)[1]])
    walk[0] -= standing
    walks = _eased(time, 0.0, EASE * step) - _eased(time, time[-1] - EASE * step, time[-1])
    height = _product(walks, walk)
    height[0] += standing
    k = np.minimum((time / step).astype(int), len(dips) - 2)
    height -= (dips[k + 1] - dips[k]) * _eased(time - k * step, 0.0, step)
    height[0] -= dips[k]
    return height


def com_from_rest_to_rest(
    plan: WalkPlan, knots: tuple[NDArray, NDArray], time: NDArray, standing: float, dips: NDArray
) -> tuple[NDArray, tuple[float, float]]:
    """CoM (3, T, 2): x, z [m] at `time` (T,) [s] with two derivatives; and the two shifts of the ZMP [m].

    `knots` as from `zmp_knots`, all but on one of the times. The CoM stands `standing` [m] high and comes down by
    `dips` [m] below its height in the walk at each step time.
    """
    at = np.sort(np.concatenate([time, (time[1:] + time[:-1]) / 2]))
    height = _height(plan, at, standing, dips)
    pull = (GRAVITY + height[2]) / height[0]
    driven = np.stack([np.interp(at, knots[0], column) for column in knots[1].T], -1)
    x, v = _between_fixed_ends(time, pull, driven)
    shifts = np.linalg.solve(v[[0, -1], 1:], -v[[0, -1], 0])
    weights = np.array([1.0, *shifts])
    x, v = x @ weights, v @ weights
    v[[0, -1]] = 0.0
    acceleration = pull[::2] * (x - driven[::2] @ weights)
    return np.stack([np.stack([x, v, acceleration]), height[:, ::2]], -1), (float(shifts[0]), float(shifts[1]))


def quintics(time: NDArray, motion: NDArray) -> PPoly:
    """Twice continuously differentiable curves through `motion` (3, T, n): values, two derivatives at `time` (T,)."""
    h = np.diff(time)[:, None]
    (x, v, a), (x1, v1, a1) = motion[:, :-1], motion[:, 1:]
    dx, dv, da = x1 - x - v * h - a * h**2 / 2, (v1 - v - a * h) * h, (a1 - a) * h**2
    return PPoly(
        np.stack(
            [
                (6 * dx - 3 * dv + da / 2) / h**5,
                (-15 * dx + 7 * dv - da) / h**4,
                (10 * dx - 4 * dv + da / 2) / h**3,
                a / 2,
                v,
                x,
            ]
        ),
        time,
    )


def _between_fixed_ends(time: NDArray, pull: NDArray, driven: NDArray) -> tuple[NDArray, NDArray]:
    """x and v of x'' = pull (x - p), each (T, columns), x = p at both ends.

    `pull` (2T - 1,) and p, `driven` (2T - 1, columns), are given at `time` (T,) and in the middle between. By
    Hermite-Simpson collocation, of fourth order, one banded system: shooting would lose e^3.2 a second.
    """
    h, n = np.diff(time), len(time)
    w0, wm, w1 = pull[:-2:2], pull[1::2], pull[2::2]
    f0, fm, f1 = ((w[:, None] * p) for w, p in ((w0, driven[:-2:2]), (wm, driven[1::2]), (w1, driven[2::2])))
    band, right = np.zeros((5, 2 * n)), np.zeros((2 * n, driven.shape[1]))

    def put(row: NDArray, column: NDArray, value: ArrayLike) -> None:
        band[2 + row - column, column] = value

    x0 = 2 * np.arange(n - 1)  # unknowns x, v alternate
    v0, x1, v1 = x0 + 1, x0 + 2, x0 + 3
    # x1 - x0 = h/2 (v0 + v1) - h^2/12 (a1 - a0), with a = w (x - p)
    row = x0 + 1
    put(row, x0, -1 - h**2 / 12 * w0)
    put(row, v0, -h / 2)
    put(row, x1, 1 + h**2 / 12 * w1)
    put(row, v1, -h / 2)
    right[row] = (h**2 / 12)[:, None] * (f1 - f0)
    # v1 - v0 = h/6 (a0 + 4 am + a1), with xm = (x0 + x1) / 2 - h/8 (v1 - v0)
    row = x0 + 2
    put(row, x0, -h / 6 * (w0 + 2 * wm))
    put(row, v0, -1 - h**2 / 12 * wm)
    put(row, x1, -h / 6 * (w1 + 2 * wm))
    put(row, v1, 1 + h**2 / 12 * wm)
    right[row] = -(h / 6)[:, None] * (f0 + 4 * fm + f1)
    ends = np.array([0, 2 * n - 1])
    put(ends, np.array([0, 2 * n - 2]), 1.0)
    right[ends] = driven[[0, -1]]
    solution = solve_banded((2, 2), band, right)
    return solution[0::2], solution[1::2]
