"""Write walks.html: recorded walks on several feet, of bodies of several masses, at several speeds; one file that opens
offline.

The page draws the mean stride of each walk, and the last moments of one that fell: arrays (MOMENTS, columns). All of a
page are packed as integers of 16 bits between the least and the largest value of each column: finer than a pixel, and a
fifth of the size of digits.
"""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.foot import LOCK
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.settings import body_of, reference_gait
from springfoot.gait import GRAVITY, Body
from springfoot.gait.people.gait_events import PERCENT, sample

from ..numbers.metrics import MOMENT_CURVES, Gait, measure
from ..numbers.per_leg import ANGLE_COLUMNS
from ..numbers.series import foot_contacts, strides_within
from ..recording.recording import TICK, Recording
from .page_figure import figure_data, planned_zmp, shown_numbers
from .template import as_json, filled

MOMENTS = 51
"""Moments of a stride, every 2 %; of a fall, evenly over its time."""
FALL_SECONDS = 1.5
"""Length of a fall's last moments that are shown [s]."""
PANELS = {
    "Thigh angle": (ANGLE_COLUMNS["thigh"], "flexion, deg", "thigh"),
    "Knee angle": (ANGLE_COLUMNS["knee"], "flexion, deg", "knee"),
    "Ankle angle": (ANGLE_COLUMNS["ankle"], "dorsiflexion, deg", "ankle"),
    "Toe angle": (ANGLE_COLUMNS["toe"], "up, deg", "toe"),
    "Hip moment": (MOMENT_CURVES["hip"], "extension, N·m/kg", "hip_moment"),
    "Knee moment": (MOMENT_CURVES["knee"], "extension, N·m/kg", "knee_moment"),
    "Ankle moment": (MOMENT_CURVES["ankle"], "plantarflexion, N·m/kg", "ankle_moment"),
    "Ankle power": ("ankle_power_W_per_kg", "generation, W/kg", "ankle_power"),
    "Vertical force": ("grf_vertical_bw", "up, body weights", "grf_vertical"),
    "Fore-aft force": ("grf_forward_bw", "forward, body weights", "grf_forward"),
}
"""Title -> column of the curves over the stride, unit, and people's curve behind it."""
BODY_PARTS = {"base": 3, "angle": 8, "com": 2, "plan": 2, "zmp": 1, "forward": 2, "up": 2, "lever": 2, "stiffness": 4}
"""Part of the drawing -> number of its columns; see `_figure_series`."""
STRIDE_COLUMNS = (
    *(name for name, size in BODY_PARTS.items() for _ in range(size)),
    *(title for title in PANELS for _ in SIDES),
)
"""The columns of a stride or a fall, in order."""
LARGEST = 65535
"""Largest integer of 16 bits."""


class Grid(NamedTuple):
    """Names and numbers of the walks: all combinations, the last axis fastest."""

    mass: Sequence[float]
    """Masses of the body [kg]."""
    speed: Sequence[float]
    """Commanded speeds [m/s]."""
    foot: Sequence[str]
    """Names of the feet."""


class Walk(NamedTuple):
    """The walk of one body at one speed on one foot."""

    recording: Recording
    """All its episodes."""
    gait: Gait | None
    """The gait of the episodes without a fall; None if all fell, or made no stride of both legs."""


def walk_of(recording: Recording) -> Walk:
    """Return a recorded walk with its gait, measured in the episodes without a fall.

    The gait is None if there are none, or if a leg has no stride in them.
    """
    upright = recording.fall_reason == ""
    gait = measure(episodes_of(recording, upright)) if upright.any() else None
    return Walk(recording, gait if gait and all(foot.count for foot in gait.feet) else None)


def walks_page(
    grid: Grid,
    walks: Sequence[Walk],
    columns: Sequence[str],
    numbers: Sequence[Sequence[str]],
    subject: str,
    command: str,
) -> str:
    """Return the page, HTML, of one walk for each combination of `grid`, in its order.

    `columns` are the headings of the page's table, `numbers` the texts below them for each walk; `subject` describes
    the recordings in sentences, and `command` is the one that made the page.
    """
    series: list[NDArray] = []

    def entry(part: tuple[dict[str, Any], NDArray] | None) -> dict[str, Any] | None:
        """Return the page's entry of a stride or fall: its numbers, and the index of its array, added to `series`."""
        if part is None:
            return None
        series.append(part[1])
        return part[0] | {"series": len(series) - 1}

    cells = [
        {
            "falls": int((walk.recording.fall_reason != "").sum()),
            "episodes": len(walk.recording.ticks),
            "numbers": list(texts),
            "body": drawn_body(walk.recording),
            "stride": entry(mean_stride(walk)),
            "fall": entry(fall_of(walk)),
        }
        for walk, texts in zip(walks, numbers, strict=True)
    ]
    speeds = len(grid.speed)
    data = {
        "grid": grid._asdict(),
        "columns": list(columns),
        "cells": cells,
        "units": {title: unit for title, (_, unit, _) in PANELS.items()},
        # People of the first mass stand for all: their curves are per kilogram.
        "people": [people_behind(walks[index * len(grid.foot)].recording) for index in range(speeds)],
        "series": packed(series),
        "what": subject,
        "made": command,
    }
    return filled("walks.html", {"DATA": as_json(data)})


