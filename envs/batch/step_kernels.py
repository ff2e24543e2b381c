"""Compose the compiled calls of a step between two calls of the physics.

    begin_step -> physics -> (next_window -> physics ->) end_step

`begin_step` sets the stiffness and begins the first control window; `next_window` measures one window and begins the
next; `end_step` measures, judges and observes. Each part stands in the file of its idea. For a listener to each window,
`end_window` and `begin_window` are two calls.

A call takes the arrays that it reads and no others: numba looks up the type of each at every call, which for one body
costs more than the kernel itself. Those of `Tables`, `Physics` and `Outcome` travel as plain tuples and get their names
inside: numba looks up a plain tuple's type in C, a named one's in Python (`python -m benchmarks.named_tuples`).

Axes: N environments; W control windows of a step; a `PhaseTable` (R, SAMPLES, 2, C) has R rows, one for each body,
variant of the leg constants and tabulated speed, SAMPLES phases, value and rise to the next phase, and C curves.
"""

from typing import NamedTuple

import numpy as np

from springfoot.arrays import NDArray

from ..control.legs import drive
from ..control.person_actions import move_aim
from ..control.stiffness_control import move, stiffen
from ..control.stride_phase import advance
from ..physics.kernel import kernel, part
from ..physics.measurement import measure_bodies
from ..physics.simulation import Physics
from ..task.episode_end import end_episodes
from ..task.observation import observe
from ..task.reward import ALIVE, judge, remember, total
from .step_result import Outcome, report


class Tables(NamedTuple):
    """The curves over the stride that a control window begins with, each of a `PhaseTable`."""

    rest: NDArray
    """(R, SAMPLES, 2, 2 or 4) rest angles of ankle and toe [rad], and torques beside the springs [N m]."""
    legs: NDArray
    """(R, SAMPLES, 2, 7) of `leg_curves`."""
    incline: NDArray
    """(1, SAMPLES, 2, 4) of `slope_table`."""
    feet: tuple[NDArray, ...]
    """`FootLines`."""


@kernel
def begin_window(controls, bodies, control, tables, springs, walking) -> None:
    """Begin a control window: put stiffness and rest angles of all joints into the control; arguments as in
    `begin_step`."""
    tables = Tables(*tables)
    # Ankles and toes, then hips and knees.
    move(controls, bodies, control, tables.rest, tables.incline, tables.feet, springs, walking)
    drive(controls, bodies, control, tables.legs, tables.incline)


@kernel
def end_window(controls, physics, forces, window, walking) -> None:
    """End control window number `window` of the step: measure it, advance the phase, and keep its contact forces.

    Args:
        controls: (N,) of `CONTROL_ROW`.
        physics: `Physics` of the simulation, as a plain tuple.
        forces: (W, N, side, contact, 2) contact forces in the step's W windows [N].
        window: number of the control window in the step, from 0.
        walking: (N,) bool, environments with a phase that moves: bodies that neither stand nor have ended.
    """
    physics = Physics(*physics)
    bodies = physics.bodies
    measure_bodies(bodies, physics.state, physics.sensors, physics.velocity, physics.warnings)
    advance(controls, bodies, walking)
    for i in range(len(bodies)):
        force = bodies[i].measured.force
        for side in range(2):
            for contact in range(3):
                for axis in range(2):
                    forces[window, i, side, contact, axis] = force[side, contact, axis]


@part
def _average_forces(tasks, forces, running) -> None:
    """Set `force` of environments `running` (N,) to the mean of their contact forces in the step, which the observation
    shows and with which the next step's `impact` compares.

    `tasks` is (N,) of `TASK_ROW`, `forces` as in `end_window`.
    """
    for i in range(len(tasks)):
        if not running[i]:
            continue
        for side in range(2):
            for contact in range(3):
                for axis in range(2):
                    total_force = 0.0
                    for window in range(len(forces)):
                        total_force += forces[window, i, side, contact, axis]
                    tasks[i].force[side, contact, axis] = total_force / len(forces)


@kernel
def begin_step(controls, bodies, control, tables, schedule, springs, factor, walking, on_schedule) -> None:
    """Set the stiffness and begin the first control window.

    Args:
        controls: (N,) of `CONTROL_ROW`.
        bodies: (N,) of `BODY_ROW`, as measured now.
        control: (N, side, joint, 2) K [N m/rad] and K theta_eq [N m] of the window, for the simulation; filled.
        tables: `Tables`, as a plain tuple.
        schedule: (R, SAMPLES, 2, 2) the schedule's stiffness of ankle and toe [N m/rad], of a `PhaseTable`.
        springs: (N,) of `SPRING_OPTIONS`.
        factor: (N, 4) factors of the actions on the stiffness [-].
        walking: (N,) bool, environments with moving springs and phase.
        on_schedule: (N,) bool, walking environments that take the schedule's stiffness in place of the action's.
    """
    stiffen(controls, bodies, schedule, springs, factor, walking, on_schedule)
    begin_window(controls, bodies, control, tables, springs, walking)


@kernel
def next_window(controls, physics, forces, window, control, tables, springs, walking) -> None:
    """End window number `window` and begin the next; arguments as in `end_window` and `begin_step`."""
    end_window(controls, physics, forces, window, walking)
    begin_window(controls, Physics(*physics).bodies, control, tables, springs, walking)


@kernel
def end_step(controls, tasks, physics, forces, target, task, walking, running, outcome) -> bool:
    """End the last control window, judge the step and observe.

    Args:
        controls, physics, forces: as in `end_window`.
        tasks: (N,) of `TASK_ROW`.
        target: (R, SAMPLES, 2, C) of `TARGET`, of a `PhaseTable`.
        task: (1,) of `TASK_OPTIONS`.
        walking: (N,) bool, environments with moving phase.
        running: (N,) bool, environments that took the step; the others get no reward.
        outcome: `Outcome`, as a plain tuple, which is filled.

    Returns whether an episode is terminated.
    """
    bodies = Physics(*physics).bodies
    outcome = Outcome(*outcome)
    end_window(controls, physics, forces, len(forces) - 1, walking)
    terms = np.empty((len(running), len(task[0].weights)))
    judge(tasks, controls, bodies, target, task, forces, terms)
    total(terms, task, outcome.reward)
    remember(tasks, controls, bodies, target, task, running)
    _average_forces(tasks, forces, running)
    any_terminated = end_episodes(
        tasks, terms[:, ALIVE], running, task[0].most_steps, outcome.terminated, outcome.truncated
    )
    move_aim(controls, bodies, task[0].seconds, walking, running)
    for i in range(len(running)):
        if running[i]:
            bodies[i].muscles.judged = 1  # the sums of the muscles' work begin anew in the next window
        else:
            outcome.reward[i] = 0.0
        decision = controls[i].decision
        for k in range(4):
            decision.last_action[k] = decision.action[k]
        person = controls[i].person
        for side in range(2):
            for joint in range(3):
                person.last_offset[side, joint] = person.offset[side, joint]
    observe(tasks, controls, bodies, target, outcome.observation)
    report(tasks, controls, bodies, terms, task, outcome.values)
    return any_terminated
