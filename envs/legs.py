"""The gait phase, and the hips and knees: what walks while the policy sets ankle and toe stiffness.

Each hip and knee is a spring like the ankle (variable impedance) around people's curves at the walking speed, with
people's moments fed forward; the stance hip also holds the trunk and the speed, and touchdown resets the phase. The
constants of `legs.json` were found by `python -m springfoot.agents.tuning` (command and seed stand in that file).
Gains are for 1.70 m and 63 kg and scale with the body (see `envs.model`).
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from math import radians, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from springfoot.gait.body import GRAVITY, REFERENCE_MASS, Body
from springfoot.gait.errors import SpringfootError
from springfoot.gait.human import HumanGait

from .kernel import kernel
from .model import HIP, KNEE, LEFT, RIGHT, damping_times
from .phase import GRID, PhaseTable, leg_phases
from .simulation import WINDOW, Measurement

KNOTS = np.arange(10) / 10
"""Stride phases of the knots that correct people's curves (periodic cubic spline)."""
STANCE_FALL = (0.5, 0.6)
"""Phases over which the trunk torque of the leg that ends its stance falls to zero."""
TOUCHDOWN_LOAD = 30.0 / (REFERENCE_MASS * GRAVITY)
"""Vertical force of a foot that counts as touchdown [body weights]: 30 N at 63 kg."""
TOUCHDOWN_PHASE = 0.80
"""Touchdown before this phase of the leg is a scuff, not a step."""
HOLD = 0.001
"""A leg's phase waits this far before 1 until its foot touches down."""


@dataclass(frozen=True, kw_only=True)
class LegConstants:
    """Tuned constants of the leg controller, for 1.70 m and 63 kg."""

    hip_knots_deg: tuple[float, ...]
    """Added to people's thigh angle at `KNOTS` [deg]."""
    knee_knots_deg: tuple[float, ...]
    """Added to people's knee angle at `KNOTS` [deg]."""
    ankle_knots_deg: tuple[float, ...]
    """Added to people's ankle angle at `KNOTS` in the planned equilibrium [deg]."""
    hip_stiffness: tuple[float, float]
    """Stance, swing [N m/rad]."""
    knee_stiffness: tuple[float, float]
    """Stance, swing [N m/rad]."""
    feedforward: tuple[float, float, float]
    """Share of people's hip, knee, ankle moment that is fed forward."""
    period_factor: float
    """Period of the phase against the plan's stride time."""
    period_speed_gain: float
    """Phase rate rises by this share for each m/s too fast [s/m]."""
    trunk_pitch_deg: float
    """Held trunk pitch [deg]."""
    trunk_stiffness: float
    """Stance-hip torque for trunk pitch [N m/rad]."""
    trunk_damping: float
    """Stance-hip torque for trunk pitch rate [N m s/rad]."""
    speed_torque: float
    """Stance-hip torque for each m/s too fast [N s]."""
    trunk_rise: float
    """Phase over which the stance hip takes the trunk."""
    swing_speed_gain: float
    """Swing-hip target for each m/s too fast (foot placement) [rad s/m]."""
    neutral_deg: tuple[float, float]
    """Constant ankle and toe angle of `equilibrium="neutral"` [deg]."""
    ankle_schedule: tuple[float, float, float, float, float]
    """Fixed ankle stiffness in loading, early stance, late stance, push-off, swing [N m/rad]."""
    toe_schedule: float
    """Fixed toe stiffness [N m/rad]."""


def constants_name(equilibrium: str, cadence: str) -> str:
    """Name of the committed constants for a setting; "angle" and "phase" share those of "planned"."""
    name = "neutral" if equilibrium == "neutral" else "planned"
    return name if cadence == "people" else f"{name}, {cadence} cadence"


def leg_constants(equilibrium: str, cadence: str) -> LegConstants:
    """The committed constants for a setting; `SpringfootError` where none were found that walk."""
    name, table = constants_name(equilibrium, cadence), _committed()
    if name not in table:
        raise SpringfootError(
            f"no leg constants walk with equilibrium {equilibrium!r} at cadence {cadence!r}; "
            "equilibrium 'neutral' needs cadence 'people'"
        )
    return constants_from(table[name])


def constants_from(values: dict[str, Any]) -> LegConstants:
    """`LegConstants` from its JSON form (lists for tuples)."""
    as_tuple: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
    }
    return LegConstants(**as_tuple)


@cache
def _committed() -> dict[str, dict]:
    text = resources.files("springfoot.envs").joinpath("legs.json").read_text(encoding="utf-8")
    return json.loads(text)["constants"]


def knot_curve(knots_deg: Sequence[float]) -> NDArray:
    """A tuned correction [rad] on `GRID`: the periodic cubic spline through `KNOTS`."""
    return np.deg2rad(CubicSpline(np.append(KNOTS, 1.0), [*knots_deg, knots_deg[0]], bc_type="periodic")(GRID))


