"""Measure, of each episode of a walk, the numbers that laboratories' effects are about.

All come from `springfoot.evaluation.numbers`: from metrics, or derived from the mean curves over the stride that it
measures. Each episode is measured alone, so that conditions are compared in pairs of episodes.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics import ANKLE, JOINTS, SIDES
from springfoot.envs.settings import body_of
from springfoot.evaluation.numbers import Gait, foot_contacts, leg_numbers, measure, strides_within
from springfoot.evaluation.recording import TICK, Recording
from springfoot.gait import GRAVITY, PERCENT
from springfoot.gait.people import on_percent

from ..base.adapting_persons import person_and_settings
from ..base.condition_walks import ConditionWalks
from ..base.kept import Kept
from ..base.study import OnProgress, PersonsStudy
from ..base.walked_speeds import TWO_PRICES

FIBRE, ALL_EFFORT = TWO_PRICES
"""Fibre work, and all of the effort as energy: its part of work is fibre work [J/kg/m] each."""
STRIDE_JOINTS = ("hip", "knee", "ankle")
"""Joints with a curve of power over the stride."""
_RIGHT = SIDES.index("right")

EFFECT_NUMBERS = (
    *("walked_m_s", FIBRE, ALL_EFFORT, "step_length_m"),
    *(f"fibre_{joint}_J_kg_m" for joint in JOINTS),
    *(f"{joint}_{sign}_J_kg" for joint in JOINTS for sign in ("positive", "negative")),
    *("push_off_J_kg", "collision_J_kg", "com_positive_W_kg", "hip_share"),
    *("dorsiflexion_deg", "ankle_power_W_kg", "ankle_moment_Nm_kg", "knee_moment_Nm_kg", "ankle_fibres_Nm"),
    *("right_push_off_J_kg", "right_com_push_off_J_kg", "right_hip_net_J_kg", "right_forward_bw"),
    *("right_knee_at_toe_off_deg", "right_knee_least_in_stance_deg", "clearance_sound_less_right_m"),
    *("knee_loading_deg", "knee_swing_deg"),
)
"""Names of the numbers. They are part of the question of kept results, so that a new number has all walks measured
again."""


def episode_walks(study: PersonsStudy) -> ConditionWalks:
    """Return the walks of a study of persons under conditions: measured by `numbers_by_episode`, and kept in the file
    of the study's flag `keep`."""
    return ConditionWalks(
        study=study,
        measured=lambda recording: {"episodes": numbers_by_episode(recording)},
        names=EFFECT_NUMBERS,
        kept=Kept(study.keep),
        find=person_and_settings,
    )


def walked_rows(
    under: ConditionWalks, person: str, walks: Sequence[tuple[Any, Mapping[str, Any]]], progress: OnProgress
) -> list[dict[str, Any]]:
    """Walk a person under each of `walks` (condition, settings with a `speed`), unless `under` keeps the walk.

    Return a row for each walk and episode: `condition`, `episode`, `speed_m_s` (commanded), `falls`, `EFFECT_NUMBERS`.
    """
    numbers = under.walk(person, [given for _, given in walks], progress)
    return [
        {"condition": condition, "episode": episode, "speed_m_s": given["speed"], **measured}
        for (condition, given), of_walk in zip(walks, numbers, strict=True)
        for episode, measured in enumerate(of_walk["episodes"])
    ]


def numbers_by_episode(recording: Recording) -> list[dict[str, float | None]]:
    """Return `falls` (1 for a fall) and `EFFECT_NUMBERS` of each episode; the latter are None if it ended in a fall, or
    if a leg took no stride."""
    return [_episode_numbers(recording.of_episode(index)) for index in range(len(recording.ticks))]


def _episode_numbers(recording: Recording) -> dict[str, float | None]:
    """Return the numbers of `numbers_by_episode` for a recording of one episode."""
    gait = measure(recording)
    fell = float(gait.metrics["falls"])
    if fell or not all(foot.count for foot in gait.feet):
        return {"falls": fell} | dict.fromkeys(EFFECT_NUMBERS)
    return {"falls": fell} | _both_legs_numbers(gait, recording) | _right_leg_numbers(gait)


