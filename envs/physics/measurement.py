"""Measure N bodies at the end of a control window, from joint positions and contact forces."""

from dataclasses import dataclass
from math import cos, sin
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import Body

from .contact import CONTACTS, contact_offsets
from .foot import SOUND, Feet, leg_segments, total_mass
from .kernel import kernel, part
from .model import ANKLE, BASE, JOINTS, KNEE, SIDES, TOE, damping_times_of, torque_ranges
from .muscles import MUSCLE_ROW, actuator_torque, work_muscles

DEGREES = len(BASE) + len(SIDES) * len(JOINTS)
"""Degrees of freedom of the body."""
SEGMENTS = np.dtype(
    [
        ("trunk", float, 2),  # part of trunk and load in hip -> CoM [m], in the trunk's frame (forward, up)
        ("part", float, (len(SIDES), len(JOINTS), 2)),  # that of thigh, shank, foot and toe: see segments_of
        ("end", float, (len(JOINTS), 2)),  # from a segment's joint to the next one [m], in its own frame
        ("contact", float, (len(CONTACTS), 2)),  # contact sphere's centre from ankle (heel, ball) or toe joint [m]
        ("radius", float, len(CONTACTS)),  # of the contact spheres [m]
        ("beta", float, (len(SIDES), len(JOINTS))),  # damping time of each joint's spring [s]
        ("torque", float, (len(SIDES), len(JOINTS), 2)),  # lowest and highest torque of each joint's actuators [N m]
    ]
)
"""Constants of one body for kinematics and springs."""
PLANT = np.dtype(
    [
        ("time", float),  # since the episode began [s]
        ("qpos", float, DEGREES),  # of base (x, z, pitch) and joints [m, rad]
        ("qvel", float, DEGREES),  # [m/s, rad/s]
        ("qacc_warmstart", float, DEGREES),
        ("control", float, (len(SIDES), len(JOINTS), 2)),  # as for `envs.physics.simulation.Simulation.advance`
    ]
)
"""Beginning of a row of MuJoCo's state."""
_PLANT_NUMBERS = PLANT.itemsize // 8


MEASURED = np.dtype(
    [
        ("time", float),
        ("base", float, 3),
        ("base_velocity", float, 3),
        ("angle", float, (len(SIDES), len(JOINTS))),
        ("velocity", float, (len(SIDES), len(JOINTS))),
        ("torque", float, (len(SIDES), len(JOINTS))),
        ("com", float, 2),
        ("com_velocity", float, 2),
        ("ankle", float, (len(SIDES), 2)),
        ("contact", float, (len(SIDES), len(CONTACTS), 2)),
        ("force", float, (len(SIDES), len(CONTACTS), 2)),
        ("diverged", np.int64),
    ]
)
"""Row of one body in a `Measurement`, which explains it."""
BODY_ROW = np.dtype(
    [
        ("segments", SEGMENTS),
        ("ground", float, 1 + len(SIDES)),  # tangent of the slope [-], height of the ground below each foot [m]
        ("measured", MEASURED),
        ("muscles", MUSCLE_ROW),
    ]
)
"""Row of one body in the simulation."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """Measurements of N bodies at the end of one control window; SI units, world x forward, z up.

    Every height z, and every upward velocity, is relative to the ground straight below the point: for a foot's contacts
    the ground of that foot, for all else the mean ground, a plane through the origin. Angles are relative to the true
    vertical; forces are horizontal and vertical.

    Axes called side, joint and contact follow `SIDES`, `JOINTS` and `CONTACTS` of `envs.physics.model`.
    """

    time: NDArray
    """(N,) time since the start of the episode [s]."""
    base: NDArray
    """(N, 3) hip x [m], hip z [m], trunk pitch [rad]."""
    base_velocity: NDArray
    """(N, 3) velocity of the hip (x, z) [m/s, m/s], rate of the pitch [rad/s]."""
    angle: NDArray
    """(N, side, joint) joint angles [rad]."""
    velocity: NDArray
    """(N, side, joint) joint velocities [rad/s]."""
    torque: NDArray
    """(N, side, joint) actuator torques at the window's end, after the torque limit [N m]."""
    com: NDArray
    """(N, 2) centre of mass (x, z) [m]."""
    com_velocity: NDArray
    """(N, 2) velocity of the centre of mass [m/s]."""
    ankle: NDArray
    """(N, side, 2) ankle axes (x, z) [m]."""
    contact: NDArray
    """(N, side, contact, 2) lowest points of the contact spheres (x, z) [m]."""
    force: NDArray
    """(N, side, contact, 2) ground reaction force (forward, up) on each, mean over the window [N]."""
    diverged: NDArray
    """(N,) lowest number of the `mjtWarning`s that MuJoCo has raised since the start of the episode, -1 for none."""

    @classmethod
    def of(cls, measured: NDArray) -> "Measurement":
        """Return the measurement in rows (N,) of `MEASURED`; its arrays are views of them."""
        return cls(**{name: measured[name] for name in MEASURED.names or ()})


