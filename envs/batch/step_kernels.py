"""What a step does between two calls of the physics: one compiled call each.

    begin_step -> physics -> (next_window -> physics ->) end_step

`begin_step` sets the stiffness and begins the first control window; `next_window` measures what came of one window and
begins the next; `end_step` measures, judges and observes. What each part does stands in the file of its idea. Where
someone listens to each window, `end_window` and `begin_window` are two calls.
"""

import numpy as np

from ..control.foot_springs import move, stiffen
from ..control.legs import advance, drive
from ..physics.kernel import kernel
from ..physics.measurement import measure_bodies
from ..task.episode_end import average
from ..task.observation import observe
from ..task.reward import ALIVE, judge, total
from .step_result import report


@kernel
def begin_window(rows, physics, tables, springs, walking) -> None:
    """Begin a control window; arguments as of `begin_step`."""
    controls, _, _ = rows
    bodies, state, _, _ = physics
    rest, _, legs, incline, feet, _ = tables
    move(controls, bodies, state, rest, incline, feet, springs, walking)
    drive(controls, bodies, state, legs, incline)


@kernel
def end_window(rows, physics, window, walking) -> None:
    """End control window number `window` of the step; else as of `begin_step`."""
    controls, _, forces = rows
    bodies, state, sensors, warnings = physics
    measure_bodies(bodies, state, sensors, warnings)
    advance(controls, bodies, walking)
    for i in range(len(bodies)):
        force = bodies[i].measured.force
        for side in range(2):
            for contact in range(3):
                for axis in range(2):
                    forces[window, i, side, contact, axis] = force[side, contact, axis]


@kernel
def begin_step(rows, physics, tables, springs, factor, walking, fixed) -> None:
    """Set the stiffness and begin the first control window.

    Args:
        rows: what is kept of each environment, plain tuples being quicker to hand over than named ones: (N,) of
            `CONTROL_ROW`; (N,) of `TASK_ROW`; (W, N, side, contact, 2) contact forces in the step's W windows [N].
        physics: `Physics` of the simulation, as a plain tuple.
        tables: curves over the stride, each of a `PhaseTable`: rest angles (R, SAMPLES, 2, 2) [rad] and fixed stiffness
            (R, SAMPLES, 2, 2) [N m/rad] of ankle and toe; `leg_curves` (R, SAMPLES, 2, 7); `slope_table`
            (1, SAMPLES, 2, 4); `FootLines` as a plain tuple; `REFERENCE` (R, SAMPLES, 2, C).
        springs: (1,) of `SPRING_OPTIONS`.
        factor: (N, 4) what the actions make of the stiffness [-].
        walking: (N,) bool, environments whose springs and phase move.
        fixed: (N,) bool, those of them that take the fixed stiffness.
    """
    stiffen(rows[0], physics[0], tables[1], springs, factor, walking, fixed)
    begin_window(rows, physics, tables, springs, walking)


@kernel
def next_window(rows, physics, tables, springs, window, walking) -> None:
    """`end_window` and `begin_window`."""
    end_window(rows, physics, window, walking)
    begin_window(rows, physics, tables, springs, walking)


@kernel
def end_step(rows, physics, tables, task, walking, running, outcome) -> bool:
    """End the last control window, judge the step and observe.

    Args:
        rows, physics, tables: as of `begin_step`.
        task: (1,) of `TASK_OPTIONS`.
        walking: (N,) bool, environments whose phase moves.
        running: (N,) bool, environments that took the step; the others get no reward.
        outcome: the arrays of a `StepResult` but its reasons, in order, which are filled.

    Returns whether an episode is terminated.
    """
    controls, tasks, forces = rows
    bodies, reference = physics[0], tables[5]
    observation, reward, terminated, truncated, values = outcome
    end_window(rows, physics, len(forces) - 1, walking)
    terms, any_terminated = np.empty((len(running), len(task[0].weights))), False
    judge(tasks, controls, bodies, reference, task, forces, terms)
    total(terms, task, reward)
    average(tasks, forces, running)
    for i in range(len(running)):
        terminated[i] = running[i] and terms[i, ALIVE] == 0.0
        truncated[i] = running[i] and not terminated[i] and tasks[i].steps >= task[0].most_steps
        any_terminated = any_terminated or terminated[i]
        if not running[i]:
            reward[i] = 0.0
        decision = controls[i].decision
        for k in range(4):
            decision.last_action[k] = decision.action[k]
    observe(tasks, controls, bodies, reference, observation)
    report(tasks, controls, bodies, terms, task, values)
    return any_terminated
