"""Compare learners by the scores of their trainings, as Agarwal et al. (2021, Deep RL at the edge of the statistical
precipice, NeurIPS) ask: interquartile means with stratified bootstrap intervals, and performance profiles.

A score is 0 for random stiffness, 1 for the best constant springs of the task, and linear in the return: that on the
public seeds, or that on seeds and bodies drawn from each policy's digest.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from scipy.stats import bootstrap, trim_mean

from springfoot.arrays import NDArray

from .judged import JudgedRow
from .task_walks import is_baseline

ENTRY_SEEDS = 5
"""Trainings of an entry that is whole; chosen. One with fewer is told."""
_RESAMPLES = 50_000
"""Resamples of the bootstrap, as in the paper's library, rliable."""
RANDOM, CONSTANT = "random", "constant"
"""Baselines at scores 0 and 1."""
SCHEDULE = "schedule"
"""Baseline that has a score as a learner has."""

Return = Literal["return_mean", "drawn_return_mean"]
"""Return of a judged submission: public, or drawn."""
LearnerScores = Mapping[str, Mapping[str, NDArray]]
"""Learner -> task -> (S,) score of each training [-]."""


def baseline_returns(rows: Sequence[JudgedRow], of: Return = "return_mean") -> dict[tuple[str, str], float]:
    """Return (baseline, task) -> mean return of random stiffness and of constant springs, those with the highest public
    return."""
    best: dict[tuple[str, str], JudgedRow] = {}
    for row in rows:
        end = row.submission.policy.partition(":")[0], row.submission.task
        if end[0] in (RANDOM, CONSTANT) and (end not in best or row.return_mean > best[end].return_mean):
            best[end] = row
    return {end: getattr(row, of) for end, row in best.items()}


def learner_scores(rows: Sequence[JudgedRow], of: Return = "return_mean") -> LearnerScores:
    """Return the scores of `SCHEDULE`, and of the entries with several trainings of something that learns, on the tasks
    that have both ends of the score, with different returns."""
    ends = baseline_returns(rows, of)
    both = {task for _, task in ends if {(RANDOM, task), (CONSTANT, task)} <= ends.keys()}
    tasks = {task for task in both if ends[RANDOM, task] != ends[CONSTANT, task]}
    returns: dict[str, dict[str, list[float]]] = {}
    for row in rows:
        if is_baseline(row.submission.policy) and row.submission.policy != SCHEDULE:
            continue
        entry = SCHEDULE if row.submission.policy == SCHEDULE else row.entry
        returns.setdefault(entry, {}).setdefault(row.submission.task, []).append(getattr(row, of))
    scores = {}
    for learner, by_task in returns.items():
        own = {
            task: (np.array(values) - ends[RANDOM, task]) / (ends[CONSTANT, task] - ends[RANDOM, task])
            for task, values in by_task.items()
            if (len(values) > 1 or learner == SCHEDULE) and task in tasks
        }
        if own:
            scores[learner] = own
    return scores


def interquartile_mean(*samples: NDArray, axis: int = -1) -> NDArray:
    """Return the mean of the values between the quartiles of all samples (…, S) together, along `axis`."""
    return trim_mean(np.concatenate(samples, axis=axis), 0.25, axis=axis)


def interval(samples: Sequence[NDArray]) -> tuple[float, float, float]:
    """Return the interquartile mean of samples (S,), each of one task, and its 95 % interval: each task's trainings
    are drawn anew among themselves, whatever their order. Of a single value all three are that value."""
    middle = float(interquartile_mean(*samples))
    if all(len(sample) < 2 for sample in samples):
        return middle, middle, middle
    found = bootstrap(
        [np.sort(sample) for sample in samples],
        interquartile_mean,
        n_resamples=_RESAMPLES,
        method="percentile",
        rng=np.random.default_rng(0),
    )
    return middle, float(found.confidence_interval.low), float(found.confidence_interval.high)


def interval_text(samples: Sequence[NDArray], pattern: str) -> str:
    """Return `interval` as text, "middle (low to high)", in the format `pattern`; of single values the middle
    alone."""
    middle, *ends = interval(samples)
    if all(len(sample) < 2 for sample in samples):
        return format(middle, pattern)
    return f"{middle:{pattern}} ({' to '.join(format(end, pattern) for end in ends)})"


def profile(samples: Sequence[NDArray], thresholds: NDArray) -> NDArray:
    """Return the fraction of trainings with a score above each of the thresholds (T,), every task with equal weight."""
    return np.mean([(sample[:, None] > thresholds).mean(axis=0) for sample in samples], axis=0)
