"""Compute the numbers of a walk on different feet that a designer of feet asks for."""

from collections.abc import Iterable

from springfoot.envs.physics import SIDES
from springfoot.evaluation.numbers import MOMENT_CURVES, Gait, asymmetry, leg_numbers

FOOT_NUMBERS = (
    *("falls", "speed_m_s", "push_off_J_kg", "sound_peak_bw", "step_asymmetry", "hip_work_J_kg_m", "fibre_J_kg_m"),
    *("effort", "ankle_range_deg", "toe_range_deg", "clearance_m", "hip_moment_Nm_kg", "knee_moment_Nm_kg"),
)
"""Names of the numbers. They are part of the question of kept results, so that a new number has all walks measured
again."""


def numbers_of_feet(gait: Gait, examined_side: str = "right") -> dict[str, float | None]:
    """Return the numbers of an undisturbed walk, by `FOOT_NUMBERS`; None for numbers without a stride.

    The foot of `examined_side` is examined, the other one is sound; "both", of feet that are alike, examines the right
    one. `falls` is a share of the episodes. Moments are peaks in extension of the sound side.
    """
    metrics = gait.metrics
    tally = gait.tally
    sides = ("right", "left") if examined_side == "left" else ("left", "right")  # sound, examined
    legs = leg_numbers(tally)
    sound, examined = (legs[side] for side in sides)
    sound_curves = tally.feet[SIDES.index(sides[0])]
    step_asymmetry = asymmetry(legs)["step_length"]
    step_length = metrics["step_length_m"]
    numbers: dict[str, float | None] = {
        "falls": metrics["falls"] / metrics["episodes"],
        "speed_m_s": metrics["speed_m_s"]["mean"],
        "push_off_J_kg": _sum(examined["joint_work_J_kg"][joint]["positive"] for joint in ("ankle", "toe")),
        "sound_peak_bw": sound["vertical_max_mean_bw"],
        "step_asymmetry": None if step_asymmetry is None else abs(step_asymmetry),
        "hip_work_J_kg_m": None,
        "fibre_J_kg_m": metrics["effort"]["fibre_J_kg_m"],
        "effort": metrics["effort"]["total"],
        "ankle_range_deg": examined["joint_range_deg"]["ankle"],
        "toe_range_deg": examined["joint_range_deg"]["toe"],
        "clearance_m": examined["toe_clearance_m"],
        **{
            f"{joint}_moment_Nm_kg": float(sound_curves.mean(MOMENT_CURVES[joint]).max())
            if sound_curves.count
            else None
            for joint in ("hip", "knee")
        },
    }
    hip_work = _sum(leg["joint_work_J_kg"]["hip"]["positive"] for leg in (sound, examined))
    if hip_work is not None and step_length:
        numbers["hip_work_J_kg_m"] = hip_work / (2 * step_length)  # per metre: a stride is two steps
    return numbers


def _sum(values: Iterable[float | None]) -> float | None:
    """Return the sum of values; None if one of them is None."""
    terms = list(values)
    numbers = [term for term in terms if term is not None]
    return float(sum(numbers)) if len(numbers) == len(terms) else None
