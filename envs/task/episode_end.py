"""How an episode ends: by a fall, by a simulation that diverges, or by its time."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from ..physics.kernel import kernel
from ..physics.measurement import Measurement


def end_step(
    most_steps: float,
    running: NDArray,
    terms: NDArray,
    window_forces: NDArray,
    steps: NDArray,
    force: NDArray,
    reward: NDArray,
) -> tuple[NDArray, NDArray]:
    """Count a step of environments that are `running` (N,), and average its contact forces; the others get no reward.

    Args:
        most_steps: of an episode.
        running: (N,) environments that took the step.
        terms: (N, terms) of the reward, `alive` first.
        window_forces: (W, N, side, contact, 2) in the step's control windows [N].
        steps: (N,) taken so far; changed in place.
        force: (N, side, contact, 2) mean over the step [N]; changed in place.
        reward: (N,); changed in place.

    Returns: (N,) the episodes that are terminated, and those that are truncated.
    """
    terminated, truncated = np.empty(len(running), bool), np.empty(len(running), bool)
    limit = most_steps - 0.5  # times are sums of steps
    _end(limit, running, terms, window_forces, steps, force, reward, terminated, truncated)
    return terminated, truncated


def divergence(m: Measurement, index: int) -> str:
    """Why a simulation that diverged did, by the name of MuJoCo's warning."""
    warning = mujoco.mjtWarning(int(m.diverged[index]))
    return f"diverged: {warning.name.removeprefix('mjWARN_')}"


@kernel
def _end(limit, running, terms, window_forces, steps, force, reward, terminated, truncated):
    for i in range(len(running)):
        terminated[i] = running[i] and terms[i, 0] == 0.0
        truncated[i] = running[i] and not terminated[i] and steps[i] + 1 >= limit
        if running[i]:
            steps[i] += 1
            _average(window_forces[:, i], force[i])
        else:
            reward[i] = 0.0


@kernel
def _average(window_forces, force):
    for side in range(2):
        for contact in range(3):
            for axis in range(2):
                total = 0.0
                for window in range(len(window_forces)):
                    total += window_forces[window, side, contact, axis]
                force[side, contact, axis] = total / len(window_forces)
