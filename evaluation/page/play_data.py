"""Collect the data that `play.html` draws: the mean stride of each recorded walk, or its last moments if it only fell.

A walk is an array (MOMENTS, columns). All walks of a page are packed as integers of 16 bits between the least and the
largest value of each column: finer than a pixel, and a fifth of the size of digits.
"""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.foot import LOCK
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.settings import body_of, reference_gait
from springfoot.gait import GRAVITY, Body
from springfoot.gait.people.gait_events import PERCENT, sample

from ..numbers.metrics import MOMENT_CURVES, measure
from ..numbers.per_leg import ANGLE_COLUMNS
from ..numbers.series import foot_contacts, strides_within
from ..recording.recording import TICK, WARM_UP, Recording
from .page_figure import figure_data, planned_zmp, shown_numbers

MOMENTS = 51
"""Moments of a stride, every 2 %; of a fall, evenly over its time."""
FALL_SECONDS = 1.5
"""Length of a fall's last moments that are shown [s]."""
STIFFNESS_UNIT = "K, N·m/rad"
PANELS = {
    "Thigh angle": (ANGLE_COLUMNS["thigh"], "flexion, deg", "thigh"),
    "Knee angle": (ANGLE_COLUMNS["knee"], "flexion, deg", "knee"),
    "Ankle angle": (ANGLE_COLUMNS["ankle"], "dorsiflexion, deg", "ankle"),
    "Toe angle": (ANGLE_COLUMNS["toe"], "up, deg", "toe"),
    "Ankle moment": (MOMENT_CURVES["ankle"], "plantarflexion, N·m/kg", "ankle_moment"),
    "Vertical force": ("grf_vertical_bw", "up, body weights", "grf_vertical"),
    "Fore-aft force": ("grf_forward_bw", "forward, body weights", "grf_forward"),
    "Ankle stiffness": ("ankle_stiffness_Nm_per_rad", STIFFNESS_UNIT, None),
    "Toe stiffness": ("toe_stiffness_Nm_per_rad", STIFFNESS_UNIT, None),
}
"""Title -> column of the curves over the stride, unit, and people's curve behind it, if any."""
BODY_PARTS = {"base": 3, "angle": 8, "com": 2, "plan": 2, "zmp": 1, "forward": 2, "up": 2, "lever": 2, "stiffness": 4}
"""Part of the drawing -> number of its columns; see `_figure_series`."""
PLAY_COLUMNS = (
    *(name for name, size in BODY_PARTS.items() for _ in range(size)),
    *(title for title in PANELS for _ in SIDES),
)
"""The columns of a walk, in order."""
LARGEST = 65535
"""Largest integer of 16 bits."""


def walk_of(recording: Recording) -> tuple[dict[str, Any], NDArray]:
    """Return one recorded walk as the page needs it: its numbers, and its series (MOMENTS, len(PLAY_COLUMNS)).

    The series is the mean stride of the left leg after the warm-up, over the episodes without a fall; if every episode
    fell, the end of the longest one, and `ended` names the reason. Positions are forward of the hip, which moves on by
    `length` [m] in `seconds` [s].
    """
    without_fall = recording.fall_reason == ""
    numbers = {"falls": int((~without_fall).sum()), "episodes": len(without_fall)}
    if not without_fall.any():
        return _last_moments(recording, numbers)
    upright = episodes_of(recording, without_fall)
    gait = measure(upright)
    body = body_of(recording.settings)
    strides = []
    durations = []
    lengths = []
    for episode, ticks in enumerate(upright.ticks):
        series = {name: values[episode, :ticks].astype(float) for name, values in upright.series.items()}
        left, _ = foot_contacts(series["force"][..., 1].sum(axis=2), body)
        begin, _, end = strides_within(left, (WARM_UP, np.inf)).T
        drawn = _figure_series(upright, series, body)
        times = begin[:, None] + (end - begin)[:, None] * np.linspace(0, 1, MOMENTS)
        sampled = sample(drawn, times, TICK, TICK)  # (stride, MOMENTS, column); column 0 is the hip's x
        length = sampled[:, -1, 0] - sampled[:, 0, 0]
        # Less a steady way forward from the stride's beginning: the hip sways about 0.
        sampled[..., 0] -= sampled[:, :1, 0] + length[:, None] * np.linspace(0, 1, MOMENTS)
        strides = [*strides, *sampled]
        durations = [*durations, *(end - begin)]
        lengths = [*lengths, *length]
    if not (strides and all(foot.count for foot in gait.feet)):
        return _last_moments(recording, numbers)
    percents_a_moment = 100 // (MOMENTS - 1)
    curves = [foot.mean(column)[::percents_a_moment] for column, _, _ in PANELS.values() for foot in gait.feet]
    metrics = gait.metrics
    numbers |= {
        "seconds": float(np.mean(durations)),
        "length": float(np.mean(lengths)),
        "speed": metrics["speed_m_s"]["mean"],
        "cost": metrics["cost_of_transport"],
        "work": metrics["joint_work_J_kg"]["ankle"]["positive"],
        "toe_off": metrics["toe_off_percent"],
        **{joint: metrics["joints"][joint]["rmse_deg"] for joint in ("thigh", "knee", "ankle")},
    }
    return numbers, np.concatenate([np.mean(strides, axis=0), np.stack(curves, -1)], axis=-1)


