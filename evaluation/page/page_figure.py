"""Collect the body of `report.html`: two strides tick by tick, as plain JSON values, and the words of its feet."""

from collections.abc import Callable
from math import radians, tan
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.control.stiffness_control import stiffness_ranges
from springfoot.envs.physics.contact import contact_offsets
from springfoot.envs.physics.foot import FootJoint
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.feet import ENGAGES, KINDS, ORTHOSIS_NUMBERS, SEGMENT_RATIOS, FootSetting
from springfoot.envs.settings.settings import TUNED, BipedSettings, body_of
from springfoot.errors import printable
from springfoot.gait import GRAVITY
from springfoot.gait.people.gait_events import PERCENT

from ..numbers.series import foot_contacts
from ..recording.recording import TICK, Recording
from ..report.animation import clip_of
from ..report.exports import opensim_forces

DRAWN_DIGITS = 4
"""Significant digits of drawn numbers; chosen: finer than a pixel."""


def shown_numbers(values: NDArray) -> Any:
    """Return an array as lists of numbers of `DRAWN_DIGITS` digits, None for NaN."""
    if values.ndim > 1:
        return [shown_numbers(row) for row in values]
    return [float(f"{value:.{DRAWN_DIGITS}g}") if np.isfinite(value) else None for value in values.tolist()]


def figure_data(recording: Recording, words_of: Callable[[FootSetting], str] | None = None) -> dict[str, Any]:
    """Return the drawing's data as JSON values: two strides of the body, tick by tick.

    `words_of` puts a foot into words, `foot_words` by default. Joints, forces, masses and plans are in metres of the
    world, K in N m/rad, rest angles in degrees.
    """
    settings = recording.settings
    body = body_of(recording.settings)
    _, first, last = clip_of(recording, body)
    walk = recording.shown()
    series = {name: values[first:last] for name, values in walk.items()}
    slope = tan(radians(settings.slope_deg))
    forces = {name: values[first:last] for name, values in opensim_forces(recording).items()}
    contacts = foot_contacts(walk["force"][..., 1].sum(axis=2), body)
    percent = [_percent_of(foot.heel_strikes, len(walk["phase"]))[first:last] for foot in contacts]
    steps = np.unique(np.concatenate([foot.heel_strikes for foot in contacts]))
    # A phase is recorded at the beginning of its tick: at the end it is the next tick's.
    phase = np.append(walk["phase"], walk["phase"][-1:], axis=0)[first + 1 : last + 1]
    offsets = contact_offsets(body)
    weight = body.mass * GRAVITY
    units = {"px": 1.0, "vx": weight, "vy": weight}  # columns of `opensim_forces`: place [m], force in body weights
    return {
        "seconds_a_frame": TICK,
        "strides": bool(np.isfinite(percent[0]).any()),
        "slope": slope,
        "height": body.height,
        "feet": [_foot_data(foot, words_of or foot_words) for foot in (settings.left_foot, settings.right_foot)],
        "lengths": {
            "trunk": body.trunk_length,
            "thigh": body.thigh_length,
            "shank": body.shank_length,
            "toe_joint": [body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height],
            "heel": list(offsets["heel"]),
            "ball": list(offsets["ball"]),
            "toe": list(offsets["toe"]),
        },
        "ranges": [[float(value) for value in ends] for ends in zip(*stiffness_ranges(settings, body), strict=True)],
        "base": shown_numbers(series["base"]),
        "angle": shown_numbers(series["angle"].reshape(len(series["angle"]), -1)),
        "com": shown_numbers(series["com"]),
        "plan": shown_numbers(series["com_reference"]),
        "zmp": shown_numbers(planned_zmp(recording, walk)[first:last]),
        "force": [
            shown_numbers(
                np.stack([forces[f"ground_force_{side[0]}_{part}"] / unit for part, unit in units.items()], -1)
            )
            for side in SIDES
        ],
        "stiffness": shown_numbers(series["stiffness"].reshape(len(series["stiffness"]), -1)),
        "equilibrium": shown_numbers(np.degrees(series["equilibrium"]).reshape(len(series["equilibrium"]), -1)),
        "percent": shown_numbers(np.stack(percent, -1)),
        "step": shown_numbers(_percent_of(steps, len(walk["phase"]))[first:last]),
        "phase": shown_numbers(phase % 1.0),
    }


