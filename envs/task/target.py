"""Tabulate the target of the body at each phase of the stride, and measure the body's distance from it.

With the guide `people` joint angles and forces are people's, and the CoM is the plan's; with the guide `plan` the whole
target is the plan's. Axes: N bodies; side, 0 left and 1 right; a `PhaseTable` (R, SAMPLES, 2, C) has R rows, one for
each body, variant of the leg constants and tabulated speed, SAMPLES phases, value and rise to the next phase, and C
curves.
"""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import ANGLES
from springfoot.gait.people.human import HumanGait
from springfoot.gait.plan.com_plan import ComPlan

from ..control.phase_table import GRID, read
from ..physics.kernel import kernel, part
from ..physics.model import JOINTS, LEFT, RIGHT

FORCE_BAND = 0.5
"""Half width of the target's range of forces about their mean [SD]; chosen: at 1 the ankle pushes off with less than
people's moment."""
TARGET = np.dtype(
    [
        ("pose", float, len(JOINTS)),  # thigh (to the vertical), knee, ankle, toe [rad]
        ("force", float, 2),  # ground reaction force (forward, up), at the middle of the step [body weights]
        ("force_band", float, 2),  # how far from it is still in range
        ("com", float, 2),  # the plan's CoM (x, z) [m], x from this leg's ankle and less its mean advance
        ("zmp", float),  # the plan's ZMP at the middle of the step [m], x as in `com`
        ("speed", float),  # the plan's forward speed of the CoM [m/s]
        ("stride_length", float),  # of the plan [m], the same at every phase
    ]
)
"""The target at a phase of one leg's stride; `com`, `zmp`, `speed` are for the leg that began its stance last."""


def target_curves(gait: HumanGait, plan: ComPlan, step_seconds: float) -> NDArray:
    """Return the target over the stride of one leg, (SAMPLES,) of dtype `TARGET` on `GRID`.

    `gait` has joint angles and forces, `plan` CoM and ZMP. `step_seconds` is the environment's step [s]: forces and CoP
    are averages over it, and belong to its middle.
    """
    curves = np.zeros(len(GRID), TARGET)
    curves["pose"] = np.stack([gait.mean(name, GRID) for name in ANGLES], -1)
    middle = (GRID - 0.5 * step_seconds / plan.stride_time) % 1.0  # a force averaged over a step belongs to its middle
    for axis, name in enumerate(("grf_forward", "grf_vertical")):
        curves["force"][:, axis] = gait.mean(name, middle)
        curves["force_band"][:, axis] = FORCE_BAND * gait.sd(name, middle)
    step_phase = (2 * GRID) % 1.0  # of the plan's step, half a stride
    x, z = plan.com(step_phase)
    curves["com"] = np.stack((x - plan.step_length * step_phase, z), -1)
    # The ZMP half an environment's step earlier, which may lie in the plan's step before: then one step length behind.
    earlier = 2 * GRID - 0.5 * step_seconds / plan.step_time
    curves["zmp"] = plan.zmp(earlier) + plan.step_length * (np.floor(earlier) - np.floor(2 * GRID) - step_phase)
    curves["speed"], _ = plan.com_velocity(step_phase)
    curves["stride_length"] = 2 * plan.step_length
    return curves


@part
def targets_at(table, control, curves) -> NDArray:
    """Return the target at the present phases of both legs, (side,) of `TARGET`.

    Args:
        table: (R, SAMPLES, 2, C) of a `PhaseTable`; its C curves are the numbers of `TARGET`.
        control: one of `CONTROL_ROW`, with the phases of the legs.
        curves: (side, C) memory, which is filled; the target is a view of it.
    """
    for side in range(2):
        read(table, control.subject.place, control.legs.phase[side], curves[side])
    return curves.view(TARGET)[:, 0]  # (side, 1) records of C numbers each, without the axis of length 1


@part
def error_of(control, targets, m) -> tuple[float, float, float]:
    """Return CoM minus target of one body: x [m], z [m], forward speed [m/s].

    `control` is of `CONTROL_ROW`, `targets` (side,) of `TARGET`, `m` of `MEASURED`. The x of the target is from the
    ankle of the leg that began its stance last; within the step it advances with the phase.
    """
    scale = control.subject.scale
    phase = control.legs.phase
    leader = LEFT if phase[LEFT] < 0.5 else RIGHT
    target = targets[leader]
    target_x = m.ankle[leader, 0] + scale.length * target.stride_length * phase[leader]
    target_x += scale.length * target.com[0]
    target_z = scale.length * target.com[1]
    target_speed = scale.time * target.speed
    return m.com[0] - target_x, m.com[1] - target_z, m.com_velocity[0] - target_speed


@kernel
def track(controls, bodies, table, error) -> None:
    """Fill `error` (N, 3) with CoM minus target of each body: x [m], z [m] and forward speed [m/s].

    `controls` (N,) of `CONTROL_ROW`; `bodies` (N,) of `BODY_ROW`, as measured now; `table` (R, SAMPLES, 2, C) of
    `TARGET`, of a `PhaseTable`.
    """
    curves = np.empty((2, table.shape[-1]))
    for i in range(len(error)):
        targets = targets_at(table, controls[i], curves)
        error[i, 0], error[i, 1], error[i, 2] = error_of(controls[i], targets, bodies[i].measured)
