"""What `report.html` draws of one policy, as plain JSON values: verdict, table, curves, schedules, and two strides.

None stands for what could not be measured. Numbers are rounded to what a screen shows; those of metrics.json are not.
"""

from math import radians, tan
from typing import Any

import numpy as np

from springfoot.envs.control.foot_springs import stiffness_ranges
from springfoot.envs.physics.foot_contact import contact_offsets
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings import body_of, reference_gait
from springfoot.gait import GRAVITY, Body, HumanGait
from springfoot.gait.arrays import NDArray
from springfoot.gait.cycle import CONTACT_THRESHOLD_BW, PERCENT, find_contacts
from springfoot.gait.stiffness import SPRINGS, thesis_schedule

from .animation import clip_of
from .exports import opensim_forces
from .metrics import MOMENT_CURVES, Gait
from .per_leg import ANGLE_COLUMNS, kinds_of
from .recording import TICK, Recording
from .schedule_tables import schedule_curves
from .stride_curves import StrideCurves

DRAWN_DIGITS = 4
"""Significant digits of what is drawn; chosen: finer than a pixel."""
FORCE_PANELS = {
    "grf_vertical": ("Vertical force", "up, body weights"),
    "grf_forward": ("Fore-aft force", "forward, body weights"),
}


def shown_numbers(values: NDArray) -> Any:
    """An array as lists of numbers of `DRAWN_DIGITS` digits, None for NaN."""
    if values.ndim > 1:
        return [shown_numbers(row) for row in values]
    return [float(f"{value:.{DRAWN_DIGITS}g}") if np.isfinite(value) else None for value in values.tolist()]


def policy_data(recording: Recording, gait: Gait) -> dict[str, Any]:
    """All that the page shows of one policy but its words and its table."""
    human = reference_gait(recording.settings)
    return {
        "name": recording.policy,
        "metrics": gait.metrics,
        "people": f"people at {human.speed:.2f} m/s" if recording.settings.human is None else human.condition,
        "toe_off": shown_numbers(
            np.array([np.nan if (t := gait.metrics["toe_off_percent"]) is None else t, 100 * human.toe_off])
        ),
        "panels": [
            *_angles(gait.both, human),
            *_kinetics(gait.both, human),
            *_com(recording, gait),
            *_springs(recording),
        ],
        "loops": _loops(recording, gait.both, human),
        "figure": _figure(recording),
    }


def _panel(group: str, title: str, unit: str, own: tuple[NDArray, NDArray], **more: Any) -> dict[str, Any]:
    return {
        "group": group,
        "title": title,
        "unit": unit,
        "mean": shown_numbers(own[0]),
        "sd": shown_numbers(own[1]),
    } | more


def _of(curves: StrideCurves, name: str) -> tuple[NDArray, NDArray]:
    return curves.mean(name), curves.sd(name)


def _people(human: HumanGait, name: str, degrees: bool = False) -> dict[str, Any]:
    unit = np.degrees(1.0) if degrees else 1.0
    phase = PERCENT / 100
    return {
        "people": shown_numbers(unit * human.mean(name, phase)),
        "people_sd": shown_numbers(unit * human.sd(name, phase)),
    }


def _angles(curves: StrideCurves, human: HumanGait) -> list[dict[str, Any]]:
    positive = {"ankle": "dorsiflexion", "toe": "up"}
    return [
        _panel(
            *("Angles", f"{joint.capitalize()} angle", f"{positive.get(joint, 'flexion')}, deg"),
            _of(curves, column),
            **_people(human, joint, degrees=True),
        )
        for joint, column in ANGLE_COLUMNS.items()
    ]


def _kinetics(curves: StrideCurves, human: HumanGait) -> list[dict[str, Any]]:
    panels = []
    for joint, column in MOMENT_CURVES.items():
        unit = f"{'extension' if joint in ('hip', 'knee') else 'plantarflexion'}, N·m/kg"
        theirs = {} if joint == "toe" else _people(human, f"{joint}_moment")
        panels.append(_panel("Moments", f"{joint.capitalize()} moment", unit, _of(curves, column), **theirs))
    for joint in ("hip", "knee", "ankle"):
        own, theirs = _of(curves, f"{joint}_power_W_per_kg"), _people(human, f"{joint}_power")
        panels.append(_panel("Powers", f"{joint.capitalize()} power", "generation, W/kg", own, **theirs))
    for name, (title, unit) in FORCE_PANELS.items():
        panels.append(_panel("Ground reaction forces", title, unit, _of(curves, f"{name}_bw"), **_people(human, name)))
    return panels


def _com(recording: Recording, gait: Gait) -> list[dict[str, Any]]:
    group, axis = "Centre of mass, centre of pressure and their plans, over the step", "step"
    com, (x, z) = gait.com, recording.plan_com.T
    cop = gait.tally.cop
    return [
        _panel(group, "CoM ahead of the ankle", "forward, m", _of(com, "x"), plan=shown_numbers(x), axis=axis),
        _panel(group, "CoM height", "above the ground, m", _of(com, "z"), plan=shown_numbers(z), axis=axis),
        _panel(
            group,
            "CoP and planned ZMP",
            "ahead of the ankle, m",
            _of(cop, "x"),
            plan=shown_numbers(recording.plan_zmp),
            axis=axis,
        ),
    ]


