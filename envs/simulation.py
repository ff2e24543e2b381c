"""N bodies walking side by side on `mujoco.batch.Batch`: the only owner of MuJoCo data and the only reader of sensors.

One call of `advance` is one control window of 10 ms: it holds `control`, runs the physics steps and returns a
`Measurement`. Kinematics are computed here from joint positions at the window's end (MuJoCo's derived fields lag one
physics step); contact forces are the mean over the window's physics steps, so that no heel strike is missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, tan

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from springfoot.gait.body import Body
from springfoot.gait.errors import SpringfootError

from .contact import CONTACTS, FRICTION, TIMESTEP, contact_offsets
from .kernel import kernel
from .model import ANKLE, JOINTS, KNEE, SIDES, TOE, build_model, damping_times, torque_limits

WINDOW = 0.01
"""Control window [s]: controls are held and forces averaged over it."""
STEPS_PER_WINDOW = round(WINDOW / TIMESTEP)


@dataclass(kw_only=True, eq=False)  # making it frozen takes longer than measuring
class Measurement:
    """What is known of N bodies at the end of one control window; SI units, world x forward, z up.

    Every height z is above the ground: below the point, and for a foot's contacts the ground of that foot; the others'
    is the mean ground, a plane through the origin. So is every velocity up. Angles are to the true vertical, and
    forces horizontal and vertical.

    Axes called side, joint and contact follow `SIDES`, `JOINTS` and `CONTACTS` of `envs.model`.
    """

    time: NDArray
    """(N,) time since the episode began [s]."""
    root: NDArray
    """(N, 3) hip x [m], hip z [m], trunk pitch [rad]."""
    root_velocity: NDArray
    """(N, 3) its rate [m/s, m/s, rad/s]."""
    angle: NDArray
    """(N, side, joint) joint angles [rad]."""
    velocity: NDArray
    """(N, side, joint) joint velocities [rad/s]."""
    torque: NDArray
    """(N, side, joint) actuator torques at the window's end, after the torque limit [N m]."""
    com: NDArray
    """(N, 2) centre of mass (x, z) [m]."""
    com_velocity: NDArray
    """(N, 2) its velocity [m/s]."""
    ankle: NDArray
    """(N, side, 2) ankle axes (x, z) [m]."""
    contact: NDArray
    """(N, side, contact, 2) lowest points of the contact spheres (x, z) [m]."""
    force: NDArray
    """(N, side, contact, 2) ground reaction force (forward, up) on each, mean over the window [N]."""
    diverged: NDArray
    """(N,) number of the first MuJoCo warning raised since the episode began (`mjtWarning`), -1 where all is well."""


