"""End episodes: by a fall, by a simulation that diverges, or by their time."""

import mujoco

from ..physics.kernel import part
from ..physics.measurement import Measurement

TERMINATIONS = (
    "",
    "fell: hip too low",
    "fell: trunk too tilted",
    "diverged: INERTIA",
    "diverged: CONTACTFULL",
    "diverged: CNSTRFULL",
    "diverged: BADQPOS",
    "diverged: BADQVEL",
    "diverged: BADQACC",
    "diverged: BADCTRL",
)
"""Reason of a termination, by its code; 0 for none. A divergence has the name of MuJoCo's warning."""
TOO_LOW, TOO_TILTED = 1, 2
"""Codes of falls."""


@part
def average(rows, window_forces, running) -> None:
    """Count a step of environments `running` (N,), and set `force` to the mean of their contact forces in the step.

    Args:
        rows: (N,) of `TASK_ROW`; `steps` and `force` are changed.
        window_forces: (W, N, side, contact, 2) forces, forward and up, in each of the step's W control windows [N].
        running: (N,) bool.
    """
    for i in range(len(rows)):
        if not running[i]:
            continue
        rows[i].steps += 1
        for side in range(2):
            for contact in range(3):
                for axis in range(2):
                    total = 0.0
                    for window in range(len(window_forces)):
                        total += window_forces[window, i, side, contact, axis]
                    rows[i].force[side, contact, axis] = total / len(window_forces)


def divergence(m: Measurement, index: int) -> int:
    """Return the code in `TERMINATIONS` of body `index` of `m`, whose simulation has diverged: that of its warning."""
    warning = mujoco.mjtWarning(int(m.diverged[index]))
    return TERMINATIONS.index(f"diverged: {warning.name.removeprefix('mjWARN_')}")
