"""Compute the effect of swinging legs on the ground reaction force.

In the cart-table model nothing turns: the force points from the ZMP to the CoM. Swinging legs turn: their angular
momentum L about the CoM changes by dL/dt = (p - x) F_z + z F_x, so that the force points from the ZMP p to a pivot,
dL/dt / F_z ahead of the CoM. With this pivot the hip moments of inverse dynamics keep the trunk upright.
"""

from collections.abc import Callable
from functools import lru_cache
from math import cos, hypot, sin

import numpy as np
from scipy.interpolate import PPoly

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..body.body import Body, gravity
from ..body.leg_dynamics import motion_of, segment_turns, spin_rate
from ..people.fourier import PLAN_HARMONICS, fourier_jet
from ..people.human import HumanGait
from .cart_table import Bob, ComMotion
from .foot import FootPath
from .periodic_spline import periodic_spline
from .posture import (
    LOWEST_COM,
    POSTURE_SAMPLES,
    STRIDE_PHASES,
    LegPostures,
    com_over_stride,
    full_reach,
    legs_under_com,
)

PLAN_SETTLED = 1e-5
"""Largest change of CoM height and pivot between two rounds of a settled plan [m]; chosen."""
ROUNDS = 60
"""Rounds after which a plan that does not settle is refused; chosen: most settle within 15."""


def spinning_legs(
    body: Body,
    com_at: Callable[[float, PPoly], ComMotion],
    feet: FootPath,
    human: HumanGait,
    step_time: float,
    knee: float,
    height: float | None = None,
    lean: float = 0.0,
) -> tuple[ComMotion, LegPostures]:
    """Find the CoM motion, and the legs, that agree with the legs' angular momentum.

    Only plans with a style of walking count this momentum; those after people's curves leave it out.

    Args:
        body: the body that walks.
        com_at: plans the CoM for a mean height [m] and a pivot ahead of it [m] over time [s] (`pivoted_com`).
        feet: path of the feet.
        human: gait that gives the toe in swing, if the feet's style does not.
        step_time: time of a step [s].
        knee: least flexion of the knee [rad]; it sets the mean CoM height if `height` does not.
        height: mean CoM height [m]; None: found, so that the straightest knee has the flexion `knee`.
        lean: forward lean of the trunk [rad].

    Raises `SpringfootError` if the rounds do not settle.
    """
    reach = full_reach(body, knee)
    fixed_height = height
    # A first guess, unless the height is fixed.
    height = 1.05 * body.leg_length if fixed_height is None else fixed_height
    half = POSTURE_SAMPLES // 2
    times = np.arange(half + 1) / half * step_time
    spline = periodic_spline(times)
    ahead = np.zeros(half)  # at the times of the samples, but the last: legs that do not turn
    legs = None
    # Fixed point: the legs under a CoM and a pivot give the next pivot, and the next height.
    for _ in range(ROUNDS):
        motion = com_at(height, spline(ahead))
        legs = legs_under_com(body, motion, feet, human, legs, lean)
        # The CoM is too high by the length that the leg lacks with the knee's least flexion.
        lacking = float(legs.reach.max()) - reach if fixed_height is None else 0.0
        before = ahead
        ahead = pivot_ahead(body, motion, legs, feet.step_length, lean)
        pivot_change = float(np.abs(ahead - before).max())
        if abs(lacking) < PLAN_SETTLED and pivot_change < PLAN_SETTLED:
            return motion, legs
        height -= lacking
        if height < LOWEST_COM * body.leg_length:
            break
    raise SpringfootError("no CoM settles over these feet: legs too short, or a swing too violent, for this step")


def pivot_ahead(body: Body, motion: ComMotion, legs: LegPostures, step_length: float, lean: float = 0.0) -> NDArray:
    """Return the distance of the pivot ahead of the CoM [m] over a step, at the first half of `STRIDE_PHASES`.

    The ground force of a body with swinging legs points to the pivot, not to the CoM (see the module's head). `legs`
    are one leg's postures over a stride; the trunk is upright or leans by `lean` [rad].
    """
    half = POSTURE_SAMPLES // 2
    angles = {name: getattr(legs, name) for name in ("thigh", "knee", "ankle", "toe")}
    # The hip without its mean progress repeats every stride, so a Fourier series can differentiate it.
    hip = legs.hip - np.outer(STRIDE_PHASES, [2 * step_length, 0.0])
    samples = np.concatenate([segment_turns(angles, motion.slope), hip], -1)
    leg = motion_of(*fourier_jet(samples, PLAN_HARMONICS, STRIDE_PHASES, 2 * motion.step_time))
    # Subtract the mean forward motion, so that the CoM repeats every stride. `motion` is of one step: the second step
    # of the stride is a step length ahead.
    com_x, com_z = com_over_stride(motion)
    com = np.stack([com_x + step_length * ((STRIDE_PHASES >= 0.5) - 2 * STRIDE_PHASES), com_z], -1)
    # Rate of change of angular momentum about the CoM [N m]: both legs, half a stride apart, and then the trunk.
    one_leg = spin_rate(body, leg, com)
    upright = motion.slope + lean
    moment_about_hip = hypot(*body.upper_moment) * np.array([sin(upright), cos(upright)])
    mass = body.trunk_mass + body.carried_mass
    # Only the first step of the stride: the second is the same.
    moment = (
        mass * (leg.hip - com)[:half] + moment_about_hip
    )  # first mass moment of trunk and load about the CoM [kg m]
    turning = one_leg[:half] + one_leg[half:]
    turning += moment[:, 0] * leg.hip_acceleration[:half, 1] - moment[:, 1] * leg.hip_acceleration[:half, 0]
    return turning / _upward_force(body, motion.bob, motion.slope)


@lru_cache(maxsize=2)
def _upward_force(body: Body, bob: Bob, slope: float) -> NDArray:
    """Return the upward force [N] on the body at the first half of `STRIDE_PHASES`; cached."""
    half = POSTURE_SAMPLES // 2
    _, g = gravity(slope)
    return body.total_mass * (-g + bob(np.arange(half) / half * bob.step_time, 2))
