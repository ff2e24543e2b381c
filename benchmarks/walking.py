"""Record a walk, and run its physics alone, which every step of ours is held against."""

import time
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from gymnasium.vector import AutoresetMode
from mujoco.batch import Batch
from numpy.typing import NDArray

from springfoot.envs.batch.step_result import Tick
from springfoot.envs.control.stiffness_control import action_of
from springfoot.envs.physics.model import build_model
from springfoot.envs.physics.timing import CONTROL_WINDOW, WINDOWS_PER_ACTION_STEP
from springfoot.envs.settings import BipedSettings
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.gait.body.body import Body

from .timing import Case, clock_cost

SEED = 0
STEP = WINDOWS_PER_ACTION_STEP * CONTROL_WINDOW
"""Simulated time of one environment step [s]."""
STUDY_TIMESTEP = 0.001
"""Physics step of the first throw-away study [s]; integrator, solver and cone as ours, flags as MuJoCo's default."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Walk:
    """T steps of N bodies on the fixed schedule of the leg tuning, seeded `SEED` + i: the same bits in any batch."""

    actions: NDArray
    """(T, N, 4) float32."""
    position: NDArray
    """(T, N, nq) at the beginning of each step."""
    velocity: NDArray
    """(T, N, nv)."""
    controls: NDArray
    """(T, WINDOWS_PER_ACTION_STEP, N, nu) held in each control window."""


def record_walk(num: int, steps: int) -> Walk:
    """Let `num` bodies walk `steps` steps; none may fall."""
    env = vector(num)
    biped = env.biped
    ticks = list[Tick]()
    biped.on_tick = ticks.append
    env.reset(seed=SEED)
    actions = []
    position = []
    velocity = []
    for _ in range(steps):
        now = biped.measurement
        position.append(np.concatenate([now.base, now.angle.reshape(num, -1)], axis=1))
        velocity.append(np.concatenate([now.base_velocity, now.velocity.reshape(num, -1)], axis=1))
        action = action_of(biped.scheduled_stiffness(), biped.settings, biped.body)
        actions.append(action.reshape(num, -1).astype(np.float32))
        _, _, terminated, *_ = env.step(actions[-1])
        assert not terminated.any(), "the bench measures walking"
    held = [np.stack([tick.stiffness, tick.stiffness * tick.equilibrium], -1).reshape(num, -1) for tick in ticks]
    return Walk(
        actions=np.stack(actions),
        position=np.stack(position),
        velocity=np.stack(velocity),
        controls=np.stack(held).reshape(steps, WINDOWS_PER_ACTION_STEP, num, -1),
    )


def vector(num: int, threads: int = 1, **settings: Any) -> SegmentedFootBipedVector:
    """Our batch as it is used in training: episodes that end begin anew in the same step."""
    return SegmentedFootBipedVector(num, num_threads=threads, autoreset_mode=AutoresetMode.SAME_STEP, **settings)


def study_model() -> mujoco.MjModel:
    """Our model at the study's settings."""
    model = build_model(Body())
    model.opt.timestep = STUDY_TIMESTEP
    model.opt.disableflags = 0
    return model


class Physics:
    """`mj_step(model, data, nstep)` for the first N bodies of a walk, and nothing else."""

    def __init__(self, model: mujoco.MjModel, num: int) -> None:
        self.model = model
        self.substeps = round(CONTROL_WINDOW / model.opt.timestep)
        self.bodies = [mujoco.MjData(model) for _ in range(num)]
        self._clock = clock_cost()

    def place(self, walk: Walk, step: int) -> None:
        """Put all bodies where they were at the beginning of a step of the walk."""
        for index, data in enumerate(self.bodies):
            data.qpos[:] = walk.position[step, index]
            data.qvel[:] = walk.velocity[step, index]

    def step(self, walk: Walk, step: int) -> float:
        """Repeat one step from where the bodies are, with the walk's controls; CPU time of the physics [s]."""
        spent = 0.0
        for controls in walk.controls[step]:
            for data, control in zip(self.bodies, controls, strict=False):
                data.ctrl[:] = control
            begin = time.process_time()
            for data in self.bodies:
                mujoco.mj_step(self.model, data, self.substeps)
            spent += time.process_time() - begin - self._clock
        return spent


