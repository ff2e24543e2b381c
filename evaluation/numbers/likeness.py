"""Compute how like people's a mean gait is: each curve's distance from theirs, its correlation and its peaks.

Human-facing edge: angles in degrees, forces in body weights (BW), moments in N m/kg. Curves are (101,) over percent.
"""

from collections.abc import Mapping

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait import HumanGait
from springfoot.gait.people import scores as score
from springfoot.gait.people.gait_events import PERCENT

ANGLE_JOINTS = ("thigh", "knee", "ankle", "toe")
"""Joints with an angle that is held against people's; the thigh's is to the vertical."""
MOMENT_JOINTS = ("hip", "knee", "ankle")
"""Joints with a known moment of people."""
LATE_SWING_PERCENT = 80
"""Percent of the stride from which the hip holds the leg back before it lands."""

Numbers = dict[str, float | None]
"""Name of a number, its unit at the end -> value; None where it cannot be computed."""
_PHASE = PERCENT / 100


def angle_numbers(curve: NDArray, human: HumanGait, joint: str) -> Numbers:
    """Return how far the mean curve of a joint's angle (101,) [deg] is from the mean of `human`: RMSE, correlation, and
    percent of the stride within one SD."""
    people = np.degrees(human.mean(joint, _PHASE))
    return {
        "rmse_deg": score.rmse(curve, people),
        "r": score.correlation(curve, people),
        "within_1sd_percent": score.share_within_sd(curve, people, np.degrees(human.sd(joint, _PHASE))),
    }


def moment_numbers(curve: NDArray, human: HumanGait, joint: str) -> Numbers:
    """Return peaks of the mean curve of a joint's moment (101,) [N m/kg], and its likeness to that of `human`.

    The likeness, correlation and percent within two SD, is None for the toe, of which people's moment is unknown.
    """
    peak, percent = score.largest(curve)
    late_swing, _ = score.largest(curve[LATE_SWING_PERCENT:])
    numbers: Numbers = {"peak_Nm_kg": peak, "peak_percent": percent, "late_swing_peak_Nm_kg": late_swing}
    if joint not in MOMENT_JOINTS:
        return numbers | {"r": None, "within_2sd_percent": None}
    people = human.mean(f"{joint}_moment", _PHASE)
    sd = human.sd(f"{joint}_moment", _PHASE)
    return numbers | {
        "r": score.correlation(curve, people),
        "within_2sd_percent": score.share_within_sd(curve, people, 2 * sd),
    }


def force_numbers(vertical: NDArray, forward: NDArray, human: HumanGait) -> Numbers:
    """Return peaks of one foot's force [BW], and its likeness to people's.

    A force that is missing is a curve of NaN, and its numbers are None.
    """
    features = score.force_features(vertical, forward)
    return {
        "vertical_peak1_bw": features.vertical_peak1,
        "vertical_valley_bw": features.vertical_valley,
        "vertical_peak2_bw": features.vertical_peak2,
        "vertical_r": score.correlation(vertical, human.mean("grf_vertical", _PHASE)),
        "braking_peak_bw": features.braking_peak,
        "forward_peak_bw": features.forward_peak,
        "forward_r": score.correlation(forward, human.mean("grf_forward", _PHASE)),
    }


def gait_numbers(curves: Mapping[str, NDArray], human: HumanGait) -> dict[str, Numbers]:
    """Return the likeness of a mean gait to people's: joint, `grf` or moment -> its numbers.

    `curves` are named as those of `HumanGait`, in its units and signs; numbers of missing ones are left out.
    The numbers are named as in metrics.json; beside them stand RMSE in people's SD and of forces, in which some
    publications count.
    """
    numbers: dict[str, Numbers] = {}
    for joint in ANGLE_JOINTS:
        if joint in curves:
            people, sd = human.mean(joint, _PHASE), human.sd(joint, _PHASE)
            numbers[joint] = angle_numbers(np.degrees(curves[joint]), human, joint)
            numbers[joint]["rmse_sd"] = score.rmse(curves[joint] / sd, people / sd)
    if curves.keys() & {"grf_vertical", "grf_forward"}:
        missing = np.full(len(PERCENT), np.nan)
        vertical, forward = curves.get("grf_vertical", missing), curves.get("grf_forward", missing)
        numbers["grf"] = force_numbers(vertical, forward, human)
        numbers["grf"]["vertical_rmse_bw"] = score.rmse(vertical, human.mean("grf_vertical", _PHASE))
        numbers["grf"]["forward_rmse_bw"] = score.rmse(forward, human.mean("grf_forward", _PHASE))
    for joint in MOMENT_JOINTS:
        if f"{joint}_moment" in curves:
            numbers[f"{joint}_moment"] = moment_numbers(curves[f"{joint}_moment"], human, joint)
    return numbers
