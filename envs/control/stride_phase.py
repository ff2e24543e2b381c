"""Advance the phase of the stride of each leg, and reset it when a foot touches down."""

from springfoot.gait.body.body import GRAVITY, REFERENCE_MASS

from ..physics.kernel import part
from ..physics.model import LEFT, RIGHT

TOUCHDOWN_LOAD = 30.0 / (REFERENCE_MASS * GRAVITY)
"""Vertical force of a foot that counts as touchdown [body weights]; chosen: 30 N at 63 kg, as of force plates."""
TOUCHDOWN_PHASE = 0.80
"""A touchdown before this stride phase of the leg is a scuff, not a step; chosen."""
SLOWEST = -0.1
"""Error of the speed [m/s] at which the input of the gains, here and in `legs`, is clipped; chosen: a body that sets
off, or that its springs keep slow, is far slower than the plan for many steps, and its full error would make the legs
trip it."""
HOLD = 0.001
"""Distance below 1 at which a leg's phase waits until its foot touches down; chosen, small against a window's 0.009."""


@part
def speed_excess(m, row) -> float:
    """Return by how much the CoM moves forward faster than planned [m/s], at least `SLOWEST`.

    `m` is of `MEASURED`, `row` of `CONTROL_ROW`.
    """
    return max(m.com_velocity[0] - row.subject.speed * row.legs.planned_speed, SLOWEST)


@part
def _load(force):
    """Return the upward force [N] on a foot, the sum over heel, ball and toe of `force` (3, 2), forward and up [N]."""
    return force[0, 1] + force[1, 1] + force[2, 1]


@part
def advance(rows, bodies, walking) -> None:
    """Advance the phase of the legs by one window.

    The phase waits at the end of a leg's stride for a late foot, and jumps to the start of its stride when a foot
    lands. The right leg is half a stride behind the left one.

    Args:
        rows: (N,) of `CONTROL_ROW`; the phase of the legs is changed.
        bodies: (N,) of `BODY_ROW`, as measured at the window's end.
        walking: (N,) bool; the phase of other bodies waits.
    """
    for i in range(len(rows)):
        if not walking[i]:
            continue
        legs = rows[i].legs
        m = bodies[i].measured
        gain = legs.gains
        left = legs.phase[LEFT]
        rate = gain.rate * (1.0 + gain.rate_gain * speed_excess(m, rows[i]))
        end = (0.5 if left < 0.5 else 1.0) - HOLD  # of the right leg's stride, or of the left leg's
        left = min(left + max(rate, 0.0), max(end, left))  # never backwards, and not beyond `end`
        right = (left + 0.5) % 1.0
        if left > TOUCHDOWN_PHASE and _load(m.force[LEFT]) > gain.touchdown:
            left = 0.0
        elif right > TOUCHDOWN_PHASE and _load(m.force[RIGHT]) > gain.touchdown:
            left = 0.5
        legs.phase[LEFT] = left
        legs.phase[RIGHT] = (left + 0.5) % 1.0
