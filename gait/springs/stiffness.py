"""Compute joint stiffness, equation (4) of the thesis, K = d tau / d theta, and schedules of it over the stride.

Angle and torque of ankle and toe over one stride -> gait events -> a straight line between each two -> springs.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_within

from ..body.body import Body
from ..body.tissue import TOE_STIFFNESS
from ..people.human import human_gait

SPRINGS = ("ankle", "toe")
"""The joints of a schedule, in the order of the last axis of its arrays."""
LOWEST_STIFFNESS = (20.0, 5.0)
"""Stiffness of ankle and toe in swing [N m/rad] for 1.70 m and 63 kg; chosen, the least of an action by default; the
thesis says 0."""
STIFFNESS_RANGE = (0.0, 1e5)
"""Accepted stiffnesses of a schedule [N m/rad]; chosen."""
ANGLE_RANGE = (-np.pi, np.pi)
"""Accepted rest angles of a schedule [rad]."""
HEEL_OFF_RISE = 0.05
"""Part of the toe's rise, from its lowest angle in stance to its largest, at which the heel is off [-]; chosen."""


class Segment(NamedTuple):
    """A spring that holds from one stride phase to that of the next segment."""

    start: float
    """Stride phase [0, 1) of this leg at its beginning."""
    stiffness: float
    """K [N m/rad]."""
    equilibrium: float
    """theta_eq [rad]; dorsiflexion, toe up positive."""