class Legs:
    """Phase and hip-knee controller of N bodies.

    Args:
        constants: one set for all, or several to be told apart by `variant`.
        body, human: the body, and people at its speed.
        stride_time: the plan's [s].
        speed: commanded [m/s].
        num: N.
        variant: (N,) which of `constants` each body has.
    """

    def __init__(
        self,
        constants: Sequence[LegConstants],
        body: Body,
        human: HumanGait,
        stride_time: float,
        speed: float,
        num: int,
        variant: NDArray | None = None,
    ):
        variant = np.zeros(num, int) if variant is None else variant
        self._gains = np.array([_gains(c, body, stride_time, speed) for c in constants], GAINS)[variant]
        self._table = PhaseTable(np.stack([leg_curves(c, body, human, stride_time) for c in constants]), variant)
        self.phase = leg_phases(np.zeros(num))
        """(N, side) phase of each leg's stride in [0, 1), 0 at its heel strike; changed in place."""

    def reset(self, ids: NDArray, left_phase: NDArray) -> None:
        """Put the left legs of `ids` (K,) at phases (K,)."""
        self.phase[ids] = leg_phases(left_phase)

    def advance(self, m: Measurement, running: NDArray) -> None:
        """Let one window pass for those `running` (N,): the phase runs on, waits for a late foot, and starts anew
        with the one that lands."""
        _advance(self._gains, m.com_velocity, m.force, running, self.phase)

    def command(self, m: Measurement, stiffness: NDArray, drive: NDArray) -> None:
        """Put hip and knee stiffness [N m/rad] and drive torque K theta_eq + feed-forward [N m] into their places in
        two arrays (N, side, joint)."""
        curves = self._table.at(self.phase)
        _command(self._gains, curves, m.root, m.root_velocity, m.com_velocity, stiffness, drive)


GAINS = np.dtype(
    [
        ("speed", float),  # commanded [m/s]
        ("touchdown", float),  # vertical force of a foot that has landed [N]
        ("rate", float),  # phase in one window
        ("rate_gain", float),  # its rise for each m/s too fast [s/m]
        ("pitch", float),  # held trunk pitch [rad]
        ("trunk_stiffness", float),  # [N m/rad]
        ("trunk_damping", float),  # [N m s/rad]
        ("speed_torque", float),  # [N s]
        ("swing_gain", float),  # [rad s/m]
    ]
)
"""Constants of one body's legs, scaled to it."""


def _gains(c: LegConstants, body: Body, stride_time: float, speed: float) -> tuple[float, ...]:
    scale, root = body.stiffness_scale, sqrt(body.length_scale)
    return (
        speed,
        TOUCHDOWN_LOAD * body.mass * GRAVITY,
        WINDOW / (c.period_factor * stride_time),
        c.period_speed_gain / root,
        radians(c.trunk_pitch_deg),
        c.trunk_stiffness * scale,
        c.trunk_damping * scale * root,
        c.speed_torque * scale / root,
        c.swing_speed_gain / root,
    )


@kernel
def _advance(gains, com_velocity, force, running, phase):
    for i in range(len(phase)):
        if not running[i]:
            continue
        gain, left = gains[i], phase[i, LEFT]
        rate = gain.rate * (1.0 + gain.rate_gain * (com_velocity[i, 0] - gain.speed))
        waiting = (0.5 if left < 0.5 else 1.0) - HOLD
        left = min(left + max(rate, 0.0), max(waiting, left))
        right = (left + 0.5) % 1.0
        if left > TOUCHDOWN_PHASE and _load(force[i, LEFT]) > gain.touchdown:
            left = 0.0
        elif right > TOUCHDOWN_PHASE and _load(force[i, RIGHT]) > gain.touchdown:
            left = 0.5
        phase[i, LEFT], phase[i, RIGHT] = left, (left + 0.5) % 1.0


@kernel
def _load(force):
    return force[0, 1] + force[1, 1] + force[2, 1]


@kernel
def _command(gains, curves, root, root_velocity, com_velocity, stiffness, drive):
    for i in range(len(gains)):
        gain = gains[i]
        too_fast = com_velocity[i, 0] - gain.speed
        trunk = -gain.trunk_stiffness * (root[i, 2] - gain.pitch) - gain.trunk_damping * root_velocity[i, 2]
        on_trunk = trunk + gain.speed_torque * too_fast
        placement = gain.swing_gain * too_fast  # a faster body puts its foot further ahead
        for side in range(2):
            stance, hip, knee = curves[i, side, 0], curves[i, side, 1], curves[i, side, 2]
            stiffness[i, side, HIP], stiffness[i, side, KNEE] = hip, knee
            drive[i, side, HIP] = curves[i, side, 3] + (stance * on_trunk + (1.0 - stance) * hip * placement)
            drive[i, side, KNEE] = curves[i, side, 4]


def leg_curves(constants: LegConstants, body: Body, human: HumanGait, stride_time: float) -> NDArray:
    """(SAMPLES, 5) stance weight, hip and knee stiffness [N m/rad], hip and knee drive torque [N m]."""
    fall_from, fall_to = STANCE_FALL
    stance = np.interp(GRID, [0.0, constants.trunk_rise, fall_from, fall_to], [0.0, 1.0, 1.0, 0.0])
    beta, period = damping_times(body), constants.period_factor * stride_time
    torque = body.mass * body.length_scale
    columns = [stance]
    drives = []
    for joint, name, moment, knots, (in_stance, in_swing) in (
        (HIP, "thigh", "hip_moment", constants.hip_knots_deg, constants.hip_stiffness),
        (KNEE, "knee", "knee_moment", constants.knee_knots_deg, constants.knee_stiffness),
    ):
        stiffness = (in_swing + (in_stance - in_swing) * stance) * body.stiffness_scale
        target = human.mean(name, GRID) + beta[joint] * human.rate(name, GRID) / period + knot_curve(knots)
        feed = -constants.feedforward[joint] * human.mean(moment, GRID) * torque  # people count extension positive
        columns.append(stiffness)
        drives.append(stiffness * target + feed)
    return np.stack(columns + drives, axis=-1)
