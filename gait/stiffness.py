"""Joint stiffness: equation (4) of the thesis, K = d tau / d theta, and schedules of it over the stride."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .body import Body
from .errors import SpringfootError, require_within
from .human import human_gait

SPRINGS = ("ankle", "toe")
"""The joints of a schedule, in the order of the last axis of its arrays."""
TOE_STIFFNESS = 28.0
"""Toe joint under load [N m/rad] for 1.70 m and 63 kg: near the low end of barefoot estimates, 25-60; the thesis has no
number of its own."""
LOWEST_STIFFNESS = (20.0, 5.0)
"""Ankle and toe in swing [N m/rad] for 1.70 m and 63 kg: the least a walk with springs can set; the thesis says 0."""
STIFFNESS_RANGE = (0.0, 1e5)
"""Stiffnesses accepted in a schedule [N m/rad]."""
ANGLE_RANGE = (-np.pi, np.pi)
"""Equilibrium angles accepted in a schedule [rad]."""


class Segment(NamedTuple):
    """A spring from one stride phase to the next segment's."""

    start: float
    """Stride phase [0, 1) of this leg at which it begins."""
    stiffness: float
    """K [N m/rad]."""
    equilibrium: float
    """theta_eq [rad]; dorsiflexion, toe up positive."""


@dataclass(frozen=True)
class StiffnessSchedule:
    """Piecewise constant springs over the stride: tau = K (theta_eq - theta), positive as the angle.

    Each joint's segments ascend in phase; before the first one the last one of the stride before still holds. Raises
    `SpringfootError` for segments out of order, of bad numbers, or missing.
    """

    ankle: tuple[Segment, ...]
    toe: tuple[Segment, ...]

    def __post_init__(self) -> None:
        for joint in SPRINGS:
            segments = tuple(_segment(joint, entry) for entry in getattr(self, joint))
            starts = [segment.start for segment in segments]
            if not segments or starts != sorted(set(starts)):
                raise SpringfootError(f"{joint} segments must ascend in phase, at least one, got starts {starts}")
            object.__setattr__(self, joint, segments)

    def at(self, phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """K [N m/rad] and theta_eq [rad] at stride phases of any shape, each (..., 2) for ankle and toe."""
        phase = np.mod(np.asarray(phase, float), 1.0)
        stiffness, equilibrium = np.empty((2, *phase.shape, len(SPRINGS)))
        for column, joint in enumerate(SPRINGS):
            starts, springs, rests = np.array(getattr(self, joint)).T
            # Index -1 before the first start: the last segment of the stride before.
            index = np.searchsorted(starts, phase, side="right") - 1
            stiffness[..., column], equilibrium[..., column] = springs[index], rests[index]
        return stiffness, equilibrium

    def to_json(self) -> dict[str, list[list[float]]]:
        """Plain lists: {"ankle": [[start phase, K, theta_eq], ...], "toe": [...]}."""
        return {joint: [list(segment) for segment in getattr(self, joint)] for joint in SPRINGS}

    @classmethod
    def from_json(cls, data: object) -> "StiffnessSchedule":
        """The inverse of `to_json`; `SpringfootError` if `data` is not of that form."""
        if not isinstance(data, dict) or set(data) != set(SPRINGS):
            raise SpringfootError(f"a stiffness schedule must be an object with keys ankle and toe, got {data!r:.80}")
        for joint, segments in data.items():
            if not isinstance(segments, (list, tuple)):
                raise SpringfootError(f"{joint} must be a list of [phase, N m/rad, rad], got {segments!r:.80}")
        return cls(*(tuple(data[joint]) for joint in SPRINGS))


def line_spring(start: tuple[float, float], end: tuple[float, float], lowest: float = 0.0) -> tuple[float, float]:
    """Equation (4): the spring (K [N m/rad], theta_eq [rad]) of a straight line in the angle-torque plane.

    `start`, `end`: (angle [rad], torque [N m]), torque positive as the angle, so that K = -d tau / d theta and the
    line is tau = K (theta_eq - theta). A line that no spring can follow, falling less than `lowest` or not falling at
    all (torque growing with the angle, or changing at a standing angle), gets K = `lowest` through its mid-point.
    """
    (first_angle, first_torque), (last_angle, last_torque) = start, end
    turned, lost = last_angle - first_angle, first_torque - last_torque
    stiffness = lost / turned if abs(turned) > 1e-6 else 0.0
    stiffness = max(stiffness, lowest)
    if stiffness == 0.0:
        return 0.0, (first_angle + last_angle) / 2
    return stiffness, (first_angle + last_angle) / 2 + (first_torque + last_torque) / 2 / stiffness


def thesis_schedule(
    body: Body, speed: float = 1.2, swing_stiffness: tuple[float, float] = LOWEST_STIFFNESS
) -> StiffnessSchedule:
    """The thesis's schedule: people's ankle angle-moment curve cut into straight lines between its events.

    Ankle events: heel strike, foot flat (the first dip of the angle), maximum dorsiflexion, toe-off. Torques scale
    with mass x height from people's at `speed` [m/s]. The toe has `TOE_STIFFNESS` from heel strike to toe-off and
    rests at 0. In swing both springs rest at 0 with `swing_stiffness` (ankle, toe) [N m/rad, for 1.70 m and 63 kg];
    no line of the ankle falls below it.
    """
    human = human_gait(speed, body.height)
    scale = body.stiffness_scale
    lowest_ankle, lowest_toe = (
        require_within("swing_stiffness", k, STIFFNESS_RANGE, "N m/rad") for k in swing_stiffness
    )
    phase = np.linspace(0.0, human.toe_off, 1001)
    angle = human.mean("ankle", phase)
    top = int(angle.argmax())
    dip = int(angle[:top].argmin())
    # The data count plantarflexion positive, the joint dorsiflexion.
    torque = -human.mean("ankle_moment", phase) * body.mass * body.length_scale

    events = [0, dip, top, len(phase) - 1]
    points = [(float(angle[i]), float(torque[i])) for i in events]
    ankle = [
        Segment(float(phase[event]), *line_spring(start, end, lowest_ankle * scale))
        for event, start, end in zip(events[:-1], points[:-1], points[1:], strict=True)
    ]
    swing = Segment(human.toe_off, lowest_ankle * scale, 0.0)
    toe = (Segment(0.0, TOE_STIFFNESS * scale, 0.0), Segment(human.toe_off, lowest_toe * scale, 0.0))
    return StiffnessSchedule((*ankle, swing), toe)


def _segment(joint: str, entry: object) -> Segment:
    if not isinstance(entry, (list, tuple)) or len(entry) != 3:
        raise SpringfootError(f"{joint} segment must be [phase, N m/rad, rad], got {entry!r:.80}")
    start = require_within(f"{joint} segment start", entry[0], (0.0, 1.0))
    if start == 1.0:
        raise SpringfootError(f"{joint} segment start must be below 1, got 1")
    stiffness = require_within(f"{joint} stiffness", entry[1], STIFFNESS_RANGE, "N m/rad")
    return Segment(start, stiffness, require_within(f"{joint} equilibrium", entry[2], ANGLE_RANGE, "rad"))
