"""Compute the effect of swinging legs on the ground reaction force.

The cart-table's force points from the ZMP to the CoM: nothing turns. Legs that swing do: their angular momentum L about
the CoM changes by dL/dt = (p - x) F_z + z F_x, so that the force points from the ZMP p to a pivot, dL/dt / F_z ahead of
the CoM. With it the hip moments of inverse dynamics are those that keep the trunk upright.
"""

from collections.abc import Callable
from math import cos, hypot, sin

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from springfoot.errors import SpringfootError

from ..body.body import Body, gravity
from ..body.leg import motion_of, segment_turns, spin_rate
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
    """Return the CoM motion that accounts for the legs' angular momentum, and its legs.

    The CoM is as high as leaves every knee flexed by `knee` [rad]. `legs_at` plans for a CoM `height` [m], which may be
    given, and a pivot; `still` is the pivot of legs that do not turn; `lean` [rad] is that of the trunk. Raises
    `SpringfootError` if the rounds do not settle.
    """
    reach = full_reach(body, knee)
    given = height
    height = 1.05 * body.leg_length if given is None else given
    ahead = still
    for _ in range(ROUNDS):
        motion, legs = legs_at(height, ahead)
        lacking = float(legs.reach.max()) - reach if given is None else 0.0
        before = ahead
        ahead = pivot_ahead(body, motion, legs, step_length, lean)
        moved = float(np.abs(ahead(ahead.x) - before(ahead.x)).max())
        if abs(lacking) < PLAN_SETTLED and moved < PLAN_SETTLED:
            return motion, legs
        height -= lacking
        if height < LOWEST_COM * body.leg_length:
            break
    raise SpringfootError("no CoM settles over these feet: legs too short, or a swing too violent, for this step")


def pivot_ahead(body: Body, motion: ComMotion, legs: LegPostures, step_length: float, lean: float = 0.0) -> CubicSpline:
    """Return the distance of the pivot ahead of the CoM [m] over the time of a step, trunk upright or at a `lean`
    [rad]."""
    stride_time = 2 * motion.step_time
    half = POSTURE_SAMPLES // 2
    phase = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    angles = {name: getattr(legs, name) for name in ("thigh", "knee", "ankle", "toe")}
    still = legs.hip - np.outer(phase, [2 * step_length, 0.0])
    samples = np.concatenate([segment_turns(angles, motion.slope), still], -1)
    leg = motion_of(*fourier_jet(samples, PLAN_HARMONICS, phase, stride_time))
    com = np.stack(motion.position(np.mod(2 * phase, 1.0) * motion.step_time), -1)
    com[:, 0] += step_length * ((phase >= 0.5) - 2 * phase)
    own = spin_rate(body, leg, com)
    upright = motion.slope + lean
    upper = hypot(*body.upper_moment) * np.array([sin(upright), cos(upright)])
    turning = own + np.roll(own, -half)
    mass = body.trunk_mass + body.carried_mass
    lever = mass * (leg.hip - com) + upper
    turning += lever[:, 0] * leg.hip_acceleration[:, 1] - lever[:, 1] * leg.hip_acceleration[:, 0]
    step = turning[:half]
    time = np.arange(half + 1) / half * motion.step_time
    force = body.total_mass * (-gravity(motion.slope)[1] + motion.acceleration(time[:-1])[1])
    ahead = step / force
    return CubicSpline(time, np.append(ahead, ahead[0]), bc_type="periodic")
