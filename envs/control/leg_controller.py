"""The phase of the gait, and the hips and knees, which no action sets.

Each hip and knee is a spring like the ankle (variable impedance) around people's curves at the walking speed, with
people's moments fed forward. The stance hip also holds the trunk and the speed. A touchdown resets the phase. The
constants of `legs.json` were found by `springfoot study leg-tuning`, those for slopes by
`springfoot study slope-tuning` (command and seed stand in that file).
Gains are for 1.70 m and 63 kg and scale with the body (see `envs.physics.model`).
"""

from collections.abc import Sequence
from math import radians, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from springfoot.gait.body import GRAVITY, REFERENCE_MASS, Body

from ..physics.kernel import kernel
from ..physics.measurement import Measurement
from ..physics.model import HIP, KNEE, LEFT, RIGHT, damping_times
from ..timing import CONTROL_WINDOW
from .leg_constants import LegConstants, SlopeConstants
from .phase_table import GRID, PhaseTable, leg_phases
from .reference_walk import ReferenceWalk
from .subjects import Subjects

KNOTS = np.arange(10) / 10
"""Stride phases of the knots of the corrections to people's curves, which are periodic cubic splines."""
STANCE_FALL = (0.5, 0.6)
"""Stride phases over which the trunk torque of a leg falls to zero as its stance ends; chosen, about double support."""
TOUCHDOWN_LOAD = 30.0 / (REFERENCE_MASS * GRAVITY)
"""Vertical force of a foot that counts as touchdown [body weights]; chosen: 30 N at 63 kg, as of force plates."""
TOUCHDOWN_PHASE = 0.80
"""A touchdown before this stride phase of the leg is a scuff, not a step; chosen."""
SLOWEST = -0.1
"""Error of the speed below which gains see no more of it [m/s]; chosen: a body that sets off, or that its springs keep
slow, is far slower than the plan for many steps, and with all of its error the legs would trip it."""
PLANNED_SPEED = 5
"""Column of `leg_curves`."""
HOLD = 0.001
"""A leg's phase waits at 1 minus this until its foot touches down; chosen, small against a window's 0.009."""


def knot_curve(knots_deg: Sequence[float]) -> NDArray:
    """A tuned correction [rad] on `GRID`: the periodic cubic spline through `KNOTS`."""
    return np.deg2rad(CubicSpline(np.append(KNOTS, 1.0), [*knots_deg, knots_deg[0]], bc_type="periodic")(GRID))


def slope_table(constants: SlopeConstants) -> PhaseTable:
    """What a slope adds to hip, knee, ankle and held trunk pitch over the stride, per radian of slope: (SAMPLES, 4)."""
    cosine, sine = np.cos(2 * np.pi * GRID), np.sin(2 * np.pi * GRID)
    joints = [a + b * cosine + c * sine for a, b, c in (constants.hip, constants.knee, constants.ankle)]
    return PhaseTable(np.stack([*joints, np.full(len(GRID), constants.trunk)], -1))


