"""Compute limits, tolerances and units of the reward for one body."""

from functools import lru_cache
from math import sqrt

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import GRAVITY, Body

from ..physics.model import ANKLE, HIP, JOINTS, KNEE, TOE
from .episode_end import MIN_HIP_HEIGHT

COM_X_TOLERANCE, COM_Z_TOLERANCE = 0.03, 0.015
"""Error of the CoM, forward and up, at which its reward is 1/e [m at 1.70 m, scaled with height]; chosen."""
COP_TOLERANCE = 0.04
"""Distance of the CoP from the planned ZMP at which its reward is 1/e [m at 1.70 m, scaled with height]; chosen."""
SPEED_TOLERANCE = 0.05
"""Error of the CoM's forward speed at which its reward is 1/e [m/s at 1.70 m, scaled with its square root]; chosen: at
0.10 policies walk too slowly and push off with less than people's moment."""
POSE_WEIGHTS = {HIP: 3.0, ANKLE: 3.0, TOE: 0.1}
"""Weight of a joint's squared error in the pose error E [-], the knee's being the setting `knee_weight`; chosen: the
toe counts little, as its curve comes from other people than the curves of thigh, knee and ankle."""
ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT = 300.0, 60.0
"""Stiffness that costs one unit [N m/rad at 1.70 m, 63 kg, scaled with mass x height]; chosen, as in mid-stance."""
TOE_SHARE = 0.25
"""Weight of the toe against the ankle in the cost of stiffness [-]; chosen."""

SCALES = np.dtype(
    [
        ("min_hip_height", float),  # [m]
        ("tolerance", float, 4),  # of the CoM's x, z [m] and forward speed [m/s], of the CoP [m]
        ("pose_share", float, len(JOINTS)),
        ("stiffness_unit", float, 2),  # ankle, toe [N m/rad]
        ("stiffness_share", float, 2),
        ("strength_scale", float),  # of tissue and tendons, over that of 1.70 m and 63 kg [-]
        ("weight", float),  # of body and load [N]
    ]
)
"""Limits, tolerances and units of one body."""


@lru_cache(maxsize=256)
def body_scales(body: Body, knee_weight: float) -> NDArray:
    """Return the limits, tolerances and units by which the reward judges a body, (1,) of `SCALES`; cached.

    `knee_weight` is the knee's among `POSE_WEIGHTS`.
    """
    length = body.length_scale
    scales = np.zeros(1, SCALES)
    scales["min_hip_height"] = MIN_HIP_HEIGHT * length
    lengths = np.array([COM_X_TOLERANCE, COM_Z_TOLERANCE, COP_TOLERANCE]) * length
    com_x, com_z, cop = lengths
    scales["tolerance"] = com_x, com_z, SPEED_TOLERANCE * sqrt(length), cop
    weights = POSE_WEIGHTS | {KNEE: knee_weight}
    scales["pose_share"] = [weights[joint] for joint in range(len(JOINTS))]
    scales["stiffness_unit"] = np.array([ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT]) * body.stiffness_scale
    scales["stiffness_share"] = np.array([1.0, TOE_SHARE]) / (1.0 + TOE_SHARE)
    scales["strength_scale"] = body.strength_scale
    scales["weight"] = body.total_mass * GRAVITY
    return scales
