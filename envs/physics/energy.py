"""Compute torque, work and energy of N bodies over the physics steps of a window, only while something reads them.

MuJoCo computes each force at the beginning of a physics step. The work of a force in a step is that force times the
mean of the velocities before and after it, times the step. With this rule the energies of `pretrained` close to 0.003
J/kg a stride; the velocity before alone leaves 0.028, the one after 0.024.
"""

from dataclasses import dataclass
from math import cos, sin
from typing import NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import GRAVITY, Body

from .foot import SOUND, Feet, leg_segments
from .kernel import kernel, part
from .model import JOINTS, KNEE, SIDES, armatures_of, damping_times_of, joints_of

LEDGER = np.dtype(
    [
        ("actuators", float),
        ("passive_damping", float),  # of the joints, and all of orthoses
        ("contact", float),  # of ground and joint stops
        ("pushes", float),
        ("mechanical", float),  # kinetic and potential energy at the window's end
        (
            "stiffness_changes",
            float,
            len(JOINTS),
        ),  # by changing K under the deflection x = theta_eq - theta: 1/2 dK x^2
        ("equilibrium_changes", float, len(JOINTS)),  # by moving theta_eq from deflection x to x': 1/2 K (x'^2 - x^2)
        ("spring_damping", float, len(JOINTS)),  # of the part -K beta dtheta/dt of the actuators' torque
    ]
)
"""Energies of one window of one body [J], both legs together, into the body positive; `mechanical` is a state, all
others are work.

mechanical rises by actuators + passive_damping + contact + pushes. Every joint is a spring with K and theta_eq that
change between windows (not before an episode's first), so the actuators' work comes from stiffness_changes +
equilibrium_changes + spring_damping and from the energy stored in the springs. That sum agrees to 3 % of the energy put
in: MuJoCo moves a joint by the velocity after a step.
"""


RECORDED = ("qvel", "qfrc_actuator", "qfrc_passive", "qfrc_constraint")
"""Fields of MuJoCo's data that are recorded after each physics step, as `StepRecord` holds them."""


def ledger_entries() -> tuple[str, ...]:
    """Return the names of the numbers of `LEDGER` in order, such as `stiffness_changes/ankle` for one of an array over
    joints."""
    arrays = {name for name in LEDGER.names or () if LEDGER[name].shape}
    return tuple(
        entry
        for name in LEDGER.names or ()
        for entry in ([f"{name}/{joint}" for joint in JOINTS] if name in arrays else [name])
    )