class LegController:
    """Phase and hip-knee controller of N bodies.

    Args:
        rows: leg constants and walk of each row of the tables (`envs.control.reference_walk.rows`).
        subjects: bodies and commanded speeds.
        incline: what a slope adds (`slope_table`).
    """

    def __init__(self, rows: Sequence[tuple[LegConstants, ReferenceWalk]], subjects: Subjects, incline: PhaseTable):
        self._subjects, self._incline = subjects, incline
        self._rows = np.array([_gains(c, walk.body, walk.plan.stride_time) for c, walk in rows], GAINS)
        self._table = PhaseTable(np.stack([leg_curves(c, walk) for c, walk in rows]))
        self._gains = np.zeros(len(subjects.place), GAINS)
        self.phase = leg_phases(np.zeros(len(subjects.place)))
        """(N, side) phase of each leg's stride in [0, 1), 0 at its heel strike; changed in place."""
        self._curves = self._table.at(self.phase, subjects.place)  # of the window that runs
        self.follow()

    def follow(self) -> None:
        """Take over the present bodies and commanded speeds of the subjects."""
        _follow(self._rows, self._subjects.place, self._subjects.scale, self._gains)

    def reset(self, ids: NDArray, left_phase: NDArray) -> None:
        """Put the left legs of bodies `ids` (K,) at the stride phases `left_phase` (K,)."""
        self.phase[ids] = leg_phases(left_phase)

    def advance(self, m: Measurement, running: NDArray) -> None:
        """Let one window pass for the bodies `running` (N,).

        The phase runs on, waits at its end for a late foot, and is set to the start of its stride by a foot that lands.
        """
        _advance(self._gains, self._subjects.speed, self._curves, m.com_velocity, m.force, running, self.phase)

    def drive(self, m: Measurement, control: NDArray) -> None:
        """Put stiffness [N m/rad] and drive torque K theta_eq + feed-forward [N m] of hips and knees into `control`,
        which is (N, side, joint, 2)."""
        subjects = self._subjects
        self._curves = curves = self._table.at(self.phase, subjects.place)
        state = m.base, m.base_velocity, m.com_velocity
        _drive(self._gains, subjects.speed, subjects.scale, curves, *state, control)
        if subjects.slope.any():
            _incline(subjects.slope, self._gains, curves, self._incline.at(self.phase), control)


GAINS = np.dtype(
    [
        ("touchdown", float),  # vertical force of a foot that has landed [N]
        ("rate", float),  # advance of the phase in one window
        ("rate_gain", float),  # share by which it rises for each m/s too fast [s/m]
        ("pitch", float),  # held trunk pitch [rad]
        ("trunk_stiffness", float),  # [N m/rad]
        ("trunk_damping", float),  # [N m s/rad]
        ("speed_torque", float),  # [N s]
        ("swing_gain", float),  # [rad s/m]
    ]
)
"""Constants of one body's legs, scaled to it."""


def _gains(c: LegConstants, body: Body, stride_time: float) -> tuple[float, ...]:
    scale, time_scale = body.stiffness_scale, sqrt(body.length_scale)
    return (
        TOUCHDOWN_LOAD * body.total_mass * GRAVITY,
        CONTROL_WINDOW / (c.period_factor * stride_time),
        c.period_speed_gain / time_scale,
        radians(c.trunk_pitch_deg) + body.trunk_lean,
        c.trunk_stiffness * scale,
        c.trunk_damping * scale * time_scale,
        c.speed_torque * scale / time_scale,
        c.swing_speed_gain / time_scale,
    )


@kernel
def _follow(rows, place, scale, gains):
    for i in range(len(gains)):
        row, weight = place[i].row, place[i].weight
        low, high = rows[row], rows[row + 1 if weight > 0.0 else row]
        time_scale, mass, torque, gain = scale[i].time, scale[i].mass, scale[i].torque, gains[i]
        gain.touchdown = mass * _between(low.touchdown, high.touchdown, weight)
        gain.rate = _between(low.rate, high.rate, weight) / time_scale
        gain.rate_gain = _between(low.rate_gain, high.rate_gain, weight) / time_scale
        gain.pitch = _between(low.pitch, high.pitch, weight)
        gain.trunk_stiffness = torque * _between(low.trunk_stiffness, high.trunk_stiffness, weight)
        gain.trunk_damping = torque * time_scale * _between(low.trunk_damping, high.trunk_damping, weight)
        gain.speed_torque = torque / time_scale * _between(low.speed_torque, high.speed_torque, weight)
        gain.swing_gain = _between(low.swing_gain, high.swing_gain, weight) / time_scale


@kernel
def _incline(slope, gains, curves, inclined, control):
    """Move the targets of hips, knees and trunk with the slope."""
    for i in range(len(slope)):
        for side in range(2):
            hip, knee = control[i, side, HIP], control[i, side, KNEE]
            lean = curves[i, side, 0] * gains[i].trunk_stiffness * inclined[i, side, 3]
            hip[1] += slope[i] * (hip[0] * inclined[i, side, 0] + lean)
            knee[1] += slope[i] * knee[0] * inclined[i, side, 1]


