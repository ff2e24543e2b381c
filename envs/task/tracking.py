"""How far a body is from its plan."""

import numpy as np

from springfoot.arrays import NDArray

from ..control.phase_table import read
from ..physics.kernel import kernel, part
from ..physics.model import LEFT, RIGHT
from .reward_reference import REFERENCE


@part
def curves_at(table, control, curves) -> NDArray:
    """People and plan at the present phases of both legs, (side,) of `REFERENCE`; a view of `curves` (side, C)."""
    for side in range(2):
        read(table, control.subject.place, control.legs.phase[side], curves[side])
    return curves.view(REFERENCE)[:, 0]


@part
def error_of(control, planned, m) -> tuple[float, float, float]:
    """CoM minus plan: x [m], z [m], forward speed [m/s]. The x of the plan is from the ankle of the leg whose stance
    began last."""
    ratio, phase = control.subject.scale, control.legs.phase
    leader = LEFT if phase[LEFT] < 0.5 else RIGHT
    own = planned[leader]
    planned_x = m.ankle[leader, 0] + ratio.length * own.stride_length * phase[leader]
    planned_x += ratio.length * own.com[0]
    return m.com[0] - planned_x, m.com[1] - ratio.length * own.com[1], m.com_velocity[0] - ratio.time * own.speed


@kernel
def track(controls, bodies, table, error) -> None:
    """Fill `error` (N, 3), CoM minus plan: x [m], z [m] and forward speed [m/s].

    `controls` (N,) of `CONTROL_ROW`; `bodies` (N,) of `BODY_ROW`; `table` (R, SAMPLES, 2, C) of `REFERENCE`.
    """
    curves = np.empty((2, table.shape[-1]))
    for i in range(len(error)):
        planned = curves_at(table, controls[i], curves)
        error[i, 0], error[i, 1], error[i, 2] = error_of(controls[i], planned, bodies[i].measured)