def _both_legs_numbers(gait: Gait, recording: Recording) -> dict[str, float | None]:
    """Return the entries of `EFFECT_NUMBERS` that are of the whole body, or means of both legs."""
    metrics = gait.metrics
    effort = metrics["effort"]
    body = body_of(recording.settings)
    curves = gait.both
    stance = metrics["toe_off_percent"] >= PERCENT
    knee = curves.mean("knee_flexion_deg")
    return {
        "walked_m_s": metrics["speed_m_s"]["mean"],
        FIBRE: effort["fibre_J_kg_m"],
        ALL_EFFORT: GRAVITY * effort["total"] * body.total_mass / body.mass,
        "step_length_m": metrics["step_length_m"],
        **{f"fibre_{joint}_J_kg_m": effort["per_joint"][joint]["fibre_J_kg_m"] for joint in JOINTS},
        **{
            f"{joint}_{sign}_J_kg": metrics["joint_work_J_kg"][joint][sign]
            for joint in JOINTS
            for sign in ("positive", "negative")
        },
        "push_off_J_kg": metrics["com_work_J_kg"]["push_off"],
        "collision_J_kg": metrics["com_work_J_kg"]["collision"],
        "com_positive_W_kg": 2.0 * float(np.maximum(com_power(gait), 0.0).mean()),  # of two legs
        "hip_share": _hip_share(gait, stance),
        "dorsiflexion_deg": float(curves.mean("ankle_dorsiflexion_deg")[stance].max()),
        "ankle_power_W_kg": float(curves.mean("ankle_power_W_per_kg").max()),
        **{f"{joint}_moment_Nm_kg": metrics["moments"][joint]["peak_Nm_kg"] for joint in ("ankle", "knee")},
        "ankle_fibres_Nm": float(_ankle_fibre_moment(recording).max()),
        "knee_loading_deg": float(knee[metrics["toe_off_percent"] / 2 >= PERCENT].max()),  # flexion, as below
        "knee_swing_deg": float(knee[~stance].max()),
    }


def _right_leg_numbers(gait: Gait) -> dict[str, float | None]:
    """Return the entries of `EFFECT_NUMBERS` that are of the right leg, which wears the device, or compare the
    clearance of both toes."""
    legs = leg_numbers(gait.tally)
    left, right = (legs[side] for side in SIDES)
    work = right["joint_work_J_kg"]
    knee = gait.feet[_RIGHT].mean("knee_flexion_deg")
    return {
        "right_push_off_J_kg": work["ankle"]["positive"] + work["toe"]["positive"],
        "right_com_push_off_J_kg": right["com_work_J_kg"]["push_off"],
        "right_hip_net_J_kg": work["hip"]["positive"] - work["hip"]["negative"],
        "right_forward_bw": right["forward_peak_bw"],
        "right_knee_at_toe_off_deg": float(np.interp(right["stance_percent"], PERCENT, knee)),
        "right_knee_least_in_stance_deg": float(knee[right["stance_percent"] >= PERCENT].min()),
        "clearance_sound_less_right_m": left["toe_clearance_m"] - right["toe_clearance_m"],
    }


def com_power(gait: Gait) -> NDArray:
    """Return the power of one leg's ground force on the CoM over percent of the stride, 0 to 99, (100,) [W/kg].

    The force is the mean curve of both legs over the stride, the CoM's velocity its mean curve over the step, twice in
    a stride. It holds on level ground alone, with both legs alike.
    """
    step_seconds = 60.0 / gait.metrics["cadence_steps_min"]
    over_step = 2 * np.arange(100) % 100  # percent of the step at each percent of the stride
    forward = gait.com.mean("vx")[over_step]
    upward = np.gradient(gait.com.mean("z"), step_seconds / 100)[over_step]
    vertical, fore_aft = (GRAVITY * gait.both.mean(name)[:100] for name in ("grf_vertical_bw", "grf_forward_bw"))
    return vertical * upward + fore_aft * forward


def _hip_share(gait: Gait, stance: NDArray) -> float:
    """Return the hip's share of the negative work of hip, knee and ankle in `stance` (101,), of the mean curves [-]."""
    work = {joint: -np.minimum(gait.both.mean(f"{joint}_power_W_per_kg"), 0.0)[stance].sum() for joint in STRIDE_JOINTS}
    return float(work["hip"] / sum(work.values()))


def _ankle_fibre_moment(recording: Recording) -> NDArray:
    """Return the mean curve of the moment of the ankles' muscle fibres over percent of the stride (101,) [N m]."""
    series = recording.shown()
    contacts = foot_contacts(series["force"][..., 1].sum(axis=2), body_of(recording.settings))
    curves = []
    for side, foot in enumerate(contacts):
        begin, _, end = strides_within(foot, recording.measured_span).T
        curves.append(on_percent(series["fibre_moment"][:, side, ANKLE], begin, end, TICK, first=TICK / 2))
    return np.concatenate(curves).mean(axis=0)