@kernel
def _between(low, high, weight):
    return low + weight * (high - low)


@kernel
def _advance(gains, speed, curves, com_velocity, force, running, phase):
    for i in range(len(phase)):
        if not running[i]:
            continue
        gain, left = gains[i], phase[i, LEFT]
        rate = gain.rate * (1.0 + gain.rate_gain * _too_fast(com_velocity[i], speed[i], curves[i, LEFT]))
        waiting = (0.5 if left < 0.5 else 1.0) - HOLD
        left = min(left + max(rate, 0.0), max(waiting, left))
        right = (left + 0.5) % 1.0
        if left > TOUCHDOWN_PHASE and _load(force[i, LEFT]) > gain.touchdown:
            left = 0.0
        elif right > TOUCHDOWN_PHASE and _load(force[i, RIGHT]) > gain.touchdown:
            left = 0.5
        phase[i, LEFT], phase[i, RIGHT] = left, (left + 0.5) % 1.0


@kernel
def _too_fast(com_velocity, speed, curves):
    return max(com_velocity[0] - speed * curves[PLANNED_SPEED], SLOWEST)


@kernel
def _load(force):
    return force[0, 1] + force[1, 1] + force[2, 1]


@kernel
def _drive(gains, speed, scale, curves, base, base_velocity, com_velocity, control):
    for i in range(len(gains)):
        gain = gains[i]
        too_fast = _too_fast(com_velocity[i], speed[i], curves[i, LEFT])
        torque = scale[i].torque
        trunk = -gain.trunk_stiffness * (base[i, 2] - gain.pitch) - gain.trunk_damping * base_velocity[i, 2]
        on_trunk = trunk + gain.speed_torque * too_fast
        aim = gain.swing_gain * too_fast
        for side in range(2):
            stance, hip, knee = curves[i, side, 0], torque * curves[i, side, 1], torque * curves[i, side, 2]
            own = stance * on_trunk + (1.0 - stance) * hip * aim
            control[i, side, HIP, 0], control[i, side, HIP, 1] = hip, torque * curves[i, side, 3] + own
            control[i, side, KNEE, 0], control[i, side, KNEE, 1] = knee, torque * curves[i, side, 4]


def leg_curves(constants: LegConstants, walk: ReferenceWalk) -> NDArray:
    """(SAMPLES, 6) stance weight, hip and knee stiffness [N m/rad], hip and knee drive torque [N m], and the planned
    CoM's forward speed over its mean."""
    body, human = walk.body, walk.human
    fall_from, fall_to = STANCE_FALL
    stance = np.interp(GRID, [0.0, constants.trunk_rise, fall_from, fall_to], [0.0, 1.0, 1.0, 0.0])
    beta, period = damping_times(body), constants.period_factor * walk.plan.stride_time
    columns = [stance]
    drives = []
    for joint, name, knots, (in_stance, in_swing) in (
        (HIP, "thigh", constants.hip_knots_deg, constants.hip_stiffness),
        (KNEE, "knee", constants.knee_knots_deg, constants.knee_stiffness),
    ):
        stiffness = (in_swing + (in_stance - in_swing) * stance) * body.stiffness_scale
        target = human.mean(name, GRID) + beta[joint] * human.rate(name, GRID) / period + knot_curve(knots)
        if joint == HIP:
            target = target + body.trunk_lean  # hip = thigh to the vertical + pitch of the trunk
        feed = -constants.feedforward[joint] * walk.moments[:, joint]  # moments are positive in extension
        columns.append(stiffness)
        drives.append(stiffness * target + feed)
    planned_speed = walk.plan.com_velocity(2 * GRID % 1.0)[0] / walk.speed
    return np.stack([*columns, *drives, planned_speed], axis=-1)
