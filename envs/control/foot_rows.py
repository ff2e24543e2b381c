"""What the control keeps of the feet: muscles or a device at each ankle and toe, in rows that kernels read."""

from collections.abc import Sequence

import numpy as np

from springfoot.gait.arrays import NDArray

from ..feet import feet_of
from ..physics.foot import LOCK, Feet
from ..settings import BipedSettings
from .rows import FOOT


def foot_rows(settings: BipedSettings, feet: Sequence[Feet]) -> NDArray:
    """(N,) of `FOOT` for N pairs of feet."""
    rows = np.zeros(len(feet), FOOT)
    decided = [settings.stiffness_joints in ("both", name) for name in ("ankle", "toe")]
    for row, pair in zip(rows, feet, strict=True):
        for side, foot in enumerate(pair):
            for index, joint in enumerate(foot.joints):
                row["muscles"][side, index] = joint.device is None
                row["controlled"][side, index] = decided[index] and joint.device is None
                row["in_swing"][side, index] = joint.acts_in_swing
                rest = joint.device.rest if joint.device else joint.rest
                row["rests"][side, index], row["rest"][side, index] = rest is not None, rest or 0.0
                row["stiffness"][side, index] = joint.device.stiffness if joint.device else 0.0
                row["locked"][side, index] = joint.device == LOCK
    return rows


def controlled_joints(settings: BipedSettings) -> NDArray:
    """(side, 2) whether actions set the stiffness of ankle and toe; others are read as 0."""
    feet = feet_of(settings.left_foot, settings.right_foot)
    return foot_rows(settings, [feet])["controlled"][0].astype(bool)
