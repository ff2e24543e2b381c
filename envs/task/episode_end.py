"""End episodes: by a fall, by a simulation that diverges, or by their time."""

import mujoco
import numpy as np

from springfoot.arrays import NDArray

from ..physics.kernel import part
from ..physics.measurement import Measurement

MIN_HIP_HEIGHT = 0.65
"""Lowest hip before it counts as a fall [m at 1.70 m, scaled with height]; chosen: in walking it stays above 0.83 m."""
MAX_PITCH = 0.8
"""Largest tilt of the trunk, forward or backward, before it counts as a fall [rad]; chosen: walking stays within 0.04
rad."""

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
def is_alive(m, min_hip_height) -> bool:
    """Return whether a body has neither fallen nor diverged.

    `m` is of `MEASURED`, `min_hip_height` [m] is `MIN_HIP_HEIGHT` scaled to it.
    """
    upright = m.base[1] >= min_hip_height and abs(m.base[2]) <= MAX_PITCH  # hip and trunk; False for NaN
    return upright and m.diverged < 0


@part
def end_episodes(rows, alive, running, most_steps, terminated, truncated) -> bool:
    """Count a step of environments `running` (N,), and fill whether it ends their episodes; return whether any fell or
    diverged.

    Args:
        rows: (N,) of `TASK_ROW`; `steps` is changed.
        alive: (N,) reward term `alive`, 0 for a body that fell or diverged.
        running: (N,) bool; the episodes of others do not end.
        most_steps: steps of an episode after which it is truncated.
        terminated: (N,) bool, filled: fallen or diverged.
        truncated: (N,) bool, filled: out of time, and not terminated.
    """
    any_terminated = False
    for i in range(len(rows)):
        if running[i]:
            rows[i].steps += 1
        terminated[i] = running[i] and alive[i] == 0.0
        truncated[i] = running[i] and not terminated[i] and rows[i].steps >= most_steps
        any_terminated = any_terminated or terminated[i]
    return any_terminated


def reasons_of(m: Measurement, min_hip_height: NDArray, terminated: NDArray) -> NDArray:
    """Return (N,) the reason why an episode is `terminated` (N,), as codes of `TERMINATIONS`; 0 where it is not.

    `m` is measured at the step's end; `min_hip_height` (N,) [m] as in `is_alive`.
    """
    reasons = np.where(terminated, falls_of(m, min_hip_height), 0)
    for index in np.flatnonzero(terminated & (m.diverged >= 0)).tolist():
        warning = mujoco.mjtWarning(int(m.diverged[index]))
        reasons[index] = TERMINATIONS.index(f"diverged: {warning.name.removeprefix('mjWARN_')}")
    return reasons


def falls_of(m: Measurement, min_hip_height: NDArray) -> NDArray:
    """Return (N,) the reason of each body's fall, as codes of `TERMINATIONS`; 0 without one. The rule is that of
    `is_alive`."""
    tilted = np.where(np.abs(m.base[:, 2]) <= MAX_PITCH, 0, TOO_TILTED)
    return np.where(m.base[:, 1] >= min_hip_height, tilted, TOO_LOW)
