"""What a step costs beside its physics: CPU time of the full batched step over that of `mj_step` alone; what planning
takes of it; and leg inverse kinematics against np.sin.

    make bench

Step and physics run in one process, in turn, step by step: the batch steps N walking bodies for 20 ms (observation,
reward and info included); then `mujoco.mj_step(model, data, nstep)` repeats the same physics steps from the same states
with the same controls. Ratios of such pairs do not depend on how busy or how fast the machine is.
"""

import time

import mujoco
import numpy as np

from springfoot.agents.config import TrainingConfig
from springfoot.envs.actuation import action_of
from springfoot.envs.biped import WINDOWS, Biped, Tick
from springfoot.envs.settings import BipedSettings
from springfoot.envs.simulation import STEPS_PER_WINDOW
from springfoot.envs.task import Task
from springfoot.gait import Body
from springfoot.gait.posture import leg_angles

STEPS, WARM_UP = 200, 20


def step_over_physics(num: int) -> tuple[np.ndarray, np.ndarray, float]:
    """CPU time [s] of each full step and of its physics alone, (STEPS,); largest joint-angle difference [rad]."""
    biped = Biped(BipedSettings(), num)
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    biped.reset(np.arange(num), range(num))
    model = biped.model
    raw = [biped.data(index) for index in range(num)]
    full, physics = np.empty((2, STEPS + WARM_UP))
    for step in range(STEPS + WARM_UP):
        action = action_of(biped.scheduled_stiffness(), biped.settings, biped.body).reshape(num, -1)
        ticks.clear()
        begin = time.process_time()
        outcome = biped.step(action)
        full[step] = time.process_time() - begin
        assert not outcome.terminated.any(), "the bench measures walking"
        physics[step] = 0.0
        for tick in ticks:
            controls = np.stack([tick.stiffness, tick.stiffness * tick.equilibrium], -1).reshape(num, -1)
            for data, control in zip(raw, controls, strict=True):
                data.ctrl[:] = control
            begin = time.process_time()
            for data in raw:
                mujoco.mj_step(model, data, STEPS_PER_WINDOW)
            physics[step] += time.process_time() - begin
    apart = max(np.abs(raw[i].qpos[3:] - ticks[-1].measurement.angle[i].ravel()).max() for i in range(num))
    return full[WARM_UP:], physics[WARM_UP:], apart


def planning_over_step(training: TrainingConfig) -> float:
    """CPU time of planning over that of a step as it is trained: the plan read twice a step and made once a run.

    Making it counts with the whole environment around it.
    """
    num, settings = training.num_envs, training.environment
    begin = time.process_time()
    biped = Biped(settings, num)
    made = time.process_time() - begin
    task = Task(settings, biped.body, biped.plan, biped.human)
    biped.reset(np.arange(num), range(num))
    phase = np.random.default_rng(0).uniform(size=(num, 2))
    step, read = np.empty((2, STEPS))
    for k in range(STEPS):
        begin = time.process_time()
        biped.step(np.zeros((num, 4)))
        between = time.process_time()
        task.tracking(biped.measurement, phase)
        step[k], read[k] = between - begin, time.process_time() - between
    return float((2 * np.median(read) + made * num / training.timesteps) / np.median(step))


def inverse_kinematics_over_sin(legs: int = 64_000) -> float:
    """CPU time of the inverse kinematics of `legs` legs over that of np.sin of as many numbers."""
    body, random = Body(), np.random.default_rng(0)
    forward, down, numbers = random.uniform([[-0.4], [0.5], [-3.0]], [[0.4], [0.75], [3.0]], (3, legs))
    times = np.empty((STEPS, 3))
    for row in times:
        row[0] = time.process_time()
        np.sin(numbers)
        row[1] = time.process_time()
        leg_angles(forward, down, body.thigh_length, body.shank_length)
        row[2] = time.process_time()
    of_sin, of_legs = np.median(np.diff(times), axis=0)
    return float(of_legs / of_sin)


def main() -> None:
    """Print the ratios."""
    print(f"full step of {WINDOWS} x {STEPS_PER_WINDOW} physics steps over mj_step alone, CPU time, {STEPS} pairs")
    for num in (64, 8, 1):
        full, physics, apart = step_over_physics(num)
        low, median, high = np.percentile(full / physics, (25, 50, 75))
        print(
            f"N = {num:2d}: ratio {median:.3f} (quartiles {low:.3f} to {high:.3f}); "
            f"{1e6 * np.median(physics) / num:.0f} us of physics per body and step; same walk within {apart:.0e} rad"
        )
    training = TrainingConfig()
    share = planning_over_step(training)
    print(f"planning: {100 * share:.2f} % of a training step of {training.num_envs} bodies (at most 1 %)")
    print(f"inverse kinematics of 64 000 legs: {inverse_kinematics_over_sin():.1f} x np.sin of as many (at most 30 x)")


if __name__ == "__main__":
    main()