def step_over_physics(walk: Walk, num: int, rounds: int) -> tuple[NDArray, float]:
    """Return the CPU time [s] of (full step, its physics, the study's), taking turns step by step: (3, rounds x steps).

    Also the largest difference [m, rad] between the walk of the full step and of its physics alone after a round.
    """
    env = vector(num)
    ours = Physics(env.biped.model, num)
    study = Physics(study_model(), num)
    clock = clock_cost()
    spent = np.empty((3, rounds + 1, len(walk.actions)))
    apart = 0.0
    for round_ in range(rounds + 1):
        env.reset(seed=SEED)
        for data in ours.bodies:
            mujoco.mj_resetData(ours.model, data)
        ours.place(walk, 0)
        for step, actions in enumerate(walk.actions[:, :num]):
            begin = time.process_time()
            env.step(actions)
            spent[0, round_, step] = time.process_time() - begin - clock
            spent[1, round_, step] = ours.step(walk, step)  # walks on by itself: the same bits
            study.place(walk, step)  # would walk another way after a while
            spent[2, round_, step] = study.step(walk, step)
        angle = env.biped.measurement.angle.reshape(num, -1)
        apart = max(apart, *(float(np.abs(data.qpos[3:] - angle[i]).max()) for i, data in enumerate(ours.bodies)))
    return spent[:, 1:].reshape(3, -1), apart


PRICED = {"fibre_work": -1.0, "activation": -1.0, "impact": -1.0}
"""Terms of the reward that price a walk -> a weight, which is 0 by default."""


def step_over_plain(walk: Walk, num: int, rounds: int) -> dict[str, float]:
    """Return the CPU time of a full step of N bodies over that of the default settings, by name of the ratio.

    The steps take turns; each ratio is the median over rounds x steps.
    """
    weights = BipedSettings().reward_weights
    envs = {
        "plain": vector(num),
        "priced_over_plain": vector(num, reward_weights={**weights, **PRICED}),
        "learned_person_over_constants": vector(num, person="learned"),
    }
    clock = clock_cost()
    spent = np.empty((len(envs), rounds + 1, len(walk.actions)))
    for round_ in range(rounds + 1):
        for env in envs.values():
            env.reset(seed=SEED)
        for step, actions in enumerate(walk.actions[:, :num]):
            for index, env in enumerate(envs.values()):
                begin = time.process_time()
                env.step(actions)
                spent[index, round_, step] = time.process_time() - begin - clock
    ratios = np.median(spent[:, 1:] / spent[:1, 1:], axis=(1, 2))
    return {name: float(ratio) for name, ratio in zip(envs, ratios, strict=True) if name != "plain"}


def batch_case(walk: Walk, num: int, threads: int) -> Case:
    """Return `mujoco.batch.Batch` alone, stepped through the walk's controls."""
    model = build_model(Body())
    batch = Batch(model, num, threads)
    substeps = round(CONTROL_WINDOW / model.opt.timestep)
    position, velocity, control = (batch.bind(name) for name in ("qpos", "qvel", "ctrl"))
    controls = walk.controls[:, :, :num].reshape(-1, num, model.nu)

    def prepare() -> None:
        batch.reset(np.arange(num), stage=mujoco.mjtStage.mjSTAGE_NONE)
        position[:] = walk.position[0, :num]
        velocity[:] = walk.velocity[0, :num]

    def run() -> None:
        for window in controls:
            control[:] = window
            batch.step(nstep=substeps)

    name = f"Batch alone, N = {num}, {threads} thread{'s' * (threads > 1)}"
    return Case(name=name, samples=num * len(walk.actions), seconds=STEP, prepare=prepare, run=run)
