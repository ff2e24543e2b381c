"""Simulate N bodies side by side on `mujoco.batch.Batch`: the only owner of MuJoCo data, the only reader of sensors.

One call of `advance` is one control window of 10 ms: it holds the control and runs the physics steps. The kernel
`measure_bodies` then fills a `Measurement`: kinematics from joint positions at the window's end, as MuJoCo's derived
fields lag one physics step, and the mean contact forces of the window's steps, so that no heel strike is missed.
"""

from collections.abc import Sequence
from functools import lru_cache, partial
from math import cos, sin, tan
from typing import Any, NamedTuple, TypeAlias

import mujoco
import numpy as np
from mujoco.batch import Batch

from springfoot.arrays import NDArray
from springfoot.errors import MOST_THREADS, SpringfootError, require_count
from springfoot.gait.body.body import Body

from .contact import CONTACTS, FRICTION
from .energy import RECORDED, StepRecord, WindowWork, parts_of, window_work
from .foot import SOUND, Feet, act_one_way
from .measurement import BODY_ROW, DEGREES, Measurement, measure_bodies, segments_of
from .model import JOINTS, SIDES, build_model, springs_of
from .muscles import forget, muscles_of
from .timing import CONTROL_WINDOW

MjModel: TypeAlias = Any
"""A `mujoco.MjModel`; MuJoCo has no type stubs, and its unknown types would be unknown in our users' files."""
MjData: TypeAlias = Any
"""A `mujoco.MjData`, likewise."""


MOST_MODELS = 64
"""Compiled models that a simulation keeps for bodies and feet to come; chosen, 0.3 MB each."""
SENSORS = "sensordata"
"""MuJoCo's field of the contact forces."""


class Physics(NamedTuple):
    """The arrays of a simulation that kernels read and write."""

    bodies: NDArray
    """(N,) of `BODY_ROW`."""
    state: NDArray
    """(N, numbers) MuJoCo's state, with rows that begin as `PLANT`."""
    sensors: NDArray
    """(N, S, side, contact, 3) contact forces of the last window's S physics steps [N]."""
    velocity: NDArray
    """(N, S, D) velocities after those steps [m/s, rad/s]."""
    warnings: NDArray
    """(N, kinds) how often MuJoCo has warned of each kind since the episode began."""


