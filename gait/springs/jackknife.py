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
"""Condition number of the normal equations, columns of unit size, beyond which columns count as collinear."""


def jackknife_interval(value: float, without: NDArray, inflation: float = 1.0) -> Estimate:
    """Return a value with its confidence interval, from its values (T,) that leave out one of T trials each.

    `inflation` multiplies the variance.
    """
    trials = len(without)
    # Jackknife variance: (T - 1) / T times the squared deviations of the T values.
    variance = inflation * (trials - 1) / trials * np.sum((without - without.mean()) ** 2)
    half = stdtrit(trials - 1, (1 + CONFIDENCE) / 2) * np.sqrt(variance)  # Student's t
    return Estimate(float(value), float(value - half), float(value + half))


class TrialFit(NamedTuple):
    """Least squares of all trials, and again without each trial."""

    coefficients: NDArray
    """(p,) coefficients."""
    without: NDArray
    """(trials, p) coefficients without each trial."""
    inflation: float
    """Factor on variances: samples over the degrees of freedom that are left."""
    explained: float
    """Fraction of the variance explained [0..1]."""

    def interval(self, value: float, without: NDArray) -> Estimate:
        """Return a function of the coefficients, such as their ratio, with its confidence interval.

        `value` is the function at `coefficients`, `without` (trials,) the function at each row of `self.without`.
        """
        return jackknife_interval(value, without, self.inflation)

    def chance(self, first: int) -> float:
        """Return the p-value of coefficients `first` and later ones being all 0, by Hotelling's T^2; 1 with too few
        trials."""
        values = self.coefficients[first:]
        without = self.without[:, first:]
        trials, count = without.shape
        if trials <= count:
            return 1.0
        # The jackknife covariance, as the variance in `interval`.
        deviation = without - without.mean(0)
        covariance = self.inflation * (trials - 1) / trials * deviation.T @ deviation
        squared = values @ np.linalg.pinv(covariance, hermitian=True) @ values  # T^2, which scaled is distributed as F
        return float(fdtrc(count, trials - count, squared * (trials - count) / (count * (trials - 1))))


def fit_by_trial(columns: NDArray, values: NDArray, trial: NDArray, spent: int) -> TrialFit | None:
    """Fit `values` (n,) on `columns` (n, p) by least squares without a constant, with all trials and without each.

    `trial` (n,) is the index of each sample's trial: 0, 1, ..., none without samples. `spent` is the number of degrees
    of freedom already used, such as by means subtracted from the columns. Returns None if the data do not determine the
    coefficients: too few samples, a column that is 0, columns nearly collinear, or values all 0.
    """
    count, unknowns = columns.shape
    # Columns of unit size lose no digits to units.
    scale = np.sqrt((columns**2).mean(0))
    total_square = values @ values
    freedom = count - spent - unknowns
    if not (scale > 1e-12).all() or freedom <= 0 or total_square == 0:  # 1e-12: a column of 0 but for rounding
        return None
    scaled = columns / scale
    order = np.argsort(trial, kind="stable")
    ends = np.cumsum(np.bincount(trial))[:-1]  # of all trials but the last one, in that order
    trials = list(zip(np.split(scaled[order], ends), np.split(values[order], ends), strict=True))
    # Normal equations X'X b = X'y of each trial; leaving a trial out subtracts its part.
    grams = np.stack([part.T @ part for part, _ in trials])
    moments = np.stack([part.T @ part_values for part, part_values in trials])
    gram = grams.sum(0)
    moment = moments.sum(0)
    if np.linalg.cond(gram) > WORST_CONDITION:
        return None
    coefficients = np.linalg.solve(gram, moment)
    ridge = 1e-12 * count * np.eye(unknowns)  # a coefficient that one trial alone determines gets a wide interval
    without = np.linalg.solve(gram - grams + ridge, (moment - moments)[..., None])[..., 0]
    unexplained = np.sum((values - scaled @ coefficients) ** 2)
    return TrialFit(coefficients / scale, without / scale, count / freedom, float(1 - unexplained / total_square))
