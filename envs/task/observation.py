"""Make the observation of a policy: dimensionless and bounded entries.

Axes: N environments; D entries; a `PhaseTable` (R, SAMPLES, 2, C) has R rows, phases, value and rise to the
next phase, and C curves.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import cos, exp, log, pi, sin, sqrt

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import GRAVITY, Body

from ..control.stiffness_control import muscle_stiffness
from ..physics.contact import CONTACTS
from ..physics.kernel import kernel, part
from ..physics.model import ACTIONS, ANKLE, JOINTS, LEFT, MOVED, SIDES
from .observation_entries import OBSERVATION, PERSON_OBSERVATION, UNITS
from .target import error_of, targets_at
from .worn import WORN

LOW, HIGH = (np.array([getattr(entry, end) for entry in PERSON_OBSERVATION], np.float32) for end in ("low", "high"))
"""(D,) bounds of `PERSON_OBSERVATION`, those of `OBSERVATION` first."""
_UNIT = np.array([UNITS.index(entry.unit) for entry in PERSON_OBSERVATION])
"""(D,) index in `UNITS` of the unit of each entry."""
_SHORT = len(OBSERVATION)

SEEN = np.dtype(
    [
        ("base", float, 2),  # height of the hip, pitch of the trunk
        ("angle", float, (len(SIDES), len(JOINTS))),
        ("base_velocity", float, 3),  # of the hip, forward and up, and rate of the pitch
        ("velocity", float, (len(SIDES), len(JOINTS))),
        ("cycle", float, 4),  # sine and cosine of the left leg's phase, then of twice that
        ("load", float, (len(SIDES), len(CONTACTS))),
        ("error", float, 3),  # CoM minus plan: x, z, forward speed
        ("last_action", float, len(ACTIONS)),
        ("planned_ankle", float, len(SIDES)),
        ("leading_leg", float),  # +1 left, -1 right
        ("command", float, 2),  # commanded speed, height ratio
        ("last_offset", float, (len(SIDES), len(MOVED))),
        ("own_stiffness", float),
        ("slope", float),
        ("stiffness", float, (len(SIDES), 2)),  # logarithm of K over its unit
        ("worn", float, WORN),
        ("planned_step", float),
        ("held_speed", float, 2),  # mean speed minus the commanded one, speed aimed at beyond it
    ]
)
"""The entries of `PERSON_OBSERVATION`, in order, before they are made dimensionless [SI]."""
_SOFTEST = exp(-6.0)
"""Stiffness over its unit below which its entry stays [-]; chosen, the entry's lower bound."""


@lru_cache(maxsize=256)
def units_of(body: Body) -> NDArray:
    """Return the size of each of `UNITS` for a body, (6,) [SI]; cached: do not change the result."""
    leg = body.leg_length
    return np.array([1.0, 1.0, leg, sqrt(GRAVITY * leg), sqrt(GRAVITY / leg), body.total_mass * GRAVITY])


@part
def _stiffness_entry(row, control, side, joint) -> float:
    """Return the natural logarithm of K over its unit (`SCALES`) at one ankle or toe, muscles and device together [-].

    Before an episode's first step no K of muscles is set, nor that of a torque-angle line, and the entry is 0. `row`
    is of `TASK_ROW`, `control` of `CONTROL_ROW`; `side` is 0 left, 1 right, `joint` 0 ankle, 1 toe.
    """
    springs = control.springs
    stiffness = muscle_stiffness(springs, side, joint) + springs.device[side, joint]
    if springs.fresh:
        of_device = springs.device[side, joint]
        stiffness = of_device if of_device > 0.0 else row.scales.stiffness_unit[joint]
    return log(max(stiffness / row.scales.stiffness_unit[joint], _SOFTEST))