def _springs(recording: Recording) -> list[dict[str, Any]]:
    """K and theta_eq over the leg's phase: its mean is the open-loop copy, the SD around it feedback."""
    curves, group = schedule_curves(recording), "Stiffness and equilibrium over the leg's phase"
    panels = []
    for column, words, unit in (
        ("stiffness_Nm_per_rad", "stiffness K", "N·m/rad"),
        ("equilibrium_deg", "equilibrium θ_eq", "dorsiflexion or up, deg"),
    ):
        for joint in SPRINGS:
            for side in SIDES:
                name = f"{joint}_{side}_{column}"
                title = f"{side.capitalize()} {joint}, {words}"
                panels.append(
                    _panel(group, title, unit, (curves[name], curves[f"{name}_sd"]), zero=unit == "N·m/rad", axis=side)
                )
    return panels


def _loops(recording: Recording, curves: StrideCurves, human: HumanGait) -> list[dict[str, Any]]:
    """Moment over angle of ankle and toe; of the ankle also people's, and the thesis's straight lines."""
    phase = PERCENT / 100
    body = body_of(recording.settings)
    lines = [
        segment for segment in thesis_schedule(body, recording.settings.speed).ankle if segment.start < human.toe_off
    ]
    ends = [*(segment.start for segment in lines[1:]), human.toe_off]
    thesis = []
    for segment, end in zip(lines, ends, strict=True):
        angle = human.mean("ankle", np.array([segment.start, end]))
        moment = segment.stiffness * (angle - segment.equilibrium) / (body.total_mass * body.length_scale)
        thesis.append(shown_numbers(np.stack([np.degrees(angle), moment], -1)))
    return [
        {
            "title": "Ankle: moment over angle",
            "x": shown_numbers(curves.mean("ankle_dorsiflexion_deg")),
            "y": shown_numbers(curves.mean("ankle_moment_Nm_per_kg")),
            "people_x": shown_numbers(np.degrees(human.mean("ankle", phase))),
            "people_y": shown_numbers(human.mean("ankle_moment", phase)),
            "thesis": thesis,
        },
        {
            "title": "Toe: moment over angle",
            "x": shown_numbers(curves.mean("mtp_dorsiflexion_deg")),
            "y": shown_numbers(curves.mean("mtp_moment_Nm_per_kg")),
        },
    ]


def _figure(recording: Recording) -> dict[str, Any]:
    """Two strides of the body, tick by tick: joints, forces, masses and plans, in metres of the world."""
    settings, body = recording.settings, body_of(recording.settings)
    _, first, last = clip_of(recording, body)
    whole = recording.shown()
    series = {name: values[first:last] for name, values in whole.items()}
    slope = tan(radians(settings.slope_deg))
    forces = {name: values[first:last] for name, values in opensim_forces(recording).items()}
    percent = [_percent_of(whole, side, body)[first:last] for side in range(len(SIDES))]
    offsets, weight = contact_offsets(body), body.mass * GRAVITY
    acting = {"px": 1.0, "vx": weight, "vy": weight}
    return {
        "seconds_a_frame": TICK,
        "strides": bool(np.isfinite(percent[0]).any()),
        "slope": slope,
        "height": body.height,
        "feet": list(kinds_of(settings).values()),
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
        "zmp": shown_numbers(_planned_zmp(recording, whole)[first:last]),
        "force": [
            shown_numbers(
                np.stack([forces[f"ground_force_{side[0]}_{part}"] / unit for part, unit in acting.items()], -1)
            )
            for side in SIDES
        ],
        "stiffness": shown_numbers(series["stiffness"].reshape(len(series["stiffness"]), -1)),
        "equilibrium": shown_numbers(np.degrees(series["equilibrium"]).reshape(len(series["equilibrium"]), -1)),
        "percent": shown_numbers(np.stack(percent, -1)),
        "phase": shown_numbers(series["phase"]),
    }


def _percent_of(series: dict[str, NDArray], side: int, body: Body) -> NDArray:
    """(T,) percent of the stride of one foot at the end of each tick, NaN outside strides."""
    vertical = series["force"][:, side, :, 1].sum(axis=1)
    strikes = find_contacts(vertical, TICK, CONTACT_THRESHOLD_BW * body.mass * GRAVITY, first=TICK / 2).heel_strikes
    time = TICK * np.arange(1, len(vertical) + 1)
    if len(strikes) < 2:
        return np.full(len(time), np.nan)
    strides = np.interp(time, strikes, np.arange(len(strikes)), left=np.nan, right=np.nan)
    return 100 * (strides % 1.0)


def _planned_zmp(recording: Recording, series: dict[str, NDArray]) -> NDArray:
    """(T,) forward place of the planned ZMP [m]: over the step of the leg whose stance began last, from its ankle."""
    phase = series["phase"] % 1.0
    side = np.where(phase[:, 0] < phase[:, 1], 0, 1)
    every = np.arange(len(phase))
    ahead = np.interp(np.minimum(200 * phase[every, side], 99.0), PERCENT, recording.plan_zmp)
    return series["ankle"][every, side, 0] + ahead
