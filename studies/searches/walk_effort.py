"""Compute the cost of a simulated walk without another walk to follow: effort, impact, and errors of its task.

The plan gives the task: the CoM's course over the feet, speed and step time. The legs are then free to do it with least
effort (`springfoot.gait.plan.effort`, of the walk itself). Cost of transport, muscle activity and impact are among the
criteria that Veerkamp et al., J. Biomech. 123 (2021) 110530 weigh in planar predictions of gait.
"""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.evaluation.numbers import StrideTally, effort_and_impact
from springfoot.gait.plan import PER_DEGREE

from .leg_walks import SETTLED

PER_EFFORT = 10.0
"""Cost of one unit of effort and impact; chosen, so that every walk costs less than a fall."""
TASK_TOLERANCE = {"speed": 0.01, "period": 0.02, "place": 0.01, "skipped": 0.01, "travel": 0.01, "unsteady": 0.05}
"""Units in which errors of the task count (`effort_and_impact`); chosen."""
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
    effort, impact_of_legs, task_errors = effort_and_impact(series, tally, biped, SETTLED)
    of_effort = effort.total + PER_DEGREE * effort.beyond_range + impact * impact_of_legs
    of_task = [PER_TASK_ERROR * task_errors[name] / TASK_TOLERANCE[name] for name in TASK_TOLERANCE]
    return PER_EFFORT * of_effort + float(np.linalg.norm([*of_task, *(PER_MISS * missed)]))