def episodes_of(recording: Recording, rows: NDArray) -> Recording:
    """Return a recording of some episodes of another: those for which `rows` (E,) is True."""
    named = {name: getattr(recording, name)[rows] for name in ("ticks", "returns", "fall_reason")}
    return replace(recording, **named, series={name: values[rows] for name, values in recording.series.items()})


def _last_moments(recording: Recording, numbers: dict[str, Any]) -> tuple[dict[str, Any], NDArray]:
    """Return `numbers` with those of a walk that only fell, and the series (MOMENTS, len(PLAY_COLUMNS)) of its last
    moments; its curves are 0."""
    series = recording.shown()
    drawn = _figure_series(recording, series, body_of(recording.settings))
    end = TICK * len(drawn)
    seconds = min(FALL_SECONDS, end - TICK)  # the first sample is at the end of the first tick
    sampled = sample(drawn, np.linspace(end - seconds, end, MOMENTS)[None], TICK, TICK)[0]
    sampled[:, 0] -= sampled[0, 0]
    numbers |= {
        "seconds": seconds,
        "length": 0.0,
        "ended": str(recording.fall_reason[recording.example]) or "without a stride of both legs",
        "after": end,
    }
    return numbers, np.concatenate([sampled, np.zeros((MOMENTS, len(PLAY_COLUMNS) - sampled.shape[1]))], axis=-1)


def _figure_series(recording: Recording, series: dict[str, NDArray], body: Body) -> NDArray:
    """Return the drawing's series of one episode: columns (T, 26) of `BODY_PARTS`.

    They are: `base`, hip x, z and trunk pitch; `angle` of the joints; CoM, `plan` of the CoM and planned `zmp`, forward
    of the hip; forces `forward` and `up` in body weights; `lever`, the vertical force times its CoP forward of the hip,
    0 without a force; `stiffness` K.
    """
    hip = series["base"][:, :1]  # x (T, 1)
    ahead = np.array([[1.0, 0.0]]) * hip  # (T, (x, 0)): leaves heights as they are
    force = series["force"] / (body.total_mass * GRAVITY)
    lever = (force[..., 1] * (series["contact"][..., 0] - hip[:, :, None])).sum(axis=-1)
    parts = {
        "base": series["base"],
        "angle": series["angle"],
        "com": series["com"] - ahead,
        "plan": series["com_reference"] - ahead,
        "zmp": planned_zmp(recording, series)[:, None] - hip,
        "forward": force[..., 0].sum(axis=-1),
        "up": force[..., 1].sum(axis=-1),
        "lever": lever,
        "stiffness": series["stiffness"],
    }
    return np.concatenate([parts[name].reshape(len(hip), size) for name, size in BODY_PARTS.items()], axis=-1)


def packed(walks: Sequence[NDArray]) -> dict[str, Any]:
    """Return all series of a page as JSON values: `low` and `high` of each column, and 16-bit integers between them in
    base 64."""
    values = np.stack(walks)
    values = np.where(values < LOCK.stiffness, values, 0.0)  # no other number is as large as the K of a locked joint
    low = values.min(axis=(0, 1))
    high = values.max(axis=(0, 1))
    fraction = (values - low) / np.where(high > low, high - low, 1.0)  # 0 in a column of equal values
    integers = np.round(fraction * LARGEST).astype("<u2")
    return {
        "samples": MOMENTS,
        "columns": PLAY_COLUMNS,
        "low": shown_numbers(low),
        "high": shown_numbers(high),
        "data": b64encode(integers.tobytes()).decode(),
    }


def people_behind(recording: Recording) -> dict[str, Any]:
    """Return people's data for the page as JSON values: mean and SD behind each panel, over percent of the stride, and
    their toe-off [%], at the speed of a recording."""
    human = reference_gait(recording.settings)
    phase = PERCENT / 100
    curves = {}
    for title, (_, unit, name) in PANELS.items():
        if name is None:
            continue
        unit_factor = np.degrees(1.0) if unit.endswith("deg") else 1.0  # people's angles are in radians
        curves[title] = {
            "people": shown_numbers(unit_factor * human.mean(name, phase)),
            "people_sd": shown_numbers(unit_factor * human.sd(name, phase)),
        }
    return {"toe_off": 100 * human.toe_off, "curves": curves}


def drawn_body(recording: Recording) -> dict[str, Any]:
    """Return the body for the drawing: height, lengths, feet, slope of the ground, and ranges of K for its colours."""
    names = ("slope", "height", "feet", "lengths", "ranges")
    figure = figure_data(recording)
    return {name: figure[name] for name in names}
