"""Measure how a walk does its plan's task, and its price for the legs: effort, impact, and errors of the task."""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.gait.body.body import GRAVITY
from springfoot.gait.people.gait_events import on_percent
from springfoot.gait.plan.effort import ACTIVATION_TIME, Effort

from ..recording.recording import TICK
from .measured_effort import mean_effort
from .series import foot_contacts, strides_within
from .tally import StrideTally


def impact_of(force: NDArray, tick: float) -> float:
    """Return the mean square of `ACTIVATION_TIME` times the rate of a foot's force (T, 2) [body weights], doubled for
    both feet."""
    change = np.gradient(force, tick, axis=0)
    return float(2 * ACTIVATION_TIME**2 * (change**2).sum(-1).mean())


def effort_and_impact(
    series: dict[str, NDArray], tally: StrideTally, biped: Biped, settled: float
) -> tuple[Effort, float, dict[str, float]]:
    """Return the effort of the walk, the impact (`impact_of`, mean of the legs), and the errors of the task.

    The errors: `speed` [m/s]; `period`, stride time over the plan's, less 1; `place` of the CoM over the foot, root
    mean square over the stride [m]; `skipped`, planned travel that a leg skips as its foot lands [m]; `travel` of the
    sole on the floor in a stance [m]; `unsteady`, SD of the vertical force over the strides of both legs [body
    weights]. `tally` is that of the walk's `series` from `settled` [s] on.
    """
    body = biped.body
    weight = body.mass * GRAVITY
    ahead = series["com"][:, 0] - series["com_reference"][:, 0]  # of the CoM, forward of the plan's [m]
    impacts: list[float] = []
    places: list[float] = []
    landings: list[float] = []
    for side, foot in enumerate(foot_contacts(series["force"][..., 1].sum(axis=2), body)):
        strides = strides_within(foot, (settled, np.inf))  # (strides, 3): heel strike, toe-off, next heel strike [s]
        begin, _, end = strides.T
        off = on_percent(ahead, begin, end, TICK, first=TICK).mean(0)[:-1]
        places.append(float(np.sqrt(np.mean(off**2))))
        force = series["force"][:, side].sum(1) / weight
        first, last = (strides[[0, -1], [0, 2]] / TICK).astype(int)  # begin of the first stride, end of the last one
        impacts.append(impact_of(force[first : last + 1], TICK))
        phase = series["phase"][:, side]
        # The phase that the leg reaches in swing, before the foot's landing sets it to 0.
        landings += [phase[leave:land].max() for _, leave, land in np.floor(strides / TICK).astype(int)]
    effort = mean_effort(tally.effort, body)
    assert effort is not None  # a tally with strides
    task_errors = {
        "speed": float(np.mean(tally.speed)) - biped.settings.speed,
        "period": float(np.mean(tally.stride_time)) / biped.plan.stride_time - 1,
        "place": float(np.mean(places)),
        "skipped": (1.0 - float(np.mean(landings))) * 2 * biped.plan.step_length,
        "travel": float(np.mean(tally.travel)),
        "unsteady": tally.unsteady,
    }
    return effort, float(np.mean(impacts)), task_errors
