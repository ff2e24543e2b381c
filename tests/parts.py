"""Parts of kernels as kernels of their own, whose code is kept: a part that is called alone is compiled at each start.

Their arguments are those of the parts.
"""

from springfoot.envs.control import legs, stiffness_control
from springfoot.envs.physics.kernel import kernel
from springfoot.envs.task import reward

_judge, _total = reward.judge, reward.total
_move, _stiffen, _drive = stiffness_control.move, stiffness_control.stiffen, legs.drive


@kernel
def judge(rows, controls, bodies, table, options, forces, terms):
    """Fill `terms` with the terms of the reward."""
    _judge(rows, controls, bodies, table, options, forces, terms)


@kernel
def total(terms, options, reward):
    """Fill `reward` with the weighted sum of the terms."""
    _total(terms, options, reward)


@kernel
def stiffen(rows, bodies, schedule, options, factor, walking, on_schedule):
    """Give the springs the stiffness that the action asks for."""
    _stiffen(rows, bodies, schedule, options, factor, walking, on_schedule)


@kernel
def move(rows, bodies, control, rest, incline, feet, options, walking):
    """Move the rest angles of ankles and toes with the phase."""
    _move(rows, bodies, control, rest, incline, feet, options, walking)


@kernel
def drive(rows, bodies, control, legs, incline):
    """Drive hips and knees."""
    _drive(rows, bodies, control, legs, incline)