@dataclass(frozen=True)
class StiffnessSchedule:
    """Piecewise constant springs over the stride: tau = K (theta_eq - theta), positive as the angle.

    Each joint's segments ascend in phase; before the first one, the last one of the previous stride still holds. Raises
    `SpringfootError` for segments out of order, of bad numbers, or missing.
    """

    ankle: tuple[Segment, ...]
    toe: tuple[Segment, ...]

    def __post_init__(self) -> None:
        for joint in SPRINGS:
            segments = tuple(_checked_segment(joint, entry) for entry in getattr(self, joint))
            starts = [segment.start for segment in segments]
            if not segments or starts != sorted(set(starts)):
                raise SpringfootError(f"{joint} segments must ascend in phase, at least one, got starts {starts}")
            object.__setattr__(self, joint, segments)

    def at(self, phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return K [N m/rad] and theta_eq [rad] at stride phases of any shape, each (..., 2) for ankle and toe."""
        phase = np.mod(np.asarray(phase, float), 1.0)
        stiffness, equilibrium = np.empty((2, *phase.shape, len(SPRINGS)))
        for column, joint in enumerate(SPRINGS):
            starts, springs, rests = np.array(getattr(self, joint)).T  # columns of `Segment`
            # Before the first start the index is -1: the last segment of the previous stride.
            index = np.searchsorted(starts, phase, side="right") - 1
            stiffness[..., column] = springs[index]
            equilibrium[..., column] = rests[index]
        return stiffness, equilibrium

    def to_json(self) -> dict[str, list[list[float]]]:
        """Return plain lists: {"ankle": [[start phase, K, theta_eq], ...], "toe": [...]}."""
        return {joint: [list(segment) for segment in getattr(self, joint)] for joint in SPRINGS}

    @classmethod
    def from_json(cls, data: object) -> "StiffnessSchedule":
        """Return the inverse of `to_json`; raise `SpringfootError` for data of another form."""
        if not isinstance(data, dict) or set(data) != set(SPRINGS):
            raise SpringfootError(f"a stiffness schedule must be an object with keys ankle and toe, got {data!r:.80}")
        for joint, segments in data.items():
            if not isinstance(segments, (list, tuple)):
                raise SpringfootError(f"{joint} must be a list of [phase, N m/rad, rad], got {segments!r:.80}")
        return cls(*(tuple(data[joint]) for joint in SPRINGS))


def line_spring(start: tuple[float, float], end: tuple[float, float], lowest: float = 0.0) -> tuple[float, float]:
    """Return the spring (K [N m/rad], theta_eq [rad]) of a straight line in the angle-torque plane, equation (4).

    `start`, `end`: (angle [rad], torque [N m]), torque positive as the angle, so that K = -d tau / d theta and the line
    is tau = K (theta_eq - theta). A line that no spring can follow, falling less than `lowest` or not falling at all
    (torque growing with the angle, or changing at a standing angle), gets K = `lowest` through its mid-point.
    """
    first_angle, first_torque = start
    last_angle, last_torque = end
    angle_change = last_angle - first_angle
    torque_drop = first_torque - last_torque
    # An angle that stands has no slope.
    stiffness = torque_drop / angle_change if abs(angle_change) > 1e-6 else 0.0
    stiffness = max(stiffness, lowest)
    if stiffness == 0.0:  # only with a `lowest` of 0: no torque at any angle
        return 0.0, (first_angle + last_angle) / 2
    # The angle at which the line through the mid-point has no torque.
    return stiffness, (first_angle + last_angle) / 2 + (first_torque + last_torque) / 2 / stiffness


def ankle_events(phase: ArrayLike, angle: ArrayLike, toe_off: float) -> dict[str, float]:
    """Return the phases of heel strike, foot flat, maximum dorsiflexion and toe-off, in this order, from the ankle
    angle.

    `phase` (n,) ascends from 0, heel strike, at least to `toe_off`; `angle` (n,) [rad], dorsiflexion positive. Foot
    flat is the ankle's lowest angle before its largest in stance. An ankle that only dorsiflexes has foot flat at heel
    strike; one that only plantarflexes has its maximum there too. Raises `SpringfootError` for curves of another form.
    """
    phase, angle = _stance_part(phase, angle, toe_off)
    top = int(angle.argmax())  # sample of maximum dorsiflexion
    dip = int(angle[: top + 1].argmin())
    return {
        "heel_strike": float(phase[0]),
        "foot_flat": float(phase[dip]),
        "maximum_dorsiflexion": float(phase[top]),
        "toe_off": float(phase[-1]),
    }


def toe_events(phase: ArrayLike, angle: ArrayLike, toe_off: float) -> dict[str, float]:
    """Return the phases of heel strike, heel-off, maximum dorsiflexion and toe-off, in this order, from the toe angle.

    Arguments as in `ankle_events`, toe up positive. Maximum dorsiflexion is the largest angle in the second half of
    stance, since a toe also lands raised. The toe rises to it from its lowest angle after a quarter of stance, when the
    foot is flat; heel-off is the last phase at which it has made at most `HEEL_OFF_RISE` of that rise.
    """
    phase, angle = _stance_part(phase, angle, toe_off)
    quarter, half = np.searchsorted(phase, [toe_off / 4, toe_off / 2])
    top = int(half + angle[half:].argmax())
    flat = angle[quarter : top + 1]
    heel_off = int(quarter + np.flatnonzero(flat <= flat.min() + HEEL_OFF_RISE * (angle[top] - flat.min()))[-1])
    return {
        "heel_strike": float(phase[0]),
        "heel_off": float(phase[heel_off]),
        "maximum_dorsiflexion": float(phase[top]),
        "toe_off": float(phase[-1]),
    }


def schedule_from_curves(
    phase: ArrayLike,
    toe_off: float,
    ankle: tuple[ArrayLike, ArrayLike],
    toe: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    lowest: tuple[float, float] = (0.0, 0.0),
    toe_stiffness: float = TOE_STIFFNESS,
) -> StiffnessSchedule:
    """Return the springs of measured, planned or simulated curves by equation (4): a straight line between two events.

    Args:
        phase: (n,) stride phases, ascending from 0, heel strike, at least to `toe_off`.
        toe_off: stride phase at which swing begins; springs then rest at 0 with the lowest stiffness.
        ankle: angle (n,) [rad], dorsiflexion positive, and torque (n,) [N m], positive as the angle (a plantarflexion
            moment with its sign turned).
        toe: the same of the toe, up positive; None without a known moment: `toe_stiffness` resting at 0 in stance.
        lowest: stiffness of ankle and toe [N m/rad] in swing, and the least of any line; the thesis says 0. A line
            that no spring can follow gets it, through its mid-point (`line_spring`).
        toe_stiffness: [N m/rad], if `toe` is None.

    Raises `SpringfootError` for curves that do not fit, or a rest angle outside `ANGLE_RANGE` (a heavy load on a line
    of low stiffness: give a higher `lowest`).
    """
    low_ankle, low_toe = (require_within("lowest", k, STIFFNESS_RANGE, "N m/rad") for k in lowest)
    ankle_lines = _springs_between_events(ankle_events(phase, ankle[0], toe_off), phase, *ankle, low_ankle)
    if toe is None:
        toe_lines = [Segment(0.0, toe_stiffness, 0.0)]
    else:
        toe_lines = _springs_between_events(toe_events(phase, toe[0], toe_off), phase, *toe, low_toe)
    return StiffnessSchedule(
        (*ankle_lines, Segment(toe_off, low_ankle, 0.0)), (*toe_lines, Segment(toe_off, low_toe, 0.0))
    )


THESIS_SWING = ((45.0, 0.0), (25.0, 10.0))
"""Swing springs of ankle and toe, (K [N m/rad] for 1.70 m and 63 kg, rest angle [deg]), that complete the thesis's
lines.

The toe joint rests 10 deg up, as people hold it; with an ankle of 45 or a toe of 25 N m/rad it then clears the floor,
with the lowest of both it does so in about half of the walks. Resting at 0 it catches the floor, as a drop foot does,
with springs of 200 and 50 N m/rad as well: K alone does not help (tests/agents/policies/test_baselines.py).
"""
PRINTED_SWING = tuple((k, 0.0) for k in LOWEST_STIFFNESS)
"""Swing springs as printed: the thesis gives swing no stiffness; the lowest of an ankle and a toe, resting at 0."""


def thesis_schedule(
    body: Body, speed: float = 1.2, swing: tuple[tuple[float, float], ...] = THESIS_SWING
) -> StiffnessSchedule:
    """Return the thesis's schedule: people's ankle angle-moment curve cut into straight lines between its events.

    The curve is people's at `speed` [m/s], scaled by mass x height. People's moment of the toe is unknown: the toe has
    `TOE_STIFFNESS` from heel strike to toe-off and rests at 0. No line of the ankle is softer than `LOWEST_STIFFNESS`.
    `swing` is (K [N m/rad, for 1.70 m and 63 kg], rest angle [deg]) of ankle and toe after toe-off.
    """
    human = human_gait(speed, body.height)
    scale = body.stiffness_scale
    phase = np.linspace(0.0, human.toe_off, 1001)  # every 0.1 % of stance
    # The data count plantarflexion positive, the joint dorsiflexion.
    torque = -human.mean("ankle_moment", phase) * body.total_mass * body.length_scale
    stance = schedule_from_curves(
        phase,
        human.toe_off,
        (human.mean("ankle", phase), torque),
        lowest=(LOWEST_STIFFNESS[0] * scale, LOWEST_STIFFNESS[1] * scale),
        toe_stiffness=TOE_STIFFNESS * scale,
    )
    return with_swing(stance, body, swing)


def with_swing(
    schedule: StiffnessSchedule, body: Body, swing: tuple[tuple[float, float], ...] = THESIS_SWING
) -> StiffnessSchedule:
    """Return a schedule of `schedule_from_curves` with other springs in swing, `swing` as in `thesis_schedule`."""
    segments = []
    for joint, (k, rest_deg) in zip(SPRINGS, swing, strict=True):
        *stance, last = getattr(schedule, joint)
        segments.append((*stance, Segment(last.start, k * body.stiffness_scale, radians(rest_deg))))
    return StiffnessSchedule(*segments)


def _stance_part(phase: ArrayLike, angle: ArrayLike, toe_off: float) -> tuple[NDArray, NDArray]:
    """Return phases and angles from heel strike to `toe_off`, with a sample at `toe_off` itself.

    Arguments as in `ankle_events`. Raises `SpringfootError` for curves of another form.
    """
    require_within("toe_off", toe_off, (0.0, 1.0))
    phase, angle = _checked_curves(phase, angle)
    if not (len(phase) > 1 and phase[0] == 0.0 and np.all(np.diff(phase) > 0) and 0 < toe_off <= phase[-1]):
        raise SpringfootError(f"phase must ascend from 0 to toe_off ({toe_off:g}) or beyond, got {phase!s:.60}")
    inside = phase < toe_off
    return np.append(phase[inside], toe_off), np.append(angle[inside], np.interp(toe_off, phase, angle))


def _checked_curves(*curves: ArrayLike) -> list[NDArray]:
    """Return the curves as float arrays (n,); raise `SpringfootError` unless all are finite and of one length."""
    arrays = [np.asarray(curve, float) for curve in curves]
    shapes = [array.shape for array in arrays]
    if len(shapes[0]) != 1 or len(set(shapes)) > 1 or not all(np.isfinite(array).all() for array in arrays):
        raise SpringfootError(f"curves must be finite numbers, one a phase, got shapes {shapes}")
    return arrays


def _springs_between_events(
    events: dict[str, float], phase: ArrayLike, angle: ArrayLike, torque: ArrayLike, lowest: float
) -> list[Segment]:
    """Return one spring for each event but the last: that of the straight line to the next event (`line_spring`).

    Events that coincide have no spring between them. `events` are stride phases by name, ascending; angle [rad] and
    torque [N m] are curves (n,) over `phase` (n,), `lowest` the least K [N m/rad].
    """
    phases, angles, torques = _checked_curves(phase, angle, torque)
    times = list(events.values())
    points = [(float(np.interp(time, phases, angles)), float(np.interp(time, phases, torques))) for time in times]
    return [
        Segment(time, *line_spring(start_point, end_point, lowest))
        for (time, end), (start_point, end_point) in zip(pairwise(times), pairwise(points), strict=True)
        if end > time
    ]


def _checked_segment(joint: str, entry: object) -> Segment:
    """Return a segment of a joint from its JSON form [phase, N m/rad, rad]; raise `SpringfootError` for bad numbers."""
    if not isinstance(entry, (list, tuple)) or len(entry) != 3:
        raise SpringfootError(f"{joint} segment must be [phase, N m/rad, rad], got {entry!r:.80}")
    start = require_within(f"{joint} segment start", entry[0], (0.0, 1.0))
    if start == 1.0:
        raise SpringfootError(f"{joint} segment start must be below 1, got 1")
    stiffness = require_within(f"{joint} stiffness", entry[1], STIFFNESS_RANGE, "N m/rad")
    return Segment(start, stiffness, require_within(f"{joint} equilibrium", entry[2], ANGLE_RANGE, "rad"))
