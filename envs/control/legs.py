"""Control the hips and knees, which no action sets.

Each hip and knee is a spring like the ankle (variable impedance) around the target's curves at the walking speed, with
its moments fed forward. The stance hip also holds the trunk and the speed. `stride_phase` has the phase. `legs.json`
holds the constants, found by searches, and the command of each. Gains are for 1.70 m and 63 kg and scale with the body
(see `envs.physics.model`). Axes: N bodies; side, 0 left and 1 right; a `PhaseTable` (R, SAMPLES, 2, C) has R rows,
phases, value and rise to the next phase, and C curves.
"""

from collections.abc import Sequence
from math import radians, sqrt

import numpy as np
from scipy.interpolate import CubicSpline

from springfoot.arrays import NDArray
from springfoot.gait.body.body import GRAVITY

from ..physics.kernel import kernel, part
from ..physics.model import HIP, KNEE, LEFT, damping_times
from ..physics.timing import CONTROL_WINDOW
from .constants import KNOTS, LegConstants, SlopeConstants
from .phase_table import GRID, PhaseTable, leg_phases, read
from .reference_walk import ReferenceWalk
from .state import GAINS, PLACE
from .stride_phase import TOUCHDOWN_LOAD, speed_excess
from .subjects import Subjects

STANCE_FALL = (0.5, 0.6)
"""Stride phases over which the trunk torque of a leg falls to zero as its stance ends; chosen, about double support."""
STANCE, HIP_STIFFNESS, KNEE_STIFFNESS, HIP_DRIVE, KNEE_DRIVE, PLANNED_SPEED = range(6)
"""Columns of `leg_curves`, which explains them."""
INCLINE_TRUNK = 3
"""Column of `slope_table` with the held trunk pitch; columns `HIP`, `KNEE` and `ANKLE` have those joints."""


def knot_curve(knots_deg: Sequence[float]) -> NDArray:
    """Return a tuned correction [rad] on `GRID`: the periodic cubic spline through `KNOTS`."""
    return np.deg2rad(CubicSpline(np.append(KNOTS, 1.0), [*knots_deg, knots_deg[0]], bc_type="periodic")(GRID))


def slope_table(constants: SlopeConstants) -> PhaseTable:
    """Return the change of hip, knee, ankle and held trunk pitch on a slope, per radian of slope, as a table over the
    stride with one row of four curves."""
    cosine = np.cos(2 * np.pi * GRID)
    sine = np.sin(2 * np.pi * GRID)
    joints = [a + b * cosine + c * sine for a, b, c in (constants.hip, constants.knee, constants.ankle)]
    return PhaseTable(np.stack([*joints, np.full(len(GRID), constants.trunk)], -1))


@part
def _between(low, high, weight):
    """Return the number, or array, at `weight` in [0, 1] of the way from `low` to `high`."""
    return low + weight * (high - low)


@kernel
def _compute_gains(constants, rows):
    """Compute the gains of N bodies.

    They are linear between those of the two tabulated speeds nearest to the commanded speed, and scale with the body.

    Args:
        constants: (R,) of `GAINS`, those of the settings' body, one for each row of the tables.
        rows: (N,) of `CONTROL_ROW`, one for each body; `legs.gains` is filled.
    """
    for i in range(len(rows)):
        subject = rows[i].subject
        gain = rows[i].legs.gains
        row = subject.place.row
        weight = subject.place.weight
        scale = subject.scale
        low = constants[row]
        high = constants[row + 1 if weight > 0.0 else row]  # the last row has no next one
        gain.touchdown = scale.mass * _between(low.touchdown, high.touchdown, weight)
        gain.rate = _between(low.rate, high.rate, weight) / scale.time
        gain.rate_gain = _between(low.rate_gain, high.rate_gain, weight) / scale.time
        gain.pitch = _between(low.pitch, high.pitch, weight)
        gain.trunk_stiffness = scale.torque * _between(low.trunk_stiffness, high.trunk_stiffness, weight)
        gain.trunk_damping = scale.torque * scale.time * _between(low.trunk_damping, high.trunk_damping, weight)
        gain.speed_torque = scale.torque / scale.time * _between(low.speed_torque, high.speed_torque, weight)
        gain.swing_gain = _between(low.swing_gain, high.swing_gain, weight) / scale.time


