"""Compute the numbers of each leg by itself, where the feet differ, and the asymmetry of the legs."""

from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.model import JOINTS, SIDES
from springfoot.envs.settings.settings import BipedSettings
from springfoot.gait.people import scores as score

from .tally import StrideTally

ANGLE_COLUMNS = {
    "thigh": "thigh_flexion_deg",
    "knee": "knee_flexion_deg",
    "ankle": "ankle_dorsiflexion_deg",
    "toe": "mtp_dorsiflexion_deg",
}
"""Joint -> column of the curves over the stride."""
USUAL_TOE_OFF = 60.0
"""Percent of the stride at which swing begins in means by phase if no toe-off was measured; chosen, near people's."""


def kinds_of(settings: BipedSettings) -> dict[str, str]:
    """Return `feet` of metrics.json: the kind of the left and of the right foot."""
    return {"left": settings.left_foot.kind, "right": settings.right_foot.kind}


def feet_differ(settings: BipedSettings) -> bool:
    """Return True if the two feet of the settings differ."""
    left, right = settings.feet
    return left != right


def leg_numbers(tally: StrideTally) -> dict[str, dict[str, Any]]:
    """Return `per_leg` of metrics.json: the numbers of the left and of the right leg."""
    return {side: _leg_metrics(tally, index) for index, side in enumerate(SIDES)}


def asymmetry(legs: dict[str, dict[str, Any]]) -> dict[str, float | None]:
    """Return `asymmetry` of metrics.json: (right - left) over their mean of some numbers of `legs`, 0 for equal legs.

    `legs` are those of `leg_numbers`. The entries have the numbers' names without the unit.
    """
    names = ("step_length_m", "stance_percent", "vertical_max_mean_bw")
    return {name.rpartition("_")[0]: _relative_difference(*(legs[side][name] for side in SIDES)) for name in names}


def _leg_metrics(tally: StrideTally, side: int) -> dict[str, Any]:
    """Return the numbers of metrics.json for one leg, `side` 0 left, 1 right."""
    curves = tally.feet[side]
    of_side = np.array(tally.stride_sides, int) == side  # strides of this leg
    features = score.force_features(curves.mean("grf_vertical_bw"), curves.mean("grf_forward_bw"))
    work = _select(tally.joint_work, of_side)
    stance = _mean(_select(tally.toe_off, of_side))
    # Steps that this leg makes: they begin as it pushes off and the other leg lands.
    swings = np.array(tally.step_sides, int) == side
    return {
        "strides": int(of_side.sum()),
        "step_length_m": _mean(_select(tally.step_length, swings)),
        "stance_percent": stance,
        "joint_range_deg": {
            joint: float(np.ptp(curves.mean(column))) if curves.count else None
            for joint, column in ANGLE_COLUMNS.items()
        },
        "vertical_peak1_bw": features.vertical_peak1,
        "vertical_peak2_bw": features.vertical_peak2,
        "vertical_max_mean_bw": _mean(_select(tally.vertical_max, of_side)),
        "braking_peak_bw": features.braking_peak,
        "forward_peak_bw": features.forward_peak,
        "joint_work_J_kg": {
            joint: dict(zip(("positive", "negative"), _joint_work(work, index), strict=True))
            for index, joint in enumerate(JOINTS)
        },
        "com_work_J_kg": {
            "push_off": _mean(_select(tally.push_off, swings)),
            "collision": _mean(_select(tally.collision, ~swings)),  # of the leg that lands: in the other leg's steps
        },
        "toe_clearance_m": float(np.median(_select(tally.clearance, of_side))) if of_side.any() else None,
        "stiffness_Nm_rad": {
            name: score.phase_means(
                curves.mean(f"{name}_stiffness_Nm_per_rad"), USUAL_TOE_OFF if stance is None else stance
            )
            for name in ("ankle", "toe")
        },
    }


def _select(values: list[Any], mask: NDArray) -> NDArray:
    """Return those of n values, as an array, for which `mask` (n,) is True."""
    return np.array(values)[mask] if len(values) else np.empty(0)


def _mean(values: NDArray) -> float | None:
    """Return the mean of values; None without any."""
    return float(values.mean()) if len(values) else None


def _joint_work(work: NDArray, joint: int) -> tuple[float | None, float | None]:
    """Return the mean positive work of a joint in a stride, and its negative work as a positive number [J/kg].

    `work` (strides, joint, (positive, negative)) is that of one leg [J/kg]; None without a stride.
    """
    if not len(work):
        return None, None
    positive, negative = work[:, joint].mean(0)
    return float(positive), float(-negative)


def _relative_difference(left: float | None, right: float | None) -> float | None:
    """Return the right leg's number less the left's, over their mean, dimensionless; None if either is missing."""
    return None if left is None or right is None else 2 * (right - left) / (right + left)