class Simulation:
    """N simulations, of one body at first.

    Args:
        body: whose model is simulated.
        num: N.
        threads: of the physics; any number gives the same bits.
        model: the body's model with other options, such as a timestep that divides `WINDOW`, in place of the default.
        friction: between feet and ground, of the default models [-].
    """

    def __init__(
        self,
        body: Body,
        num: int,
        threads: int = 1,
        model: mujoco.MjModel | None = None,
        friction: float = FRICTION,
    ):
        self.body = body
        self.num = num
        self.model = model or build_model(body, friction)
        self.models = [self.model] * num
        """Of each simulation."""
        self._own_options = model is not None
        self._friction = friction
        self._substeps = round(WINDOW / self.model.opt.timestep)
        self._batch = Batch(self.model, num, threads)
        self._qpos = self._batch.bind("qpos")
        self._qvel = self._batch.bind("qvel")
        self.control = self._batch.bind("ctrl").reshape(num, len(SIDES), len(JOINTS), 2)
        """(N, side, joint, 2) K [N m/rad] and K theta_eq plus any feed-forward torque [N m]; changed in place."""
        self._time = self._batch.bind("time").reshape(num)
        self._push = self._batch.bind("xfrc_applied")[:, self.model.body("trunk").id]
        self._position, self._turn = self._batch.bind("mocap_pos"), self._batch.bind("mocap_quat")
        self._ground = np.zeros((num, 1 + len(SIDES)))  # tangent of the slope, height below each foot [m]
        self._warnings = self._batch.warning[:, :, 1]
        self._sensors = np.zeros((num, self._substeps, len(SIDES), len(CONTACTS), 3))
        self._record = {"sensordata": self._sensors.reshape(num, self._substeps, self.model.nsensordata)}
        self._segments = np.repeat(_segments(body), num)
        self._no_control = np.zeros_like(self.control)

    def fit(self, ids: Sequence[int], bodies: Sequence[Body]) -> None:
        """Simulate `bodies` (K,) in `ids` (K,) from their next reset on; compiling a model takes about 1.5 ms."""
        if self._own_options:
            raise SpringfootError("a simulation with a model of one's own keeps its body")
        for index, body in zip(ids, bodies, strict=True):
            self.models[index] = self.model if body == self.body else build_model(body, self._friction)
            self._segments[index] = _segments(body)[0]
        self._batch.set_models(self.models)

    def reset(self, ids: NDArray, root: NDArray, root_velocity: NDArray, angle: NDArray, velocity: NDArray) -> None:
        """Put simulations `ids` (K,) into the states given: (K, 3), (K, 3), (K, side, joint), (K, side, joint)."""
        position, turn = self._position[ids], self._turn[ids]  # the ground stays
        self._batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._position[ids], self._turn[ids] = position, turn
        self._qpos[ids, :3], self._qpos[ids, 3:] = root, angle.reshape(len(ids), -1)
        self._qvel[ids, :3], self._qvel[ids, 3:] = root_velocity, velocity.reshape(len(ids), -1)
        for state, given in ((self._qpos, root), (self._qvel, root_velocity)):
            state[ids, 1] += self._ground[ids, 0] * given[:, 0]

    def lay(self, ids: NDArray, slope: NDArray, height: NDArray) -> None:
        """Give simulations `ids` (K,) ground of a slope (K,) [rad], uphill positive, whose plane below each foot lies
        `height` (K, side) [m] above the mean one, which goes through the origin."""
        for index, angle, heights in zip(ids.tolist(), slope.tolist(), height, strict=True):
            self._ground[index] = tan(angle), *heights
            self._position[index, :, 2] = heights  # mocap bodies are the grounds, in the order of SIDES
            self._turn[index] = cos(angle / 2), 0.0, -sin(angle / 2), 0.0

    def push(self, force: NDArray) -> None:
        """Hold a horizontal force [N], (N,), on the trunk's CoM until told otherwise."""
        self._push[:, 0] = force

    def advance(self, ids: NDArray | None = None) -> Measurement:
        """Run one control window with `control` held; the measurement of all N at its end.

        Only simulations `ids` run, all by default; the others stay as they are, and their forces read 0.
        """
        if ids is None:
            self._batch.rollout(self._substeps, record=["sensordata"], out=self._record)
        else:
            self._sensors[:] = 0.0
            if len(ids):
                self._record["sensordata"][ids] = self._batch.rollout(self._substeps, record=["sensordata"], ids=ids)[
                    "sensordata"
                ]
        return self._measure(self.control)

    def measure(self) -> Measurement:
        """The state as it stands, with no torque and no force: what is known right after a reset."""
        self._sensors[:] = 0.0
        return self._measure(self._no_control)

    def data(self, index: int) -> mujoco.MjData:
        """A copy of one simulation's state after `mj_forward`, to render or to inspect."""
        data = self._batch.get_data(index)
        mujoco.mj_forward(self.models[index], data)
        return data

    def _measure(self, control: NDArray) -> Measurement:
        legs, feet = (self.num, len(SIDES), len(JOINTS)), (self.num, len(SIDES), len(CONTACTS), 2)
        m = Measurement(
            time=self._time.copy(),
            root=np.empty((self.num, 3)),
            root_velocity=np.empty((self.num, 3)),
            angle=np.empty(legs),
            velocity=np.empty(legs),
            torque=np.empty(legs),
            com=np.empty((self.num, 2)),
            com_velocity=np.empty((self.num, 2)),
            ankle=np.empty((self.num, len(SIDES), 2)),
            contact=np.empty(feet),
            force=np.empty(feet),
            diverged=np.empty(self.num, int),
        )
        state = self._segments, self._ground, self._qpos, self._qvel, control, self._sensors, self._warnings
        legs = m.root, m.root_velocity, m.angle, m.velocity, m.torque
        _measure(*state, *legs, m.com, m.com_velocity, m.ankle, m.contact, m.force, m.diverged)
        return m


@kernel
def _measure(
    segments,
    ground,
    position,
    rate,
    control,
    sensors,
    warnings,
    root,
    root_velocity,
    angle,
    velocity,
    torque,
    com,
    com_velocity,
    ankle,
    contact,
    force,
    diverged,
):
    for i in range(len(root)):
        for k in range(3):
            root[i, k], root_velocity[i, k] = position[i, k], rate[i, k]
        _read_joints(segments[i], position[i], rate[i], control[i], angle[i], velocity[i], torque[i])
        _locate(segments[i], position[i], rate[i], com[i], com_velocity[i], ankle[i], contact[i])
        _above(ground[i], root[i], root_velocity[i], com[i], com_velocity[i], ankle[i], contact[i])
        _average(sensors[i], force[i])
        diverged[i] = -1
        for kind in range(warnings.shape[1] - 1, -1, -1):
            if warnings[i, kind] > 0:
                diverged[i] = kind


@kernel
def _read_joints(segments, position, rate, control, angle, velocity, torque):
    beta, limit = segments.beta, segments.limit
    for side in range(2):
        for joint in range(4):
            theta, theta_rate = position[3 + 4 * side + joint], rate[3 + 4 * side + joint]
            stiffness, drive = control[side, joint]
            spring = drive - stiffness * (theta + beta[joint] * theta_rate)
            angle[side, joint], velocity[side, joint] = theta, theta_rate
            torque[side, joint] = min(max(spring, -limit[joint]), limit[joint])