class StepRecord(NamedTuple):
    """MuJoCo's record of the S physics steps of a window; D degrees of freedom, in the order of qvel."""

    before: NDArray
    """(N, D) velocity at the beginning of the window [m/s, rad/s]."""
    pitch: NDArray
    """(N,) pitch of the trunk at the beginning of the window [rad]."""
    velocity: NDArray
    """(N, S, D) velocity after each step [m/s, rad/s]."""
    actuator: NDArray
    """(N, S, D) generalised forces of the actuators in each step [N, N m]."""
    passive: NDArray
    """(N, S, D) generalised forces of the joint damping."""
    constraint: NDArray
    """(N, S, D) generalised forces of contacts and joint stops."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WindowWork:
    """Torque, work and energy of N bodies in one control window."""

    torque: NDArray
    """(N, side, joint) actuator and joint damping, mean over the physics steps [N m]."""
    work: NDArray
    """(N, side, joint, 2) positive and negative work of this torque, summed over the physics steps [J]."""
    energy: NDArray
    """(N,) of `LEDGER`."""


_LEGS = (len(SIDES), len(JOINTS))
PART = [
    ("mass", float),  # [kg]
    ("inertia", float),  # about its CoM [kg m^2]
    ("com", float, 2),  # forward and up in its own frame [m]
]
PARTS = np.dtype(
    [
        ("upper", PART, 2),  # trunk, load
        ("leg", PART, _LEGS),  # thigh, shank, foot, toe
        ("end", float, (len(JOINTS), 2)),  # from a leg segment's joint to the next one [m], in its own frame
        ("armature", float, _LEGS),  # [kg m^2]
        ("beta", float, _LEGS),  # [s]
        ("table", np.int64, _LEGS),  # 1 for a device with a torque-angle line: of its own, so that nothing changes it
    ]
)
"""Numbers of a body that its energy needs."""


def parts_of(body: Body, feet: Feet = SOUND) -> NDArray:
    """Return the numbers that the energy of a body with these feet needs, (1,) of `PARTS`."""
    parts = np.zeros(1, PARTS)
    parts["upper"]["mass"] = body.trunk_mass, body.carried_mass
    parts["upper"]["inertia"] = body.trunk_inertia, body.carried_inertia
    parts["upper"]["com"] = (0.0, body.trunk_com_above_hip), body.carried_com
    for side, foot in enumerate(feet):
        leg = leg_segments(body, foot)
        for name in ("mass", "inertia", "com"):
            parts["leg"][name][:, side] = getattr(leg, name)
    toe_joint = (body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height)
    parts["end"] = [(0.0, -body.thigh_length), (0.0, -body.shank_length), toe_joint, (0.0, 0.0)]
    parts["armature"] = armatures_of(body, feet)
    parts["beta"] = damping_times_of(body, feet)
    parts["table"] = [[bool(joint.device and joint.device.table) for joint in joints_of(foot)] for foot in feet]
    return parts


@kernel
def _sum_work(parts, steps, control, push, timestep, torque, work, energy):
    """Add the work of a window's physics steps to `work` and `energy` [J], and mean torques [N m] to `torque`.

    Args:
        parts: (N,) of `PARTS`.
        steps: `StepRecord`.
        control: (N, side, joint, 2), K and K theta_eq held in the window [N m/rad, N m].
        push: (N,) horizontal force on the trunk's CoM [N].
        timestep: time of a physics step [s].
        torque: (N, side, joint), of actuators and joint damping together.
        work: (N, side, joint, 2), positive and negative work of that torque.
        energy: (N,) of `LEDGER`.
    """
    count = steps.velocity.shape[1]
    for i in range(len(parts)):
        own = parts[i]
        entry = energy[i]
        pitch = steps.pitch[i]
        for step in range(count):
            before = steps.before[i] if step == 0 else steps.velocity[i, step - 1]
            after = steps.velocity[i, step]
            for dof in range(len(after)):
                way = 0.5 * (before[dof] + after[dof]) * timestep  # [m, rad]
                entry.actuators += steps.actuator[i, step, dof] * way
                entry.passive_damping += steps.passive[i, step, dof] * way
                entry.contact += steps.constraint[i, step, dof] * way
            lever = own.upper[0].com[1] * cos(pitch)  # of the push about the hip
            entry.pushes += push[i] * 0.5 * timestep * (before[0] + after[0] + lever * (before[2] + after[2]))
            pitch += timestep * after[2]
            for side in range(2):
                for joint in range(4):
                    dof = 3 + 4 * side + joint  # behind the trunk's x, z and pitch
                    way = 0.5 * (before[dof] + after[dof]) * timestep
                    net = steps.actuator[i, step, dof] + steps.passive[i, step, dof]
                    torque[i, side, joint] += net / count
                    work[i, side, joint, 0 if net * way > 0.0 else 1] += net * way
                    entry.spring_damping[joint] -= (
                        control[i, side, joint, 0] * own.beta[side, joint] * before[dof] * way
                    )


@kernel
def _sum_changes(parts, control, control_before, angle, energy):
    """Add to `energy` [J] the gain of the springs by changes of K and theta_eq under load, as a window begins.

    Args:
        parts: (N,) of `PARTS`.
        control: (N, side, joint, 2), K and K theta_eq held in the window [N m/rad, N m].
        control_before: the same of the window before; NaN where there was none.
        angle: (N, side, joint) at the beginning of the window [rad].
        energy: (N,) of `LEDGER`.
    """
    for i in range(len(energy)):
        for side in range(2):
            for joint in range(4):
                k = control[i, side, joint, 0]
                k_before = control_before[i, side, joint, 0]
                # Not at the start of an episode (NaN is not > 0), without a spring, or for a foot with a
                # table of torque over the angle.
                if k + k_before > 0.0 and not parts[i].table[side, joint]:
                    rest = control[i, side, joint, 1] / k
                    rest_before = control_before[i, side, joint, 1] / k_before
                    # A slack spring has no rest angle; it takes that of the other window, so that K alone changes.
                    if k == 0.0:
                        rest = rest_before
                    if k_before == 0.0:
                        rest_before = rest
                    before = rest_before - angle[i, side, joint]
                    after = rest - angle[i, side, joint]
                    energy[i].stiffness_changes[joint] += 0.5 * (k - k_before) * before * before
                    energy[i].equilibrium_changes[joint] += 0.5 * k * (after * after - before * before)


@part
def _part_energy(part, x, z, x_rate, z_rate, turn, spin):
    """Return kinetic plus potential energy [J] of one `part`, of `PART`.

    Its joint is at (x, z) [m] and moves at (x_rate, z_rate) [m/s]; it is turned up-forward by `turn` [rad], at the rate
    `spin` [rad/s].
    """
    forward = part.com[0]
    up = part.com[1]
    # From the joint to the CoM, in the world.
    along = forward * cos(turn) - up * sin(turn)
    above = forward * sin(turn) + up * cos(turn)
    speed = (x_rate - above * spin) ** 2 + (z_rate + along * spin) ** 2
    return part.mass * (0.5 * speed + GRAVITY * (z + above)) + 0.5 * part.inertia * spin**2


@kernel
def _set_mechanical(parts, position, rate, energy):
    """Set `mechanical`, kinetic and potential energy [J], of `energy` (N,) of `LEDGER`, from positions and rates.

    The kinematics are those of `envs.physics.measurement`. `parts` (N,) of `PARTS`; `position` and `rate` (N, 11),
    MuJoCo's coordinates [m, rad] and their rates: x, z and pitch of the trunk, then the joints of both legs.
    """
    for i in range(len(energy)):
        own = parts[i]
        total = 0.0
        q = position[i]
        v = rate[i]
        for piece in range(2):  # trunk, load
            total += _part_energy(own.upper[piece], q[0], q[1], v[0], v[1], -q[2], -v[2])
        for side in range(2):
            x = q[0]
            z = q[1]
            x_rate = v[0]
            z_rate = v[1]
            turn = -q[2]
            spin = -v[2]
            for joint in range(4):
                sign = -1.0 if joint == KNEE else 1.0  # a bent knee turns the shank back
                dof = 3 + 4 * side + joint
                turn = turn + sign * q[dof]
                spin = spin + sign * v[dof]
                total += _part_energy(own.leg[side, joint], x, z, x_rate, z_rate, turn, spin)
                total += 0.5 * own.armature[side, joint] * v[dof] ** 2
                forward, up = own.end[joint]
                # On to the next joint.
                along = forward * cos(turn) - up * sin(turn)
                above = forward * sin(turn) + up * cos(turn)
                x = x + along
                z = z + above
                x_rate = x_rate - above * spin
                z_rate = z_rate + along * spin
        energy[i].mechanical = total


def window_work(
    parts: NDArray,
    steps: StepRecord,
    control: NDArray,
    control_before: NDArray,
    angle: NDArray,
    push: NDArray,
    state: tuple[NDArray, NDArray],
    timestep: float,
) -> WindowWork:
    """Return torque, work and energy of one control window.

    Args:
        parts: (N,) of `PARTS`.
        steps: MuJoCo's record of the window's physics steps.
        control: (N, side, joint, 2) K [N m/rad] and K theta_eq [N m] held in the window.
        control_before: the same of the window before; NaN where there was none.
        angle: (N, side, joint) at the beginning of the window [rad].
        push: (N,) horizontal force on the trunk's CoM [N].
        state: MuJoCo's qpos and qvel at the window's end, (N, D) each.
        timestep: time of a physics step [s].
    """
    num = len(parts)
    torque = np.zeros((num, len(SIDES), len(JOINTS)))
    work = np.zeros((num, len(SIDES), len(JOINTS), 2))
    energy = np.zeros(num, LEDGER)
    _sum_work(parts, steps, control, push, timestep, torque, work, energy)
    _sum_changes(parts, control, control_before, angle, energy)
    _set_mechanical(parts, *state, energy)
    return WindowWork(torque=torque, work=work, energy=energy)
