"""What a policy sees: the entries of the observation, dimensionless and bounded."""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import cos, pi, sin, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from springfoot.gait.body import GRAVITY, Body

from ..control.subjects import Subjects
from ..physics.foot_contact import CONTACTS
from ..physics.kernel import kernel
from ..physics.model import ACTIONS, JOINTS, LEFT, SIDES

if TYPE_CHECKING:
    from ..physics.measurement import Measurement


class Entry(NamedTuple):
    """One entry of the observation: its name, the unit that divides it, the bounds that clip it, its meaning, and
    whether it is measured. What is not measured needs no sensor: the controller has set it itself."""

    name: str
    unit: str
    low: float
    high: float
    meaning: str
    measured: bool = True


def _entries() -> tuple[Entry, ...]:
    legs = [(side, joint) for side in SIDES for joint in JOINTS]
    sign: dict[str, str] = dict(zip(JOINTS, ("flexion", "flexion", "dorsiflexion", "toe up"), strict=True))
    return (
        Entry("hip_height", "leg length", 0.0, 2.0, "height of the hip"),
        Entry("pitch", "rad", -3.2, 3.2, "pitch of the trunk, forward positive"),
        *(Entry(f"{joint}_{side}", "rad", -3.2, 3.2, f"angle, {sign[joint]} positive") for side, joint in legs),
        Entry("hip_velocity_x", "sqrt(g l)", -5.0, 5.0, "velocity of the hip, forward positive"),
        Entry("hip_velocity_z", "sqrt(g l)", -5.0, 5.0, "velocity of the hip, up positive"),
        Entry("pitch_rate", "sqrt(g/l)", -15.0, 15.0, "rate of the pitch, forward positive"),
        *(
            Entry(f"{joint}_rate_{side}", "sqrt(g/l)", -15.0, 15.0, f"angular rate, {sign[joint]} positive")
            for side, joint in legs
        ),
        Entry("phase_sin", "1", -1.0, 1.0, "sine of 2 pi x left stride phase", False),
        Entry("phase_cos", "1", -1.0, 1.0, "cosine of 2 pi x left stride phase", False),
        Entry("phase_sin_2", "1", -1.0, 1.0, "sine of 4 pi x left stride phase", False),
        Entry("phase_cos_2", "1", -1.0, 1.0, "cosine of 4 pi x left stride phase", False),
        *(
            Entry(
                f"load_{contact}_{side}",
                "body weight",
                0.0,
                5.0,
                "vertical force, mean of the step",
            )
            for side in SIDES
            for contact in CONTACTS
        ),
        Entry("com_x_error", "leg length", -2.0, 2.0, "CoM minus plan, forward positive"),
        Entry("com_z_error", "leg length", -2.0, 2.0, "CoM minus plan, up positive"),
        Entry("speed_error", "sqrt(g l)", -5.0, 5.0, "forward speed of the CoM minus plan"),
        *(Entry(f"last_action_{name}", "1", -1.0, 1.0, "action of the step before", False) for name in ACTIONS),
        *(
            Entry(f"planned_ankle_{side}", "rad", -3.2, 3.2, "people's ankle angle at the leg's phase", False)
            for side in SIDES
        ),
        Entry("leading_leg", "1", -1.0, 1.0, "stance that began last: +1 left, -1 right", False),
        Entry("command_speed", "sqrt(g l)", 0.0, 2.0, "commanded speed (Froude speed)", False),
        Entry("height_ratio", "1", 0.0, 2.0, "height / 1.70 m", False),
    )


OBSERVATION = _entries()
"""Every entry of the observation, in order. l is the leg length (hip to floor when standing); the weight is that of
body and load. No entry tells the mass of the body, as mechanics scale with it (`envs.physics.model`)."""


SEEN = np.dtype(
    [
        ("base", float, 2),
        ("angle", float, (len(SIDES), len(JOINTS))),
        ("base_velocity", float, 3),
        ("velocity", float, (len(SIDES), len(JOINTS))),
        ("cycle", float, 4),
        ("load", float, (len(SIDES), len(CONTACTS))),
        ("error", float, 3),
        ("last_action", float, len(ACTIONS)),
        ("planned_ankle", float, len(SIDES)),
        ("leading_leg", float),
        ("command", float, 2),
    ]
)
"""The entries of `OBSERVATION`, in order, before they are made dimensionless [SI]."""


