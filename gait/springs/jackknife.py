"""Fit regressions on data in trials, with intervals that hold even if errors last as long as a trial.

Each trial is left out once. The spread of the remaining fits is the uncertainty, however the errors of one trial depend
on each other (the estimator CV3 of MacKinnon, Nielsen & Webb 2022, Queen's Economics Working Paper 1485).
"""

from typing import NamedTuple

import numpy as np
from scipy.special import fdtrc, stdtrit

from springfoot.arrays import NDArray

from .spring_fit import CONFIDENCE, Estimate

WORST_CONDITION = 1e10
"""Condition number of the normal equations, columns of unit size, beyond which the data leave the coefficients open."""


class TrialFit(NamedTuple):
    """Least squares of all trials, and again without each trial."""

    coefficients: NDArray
    """(p,) coefficients."""
    without: NDArray
    """(trials, p) coefficients without each trial."""
    inflation: float
    """Factor on variances, for the unknowns fitted before."""
    explained: float
    """Fraction of the variance explained [0..1]."""

    def interval(self, value: float, without: NDArray) -> Estimate:
        """Return a function of the coefficients with its interval.

        `value` is the function of all trials, `without` (trials,) the function without each trial.
        """
        trials = len(without)
        variance = self.inflation * (trials - 1) / trials * np.sum((without - without.mean()) ** 2)
        half = stdtrit(trials - 1, (1 + CONFIDENCE) / 2) * np.sqrt(variance)  # Student's t
        return Estimate(float(value), float(value - half), float(value + half))

    def chance(self, first: int) -> float:
        """Return p that coefficients `first` and on are all 0, by Hotelling's T^2; 1 with too few trials."""
        values = self.coefficients[first:]
        without = self.without[:, first:]
        trials, count = without.shape
        if trials <= count:
            return 1.0
        moved = without - without.mean(0)
        covariance = self.inflation * (trials - 1) / trials * moved.T @ moved
        squared = values @ np.linalg.pinv(covariance, hermitian=True) @ values
        return float(fdtrc(count, trials - count, squared * (trials - count) / (count * (trials - 1))))


def fit_by_trial(columns: NDArray, values: NDArray, trial: NDArray, spent: int) -> TrialFit | None:
    """Fit `values` (n,) on `columns` (n, p) by least squares through 0; return None if the data leave the coefficients
    open.

    `trial` (n,) counts trials from 0, each with samples. `spent` is the number of unknowns fitted before, such as
    means.
    """
    count, unknowns = columns.shape
    size = np.sqrt((columns**2).mean(0))
    total = values @ values
    freedom = count - spent - unknowns
    if not (size > 1e-12).all() or freedom <= 0 or total == 0:
        return None
    unit = columns / size
    order = np.argsort(trial, kind="stable")
    ends = np.cumsum(np.bincount(trial))[:-1]
    parts = list(zip(np.split(unit[order], ends), np.split(values[order], ends), strict=True))
    squares = np.stack([part.T @ part for part, _ in parts])
    pulls = np.stack([part.T @ own for part, own in parts])
    whole = squares.sum(0)
    pull = pulls.sum(0)
    if np.linalg.cond(whole) > WORST_CONDITION:
        return None
    coefficients = np.linalg.solve(whole, pull)
    floor = 1e-12 * count * np.eye(unknowns)  # a coefficient that one trial alone knows gets a wide interval
    without = np.linalg.solve(whole - squares + floor, (pull - pulls)[..., None])[..., 0]
    lost = np.sum((values - unit @ coefficients) ** 2)
    return TrialFit(coefficients / size, without / size, count / freedom, float(1 - lost / total))
