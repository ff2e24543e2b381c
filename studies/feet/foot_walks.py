"""Walk on different feet, and measure the numbers that a designer of feet asks for."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from springfoot.envs.physics import JOINT_RANGE_DEG
from springfoot.envs.settings import SPRING_NUMBERS
from springfoot.evaluation.numbers import Gait, asymmetry, leg_numbers, measure
from springfoot.evaluation.recording import TICK, WARM_UP, Recording, policy_and_settings, record
from springfoot.gait.body import REFERENCE_HEIGHT, REFERENCE_MASS

PUSH_NEWTON = 150.0
"""Size of the pushes in pushed walks [N]."""
UNSEARCHED = 500
"""First evaluation seed. `adapt` uses seeds ending in 000, 001 and 002, so evaluation never reuses one."""
SCHEDULE = "untrained", {"action_mode": "residual"}
"""The person's own fixed schedule, as a policy and settings."""


@dataclass(frozen=True, kw_only=True)
class Told:
    """Number of a walk that tables show."""

    key: str
    """Name in the CSV files."""
    label: str
    """Head of its column."""
    pattern: str
    """Format."""


@dataclass(frozen=True, kw_only=True)
class Asked(Told):
    """Number of a walk by which feet are compared."""

    better: int
    """1 if more is better, -1 if less is."""


ASKED = (
    Asked(key="push_off_J_kg", label="push-off work J/kg", pattern=".2f", better=1),
    Asked(key="sound_peak_bw", label="sound-side peak BW", pattern=".2f", better=-1),
    Asked(key="step_asymmetry", label="step-length asymmetry", pattern=".3f", better=-1),
    Asked(key="hip_work_J_kg_m", label="hip work J/kg/m", pattern=".2f", better=-1),
    Asked(key="fibre_J_kg_m", label="fibre work J/kg/m", pattern=".2f", better=-1),
    Asked(key="effort", label="effort", pattern=".2f", better=-1),
    Asked(key="falls_pushed", label="falls, pushed", pattern=".2f", better=-1),
)
"""Numbers that the study of prostheses compares; all are of the right foot but the sound side's force."""


TOLD = (
    Told(key="falls", label="falls", pattern=".2f"),
    Told(key="speed_m_s", label="speed m/s", pattern=".2f"),
    *ASKED,
    Told(key="ankle_range_deg", label="ankle °", pattern=".1f"),
    Told(key="toe_range_deg", label="toe °", pattern=".1f"),
    Told(key="beyond_stop", label="at a stop", pattern=".1%"),
)
"""Numbers that tables show of a walk."""
NAMES = [number.key for number in TOLD]
"""Keys of these numbers. They are part of the question of kept results, so that a new number has all walks measured
again."""
ABOUT_STOPS = (
    "At a stop: share of time in which a joint of either leg is beyond its stop, which then carries load, in episodes "
    "without a fall."
)


def numbers_of(gait: Gait) -> dict[str, float | None]:
    """Return the numbers of an undisturbed walk, by their names in the CSV files; None for numbers without a stride.

    The left foot is the sound one, the right one is examined.
    """
    metrics = gait.metrics
    tally = gait.tally
    sound, examined = leg_numbers(tally).values()
    step_asymmetry = asymmetry({"left": sound, "right": examined})["step_length"]
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
    }
    hip_work = _sum(leg["joint_work_J_kg"]["hip"]["positive"] for leg in (sound, examined))
    if hip_work is not None and step_length:
        numbers["hip_work_J_kg_m"] = hip_work / (2 * step_length)  # per metre: a stride is two steps
    return numbers


def _sum(values: Any) -> float | None:
    """Return the sum of values; None if one of them is None."""
    values = list(values)
    return None if None in values else float(sum(values))


def walked(
    policy: str, given: Mapping[str, Any], push_newton: float = PUSH_NEWTON, **how: Any
) -> dict[str, float | None]:
    """Record a policy's walk undisturbed, and the same episodes under pushes; return the numbers of both.

    These are `numbers_of` and `beyond_stop` of the undisturbed walk, and `falls_pushed`, the fraction [0, 1] of pushed
    episodes that fell. Episodes that end in a fall count until the fall. `given` are environment settings; `how` is
    passed to `record`.
    """
    numbers: dict[str, float | None] = {}
    for push in (0.0, push_newton):
        acting, settings = policy_and_settings(policy, {**given, "push_newton": push})
        recording = record(acting, settings, name=policy, **how)
        if push:
            numbers["falls_pushed"] = float(np.mean(recording.fall_reason != ""))
        else:
            numbers |= {**numbers_of(measure(recording)), "beyond_stop": beyond_stop(recording)}
    return numbers


def beyond_stop(recording: Recording) -> float | None:
    """Return the fraction of time after `WARM_UP` in which a joint of either leg is beyond its stop.

    Episodes that end in a fall are left out; None if no time is left.
    """
    low, high = np.deg2rad(JOINT_RANGE_DEG).T
    angle = recording.series["angle"][
        recording.fall_reason == "", round(WARM_UP / TICK) :
    ]  # (episodes, T, side, joint)
    beyond = ((angle < low) | (angle > high)).any((-2, -1))
    return float(beyond.mean()) if angle.size else None


def for_body(foot: Mapping[str, Any], height: float, mass: float) -> dict[str, Any]:
    """Return the dictionary of a foot for a body of this height [m] and mass [kg].

    Its stiffness is for 1.70 m and 63 kg, scales with mass x height, and stays within the range of `SPRING_NUMBERS`.
    """
    ratio = height * mass / (REFERENCE_HEIGHT * REFERENCE_MASS)
    scaled = {
        key: round(float(np.clip(value * ratio, SPRING_NUMBERS[key].low, SPRING_NUMBERS[key].high)), 3)
        for key, value in foot.items()
        if key in SPRING_NUMBERS and key.endswith("_stiffness")
    }
    return {**foot, **scaled}
