"""Compute the cost of a simulated walk without another walk to follow: effort, impact, and errors of its task.

The plan gives the task: the CoM's course over the feet, speed and step time. The legs are then free to do it with least
effort (`springfoot.gait.plan.effort`, of the walk itself). Cost of transport, muscle activity and impact are among the
criteria that Veerkamp et al., J. Biomech. 123 (2021) 110530 weigh in planar predictions of gait.
"""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.evaluation.numbers import StrideTally, foot_contacts, mean_effort, strides_within
from springfoot.evaluation.recording import TICK
from springfoot.gait.body import GRAVITY
from springfoot.gait.people import on_percent
from springfoot.gait.plan import ACTIVATION_TIME, PER_DEGREE, Effort

from .leg_walks import SETTLED

PER_EFFORT = 10.0
"""Cost of one unit of effort and impact; chosen, so that every walk costs less than a fall."""
TASK_TOLERANCE = {"speed": 0.01, "period": 0.02, "place": 0.01, "skipped": 0.01, "travel": 0.01, "unsteady": 0.05}
"""Units in which errors of the task count; chosen. Speed [m/s]; stride time over the plan's, less 1; place of the CoM
over the foot, root mean square over the stride [m]; planned travel that a leg skips as its foot lands [m]; travel of
the sole on the floor in a stance [m]; SD of the vertical force over the strides of both legs [body weights]."""
PER_TASK_ERROR, PER_MISS = 0.6, 0.01
"""Cost of one unit of `TASK_TOLERANCE`, and of one tolerance of distance from the plan; chosen: the task counts, and
the planned angles hardly."""


def effort_price(
    series: dict[str, NDArray], tally: StrideTally, biped: Biped, missed: NDArray, impact: float = 1.0
) -> float:
    """Return the cost of one walk from its series and its tally.

    `missed` is the walk's distance from the plan [tolerances] (`leg_cost.misses`), `impact` the price of impact over
    that of effort.
    """
    effort, impact_of_legs, task_errors = effort_and_impact(series, tally, biped)
    of_effort = effort.total + PER_DEGREE * effort.beyond_range + impact * impact_of_legs
    of_task = [PER_TASK_ERROR * task_errors[name] / TASK_TOLERANCE[name] for name in TASK_TOLERANCE]
    return PER_EFFORT * of_effort + float(np.linalg.norm([*of_task, *(PER_MISS * missed)]))


def impact_of(force: NDArray, tick: float) -> float:
    """Return the mean square of `ACTIVATION_TIME` times the rate of a foot's force (T, 2) [body weights], doubled for
    both feet."""
    change = np.gradient(force, tick, axis=0)
    return float(2 * ACTIVATION_TIME**2 * (change**2).sum(-1).mean())


def effort_and_impact(
    series: dict[str, NDArray], tally: StrideTally, biped: Biped, settled: float = SETTLED
) -> tuple[Effort, float, dict[str, float]]:
    """Return the effort of the walk, the impact (`impact_of`, mean of the legs), and the errors of the task.

    The errors have the names of `TASK_TOLERANCE`. `tally` is the evaluation's, of the walk's `series` from `settled`
    [s] on.
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
    assert effort is not None  # `measured` lets no such walk pass
    task_errors = {
        "speed": float(np.mean(tally.speed)) - biped.settings.speed,
        "period": float(np.mean(tally.stride_time)) / biped.plan.stride_time - 1,
        "place": float(np.mean(places)),
        "skipped": (1.0 - float(np.mean(landings))) * 2 * biped.plan.step_length,
        "travel": float(np.mean(tally.travel)),
        "unsteady": float(np.sqrt(np.mean(tally.both.sd("grf_vertical_bw") ** 2))),
    }
    return effort, float(np.mean(impacts)), task_errors
