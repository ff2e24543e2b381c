"""N bodies walking side by side on `mujoco.batch.Batch`: the only owner of MuJoCo data and the only reader of sensors.

One call of `advance` is one control window of 10 ms: it holds the controls, runs the physics steps and returns a
`Measurement`. Kinematics are computed here from joint positions at the window's end (MuJoCo's derived fields lag one
physics step); contact forces are the mean over the window's physics steps, so that no heel strike is missed.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from springfoot.gait.body import Body

from .model import (
    CONTACTS,
    JOINTS,
    SIDES,
    TIMESTEP,
    build_model,
    contact_offsets,
    damping_times,
    torque_limits,
)

WINDOW = 0.01
"""Control window [s]: controls are held and forces averaged over it."""
STEPS_PER_WINDOW = round(WINDOW / TIMESTEP)


@dataclass(frozen=True, kw_only=True, eq=False)
class Measurement:
    """What is known of N bodies at the end of one control window; SI units, world x forward, z up.

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
    """(N,) names of MuJoCo warnings raised in the window, "" where all is well."""


class Simulation:
    """N simulations of one body.

    Args:
        body: whose model is simulated.
        num: N.
        threads: of the physics; any number gives the same bits.
        model: the body's model with other options, such as a timestep that divides `WINDOW`, in place of the default.
    """

    def __init__(self, body: Body, num: int, threads: int = 1, model: mujoco.MjModel | None = None):
        self.body = body
        self.num = num
        self.model = model or build_model(body)
        self._substeps = round(WINDOW / self.model.opt.timestep)
        self._batch = Batch(self.model, num, threads)
        self._qpos = self._batch.bind("qpos")
        self._qvel = self._batch.bind("qvel")
        self._ctrl = self._batch.bind("ctrl")
        self._time = self._batch.bind("time")
        self._push = self._batch.bind("xfrc_applied")[:, self.model.body("trunk").id]
        self._record = {"sensordata": np.empty((num, self._substeps, self.model.nsensordata))}
        self._geometry = _Geometry(body)
        self._beta = damping_times(body)
        self._limit = torque_limits(body)

    def reset(self, ids: NDArray, root: NDArray, root_velocity: NDArray, angle: NDArray, velocity: NDArray) -> None:
        """Put simulations `ids` (K,) into the states given: (K, 3), (K, 3), (K, side, joint), (K, side, joint)."""
        self._batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._qpos[ids, :3], self._qpos[ids, 3:] = root, angle.reshape(len(ids), -1)
        self._qvel[ids, :3], self._qvel[ids, 3:] = root_velocity, velocity.reshape(len(ids), -1)

    def push(self, force: NDArray) -> None:
        """Hold a horizontal force [N], (N,), on the trunk's CoM until told otherwise."""
        self._push[:, 0] = force

    def advance(self, stiffness: NDArray, drive: NDArray, ids: NDArray | None = None) -> Measurement:
        """Run one control window.

        Args:
            stiffness: (N, side, joint) K [N m/rad], held.
            drive: (N, side, joint) K theta_eq plus any feed-forward torque [N m], held.
            ids: which simulations run; the others stay as they are, and their forces read 0. None: all.

        Returns:
            The measurement at the window's end, of all N.
        """
        ctrl = self._ctrl.reshape(self.num, len(SIDES), len(JOINTS), 2)
        ctrl[..., 0], ctrl[..., 1] = stiffness, drive
        warnings = self._batch.warning[:, :, 1].copy()
        if ids is None:
            sensors = self._batch.rollout(self._substeps, record=["sensordata"], out=self._record)["sensordata"]
            force = sensors.mean(axis=1)
        else:
            force = np.zeros((self.num, self.model.nsensordata))
            if len(ids):
                force[ids] = self._batch.rollout(self._substeps, record=["sensordata"], ids=ids)["sensordata"].mean(1)
        raised = self._batch.warning[:, :, 1] > warnings
        force = force.reshape(self.num, len(SIDES), len(CONTACTS), 3)[..., [0, 2]]
        return self._measure(stiffness, drive, force, _warning_names(raised))

    def measure(self) -> Measurement:
        """The state as it stands, with no torque and no force: what is known right after a reset."""
        none = np.zeros((self.num, len(SIDES), len(JOINTS)))
        force = np.zeros((self.num, len(SIDES), len(CONTACTS), 2))
        return self._measure(none, none, force, np.full(self.num, "", dtype=_NAME))

    def data(self, index: int) -> mujoco.MjData:
        """A copy of one simulation's state after `mj_forward`, to render or to inspect."""
        data = self._batch.get_data(index)
        mujoco.mj_forward(self.model, data)
        return data

    def _measure(self, stiffness: NDArray, drive: NDArray, force: NDArray, diverged: NDArray) -> Measurement:
        position, rate = self._qpos.copy(), self._qvel.copy()
        angle = position[:, 3:].reshape(self.num, len(SIDES), len(JOINTS))
        velocity = rate[:, 3:].reshape(self.num, len(SIDES), len(JOINTS))
        torque = drive - stiffness * (angle + self._beta * velocity)
        com, com_velocity, ankle, contact = self._geometry.locate(position, rate)
        return Measurement(
            time=self._time.reshape(self.num).copy(),
            root=position[:, :3],
            root_velocity=rate[:, :3],
            angle=angle,
            velocity=velocity,
            torque=np.clip(torque, -self._limit, self._limit),
            com=com,
            com_velocity=com_velocity,
            ankle=ankle,
            contact=contact,
            force=force,
            diverged=diverged,
        )


