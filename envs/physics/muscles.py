"""Measure the work of the muscles of N bodies in each control window: moment, work and cost of their fibres.

The cost, metabolic energy and squared activation, is that of `springfoot.gait.plan.effort`, compiled: fibres of ankle
and toe pull through a tendon in series, beside passive tissue (`springfoot.gait.body.tissue`). A window of 10 ms
is one of its intervals: moments are means over the physics steps, work is their sum. The moments of single steps are no
muscle's: rest angles are held for a window, so that torques are saw teeth. A window's cost needs the moment of the next
one too, so it is known one window later.
"""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import Body
from springfoot.gait.body.tissue import ankle_tissue_stiffness, tissue_moments
from springfoot.gait.plan.effort import (
    ACTIVATION_TIME,
    TENDON_GIVE,
    interval_work,
    metabolic_energy,
    strengths,
    volume_weights,
)

from .foot import Feet
from .kernel import part
from .model import ANKLE, JOINTS, SIDES, joints_of
from .timing import CONTROL_WINDOW

_LEGS = (len(SIDES), len(JOINTS))
MUSCLES = np.dtype(
    [
        ("tissue", float),  # factor on `tissue_moments`
        ("present", np.int64, _LEGS),  # 1 for a joint with muscles, 0 for a device in their place
        ("give", float, len(JOINTS)),  # of the tendons [rad/(N m)]
        ("strength", float, (*_LEGS, 2)),  # largest moments of extensors and flexors [N m]
        ("volume", float, (*_LEGS, 2)),  # their weights in the activation (`volume_weights`)
    ]
)
"""Constants of the muscles of one body on its feet."""
MUSCLE_ROW = np.dtype(
    [
        ("muscles", MUSCLES),
        ("time", float),  # at the end of the last window [s]
        ("windows", np.int64),  # since the episode began
        ("slack", np.int64, len(SIDES)),  # 1 while an ankle's muscles are slack: its torque is then that of the tissue
        ("judged", np.int64),  # 1 once a step has used the sums below, which then begin anew
        ("angle", float, _LEGS),  # at the end of the last window [rad]
        ("velocity", float, _LEGS),  # likewise [rad/s]
        ("delivered", float, (2, *_LEGS, 2)),  # work of fibres and tendon in halves of the last two windows [J]
        ("moment", float, (3, *_LEGS)),  # mean moment of the fibres in the last three windows, the last first [N m]
        ("energy", float, _LEGS),  # metabolic, of the fibres' work in the step, one window late [J]
        ("activation", float),  # time integral of the squared activation, likewise [s]
        ("activation_rate", float),  # of its squared rate x `ACTIVATION_TIME`, likewise [s]
        ("positive_work", float),  # of all actuators in the step [J]
    ]
)
"""Recent work of the muscles of one body."""

_BYTES = np.dtype((np.uint8, MUSCLE_ROW.itemsize))
_CONSTANT_BYTES = MUSCLES.itemsize
"""Bytes of a row that hold its constants, its first field."""

muscleless_moments = part(tissue_moments)
"""`tissue_moments`, compiled."""
_interval_work = part(interval_work)
_metabolic_energy = part(metabolic_energy)
tissue_stiffness = part(ankle_tissue_stiffness)
"""`ankle_tissue_stiffness`, compiled."""


def muscles_of(body: Body, feet: Feet) -> NDArray:
    """Return the constants of the muscles of a body on these feet, (1,) of `MUSCLES`."""
    row = np.zeros(1, MUSCLES)
    row["tissue"] = body.strength_scale  # a load makes no tissue stiffer
    row["give"] = np.array(TENDON_GIVE) / body.strength_scale
    row["present"] = [[joint.has_muscles for joint in joints_of(foot)] for foot in feet]
    row["strength"] = leg_strengths(body, feet)
    row["volume"] = volume_weights()
    return row


def leg_strengths(body: Body, feet: Feet) -> NDArray:
    """Return the largest moments (side, joint, 2) [N m] of the muscles above these feet, in extension and in flexion.

    Those of a sound leg; in extension times the joint's `strength`.
    """
    of_extensors = [[joint.strength for joint in joints_of(foot)] for foot in feet]
    return strengths(body) * np.stack([of_extensors, np.ones(_LEGS)], -1)


@part
def _activation(moment, strength):
    """Return the activation of a joint's muscles at a `moment` [N m], that of flexors negative; `strength` (2,) [N m]
    of extensors and flexors."""
    return moment / strength[0 if moment > 0.0 else 1]