class SensorNoise:
    """Gaussian noise on the measured entries of N observations, new at every step.

    Args:
        standard_deviation: of the noise, in the dimensionless units of the observation.
        num: number N of observations.
    """

    def __init__(self, standard_deviation: float, num: int) -> None:
        self._scale = standard_deviation * np.array([entry.measured for entry in OBSERVATION], float)
        self._on = standard_deviation > 0.0
        self._noise = np.zeros((num, len(OBSERVATION)))
        self._low, self._high = (
            np.array([getattr(entry, end) for entry in OBSERVATION], np.float32) for end in ("low", "high")
        )

    def draw(self, ids: NDArray, randoms: Sequence[np.random.Generator | None]) -> None:
        """Draw noise for a new observation of environments `ids` (K,), each from its generator in `randoms` (K,)."""
        if self._on:
            for index, random in zip(ids.tolist(), randoms, strict=True):
                if random is not None:
                    self._noise[index] = self._scale * random.standard_normal(len(self._scale))

    def on(self, observation: NDArray) -> NDArray:
        """The observation (N, D) with its noise, float32, within its bounds."""
        if not self._on:
            return observation
        return np.clip(observation + self._noise, self._low, self._high).astype(np.float32)


class Observer:
    """Makes the observations of N bodies."""

    def __init__(self, subjects: Subjects) -> None:
        self._subjects = subjects
        self.low = np.array([entry.low for entry in OBSERVATION], np.float32)
        self.high = np.array([entry.high for entry in OBSERVATION], np.float32)
        self._units = np.empty((len(subjects.bodies), len(OBSERVATION)))
        self._ratios = np.empty(len(subjects.bodies))
        self._row = np.zeros(1, SEEN)  # the body whose observation is being made
        self._entries = self._row.view(float)
        self.fit(range(len(subjects.bodies)))

    def fit(self, ids: Iterable[int]) -> None:
        """Take over the present bodies of environments `ids`."""
        for index in ids:
            body = self._subjects.bodies[index]
            self._units[index] = _units(body)
            self._ratios[index] = body.length_scale

    def observe(
        self,
        m: "Measurement",
        leg_phase: NDArray,
        error: NDArray,
        planned_ankle: NDArray,
        last_action: NDArray,
        force: NDArray,
    ) -> NDArray:
        """The observation, float32 (N, D); NaN reads as the upper bound.

        `leg_phase` (N, 2); `error` (N, 3) of the CoM and its speed against the plan [m, m, m/s]; `planned_ankle`
        (N, 2) [rad]; `last_action` (N, 4); `force` (N, 2, 3, 2) on the body [N], mean over the step.
        """
        observation = np.empty((len(leg_phase), len(OBSERVATION)), np.float32)
        state = m.base, m.base_velocity, m.angle, m.velocity, leg_phase, error, planned_ankle, last_action, force
        subject = self._subjects.speed, self._ratios, self._units
        _observe(*state, *subject, self._row, self._entries, self.low, self.high, observation)
        return observation


@lru_cache(maxsize=256)
def _units(body: Body) -> NDArray:
    leg = body.leg_length
    unit = {
        "1": 1.0,
        "rad": 1.0,
        "leg length": leg,
        "sqrt(g l)": sqrt(GRAVITY * leg),
        "sqrt(g/l)": sqrt(GRAVITY / leg),
        "body weight": body.total_mass * GRAVITY,
    }
    return np.array([unit[entry.unit] for entry in OBSERVATION])


@kernel
def _observe(
    base,
    base_velocity,
    angle,
    velocity,
    leg_phase,
    error,
    planned_ankle,
    last_action,
    force,
    speed,
    ratios,
    units,
    seen,
    entries,
    low,
    high,
    observation,
):
    """Fill `observation` row by row; `entries` is `seen`, the record of one body, as plain numbers."""
    row = seen[0]
    for i in range(len(observation)):
        left = leg_phase[i, LEFT]
        s, c = sin(2 * pi * left), cos(2 * pi * left)
        row.cycle[0], row.cycle[1], row.cycle[2], row.cycle[3] = s, c, 2 * s * c, 1 - 2 * s * s
        row.leading_leg = 1.0 if left < 0.5 else -1.0
        row.base[0], row.base[1] = base[i, 1], base[i, 2]
        row.command[0], row.command[1] = speed[i], ratios[i]
        for k in range(3):
            row.base_velocity[k], row.error[k] = base_velocity[i, k], error[i, k]
        for k in range(4):
            row.last_action[k] = last_action[i, k]
        for side in range(2):
            row.planned_ankle[side] = planned_ankle[i, side]
            for joint in range(4):
                row.angle[side, joint], row.velocity[side, joint] = angle[i, side, joint], velocity[i, side, joint]
            for contact in range(3):
                row.load[side, contact] = force[i, side, contact, 1]
        for k in range(len(entries)):
            value = entries[k] / units[i, k]
            if not value <= high[k]:  # `not <=`, so that NaN also maps to the upper bound
                value = high[k]
            observation[i, k] = max(value, low[k])