def segments_of(body: Body, feet: Feet = SOUND) -> NDArray:
    """Return the constants of one body with these feet, (1,) of dtype `SEGMENTS`.

    The CoM is the hip plus one offset for each segment, which turns with the segment. The offset is the sum of two
    products: the segment's fraction of the mass times its own CoM, and the fraction of everything below it times the
    position of its far end.
    """
    toe_joint = (body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height)
    offsets = contact_offsets(body)
    mass = total_mass(body, feet)
    segments = np.zeros(1, SEGMENTS)
    segments["trunk"] = np.array(body.upper_moment) / mass
    for side, foot_below in enumerate(feet):
        leg = leg_segments(body, foot_below)
        thigh, shank, foot, toe = leg.mass
        # Thigh and shank point down from their joints; so their CoMs lie at negative heights.
        (_, thigh_com), (_, shank_com), (forward, up), (toe_com, _) = leg.com
        segments["part"][:, side] = (
            np.array(
                [
                    (0.0, -(thigh * -thigh_com + (shank + foot + toe) * body.thigh_length)),
                    (0.0, -(shank * -shank_com + (foot + toe) * body.shank_length)),
                    (foot * forward + toe * toe_joint[0], foot * up + toe * toe_joint[1]),
                    (toe * toe_com, 0.0),
                ]
            )
            / mass
        )
    segments["end"] = [(0.0, -body.thigh_length), (0.0, -body.shank_length), toe_joint, (0.0, 0.0)]
    segments["contact"] = [(forward, up) for forward, up, _ in offsets.values()]
    segments["radius"] = [radius for *_, radius in offsets.values()]
    segments["beta"] = damping_times_of(body, feet)
    segments["torque"] = torque_ranges(body, feet)
    return segments


@part
def _turned(offset, c, s):
    """Return the offset (u, w) [m] in the world, (x, z), of a segment turned by an angle of cosine `c` and sine `s`."""
    return offset[0] * c - offset[1] * s, offset[0] * s + offset[1] * c


@part
def _fill_kinematics(segments, position, rate, m):
    """Fill CoM, ankles and contact points of `m`, of `MEASURED`, and the CoM's velocity, by planar kinematics [m, m/s].

    Heights are above the origin of the world. `segments` of `SEGMENTS`; `position` and `rate` (11,), MuJoCo's
    coordinates [m, rad] and their rates. A segment is turned by s, positive up-forward: a thigh's flexion, a foot's
    toes-up pitch. An offset (u, w) in its frame is then (x, z) = (u cos s - w sin s, u sin s + w cos s) in the world,
    and moves at ds/dt (-z, x).
    """
    hip_x = position[0]
    hip_z = position[1]
    pitch = position[2]
    x, z = _turned(segments.trunk, cos(-pitch), sin(-pitch))
    com_x = hip_x + x
    com_z = hip_z + z
    com_rate_x = rate[0] + z * rate[2]
    com_rate_z = rate[1] - x * rate[2]
    for side in range(2):
        joint_x = hip_x
        joint_z = hip_z
        turn = -pitch
        spin = -rate[2]
        for joint in range(4):
            sign = -1.0 if joint == KNEE else 1.0  # a bent knee turns the shank back
            turn += sign * position[3 + 4 * side + joint]
            spin += sign * rate[3 + 4 * side + joint]
            c = cos(turn)
            s = sin(turn)
            x, z = _turned(segments.part[side, joint], c, s)  # this segment's part in hip -> CoM
            com_x = com_x + x
            com_z = com_z + z
            com_rate_x = com_rate_x - z * spin
            com_rate_z = com_rate_z + x * spin
            if joint == ANKLE:
                m.ankle[side, 0] = joint_x
                m.ankle[side, 1] = joint_z
            for k in range(3):  # heel, ball, toe
                if joint == (ANKLE if k == 0 else TOE):  # the heel is on the foot, which turns about the ankle
                    x, z = _turned(segments.contact[k], c, s)
                    m.contact[side, k, 0], m.contact[side, k, 1] = joint_x + x, joint_z + z - segments.radius[k]
            x, z = _turned(segments.end[joint], c, s)  # on to the next joint
            joint_x = joint_x + x
            joint_z = joint_z + z
    m.com[0] = com_x
    m.com[1] = com_z
    m.com_velocity[0] = com_rate_x
    m.com_velocity[1] = com_rate_z