@part
def _add_cost_of_last_but_one(row):
    """Add the cost of the last window but one to the sums `energy`, `activation` and `activation_rate` of `row`, of
    `MUSCLE_ROW`."""
    for side in range(2):
        for joint in range(4):
            moment = row.moment[1, side, joint]
            strength = row.muscles.strength[side, joint]
            volume = row.muscles.volume[side, joint, 0 if moment > 0.0 else 1]
            now = _activation(moment, strength)
            rise = now - _activation(row.moment[2, side, joint], strength)
            next_rise = _activation(row.moment[0, side, joint], strength) - now
            first, second = _interval_work(
                row.moment[2, side, joint],
                moment,
                row.moment[0, side, joint],
                row.delivered[1, side, joint, 0],
                row.delivered[1, side, joint, 1],
                row.muscles.give[joint],
            )
            row.energy[side, joint] += _metabolic_energy(first) + _metabolic_energy(second)
            row.activation += volume * now**2 * CONTROL_WINDOW
            squared_rate = (rise**2 + next_rise**2) / 2 * (ACTIVATION_TIME / CONTROL_WINDOW) ** 2
            row.activation_rate += volume * squared_rate * CONTROL_WINDOW


@part
def actuator_torque(segments, control, theta, theta_rate, side, joint) -> float:
    """Return the torque of one joint's actuators [N m]: of its spring, within the joint's limits.

    `segments` is of `SEGMENTS`, `control` (side, joint, 2) K [N m/rad] and K theta_eq [N m]; `theta` [rad] and
    `theta_rate` [rad/s] are the joint's.
    """
    spring = control[side, joint, 1] - control[side, joint, 0] * (theta + segments.beta[side, joint] * theta_rate)
    return min(max(spring, segments.torque[side, joint, 0]), segments.torque[side, joint, 1])


@part
def work_muscles(row, m, segments, velocity, control) -> None:
    """Add a control window to the work of the muscles of one body; nothing if no time has passed.

    The joints' positive work is summed, the kept windows move on by one, and the cost of the last window but one is
    added, which needs the moment after it. The sums begin anew after a judged step.

    Args:
        row: of `MUSCLE_ROW`.
        m: of `MEASURED`, at the window's end.
        segments: of `SEGMENTS`.
        velocity: (S, D) velocities of D degrees of freedom after the window's S physics steps [m/s, rad/s].
            MuJoCo moves a joint by the velocity after a step, so they give the angles, and these the torques: recording
            torques too would cost more.
        control: (side, joint, 2) K [N m/rad] and K theta_eq [N m] of the window; muscles without K do nothing.
    """
    if m.time <= row.time:
        return
    row.time = m.time
    if row.judged:
        row.judged = 0
        row.activation = row.activation_rate = row.positive_work = 0.0
        row.energy[:] = 0.0
    steps = len(velocity)
    timestep = CONTROL_WINDOW / steps
    muscles = row.muscles
    middle = np.empty(4)
    for side in range(2):
        for joint in range(4):
            middle[joint] = 0.5 * (row.angle[side, joint] + m.angle[side, joint])
        tissue = muscleless_moments(middle[0], middle[1], middle[2], middle[3])
        for joint in range(4):
            dof = 3 + 4 * side + joint  # behind the trunk's x, z and pitch
            mean_torque = first = second = 0.0
            before = row.velocity[side, joint]
            theta = row.angle[side, joint]
            for step in range(steps):
                torque = actuator_torque(segments, control, theta, before, side, joint)
                after = velocity[step, dof]
                theta += after * timestep
                mean_torque += torque / steps
                work = torque * 0.5 * (before + after) * timestep
                early = min(max(0.5 * steps - step, 0.0), 1.0)  # part of the step in the window's first half
                first += early * work
                second += (1.0 - early) * work
                before = after
            slack = joint == ANKLE and row.slack[side] == 1
            if not slack:
                row.positive_work += max(first + second, 0.0)
            turn = m.angle[side, joint] - row.angle[side, joint]
            row.angle[side, joint] = m.angle[side, joint]
            row.velocity[side, joint] = before
            row.moment[2, side, joint] = row.moment[1, side, joint]
            row.moment[1, side, joint] = row.moment[0, side, joint]
            row.delivered[1, side, joint] = row.delivered[0, side, joint]
            row.moment[0, side, joint] = 0.0
            row.delivered[0, side, joint] = 0.0
            if muscles.present[side, joint] and control[side, joint, 0] > 0.0 and not slack:
                of_tissue = muscles.tissue * tissue[joint]
                row.moment[0, side, joint] = -mean_torque - of_tissue
                row.delivered[0, side, joint, 0] = first + 0.5 * of_tissue * turn
                row.delivered[0, side, joint, 1] = second + 0.5 * of_tissue * turn
    row.windows += 1
    if row.windows >= 3:
        _add_cost_of_last_but_one(row)


def forget(rows: NDArray, ids: NDArray | slice, angle: NDArray, velocity: NDArray) -> None:
    """Set time, windows and sums of `rows` (N,) of `MUSCLE_ROW` to 0 in simulations `ids` (K,); the constants stay.

    Their muscles begin at the joint angles `angle` and velocities `velocity` (N, side, joint) [rad, rad/s].
    """
    rows.view(_BYTES)[ids, _CONSTANT_BYTES:] = 0  # field by field it takes far longer
    rows["angle"][ids] = angle[ids]
    rows["velocity"][ids] = velocity[ids]
