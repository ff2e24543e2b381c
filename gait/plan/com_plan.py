"""Plan a CoM over one step, without legs; and the CoM over people's zero-moment point (ZMP).

In `plan_walk` the toe stays flat until the end of a double support shorter than people's: under an upright trunk
people's ZMP would take the legs away from people's angles. A body on people's legs (`envs`) follows the CoM of this
module instead: the same steps, time and height, over people's ZMP.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray

from ..body.body import Body
from ..people.human import HumanGait
from .cart_table import ComMotion, periodic_com

Point = tuple[NDArray, NDArray]

PEOPLES_SHARE = 0.9
"""Double support over people's; chosen: the ZMP, straight between the feet, is then nearest to people's at 1.2 m/s."""
PEOPLES_ZMP = (0.020, 0.150)
"""ZMP forward of the stance ankle at the start and end of single support [m at 1.70 m]; chosen: people's, to 0.5 cm."""
LOWEST = 0.065
"""Latest time of the lowest CoM over step time [-]; people's is 0.07 at 1.2 m/s (docs/results/thesis.md)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ComPlan:
    """The CoM of a periodic walk.

    Step phase 0..1 runs from the heel strike of the leading foot to that of the other foot. The frame has x [m] forward
    of the leading (stance) foot's ankle when flat, z [m] up from the floor. Phases may have any shape and are taken
    modulo 1. On a slope x is along the ground and z at right angles to it.
    """

    body: Body
    """The planned body."""
    speed: float
    """Mean forward speed along the ground [m/s] = step_length / step_time."""
    step_time: float
    """Heel strike to heel strike of the other foot [s]."""
    step_length: float
    """Heel strike to heel strike of the other foot [m]."""
    double_support: float
    """Heel strike to toe-off of the other foot [s]."""
    motion: ComMotion
    """The CoM over the time of a step, lowest in double support."""
    human: HumanGait
    """People's gait at this speed and height, or the gait given to `plan_walk` in its place."""
    lean: float = 0.0
    """Pitch of the trunk at which its CoM, with that of a load, is upright over the hip [rad], forward positive."""

    @property
    def slope(self) -> float:
        """Slope of the ground [rad], uphill positive."""
        return self.motion.slope

    @property
    def stride_time(self) -> float:
        """Time of two steps [s]."""
        return 2 * self.step_time

    def com(self, step_phase: ArrayLike) -> Point:
        """Return the CoM (x from the stance ankle, z from the floor) [m]."""
        return self.motion.position(self._time(step_phase))

    def com_velocity(self, step_phase: ArrayLike) -> Point:
        """Return the CoM velocity (forward, up) [m/s]."""
        return self.motion.velocity(self._time(step_phase))

    def com_acceleration(self, step_phase: ArrayLike) -> Point:
        """Return the CoM acceleration (forward, up) [m/s^2], continuous through the steps."""
        return self.motion.acceleration(self._time(step_phase))

    def pivot(self, step_phase: ArrayLike) -> Point:
        """Return the point (x, z) [m] to which the ground reaction force points: the CoM, or with swinging legs a point
        ahead of the CoM."""
        return self.motion.pivot(self._time(step_phase))

    def zmp(self, step_phase: ArrayLike) -> NDArray:
        """Return the ZMP [m] from the stance ankle, by equation (1) from the planned motion itself."""
        return self.motion.zmp(self._time(step_phase))

    def _time(self, step_phase: ArrayLike) -> NDArray:
        """Return the time since the step began [s] at step phases of any shape, which are taken modulo 1."""
        return np.mod(np.asarray(step_phase, float), 1.0) * self.step_time


def over_peoples_zmp(plan: ComPlan) -> ComPlan:
    """Plan the CoM over people's ZMP for the steps, height, rise and slope of `plan`.

    Double support lasts `PEOPLES_SHARE` of that of `plan.human`. In single support the ZMP runs straight along
    `PEOPLES_ZMP`.
    """
    # People's double support lasts 2 toe_off - 1 of a step: from a heel strike to the other foot's toe-off.
    double_support = PEOPLES_SHARE * (2 * plan.human.toe_off - 1) * plan.step_time
    zmp_from, zmp_to = np.array(PEOPLES_ZMP) * plan.body.length_scale
    motion = periodic_com(
        np.array([0.0, double_support, plan.step_time]),
        np.array([zmp_to - plan.step_length, zmp_from, zmp_to]),  # it starts where the step before ended
        plan.step_length,
        plan.motion.height,
        replace(plan.motion.bob, lowest_at=min(double_support / 2, LOWEST * plan.step_time)),
        plan.slope,
    )
    return ComPlan(
        body=plan.body,
        speed=plan.speed,
        step_time=plan.step_time,
        step_length=plan.step_length,
        double_support=double_support,
        motion=motion,
        human=plan.human,
    )