_NAME = "U32"


def _warning_names(raised: NDArray) -> NDArray:
    """(N, warning) -> (N,) the first warning's name without its prefix, or ""."""
    names = np.full(len(raised), "", dtype=_NAME)
    if raised.any():
        for index in np.flatnonzero(raised.any(axis=1)):
            names[index] = mujoco.mjtWarning(int(raised[index].argmax())).name.removeprefix("mjWARN_")
    return names


class _Geometry:
    """Planar forward kinematics of one body, as sums over segments.

    A segment turned up-forward by the angle s (a thigh's flexion, a foot's toes-up pitch) carries the local offset
    (u, w) to (u cos s - w sin s, u sin s + w cos s). The CoM is the hip plus one such offset for each segment: its
    own share of the mass times its CoM, plus all that hangs from its far end.
    """

    def __init__(self, body: Body):
        foot, toe = body.foot_mass, body.toe_mass
        beyond_knee = body.shank_mass + foot + toe
        forward, below = body.foot_com
        drop = body.ankle_height - body.toe_joint_height
        thigh = (0.0, -(body.thigh_mass * body.thigh_com + beyond_knee * body.thigh_length))
        shank = (0.0, -(body.shank_mass * body.shank_com + (foot + toe) * body.shank_length))
        ankle = (foot * forward + toe * body.ankle_to_toe_joint, -(foot * below + toe * drop))
        joint = (toe * body.toe_com, 0.0)
        trunk = (0.0, body.trunk_mass * body.trunk_com_above_hip)
        self._com = np.array([trunk, *([thigh, shank, ankle, joint] * len(SIDES))]).T / body.mass  # (2, segment)
        self._thigh, self._shank = body.thigh_length, body.shank_length
        offsets = contact_offsets(body)
        lowest = np.array([(u, w) for u, w, _ in offsets.values()])
        self._radius = np.array([radius for *_, radius in offsets.values()])
        # contact centres = ankle + foot-frame offset (heel; ball; toe joint) + toe-frame offset (0; 0; toe sphere)
        self._foot = np.array([lowest[0], lowest[1], (body.ankle_to_toe_joint, -drop)]).T
        self._toe = np.array([(0, 0), (0, 0), lowest[2]], float).T

    def locate(self, position: NDArray, rate: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """(N, 11) positions and rates -> com (N, 2), its velocity (N, 2), ankles (N, side, 2), contacts."""
        num = len(position)
        turn = self._segment_angles(position)
        spin = self._segment_angles(rate)
        cos, sin = np.cos(turn), np.sin(turn)
        u, w = self._com
        across, up = cos * u - sin * w, sin * u + cos * w  # each segment's part of hip -> CoM
        com = np.stack([position[:, 0] + across.sum(-1), position[:, 1] + up.sum(-1)], axis=-1)
        velocity = np.stack([rate[:, 0] - (up * spin).sum(-1), rate[:, 1] + (across * spin).sum(-1)], axis=-1)
        cos, sin = (value[:, 1:].reshape(num, len(SIDES), len(JOINTS)) for value in (cos, sin))
        ankle_x = position[:, :1] + self._thigh * sin[..., 0] + self._shank * sin[..., 1]
        ankle_z = position[:, 1:2] - self._thigh * cos[..., 0] - self._shank * cos[..., 1]
        (fu, fw), (tu, tw) = self._foot, self._toe
        foot_cos, foot_sin, toe_cos, toe_sin = cos[..., 2:3], sin[..., 2:3], cos[..., 3:4], sin[..., 3:4]
        x = ankle_x[..., None] + foot_cos * fu - foot_sin * fw + toe_cos * tu - toe_sin * tw
        z = ankle_z[..., None] + foot_sin * fu + foot_cos * fw + toe_sin * tu + toe_cos * tw - self._radius
        return com, velocity, np.stack([ankle_x, ankle_z], axis=-1), np.stack([x, z], axis=-1)

    @staticmethod
    def _segment_angles(position: NDArray) -> NDArray:
        """(N, 11) -> (N, 9) turn of trunk, then thigh, shank, foot, toe of each side, towards up-forward."""
        turn = np.empty((len(position), 1 + len(SIDES) * len(JOINTS)))
        turn[:, 0] = -position[:, 2]
        joints = position[:, 3:].reshape(len(position), len(SIDES), len(JOINTS))
        legs = turn[:, 1:].reshape(joints.shape)
        legs[..., 0] = joints[..., 0] - position[:, 2:3]
        legs[..., 1] = legs[..., 0] - joints[..., 1]
        legs[..., 2] = legs[..., 1] + joints[..., 2]
        legs[..., 3] = legs[..., 2] + joints[..., 3]
        return turn
