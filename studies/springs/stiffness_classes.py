"""Define nested classes of stiffness: constant, by phase, open loop, and a linear reflex on top of it.

A class has a K of the ankle and of the toe for each part of its own stride, the same for both legs, or of one adaptive
foot; a reflex besides multiplies the ankle's K by exp(sum of gain x error). The parts of a class divide those of the
class before it, and gains may be 0, so that each class has every stiffness of the class before it, to the bit.
"""

from collections import deque
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from springfoot.agents.policies import PolicyFunction, leg_phase
from springfoot.agents.training import PASSIVE_RANGES
from springfoot.arrays import NDArray
from springfoot.envs.control import action_of
from springfoot.envs.settings import BipedSettings, body_of, reference_gait
from springfoot.envs.task import PERSON_OBSERVATION
from springfoot.gait.body import ANKLE_TENDON, TOE_STIFFNESS
from springfoot.gait.springs import ankle_events, toe_events

CENTRE = (250.0, TOE_STIFFNESS)
"""Stiffness of ankle and toe [N m/rad] for 1.70 m and 63 kg at vectors of 0: chosen, with it the package's person walks
1.20 m/s; people's toe."""
RANGES = ((BipedSettings().ankle_stiffness_range[0], ANKLE_TENDON), BipedSettings().toe_stiffness_range)
"""Least and largest K of ankle and toe [N m/rad]; the ankle's largest is that of the tendon in series."""
FOOT_REST = 0.0
"""Rest angle of an adaptive foot's springs [rad], the one that a person is told of such a foot."""
LONGEST_PART = 0.1
"""Longest part of the stride with one K in open loop; chosen: five decisions of 20 ms."""
ERRORS = {"speed_error": 0.05, "com_x_error": 0.05, "com_z_error": 0.02}
"""Entry of the observation that a reflex reads -> its size at which a gain of 1 multiplies K by e; chosen: 0.15 m/s,
4.5 cm and 1.8 cm at 1.70 m."""
_ERROR_COLUMNS = [[entry.name for entry in PERSON_OBSERVATION].index(name) for name in ERRORS]
_ERROR_SIZES = np.array(list(ERRORS.values()))


@dataclass(frozen=True, kw_only=True)
class StiffnessClass:
    """Class of stiffness; its members are vectors (size,): ln K / `CENTRE` of the ankle's parts, of the toe's parts,
    then the gains, by error and part."""

    name: str
    """Name in tables."""
    ankle: tuple[float, ...] = (0.0,)
    """Stride phases at which the parts with one K of the ankle begin, ascending from 0."""
    toe: tuple[float, ...] = (0.0,)
    """The same of the toe."""
    gains: tuple[float, ...] = ()
    """The same of the ankle's gains; empty without a reflex."""
    late: int = 0
    """Steps by which the errors that a reflex reads are older than the body's; at first it reads the first ones."""
    ranges: tuple[tuple[float, float], ...] = RANGES
    """Least and largest K of ankle and toe [N m/rad]."""

    @property
    def size(self) -> int:
        """Return the number of entries of a vector."""
        return len(self.ankle) + len(self.toe) + len(ERRORS) * len(self.gains)

    @property
    def reflex(self) -> slice:
        """Return the place of the gains in a vector."""
        return slice(len(self.ankle) + len(self.toe), self.size)

    def split(self, vectors: ArrayLike) -> tuple[NDArray, NDArray, NDArray]:
        """Return the parts of vectors (..., size): ankle (..., parts), toe (..., parts), gains (..., errors, parts)."""
        vectors = np.asarray(vectors, float)
        ankle, toe, gains = np.split(vectors, np.cumsum([len(self.ankle), len(self.toe)]), axis=-1)
        return ankle, toe, gains.reshape(*vectors.shape[:-1], len(ERRORS), len(self.gains))

    def policy(self, vectors: ArrayLike, settings: BipedSettings) -> PolicyFunction:
        """Return the policy for N environments that sets in each the stiffness of its row of `vectors` (N, size).

        K stays within `ranges`, for the body. A reflex that is `late` remembers errors: its policy is for one walk.
        """
        ankle, toe, gains = self.split(vectors)
        rows = np.arange(len(ankle))[:, None]  # (N, 1), beside indices (N, side)
        body = body_of(settings)
        centre = np.array(CENTRE) * body.stiffness_scale
        lowest, highest = np.transpose(self.ranges) * body.stiffness_scale
        read: deque[NDArray] = deque(maxlen=self.late + 1)  # the errors of the last steps

        def act(observation: NDArray) -> NDArray:
            """Return the actions (N, 4) for observations (N, D): K by part of the stride, the ankle's times exp(sum of
            gain x error)."""
            phase = leg_phase(observation)  # (N, side)
            logs = np.stack(
                [ankle[rows, _part_index(self.ankle, phase)], toe[rows, _part_index(self.toe, phase)]], axis=-1
            )
            if self.gains:
                read.append(observation[:, _ERROR_COLUMNS] / _ERROR_SIZES)
                of_phase = gains[rows, :, _part_index(self.gains, phase)]  # (N, side, error)
                logs[..., 0] += (of_phase * read[0][:, None]).sum(-1)
            action = action_of(np.clip(centre * np.exp(logs), lowest, highest), settings, body)
            return action.reshape(len(observation), -1).astype(np.float32)

        return act

    def stiffness(self, vector: ArrayLike, phase: NDArray) -> NDArray:
        """Return ankle's and toe's K (n, 2) [N m/rad] of one vector at stride phases (n,), for 1.70 m and 63 kg and
        without errors, within `ranges`."""
        ankle, toe, _ = self.split(vector)
        parts = np.stack([ankle[_part_index(self.ankle, phase)], toe[_part_index(self.toe, phase)]], -1)
        return np.clip(np.array(CENTRE) * np.exp(parts), *np.transpose(self.ranges))

    def foot(self, vector: ArrayLike, damping_time: float | None = None) -> dict[str, Any]:
        """Return the setting of an adaptive foot with the stiffness of one vector, on any body, at rest at
        `FOOT_REST`; `damping_time` [s] is damping over stiffness, None for that of muscles."""
        ankle, toe = (
            [[start, float(self.stiffness(vector, np.array([start]))[0, joint]), FOOT_REST] for start in starts]
            for joint, starts in enumerate((self.ankle, self.toe))
        )
        damping = {} if damping_time is None else {"damping_time": damping_time}
        return {"kind": "adaptive", "schedule": {"ankle": ankle, "toe": toe}, **damping}