@part
def _make_relative_to_ground(ground, m):
    """Change heights and upward velocities of `m`, of `MEASURED`, from those in the world to those above the ground.

    `ground` (3,) is the tangent of the slope [-] and the height of the ground below each foot [m].
    """
    slope = ground[0]
    m.base[1] -= slope * m.base[0]
    m.base_velocity[1] -= slope * m.base_velocity[0]
    m.com[1] -= slope * m.com[0]
    m.com_velocity[1] -= slope * m.com_velocity[0]
    for side in range(2):
        m.ankle[side, 1] -= slope * m.ankle[side, 0]
        for k in range(3):
            m.contact[side, k, 1] -= slope * m.contact[side, k, 0] + ground[1 + side]


@part
def _read_joints(segments, plant, m):
    """Fill angle, velocity and torque (2, 4) [rad, rad/s, N m] of `m`, of `MEASURED`.

    The torque is the spring's, within the limits of `segments`, at the state of `plant`, of `PLANT`.
    """
    for side in range(2):
        for joint in range(4):
            theta = plant.qpos[3 + 4 * side + joint]  # behind the trunk's x, z and pitch
            theta_rate = plant.qvel[3 + 4 * side + joint]
            m.angle[side, joint] = theta
            m.velocity[side, joint] = theta_rate
            m.torque[side, joint] = actuator_torque(segments, plant.control, theta, theta_rate, side, joint)


@part
def _fill_mean_forces(sensors, force):
    """Fill `force` (side, contact, 2), forward and up, with the mean over physics steps of each contact's force [N].

    `sensors` is (steps, side, contact, 3): forward, lateral, up [N].
    """
    steps = len(sensors)
    for side in range(2):
        for contact in range(3):
            forward = up = 0.0
            for step in range(steps):
                forward += sensors[step, side, contact, 0]
                up += sensors[step, side, contact, 2]
            force[side, contact, 0] = forward / steps
            force[side, contact, 1] = up / steps


@part
def plant_of(state, i) -> Any:
    """Return the beginning of row `i` of MuJoCo's state (N, numbers), of `PLANT`."""
    return state[i, :_PLANT_NUMBERS].view(PLANT)[0]


@kernel
def measure_bodies(bodies, state, sensors, velocity, warnings) -> None:
    """Measure N bodies after a control window.

    Args:
        bodies: (N,) of `BODY_ROW`; `measured` is filled, and the window added to `muscles`.
        state: (N, numbers) MuJoCo's, with rows that begin as `PLANT`.
        sensors: (N, S, side, contact, 3) contact forces of the window's S physics steps [N].
        velocity: (N, S, D) velocities of D degrees of freedom after these steps [m/s, rad/s].
        warnings: (N, kinds) how often MuJoCo has warned of each kind.
    """
    for i in range(len(bodies)):
        segments = bodies[i].segments
        m = bodies[i].measured
        plant = plant_of(state, i)
        m.time = plant.time
        for k in range(3):
            m.base[k], m.base_velocity[k] = plant.qpos[k], plant.qvel[k]
        _read_joints(segments, plant, m)
        _fill_kinematics(segments, plant.qpos, plant.qvel, m)
        _make_relative_to_ground(bodies[i].ground, m)
        _fill_mean_forces(sensors[i], m.force)
        work_muscles(bodies[i].muscles, m, segments, velocity[i], plant.control)
        m.diverged = -1
        for kind in range(warnings.shape[1] - 1, -1, -1):  # backwards, so that the lowest kind stays
            if warnings[i, kind] > 0:
                m.diverged = kind