@part
def drive(rows, bodies, control, table, incline) -> None:
    """Begin a control window: put stiffness [N m/rad] and drive torque [N m] of hips and knees into the control.

    Args:
        rows: (N,) of `CONTROL_ROW`.
        bodies: (N,) of `BODY_ROW`, as measured now.
        control: (N, side, joint, 2) for `envs.physics.simulation.Simulation.advance`, filled.
        table: (R, SAMPLES, 2, 6) of `leg_curves`, of a `PhaseTable`.
        incline: (1, SAMPLES, 2, 4) of `slope_table`.
    """
    curves = np.empty((2, table.shape[-1]))
    inclined = np.empty(4)
    first_row = np.zeros(1, PLACE)[0]
    for i in range(len(rows)):
        subject = rows[i].subject
        legs = rows[i].legs
        m = bodies[i].measured
        gain = legs.gains
        torque = subject.scale.torque
        offset = rows[i].person.offset
        for side in range(2):
            read(table, subject.place, legs.phase[side], curves[side])
        legs.planned_speed = curves[LEFT, PLANNED_SPEED]
        too_fast = speed_excess(m, rows[i])
        # A stance hip holds trunk and speed by a torque; a swing hip's target shifts, so that the foot lands elsewhere.
        trunk = -gain.trunk_stiffness * (m.base[2] - gain.pitch) - gain.trunk_damping * m.base_velocity[2]
        stance_torque = trunk + gain.speed_torque * too_fast
        for side in range(2):
            stance = curves[side, STANCE]
            hip = torque * curves[side, HIP_STIFFNESS]
            knee = torque * curves[side, KNEE_STIFFNESS]
            feedback = stance * stance_torque + (1.0 - stance) * hip * (gain.swing_gain * too_fast)
            control[i, side, HIP, 0] = hip
            control[i, side, HIP, 1] = torque * curves[side, HIP_DRIVE] + feedback + hip * offset[side, HIP]
            control[i, side, KNEE, 0] = knee
            control[i, side, KNEE, 1] = torque * curves[side, KNEE_DRIVE] + knee * offset[side, KNEE]
            if subject.slope != 0.0:  # a slope moves the targets of hips, knees and trunk
                read(incline, first_row, legs.phase[side], inclined)
                lean = stance * gain.trunk_stiffness * inclined[INCLINE_TRUNK]
                control[i, side, HIP, 1] += subject.slope * (hip * inclined[HIP] + lean)
                control[i, side, KNEE, 1] += subject.slope * knee * inclined[KNEE]


class LegController:
    """Controller of phase, hips and knees of N bodies; the kernels `drive` and `advance` act on its rows and table.

    Args:
        rows: leg constants and walk of each row of the tables (`envs.control.reference_walk.rows`).
        subjects: bodies and commanded speeds.
    """

    def __init__(self, rows: Sequence[tuple[LegConstants, ReferenceWalk]], subjects: Subjects):
        self._subjects = subjects
        self._constants = np.array([_gains(c, walk) for c, walk in rows], GAINS)
        self.table = PhaseTable(np.stack([leg_curves(c, walk) for c, walk in rows]))
        self.phase = subjects.rows["legs"]["phase"]
        """(N, side) phase of each leg's stride in [0, 1), 0 at its heel strike; changed in place."""
        self.phase[:] = leg_phases(np.zeros(len(self.phase)))
        self.follow()

    def follow(self) -> None:
        """Compute the gains of all bodies anew, for their present sizes and commanded speeds."""
        _compute_gains(self._constants, self._subjects.rows)

    def reset(self, ids: NDArray, left_phase: NDArray) -> None:
        """Put the left legs of bodies `ids` (K,) at the stride phases `left_phase` (K,)."""
        self.phase[ids] = leg_phases(left_phase)


def _gains(constants: LegConstants, walk: ReferenceWalk) -> tuple[float, ...]:
    """Return the fields of `GAINS`, in their order: a leg's constants scaled to the settings' body."""
    body = walk.body
    stride_time = walk.plan.stride_time
    scale = body.stiffness_scale
    time_scale = sqrt(body.length_scale)
    return (
        TOUCHDOWN_LOAD * body.total_mass * GRAVITY,  # touchdown
        CONTROL_WINDOW / (constants.period_factor * stride_time),  # rate
        constants.period_speed_gain / time_scale,  # rate_gain
        radians(constants.trunk_pitch_deg) + body.trunk_lean + walk.plan.lean,  # pitch
        constants.trunk_stiffness * scale,
        constants.trunk_damping * scale * time_scale,
        constants.speed_torque * scale / time_scale,
        constants.swing_speed_gain / time_scale,  # swing_gain
    )


def leg_curves(constants: LegConstants, walk: ReferenceWalk) -> NDArray:
    """Return the curves over the stride by which the controller moves one leg's hip and knee, (SAMPLES, 6).

    Columns, from `STANCE` to `PLANNED_SPEED`: fraction of the stance leg's gains in effect, from 0 in swing to 1 in
    stance; hip and knee stiffness K [N m/rad]; hip and knee drive torque [N m], K times the rest angle plus the
    fed-forward moment; the planned CoM's forward speed over its mean.
    """
    body = walk.body
    target = walk.target
    fall_from, fall_to = STANCE_FALL
    stance = np.interp(GRID, [0.0, constants.trunk_rise, fall_from, fall_to], [0.0, 1.0, 1.0, 0.0])
    beta = damping_times(body)
    period = constants.period_factor * walk.plan.stride_time
    columns = [stance]
    drives = []
    for joint, name, knots, (in_stance, in_swing) in (
        (HIP, "thigh", constants.hip_knots_deg, constants.hip_stiffness),
        (KNEE, "knee", constants.knee_knots_deg, constants.knee_stiffness),
    ):
        stiffness = (in_swing + (in_stance - in_swing) * stance) * body.stiffness_scale
        # The joint's damping torque is K beta rate, so a target in motion needs a rest angle beta rate ahead.
        rest = target.mean(name, GRID) + beta[joint] * target.rate(name, GRID) / period + knot_curve(knots)
        if joint == HIP:
            rest = rest + (body.trunk_lean + walk.plan.lean)  # hip = thigh to the vertical + pitch of the trunk
        fed_forward = -constants.feedforward[joint] * walk.moments[:, joint]  # moments are positive in extension
        columns.append(stiffness)
        drives.append(stiffness * rest + fed_forward)
    # The plan's phase is that of its step, of which a stride has two.
    planned_speed = walk.plan.com_velocity(2 * GRID % 1.0)[0] / walk.speed
    return np.stack([*columns, *drives, planned_speed], axis=-1)