def widened(vector: ArrayLike, inner: StiffnessClass, outer: StiffnessClass) -> NDArray:
    """Return the vector of the class `outer` that has the same stiffness as `vector` of the class `inner` within it."""
    ankle, toe, gains = inner.split(vector)
    wide_gains = np.zeros((len(ERRORS), len(outer.gains)))
    if inner.gains:
        wide_gains = gains[:, _part_index(inner.gains, outer.gains)]
    wide = ankle[_part_index(inner.ankle, outer.ankle)], toe[_part_index(inner.toe, outer.toe)], wide_gains.ravel()
    return np.concatenate(wide)


def nested_classes(settings: BipedSettings) -> tuple[StiffnessClass, ...]:
    """Return the four classes of both legs' stiffness, each within the next.

    The phases are the thesis's: its events of ankle and toe, in the angles that the settings' body follows, part them.
    """
    gait = reference_gait(settings)
    phase = np.linspace(0.0, gait.toe_off, 1001)
    ankle = _distinct_phases(ankle_events(phase, gait.mean("ankle", phase), gait.toe_off))
    toe = _distinct_phases(toe_events(phase, gait.mean("toe", phase), gait.toe_off))
    open_loop = StiffnessClass(name="open loop", ankle=_subdivided_starts(ankle), toe=_subdivided_starts(toe))
    return (
        StiffnessClass(name="constant"),
        StiffnessClass(name="per phase", ankle=ankle, toe=toe),
        open_loop,
        replace(open_loop, name="linear reflex", gains=ankle),
    )


def classes_of_foot(settings: BipedSettings) -> tuple[StiffnessClass, ...]:
    """Return the four classes of an adaptive foot's stiffness, each within the next, as far as a person has learned
    such feet.

    They are those of both legs, without the reflex and with a second one, whose K changes only while the foot is in the
    air, where that takes no work. The first is a passive foot.
    """
    constant, per_phase, open_loop, _ = nested_classes(settings)
    stance_and_swing = (0.0, per_phase.ankle[-1])  # toe-off
    in_the_air = replace(constant, name="in the air", ankle=stance_and_swing, toe=stance_and_swing)
    return tuple(replace(each, ranges=PASSIVE_RANGES) for each in (constant, in_the_air, per_phase, open_loop))


def _part_index(starts: ArrayLike, phase: ArrayLike) -> NDArray:
    """Return, for stride phases of any shape, the index of the part in which each lies; the parts begin at `starts`."""
    return np.searchsorted(starts, phase, side="right") - 1


def _distinct_phases(events: dict[str, float]) -> tuple[float, ...]:
    """Return the distinct stride phases of `events`, ascending; the first is heel strike at 0."""
    return tuple(sorted(set(events.values())))


def _subdivided_starts(starts: tuple[float, ...]) -> tuple[float, ...]:
    """Return the starts of finer parts: each part is cut into equal ones of at most `LONGEST_PART`. All of `starts` are
    among them."""
    finer = []
    for begin, end in zip(starts, (*starts[1:], 1.0), strict=True):
        pieces = ceil((end - begin) / LONGEST_PART - 1e-9)
        finer += [begin + (end - begin) * piece / pieces for piece in range(pieces)]
    return tuple(finer)
