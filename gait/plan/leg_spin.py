"""Compute the effect of swinging legs on the ground reaction force.

In the cart-table model nothing turns: the force points from the ZMP to the CoM. Swinging legs turn: their angular
momentum L about the CoM changes by dL/dt = (p - x) F_z + z F_x, so that the force points from the ZMP p to a pivot,
dL/dt / F_z ahead of the CoM. With this pivot the hip moments of inverse dynamics keep the trunk upright.
"""

from collections.abc import Callable
from math import cos, hypot, sin

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from springfoot.errors import SpringfootError

from ..body.body import Body, gravity
from ..body.leg_dynamics import motion_of, segment_turns, spin_rate
from ..people.fourier import PLAN_HARMONICS, fourier_jet
from .cart_table import ComMotion
from .posture import LOWEST_COM, POSTURE_SAMPLES, LegPostures, full_reach

PLAN_SETTLED = 1e-5
"""Largest change of CoM height and pivot between two rounds of a settled plan [m]; chosen."""
ROUNDS = 60
"""Rounds after which a plan that does not settle is refused; chosen: most settle within 15."""


def spinning_legs(
    body: Body,
    legs_at: Callable[[float, PPoly], tuple[ComMotion, LegPostures]],
    still: PPoly,
    step_length: float,
    knee: float,
    height: float | None = None,
    lean: float = 0.0,
) -> tuple[ComMotion, LegPostures]:
    """Find the CoM motion, and the legs, that agree with the legs' angular momentum.

    Only plans with a style of walking count this momentum; those after people's curves leave it out.

    Args:
        body: the body that walks.
        legs_at: plans CoM motion and legs for a mean CoM height [m] and a pivot ahead of the CoM [m] over time [s].
        still: the pivot [m] over time [s] of legs that do not turn, with which the rounds begin.
        step_length: length of a step [m].
        knee: least flexion of the knee [rad]; it sets the mean CoM height if `height` does not.
        height: mean CoM height [m]; None: found, so that the straightest knee has the flexion `knee`.
        lean: forward lean of the trunk [rad].

    Raises `SpringfootError` if the rounds do not settle.
    """
    reach = full_reach(body, knee)
    fixed_height = height
    # A first guess, unless the height is fixed.
    height = 1.05 * body.leg_length if fixed_height is None else fixed_height
    ahead = still
    # Fixed point: the legs under a CoM and a pivot give the next pivot, and the next height.
    for _ in range(ROUNDS):
        motion, legs = legs_at(height, ahead)
        # The CoM is too high by the length that the leg lacks with the knee's least flexion.
        lacking = float(legs.reach.max()) - reach if fixed_height is None else 0.0
        before = ahead
        ahead = pivot_ahead(body, motion, legs, step_length, lean)
        pivot_change = float(np.abs(ahead(ahead.x) - before(ahead.x)).max())
        if abs(lacking) < PLAN_SETTLED and pivot_change < PLAN_SETTLED:
            return motion, legs
        height -= lacking
        if height < LOWEST_COM * body.leg_length:
            break
    raise SpringfootError("no CoM settles over these feet: legs too short, or a swing too violent, for this step")


def pivot_ahead(body: Body, motion: ComMotion, legs: LegPostures, step_length: float, lean: float = 0.0) -> CubicSpline:
    """Return the distance of the pivot ahead of the CoM [m], as a periodic function of the time in a step [s].

    The ground force of a body with swinging legs points to the pivot, not to the CoM (see the module's head). `legs`
    are one leg's postures over a stride; the trunk is upright or leans by `lean` [rad].
    """
    stride_time = 2 * motion.step_time
    half = POSTURE_SAMPLES // 2
    phase = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    angles = {name: getattr(legs, name) for name in ("thigh", "knee", "ankle", "toe")}
    # The hip without its mean progress repeats every stride, so a Fourier series can differentiate it.
    hip = legs.hip - np.outer(phase, [2 * step_length, 0.0])
    samples = np.concatenate([segment_turns(angles, motion.slope), hip], -1)
    leg = motion_of(*fourier_jet(samples, PLAN_HARMONICS, phase, stride_time))
    com = np.stack(motion.position(np.mod(2 * phase, 1.0) * motion.step_time), -1)
    # Subtract the mean forward motion, so that the CoM repeats every stride. `motion` is of one step: the second step
    # of the stride is a step length ahead.
    com[:, 0] += step_length * ((phase >= 0.5) - 2 * phase)
    # Rate of change of angular momentum about the CoM [N m]: both legs, half a stride apart, and then the trunk.
    one_leg = spin_rate(body, leg, com)
    upright = motion.slope + lean
    moment_about_hip = hypot(*body.upper_moment) * np.array([sin(upright), cos(upright)])
    turning = one_leg + np.roll(one_leg, -half)
    mass = body.trunk_mass + body.carried_mass
    moment = mass * (leg.hip - com) + moment_about_hip  # first mass moment of trunk and load about the CoM [kg m]
    turning += moment[:, 0] * leg.hip_acceleration[:, 1] - moment[:, 1] * leg.hip_acceleration[:, 0]
    time = np.arange(half + 1) / half * motion.step_time
    _, com_acceleration = motion.acceleration(time[:-1])
    _, g = gravity(motion.slope)
    upward_force = body.total_mass * (-g + com_acceleration)  # [N]
    ahead = turning[:half] / upward_force
    return CubicSpline(time, np.append(ahead, ahead[0]), bc_type="periodic")