def mean_stride(walk: Walk) -> tuple[dict[str, Any], NDArray] | None:
    """Return the mean stride of a walk: its numbers, and its series (MOMENTS, len(STRIDE_COLUMNS)); None without one.

    The stride is the left leg's after the warm-up, over the episodes without a fall. Positions are forward of the hip,
    which moves on by `length` [m] in `seconds` [s].
    """
    recording, gait = walk
    if gait is None:
        return None
    body = body_of(recording.settings)
    strides: list[NDArray] = []
    durations: list[float] = []
    for episode in np.flatnonzero(recording.fall_reason == ""):
        series = recording.episode(int(episode))
        left, _ = foot_contacts(series["force"][..., 1].sum(axis=2), body)
        begin, _, end = strides_within(left, recording.measured_span).T
        drawn = _figure_series(recording, series, body)
        times = begin[:, None] + (end - begin)[:, None] * np.linspace(0, 1, MOMENTS)
        strides.extend(sample(drawn, times, TICK, TICK))  # (MOMENTS, column) each; column 0 is the hip's x
        durations.extend(end - begin)
    drawn = np.mean(strides, axis=0)
    length = drawn[-1, 0] - drawn[0, 0]
    # Less a steady way forward from the stride's beginning: the hip sways about 0.
    drawn[:, 0] -= drawn[0, 0] + length * np.linspace(0, 1, MOMENTS)
    percents_a_moment = 100 // (MOMENTS - 1)
    curves = [foot.mean(column)[::percents_a_moment] for column, _, _ in PANELS.values() for foot in gait.feet]
    numbers = {
        "seconds": float(np.mean(durations)),
        "length": float(length),
        "toe_off": gait.metrics["toe_off_percent"],
    }
    return numbers, np.concatenate([drawn, np.stack(curves, -1)], axis=-1)


def fall_of(walk: Walk) -> tuple[dict[str, Any], NDArray] | None:
    """Return the last moments of the longest episode that fell: its numbers, and its series (MOMENTS,
    len(STRIDE_COLUMNS)), in which curves are 0; None if no episode fell.

    A walk without a fall and without a stride of both legs is shown as a fall.
    """
    fell = walk.recording.fall_reason != ""
    if not fell.any() and walk.gait is not None:
        return None
    recording = episodes_of(walk.recording, fell) if fell.any() else walk.recording
    drawn = _figure_series(recording, recording.shown(), body_of(recording.settings))
    end = TICK * len(drawn)
    seconds = min(FALL_SECONDS, end - TICK)  # the first sample is at the end of the first tick
    sampled = sample(drawn, np.linspace(end - seconds, end, MOMENTS)[None], TICK, TICK)[0]
    sampled[:, 0] -= sampled[0, 0]
    reason = str(recording.fall_reason[recording.example]) or "no stride of both legs"
    numbers = {"seconds": seconds, "length": 0.0, "reason": reason, "after": end}
    return numbers, np.concatenate([sampled, np.zeros((MOMENTS, len(STRIDE_COLUMNS) - sampled.shape[1]))], axis=-1)


def episodes_of(recording: Recording, rows: NDArray) -> Recording:
    """Return a recording of some episodes of another: those for which `rows` (E,) is True."""
    named = {name: getattr(recording, name)[rows] for name in ("ticks", "returns", "fall_reason")}
    return replace(recording, **named, series={name: values[rows] for name, values in recording.series.items()})


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


def packed(series: Sequence[NDArray]) -> dict[str, Any]:
    """Return all series of a page as JSON values: `low` and `high` of each column, and 16-bit integers between them in
    base 64.

    The K of a locked joint, which is larger than any other number, becomes 0.
    """
    values = np.stack(series)
    values = np.where(values < LOCK.stiffness, values, 0.0)  # no other number is as large as the K of a locked joint
    low = values.min(axis=(0, 1))
    high = values.max(axis=(0, 1))
    fraction = (values - low) / np.where(high > low, high - low, 1.0)  # 0 in a column of equal values
    integers = np.round(fraction * LARGEST).astype("<u2")
    return {
        "samples": MOMENTS,
        "columns": STRIDE_COLUMNS,
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
