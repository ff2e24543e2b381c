"""What the reward holds a step against: people and plan at each phase of the stride, and tolerances of one body."""

from functools import lru_cache
from math import sqrt

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import ANGLES, GRAVITY, Body
from springfoot.gait.people.human import HumanGait
from springfoot.gait.plan.com_plan import ComPlan

from ..control.phase_table import GRID
from ..physics.model import ANKLE, HIP, JOINTS, KNEE, TOE

MIN_HIP_HEIGHT = 0.65
"""A hip lower than this is a fall [m at 1.70 m, scaled with height]; chosen: in walking it stays above 0.83 m."""
COM_X_TOLERANCE, COM_Z_TOLERANCE = 0.03, 0.015
"""Error of the CoM, forward and up, at which its reward is 1/e [m at 1.70 m, scaled with height]; chosen."""
COP_TOLERANCE = 0.04
"""Distance of the CoP from the planned ZMP at which its reward is 1/e [m at 1.70 m, scaled with height]; chosen."""
SPEED_TOLERANCE = 0.05
"""Error of the CoM's forward speed at which its reward is 1/e [m/s at 1.70 m, scaled with its square root]; chosen: at
0.10 policies walk too slowly and push off with less than people's moment."""
POSE_WEIGHTS = {HIP: 3.0, KNEE: 2.5, ANKLE: 3.0, TOE: 0.1}
"""Weight of each joint's squared error in the pose error E [-]; chosen: the toe counts little, as its curve is of other
people than those of thigh, knee and ankle."""
FORCE_BAND = 0.5
"""People's range of forces, to either side of their mean [SD]; chosen: at 1 the ankle pushes off with less than their
moment."""
ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT = 300.0, 60.0
"""Stiffness whose cost is one unit [N m/rad at 1.70 m, 63 kg, scaled with mass x height]; chosen, as of mid-stance."""
TOE_SHARE = 0.25
"""Weight of the toe against the ankle in the cost of stiffness [-]; chosen."""

REFERENCE = np.dtype(
    [
        ("pose", float, len(JOINTS)),  # people's thigh (to the vertical), knee, ankle, toe [rad]
        ("force", float, 2),  # people's ground reaction force (forward, up), at the middle of the step [body weights]
        ("force_band", float, 2),  # how far from it is still people's range
        ("com", float, 2),  # the plan's CoM (x, z) [m], x from this leg's ankle and less its mean advance
        ("zmp", float),  # the plan's ZMP at the middle of the step [m], x as of `com`
        ("speed", float),  # the plan's forward speed of the CoM [m/s]
        ("stride_length", float),  # of the plan [m], the same at every phase
    ]
)
"""What people and plan do at a phase of one leg's stride; `com`, `zmp`, `speed` are for the leg whose stance began
last."""
SCALES = np.dtype(
    [
        ("min_hip_height", float),  # [m]
        ("tolerance", float, 4),  # of the CoM's x, z [m] and forward speed [m/s], of the CoP [m]
        ("pose_share", float, len(JOINTS)),
        ("stiffness_unit", float, 2),  # ankle, toe [N m/rad]
        ("stiffness_share", float, 2),
        ("weight", float),  # of body and load [N]
    ]
)
"""Limits, tolerances and units of one body."""


@lru_cache(maxsize=256)
def body_scales(body: Body) -> NDArray:
    """(1,) of dtype `SCALES`."""
    length = body.length_scale
    scales = np.zeros(1, SCALES)
    scales["min_hip_height"] = MIN_HIP_HEIGHT * length
    lengths = np.array([COM_X_TOLERANCE, COM_Z_TOLERANCE, COP_TOLERANCE]) * length
    scales["tolerance"] = *lengths[:2], SPEED_TOLERANCE * sqrt(length), lengths[2]
    scales["pose_share"] = [POSE_WEIGHTS[joint] for joint in range(len(JOINTS))]
    scales["stiffness_unit"] = np.array([ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT]) * body.stiffness_scale
    scales["stiffness_share"] = np.array([1.0, TOE_SHARE]) / (1.0 + TOE_SHARE)
    scales["weight"] = body.total_mass * GRAVITY
    return scales


def reference_curves(plan: ComPlan, human: HumanGait, step_seconds: float) -> NDArray:
    """People and plan over the stride, (SAMPLES,) of dtype `REFERENCE`, for steps of `step_seconds` [s]."""
    curves = np.zeros(len(GRID), REFERENCE)
    curves["pose"] = np.stack([human.mean(name, GRID) for name in ANGLES], -1)
    middle = (GRID - 0.5 * step_seconds / plan.stride_time) % 1.0  # a force averaged over a step belongs to its middle
    for axis, name in enumerate(("grf_forward", "grf_vertical")):
        curves["force"][:, axis] = human.mean(name, middle)
        curves["force_band"][:, axis] = FORCE_BAND * human.sd(name, middle)
    step = (2 * GRID) % 1.0
    x, z = plan.com(step)
    curves["com"] = np.stack((x - plan.step_length * step, z), -1)
    earlier = 2 * GRID - 0.5 * step_seconds / plan.step_time  # the middle of the step, which may lie in the step before
    curves["zmp"] = plan.zmp(earlier) + plan.step_length * (np.floor(earlier) - np.floor(2 * GRID) - step)
    curves["speed"], _ = plan.com_velocity(step)
    curves["stride_length"] = 2 * plan.step_length
    return curves