@kernel
def observe(rows, controls, bodies, table, observation) -> None:
    """Make the observations: entries in SI, over their units, clipped to their bounds; NaN reads as the upper bound.

    Args:
        rows: (N,) of `TASK_ROW`.
        controls: (N,) of `CONTROL_ROW`.
        bodies: (N,) of `BODY_ROW`, as measured now.
        table: (R, SAMPLES, 2, C) of `TARGET`, of a `PhaseTable`.
        observation: (N, D) float32, which is filled, D entries as `OBSERVATION` or as `PERSON_OBSERVATION`.
    """
    entries = np.empty(len(LOW))
    count = observation.shape[1]
    curves = np.empty((2, table.shape[-1]))
    seen = entries.view(SEEN)[0]  # the same numbers by name
    for i in range(len(rows)):
        row = rows[i]
        control = controls[i]
        m = bodies[i].measured
        targets = targets_at(table, control, curves)
        seen.error[0], seen.error[1], seen.error[2] = error_of(control, targets, m)
        left = control.legs.phase[LEFT]
        s = sin(2 * pi * left)
        c = cos(2 * pi * left)
        seen.cycle[0] = s
        seen.cycle[1] = c
        seen.cycle[2] = 2 * s * c  # sine of the double angle
        seen.cycle[3] = 1 - 2 * s * s  # its cosine
        seen.leading_leg = 1.0 if left < 0.5 else -1.0
        seen.base[0] = m.base[1]  # height of the hip
        seen.base[1] = m.base[2]  # pitch of the trunk
        seen.command[0] = control.subject.speed
        seen.command[1] = row.height_ratio
        for k in range(3):
            seen.base_velocity[k] = m.base_velocity[k]
        for k in range(4):
            seen.last_action[k] = control.decision.last_action[k]
        for side in range(2):
            seen.planned_ankle[side] = targets[side].pose[ANKLE]
            for joint in range(4):
                seen.angle[side, joint], seen.velocity[side, joint] = m.angle[side, joint], m.velocity[side, joint]
            for contact in range(3):
                seen.load[side, contact] = row.force[side, contact, 1]  # [1]: upward
        if count > _SHORT:
            seen.own_stiffness = 1 - control.source.not_action
            seen.slope = control.subject.slope
            for k in range(len(seen.worn)):
                seen.worn[k] = row.worn[k]
            seen.planned_step = 0.5 * control.subject.scale.length * targets[LEFT].stride_length
            seen.held_speed[0] = row.mean_speed - control.subject.speed
            seen.held_speed[1] = control.person.aim
            for side in range(2):
                for joint in range(2):
                    seen.stiffness[side, joint] = _stiffness_entry(row, control, side, joint)
                for joint in range(3):
                    seen.last_offset[side, joint] = control.person.last_offset[side, joint]
        for k in range(count):
            value = entries[k] / row.units[_UNIT[k]]
            if not value <= HIGH[k]:  # `not <=`, so that NaN also maps to the upper bound
                value = HIGH[k]
            observation[i, k] = max(value, LOW[k])


class SensorNoise:
    """Gaussian noise on the measured entries of N observations, drawn anew at every step.

    Args:
        standard_deviation: standard deviation of the noise, in the dimensionless units of the observation.
        rows: (N,) of `TASK_ROW`.
    """

    def __init__(self, standard_deviation: float, rows: NDArray) -> None:
        self._scale = standard_deviation * np.array([entry.measured for entry in OBSERVATION], float)
        self._on = standard_deviation > 0.0
        self._noise = rows["noise"]

    def draw(self, ids: NDArray, randoms: Sequence[np.random.Generator | None]) -> None:
        """Draw noise for a new observation of environments `ids` (K,), each from its generator in `randoms` (K,)."""
        if self._on:
            for index, random in zip(ids.tolist(), randoms, strict=True):
                if random is not None:
                    self._noise[index] = self._scale * random.standard_normal(len(self._scale))

    def on(self, observation: NDArray) -> NDArray:
        """Return the observation (N, D), float32, plus the noise drawn last, clipped to its bounds."""
        if not self._on:
            return observation
        noisy = observation.astype(float)
        noisy[:, :_SHORT] += self._noise  # a person's further knowledge has none
        count = observation.shape[1]
        return np.clip(noisy, LOW[:count], HIGH[:count]).astype(np.float32)