def _percent_of(strikes: NDArray, ticks: int) -> NDArray:
    """Return the percent (T,) of the way from one of `strikes` [s] to the next, at the end of each of T `ticks`.

    It is NaN before the first and after the last strike.
    """
    time = TICK * np.arange(1, ticks + 1)
    if len(strikes) < 2:
        return np.full(len(time), np.nan)
    # Strikes passed so far, with the fraction of the way to the next.
    strides_done = np.interp(time, strikes, np.arange(len(strikes)), left=np.nan, right=np.nan)
    return 100 * (strides_done % 1.0)


def planned_zmp(recording: Recording, series: dict[str, NDArray]) -> NDArray:
    """Return the planned ZMP (T,) at the end of each tick [m forward of the world's origin].

    It is that of the step of the foot that began its stance last. In the last percent of a step the value before it
    holds.
    """
    phase = series["phase"] % 1.0
    side = np.where(phase[:, 0] < phase[:, 1], 0, 1)  # the leg that began its stride, and so its stance, last
    ticks = np.arange(len(phase))
    step_percent = 200 * phase[ticks, side]  # a step is half a stride
    # At 100 percent the plan is at the next foot, so the last percent is held.
    ahead = np.interp(np.minimum(step_percent, 99.0), PERCENT, recording.plan_zmp)
    return series["ankle"][ticks, side, 0] + ahead


def _foot_data(setting: FootSetting, words_of: Callable[[FootSetting], str]) -> dict[str, Any]:
    """Return the drawing's data of a foot: its kind and numbers in words, whether it is one piece without a toe joint,
    the mechanism at ankle and toe, and whether an orthosis is on it."""
    foot = setting.foot
    joints = [_mechanism_word(joint) for joint in foot.joints]
    orthosis = any(joint.orthosis is not None for joint in foot.joints)
    return {"words": words_of(setting), "one_piece": foot.one_piece, "joints": joints, "orthosis": orthosis}


def _mechanism_word(joint: FootJoint) -> str:
    """Return the word for the mechanism at a joint: muscles, lock or device."""
    if joint.device is None:
        return "muscles"
    return "lock" if joint.is_locked else "device"


def foot_words(setting: FootSetting) -> str:
    """Return a foot of the settings in words: its kind, and in brackets the numbers that the user gave."""
    given = setting.numbers
    units = KINDS[setting.kind] | SEGMENT_RATIOS  # numbers that this kind can have
    words = [f"{_plain(name)} {given[name]:g} {units[name].unit}" for name in units if name in given]
    words += [f"{_plain(name)} of {len(given[name])} points" for name in given if name.endswith("_table")]
    words += ["on a schedule of its own"] if "schedule" in given else []
    if "orthosis" in given:
        orthosis = given["orthosis"]
        springs = [
            f"{_plain(name)} {orthosis[name]:g} {ORTHOSIS_NUMBERS[name].unit}" for name in orthosis if name != ENGAGES
        ]
        part = f" in {orthosis[ENGAGES]} alone" if ENGAGES in orthosis else ""
        words.append(f"in an orthosis with {' and '.join(springs) or 'no spring'}{part}")
    return f"{_plain(setting.kind)} ({', '.join(words)})" if words else _plain(setting.kind)


def walker_words(settings: BipedSettings, words_of: Callable[[FootSetting], str] | None = None) -> str:
    """Return body, feet and a learned person of the settings in words, such as "1.7 m, 63 kg, both feet intact".

    `words_of` puts a foot into words, `foot_words` by default.
    """
    return ", ".join(walker_parts(settings, words_of))


def walker_parts(settings: BipedSettings, words_of: Callable[[FootSetting], str] | None = None) -> list[str]:
    """Return the parts of `walker_words`: height, mass, feet, and a learned person.

    `words_of` puts a foot into words, `foot_words` by default.
    """
    height, mass = (
        f"{bounds[0]:g} to {bounds[1]:g}" if bounds else f"{value:g}"
        for bounds, value in ((settings.height_range, settings.height), (settings.mass_range, settings.mass))
    )
    left, right = map(words_of or foot_words, (settings.left_foot, settings.right_foot))
    feet = f"both feet {left}" if left == right else f"left foot {left}, right foot {right}"
    person = [] if settings.walker == TUNED else [f"person {printable(Path(settings.walker).stem)}"]
    return [f"{height} m", f"{mass} kg", feet, *person]


def _plain(name: str) -> str:
    """Return the name of a kind or a number of a foot in plain words: `ankle_deg` is "ankle rest angle"."""
    return name.replace("_deg", " rest angle").replace("_", " ")