class Simulation:
    """N simulations; all simulate the same body until `fit` gives some of them another.

    Args:
        body: the body that is simulated.
        num: N.
        threads: of the physics, up to `MOST_THREADS`; any number gives the same bits.
        model: a custom model of that body in place of the default, for instance one with another part of
            `CONTROL_WINDOW` as its timestep.
        friction: coefficient of friction between feet and ground in the default models [-].
        feet: N pairs, the feet of each simulation; sound ones if None.
        one_way: whether `fit` may give a simulation an orthosis that acts one way, even if these `feet` have none.
        loaded: whether `fit` may give a simulation a load, even if this `body` has none.
    """

    def __init__(
        self,
        body: Body,
        num: int,
        threads: int = 1,
        model: MjModel | None = None,
        friction: float = FRICTION,
        feet: Sequence[Feet] | None = None,
        one_way: bool = False,
        loaded: bool = False,
    ):
        self.body = body
        self.num = num
        self.feet = [SOUND] * num if feet is None else list(feet)
        """The left and the right foot of each simulation."""
        one_way = one_way or any(map(act_one_way, self.feet))  # all models of a batch have the same elements
        self._build = lru_cache(MOST_MODELS)(partial(build_model, friction=friction, one_way=one_way, loaded=loaded))
        built = {pair: model or self._build(body, feet=pair) for pair in dict.fromkeys(self.feet)}
        self.model = built[self.feet[0]]
        self.models = [built[pair] for pair in self.feet]
        """The compiled model of each simulation."""
        # Coordinates, their rates, no states of actuators, and two actuators for each joint, the trunk's three left
        # out.
        if (self.model.nq, self.model.nv, self.model.na, self.model.nu) != (DEGREES, DEGREES, 0, 2 * (DEGREES - 3)):
            raise SpringfootError("a custom model must have the joints and the actuators of the default one")
        self._custom_model = model is not None
        if model is not None:
            _require_usable_steps(model)
        self._substeps = round(CONTROL_WINDOW / self.model.opt.timestep)
        self._batch = Batch(self.model, num, require_count("threads", threads, 1, MOST_THREADS))
        if len(built) > 1:
            self._batch.set_models(self.models)
        state = self._batch.state
        self._qpos = self._batch.bind("qpos")
        self._qvel = self._batch.bind("qvel")
        self._control = self._batch.bind("ctrl").reshape(num, len(SIDES), len(JOINTS), 2)
        self._push = self._batch.bind("xfrc_applied")[:, self.model.body("trunk").id]
        self._position = self._batch.bind("mocap_pos")
        self._turn = self._batch.bind("mocap_quat")
        bodies = np.zeros(num, BODY_ROW)
        bodies["segments"] = np.concatenate([segments_of(body, pair) for pair in self.feet])
        if model is not None:  # its springs may differ from the default ones
            bodies["segments"]["beta"], bodies["segments"]["torque"] = springs_of(model)
        bodies["muscles"]["muscles"] = np.concatenate([muscles_of(body, pair) for pair in self.feet])
        self._parts = np.concatenate([parts_of(body, pair) for pair in self.feet])
        self._ground = bodies["ground"]
        sensors = np.zeros((num, self._substeps, len(SIDES), len(CONTACTS), 3))
        velocity = np.zeros((num, self._substeps, self.model.nv))
        self.arrays = Physics(bodies, state, sensors, velocity, self._batch.warning[:, :, 1])
        """Arrays that kernels read and write."""
        self.now = Measurement.of(bodies["measured"])
        """The last measurement; its arrays change in place."""
        self._record = {
            SENSORS: sensors.reshape(num, self._substeps, self.model.nsensordata),
            "qvel": velocity,
        }
        self._control_before = np.full(self._control.shape, np.nan)  # in the last window that was watched; NaN for none
        self.kept = {"body": bodies, "mujoco": state, "warnings": self._batch.warning, "held": self._control_before}
        """Name -> array with N rows, of everything that changes."""
        self.work: WindowWork
        """Torque, work and energy in the last window that was watched."""

    def fit(self, ids: Sequence[int], bodies: Sequence[Body], pairs: Sequence[Feet]) -> None:
        """Simulate `bodies` (K,) on the feet `pairs` (K,) in simulations `ids` (K,) from their next reset on.

        Compiling a model takes about 1.5 ms. Raises `SpringfootError` for a simulation built from a custom model.
        """
        if self._custom_model:
            raise SpringfootError(
                "cannot change bodies or feet in a simulation built from a custom model; omit `model`, "
                "or drop height_range, mass_range, drawn_bodies and drawn_feet"
            )
        for index, body, feet in zip(ids, bodies, pairs, strict=True):
            self.feet[index] = feet
            self.models[index] = self._build(body, feet=feet)
            self.arrays.bodies["segments"][index] = segments_of(body, feet)[0]
            self.arrays.bodies["muscles"]["muscles"][index] = muscles_of(body, feet)[0]
            self._parts[index] = parts_of(body, feet)[0]
        self._batch.set_models(self.models)

    def reset(self, ids: NDArray, base: NDArray, base_velocity: NDArray, angle: NDArray, velocity: NDArray) -> None:
        """Put simulations `ids` (K,) into the given states, and clear their warnings and time.

        Args:
            ids: (K,) indices.
            base: (K, 3) hip x [m], height of the hip above the mean ground [m], trunk pitch [rad].
            base_velocity: (K, 3) its rate [m/s, m/s, rad/s].
            angle: (K, side, joint) joint angles [rad].
            velocity: (K, side, joint) joint velocities [rad/s].
        """
        position = self._position[ids]
        turn = self._turn[ids]  # MuJoCo's reset would put the ground back to level
        self._batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE)
        self._position[ids] = position
        self._turn[ids] = turn
        self._control_before[ids] = np.nan
        self._qpos[ids, :3] = base
        self._qpos[ids, 3:] = angle.reshape(len(ids), -1)
        self._qvel[ids, :3] = base_velocity
        self._qvel[ids, 3:] = velocity.reshape(len(ids), -1)
        # z above the ground -> z in the world, and its rate: + tangent of the slope x x.
        for state, above_ground in ((self._qpos, base), (self._qvel, base_velocity)):
            state[ids, 1] += self._ground[ids, 0] * above_ground[:, 0]

    def lift(self, ids: NDArray, height: NDArray) -> None:
        """Lift simulations `ids` (K,) by `height` (K,) [m]."""
        self._qpos[ids, 1] += height

    def lay(self, ids: NDArray, slope: NDArray, height: NDArray) -> None:
        """Give simulations `ids` (K,) sloping ground.

        Args:
            ids: (K,) indices.
            slope: (K,) slope of the mean ground, a plane through the origin, uphill positive [rad].
            height: (K, side) height of the ground below each foot above the mean ground [m].
        """
        for index, angle, heights in zip(ids.tolist(), slope.tolist(), height, strict=True):
            self._ground[index] = tan(angle), *heights
            self._position[index, :, 2] = heights  # mocap bodies are the grounds, in the order of SIDES
            self._turn[index] = cos(angle / 2), 0.0, -sin(angle / 2), 0.0  # quaternion of a turn about y, uphill

    def push(self, force: NDArray) -> None:
        """Let a horizontal force (N,), forward positive [N], act on the CoM of the trunk until the next call."""
        self._push[:, 0] = force

    def advance(self, control: NDArray, ids: NDArray | None = None, *, watched: bool = False) -> None:
        """Run one control window with `control` held; nothing else writes the control of the joints.

        Args:
            control: (N, side, joint, 2) K [N m/rad], and K theta_eq plus any feed-forward torque [N m].
            ids: (K,) the simulations that run, all if None. The others stay as they are, contact forces included.
            watched: whether to fill `work` for this window, with 0 for simulations not in `ids`; else it keeps its last
                values. The motion has the same bits either way.
        """
        self._control[...] = control
        if watched:
            self._roll_watched(ids)
        else:
            self._roll(ids, self._record)

    def _roll_watched(self, ids: NDArray | None) -> None:
        """Run the physics steps of a window in simulations `ids` (K,), all if None, and fill `work` from their
        record."""
        velocity = self.arrays.velocity
        actuator, passive, constraint = (np.zeros_like(velocity) for _ in range(3))
        steps = StepRecord(self._qvel.copy(), self._qpos[:, 2].copy(), velocity, actuator, passive, constraint)
        angle = self._qpos[:, 3:].reshape(self._control.shape[:3]).copy()
        self._roll(ids, self._record | dict(zip(RECORDED, steps[2:], strict=True)))  # behind `before` and `pitch`
        state = self._qpos, self._qvel
        push = self._push[:, 0].copy()
        timestep = self.model.opt.timestep
        control_before = self._control_before.copy()
        if ids is not None:  # simulations that rest do no work
            still = np.setdiff1d(np.arange(self.num), ids)
            control_before[still] = np.nan
            steps.before[still] = 0.0
            push[still] = 0.0
        self.work = window_work(self._parts, steps, self._control, control_before, angle, push, state, timestep)
        self._control_before[:] = self._control

    def _roll(self, ids: NDArray | None, out: dict[str, NDArray]) -> None:
        """Run the physics steps of a window in simulations `ids` (K,), all if None.

        `out` maps names of MuJoCo's fields to the arrays (N, S, numbers) that record them. For the simulations that
        rest, the sensors stay and all other records are 0.
        """
        if ids is None:
            self._batch.rollout(self._substeps, record=tuple(out), out=out)
            return
        for name, values in out.items():
            if name != SENSORS:
                values[:] = 0.0
        if len(ids):
            recorded = self._batch.rollout(self._substeps, record=list(out), ids=ids)
            for name, values in out.items():
                values[ids] = recorded[name]

    def measure(self, ids: NDArray | slice = slice(None)) -> Measurement:
        """Measure all simulations after a reset of `ids`, and return the measurement of all N, which changes in place.

        Simulations `ids` get torques and contact forces of 0, and their muscles' sums begin anew.
        """
        self._measure_without_forces(ids)
        self.now.torque[ids] = 0.0
        forget(self.arrays.bodies["muscles"], ids, self.now.angle, self.now.velocity)
        return self.now

    def contact_points(self, ids: NDArray | slice) -> NDArray:
        """Return the lowest points (K, side, contact, 2) of the contacts of simulations `ids` (K,) in the present
        posture: x and the height above the ground [m]."""
        self._measure_without_forces(ids)
        return self.now.contact[ids]

    def _measure_without_forces(self, ids: NDArray | slice) -> None:
        """Measure all simulations, those of `ids` (K,) without contact forces."""
        self.arrays.sensors[ids] = 0.0
        measure_bodies(*self.arrays)

    def data(self, index: int) -> MjData:
        """Return a copy of the state of simulation `index` after `mj_forward`, to render or to inspect."""
        data = self._batch.get_data(index)
        mujoco.mj_forward(self.models[index], data)
        return data


def _require_usable_steps(model: MjModel) -> None:
    """Raise `SpringfootError` unless the physics steps of a custom model fill a control window and move the joints by
    the velocity after a step, as the work of the muscles takes for granted."""
    steps = CONTROL_WINDOW / model.opt.timestep
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-9:
        raise SpringfootError(
            f"a custom model's timestep must be a whole part of {CONTROL_WINDOW:g} s, got {model.opt.timestep:g} s"
        )
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise SpringfootError("a custom model's integrator must be Euler, implicit or implicitfast, got RK4")
