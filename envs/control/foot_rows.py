"""Tabulate the feet of a batch for the control's kernels: muscles or a device at each ankle and toe.

The springs of devices, as of passive prosthetic feet, get their K here (`device`); muscles get theirs in
`stiffness_control`.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.springs.stiffness import StiffnessSchedule

from ..physics.foot import Feet
from ..physics.kernel import part
from ..settings.settings import BipedSettings
from .phase_table import GRID, SAMPLES, PhaseTable, read
from .state import FOOT, PLACE


class FootLines(NamedTuple):
    """Tables of devices without a constant stiffness, for all feet of a batch; empty for feet of other kinds."""

    lines: NDArray
    """(L, points, 3) L torque-angle lines: angle [rad], torque [N m], and its fall from there on [N m/rad]. Missing
    points of shorter lines lie at infinity."""
    curves: NDArray
    """(S, SAMPLES, 2, 4) S schedules: K [N m/rad] and theta_eq [rad] of ankle and toe over the stride, of a
    `PhaseTable`."""


@part
def device(row, feet, theta, side, joint) -> Any:
    """Return K [N m/rad] and K theta_eq [N m] of the device at one joint; zeros without a device.

    They come from the device's torque-angle line at the angle `theta` [rad], from its schedule at the leg's phase, or
    from its numbers. A line continues straight beyond its ends.

    Args:
        row: of `CONTROL_ROW`.
        feet: `FootLines`, as a plain tuple.
        theta: angle of the joint [rad].
        side: 0 for the left leg, 1 for the right one.
        joint: 0 for the ankle, 1 for the toe.
    """
    lines, curves = feet
    foot = row.feet
    if foot.line[side, joint] >= 0:
        line = lines[foot.line[side, joint]]
        piece = 0
        while piece < len(line) - 2 and theta >= line[piece + 1, 0]:
            piece += 1
        # On the piece torque = torque_0 - K (theta - theta_0) = K theta_eq - K theta.
        return line[piece, 2], line[piece, 1] + line[piece, 2] * line[piece, 0]
    if foot.curve[side] >= 0:
        place = np.zeros(1, PLACE)[0]
        values = np.empty(4)  # K of ankle and toe, theta_eq of ankle and toe
        place.row = foot.curve[side]
        read(curves, place, row.legs.phase[side], values)
        return values[joint], values[joint] * values[2 + joint]
    return foot.stiffness[side, joint], foot.stiffness[side, joint] * foot.rest[side, joint]


def foot_lines(feet: Sequence[Feet]) -> FootLines:
    """Return the tables of the devices of N pairs of feet, each line and each schedule once.

    A table without devices of its kind has one row that no foot uses: kernels take no empty tables.
    """
    tables = _torque_lines(feet)
    schedules = _schedules(feet)
    most_points = max([2, *map(len, tables)])  # kernels read two at least, also of the row that no foot uses
    lines = np.full((max(len(tables), 1), most_points, 3), np.inf)
    for line, table in zip(lines, tables, strict=False):
        angle, torque = np.array(table).T
        fall = -np.diff(torque) / np.diff(angle)
        falls = np.append(fall, fall[-1])  # the last slope goes on beyond the line's end
        line[: len(table)] = np.stack([angle, torque, falls], -1)
    curves = [np.concatenate(schedule.at(GRID), -1) for schedule in schedules] or [np.zeros((SAMPLES, 4))]
    return FootLines(lines, PhaseTable(np.stack(curves)).table)


def _torque_lines(feet: Sequence[Feet]) -> list[tuple[tuple[float, float], ...]]:
    """Return the torque-angle lines (angle [rad], torque [N m]) of the devices of all feet, each once."""
    joints = [joint for pair in feet for foot in pair for joint in foot.joints]
    return list(dict.fromkeys(joint.device.table for joint in joints if joint.device and joint.device.table))


def _schedules(feet: Sequence[Feet]) -> list[StiffnessSchedule]:
    """Return the devices' schedules of all feet, each once."""
    return list(dict.fromkeys(foot.schedule for pair in feet for foot in pair if foot.schedule))


def has_lines_of(tabulated: Sequence[Feet], feet: Sequence[Feet]) -> bool:
    """Return whether the tables of the pairs `tabulated` (`foot_lines`) have each line and each schedule of `feet`."""
    return {*_torque_lines(tabulated)} >= {*_torque_lines(feet)} and {*_schedules(tabulated)} >= {*_schedules(feet)}


def foot_rows(settings: BipedSettings, feet: Sequence[Feet], tabulated: Sequence[Feet] | None = None) -> NDArray:
    """Return the muscles and devices of N pairs of feet, (N,) of `FOOT`; `settings` say which joints actions set.

    `line` and `curve` are rows of the tables that `foot_lines` made of the pairs `tabulated`, of `feet` if None.
    """
    rows = np.zeros(len(feet), FOOT)
    tables = _torque_lines(tabulated or feet)
    schedules = _schedules(tabulated or feet)
    rows["line"] = -1  # no line, no schedule
    rows["curve"] = -1
    set_by_actions = [settings.stiffness_joints in ("both", name) for name in ("ankle", "toe")]
    for row, pair in zip(rows, feet, strict=True):
        for side, foot in enumerate(pair):
            if foot.schedule:
                row["curve"][side] = schedules.index(foot.schedule)
            for index, joint in enumerate(foot.joints):
                row["muscles"][side, index] = joint.device is None
                row["controlled"][side, index] = set_by_actions[index] and joint.device is None
                row["in_swing"][side, index] = joint.acts_in_swing
                rest = joint.device.rest if joint.device else joint.rest
                row["rests"][side, index] = rest is not None
                row["rest"][side, index] = rest or 0.0  # 0 is not read where the plan has the rest angle
                row["stiffness"][side, index] = joint.device.stiffness if joint.device else 0.0
                if joint.device and joint.device.table:
                    row["line"][side, index] = tables.index(joint.device.table)
                row["locked"][side, index] = joint.is_locked
    return rows


def controlled_joints(settings: BipedSettings) -> NDArray:
    """Return (side, 2) True where actions set the stiffness of ankle and toe; other actions are read as 0."""
    return foot_rows(settings, [settings.feet])["controlled"][0].astype(bool)
