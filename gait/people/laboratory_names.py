"""Recognise the curves of a motion laboratory's software by their names: Plug-in Gait's and Visual3D's, in any table.

`LKneeAngles`, `R_ANKLE_MOMENT`, `Left Hip Angle`, with an X behind or nothing: angles in degrees, moments per kg.
Plug-in Gait has our signs, and moments in N mm/kg. Visual3D counts turns about the axis to the right: its knee flexes
below 0, its pelvis tilts forward below 0, and its moments at hip and ankle are opposite to ours.
"""

import re

import numpy as np

from springfoot.arrays import NDArray
from springfoot.files.text_table import Table

NAME = re.compile(
    r"(?:.*:)?(left|right|l|r)[ _]*(hip|knee|ankle|pelvis|toe|mtp)[ _]*(angle|moment)s?(?:[ _.:(]*x\)?)?", re.IGNORECASE
)
"""Name of a column: side, joint, quantity, and perhaps the component X."""
SMALLEST_NMM = 250.0
"""Peak from which on moments are in N mm/kg; chosen: people's ankles reach 1,000 of them, or 150 N m."""


def laboratory_curves(table: Table, side: str) -> dict[str, NDArray]:
    """Return the curves of a side (left, right) in a table with a laboratory's names, in the units and signs of
    `HumanGait`."""
    found: dict[str, NDArray] = {}
    for column in table.columns:
        match = NAME.fullmatch(column)
        if match and match[1][0].lower() == side[0] and table.has(column):
            joint = {"mtp": "toe"}.get(match[2].lower(), match[2].lower())
            is_angle = match[3].lower() == "angle"
            values = table.numbers(column)
            found[joint if is_angle else f"{joint}_moment"] = np.radians(values) if is_angle else values
    pelvis = found.pop("pelvis", None)
    moments = [name for name in found if name.endswith("_moment")]
    if moments and max(np.abs(found[name]).max() for name in moments) > SMALLEST_NMM:
        found |= {name: found[name] / 1000 for name in moments}
    turns_right = "knee" in found and found["knee"].mean() < 0  # as Visual3D counts
    if turns_right:
        found["knee"] = -found["knee"]
    if pelvis is not None and "hip" in found:
        found["thigh"] = found["hip"] + pelvis if turns_right else found["hip"] - pelvis
    return with_internal_moments(found, except_knee=turns_right)


def with_internal_moments(curves: dict[str, NDArray], except_knee: bool = False) -> dict[str, NDArray]:
    """Return the curves of a leg with moments turned if the ankle's is negative on the average: it pushes the toes
    down in every walk. `except_knee` leaves that of the knee."""
    if np.nanmean(curves.get("ankle_moment", [0.0])) >= 0:
        return curves
    turned = [name for name in curves if name.endswith("_moment") and not (except_knee and name == "knee_moment")]
    return curves | {name: -curves[name] for name in turned}