@kernel
def _average(sensors, force):
    steps = len(sensors)
    for side in range(2):
        for contact in range(3):
            forward = up = 0.0
            for step in range(steps):
                forward += sensors[step, side, contact, 0]
                up += sensors[step, side, contact, 2]
            force[side, contact, 0], force[side, contact, 1] = forward / steps, up / steps


SEGMENTS = np.dtype(
    [
        ("trunk", float, 2),  # part of trunk and load in hip -> CoM [m], in the trunk's frame (forward, up)
        ("part", float, (len(JOINTS), 2)),  # that of thigh, shank, foot and toe: see _segments
        ("end", float, (len(JOINTS), 2)),  # from a segment's joint to the next one [m], in its own frame
        ("contact", float, (len(CONTACTS), 2)),  # contact sphere's centre from ankle (heel, ball) or toe joint [m]
        ("radius", float, len(CONTACTS)),
        ("beta", float, len(JOINTS)),  # [s]
        ("limit", float, len(JOINTS)),  # [N m]
    ]
)
"""A body as its kinematics and springs need it."""


def _segments(body: Body) -> NDArray:
    """(1,) of `SEGMENTS`.

    The CoM is the hip plus one offset for each segment, turned with it: its own share of the mass times its CoM, plus
    the share of all that hangs from its far end times that end.
    """
    foot, toe = body.foot_mass, body.toe_mass
    beyond_knee = body.shank_mass + foot + toe
    forward, below = body.foot_com
    toe_joint = (body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height)
    offsets = contact_offsets(body)
    segments = np.zeros(1, SEGMENTS)
    segments["trunk"] = np.array(body.upper_moment) / body.total_mass
    segments["part"] = (
        np.array(
            [
                (0.0, -(body.thigh_mass * body.thigh_com + beyond_knee * body.thigh_length)),
                (0.0, -(body.shank_mass * body.shank_com + (foot + toe) * body.shank_length)),
                (foot * forward + toe * toe_joint[0], -foot * below + toe * toe_joint[1]),
                (toe * body.toe_com, 0.0),
            ]
        )
        / body.total_mass
    )
    segments["end"] = [(0.0, -body.thigh_length), (0.0, -body.shank_length), toe_joint, (0.0, 0.0)]
    segments["contact"] = [(forward, up) for forward, up, _ in offsets.values()]
    segments["radius"] = [radius for *_, radius in offsets.values()]
    segments["beta"], segments["limit"] = damping_times(body), torque_limits(body)
    return segments


@kernel
def _locate(segments, position, rate, com, com_velocity, ankle, contact):
    """Planar forward kinematics.

    A segment turned up-forward by s (a thigh's flexion, a foot's toes-up pitch) carries the offset (u, w) in its frame
    to (u cos s - w sin s, u sin s + w cos s), and spinning at ds/dt moves it at ds/dt (-z, x).
    """
    hip_x, hip_z, pitch = position[0], position[1], position[2]
    x, z = _turned(segments.trunk, cos(-pitch), sin(-pitch))
    com_x, com_z = hip_x + x, hip_z + z
    com_rate_x, com_rate_z = rate[0] + z * rate[2], rate[1] - x * rate[2]
    for side in range(2):
        joint_x, joint_z, turn, spin = hip_x, hip_z, -pitch, -rate[2]
        for joint in range(4):
            sign = -1.0 if joint == KNEE else 1.0  # a bent knee turns the shank back
            turn += sign * position[3 + 4 * side + joint]
            spin += sign * rate[3 + 4 * side + joint]
            c, s = cos(turn), sin(turn)
            x, z = _turned(segments.part[joint], c, s)
            com_x, com_z = com_x + x, com_z + z
            com_rate_x, com_rate_z = com_rate_x - z * spin, com_rate_z + x * spin
            if joint == ANKLE:
                ankle[side, 0], ankle[side, 1] = joint_x, joint_z
            for k in range(3):
                if joint == (ANKLE if k == 0 else TOE):  # the heel is on the foot
                    x, z = _turned(segments.contact[k], c, s)
                    contact[side, k, 0], contact[side, k, 1] = joint_x + x, joint_z + z - segments.radius[k]
            x, z = _turned(segments.end[joint], c, s)
            joint_x, joint_z = joint_x + x, joint_z + z
    com[0], com[1], com_velocity[0], com_velocity[1] = com_x, com_z, com_rate_x, com_rate_z


@kernel
def _above(ground, root, root_velocity, com, com_velocity, ankle, contact):
    """From the world's heights to those above the ground."""
    slope = ground[0]
    for position, velocity in ((root, root_velocity), (com, com_velocity)):
        position[1] -= slope * position[0]
        velocity[1] -= slope * velocity[0]
    for side in range(2):
        ankle[side, 1] -= slope * ankle[side, 0]
        for k in range(3):
            contact[side, k, 1] -= slope * contact[side, k, 0] + ground[1 + side]


@kernel
def _turned(offset, c, s):
    return offset[0] * c - offset[1] * s, offset[0] * s + offset[1] * c
