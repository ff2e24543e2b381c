"""Compute intervals of means and fractions, and a test of two policies' falls in the same episodes."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binomtest, bootstrap, t

from springfoot.arrays import NDArray

RESAMPLES = 10_000
"""Resamples of the bootstrap."""
LEVEL = 0.95
"""Confidence level of every interval."""
POWER = 0.8
"""Chance with which the smallest visible difference is seen."""
LEAST_AGREEING = 5
"""Persons that must all have one sign for it to be known where the interval holds 0: by chance they do in 1 of 16."""


def mean_interval(values: NDArray, level: float = LEVEL) -> tuple[float, float]:
    """Return the percentile bootstrap interval of the mean of a sample (n,), from `RESAMPLES` resamples of a fixed
    seed.

    Falls make returns bimodal and skewed, so no normal distribution is assumed. For a single value both ends are that
    value. The differences of two rows on the same episodes give a paired interval.
    """
    if len(values) < 2:
        return float(values[0]), float(values[0])
    result = bootstrap(
        (values,),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=level,
        method="percentile",
        rng=np.random.default_rng(0),
    )
    return float(result.confidence_interval.low), float(result.confidence_interval.high)


def of_persons(values: Sequence[NDArray]) -> NDArray:
    """Return the sample (n,) with the spread that tells how well a mean is known, from the values (E,) of each person
    in its episodes: the persons' means, as one person's episodes say nothing of how others learn; of one person its
    episodes.

    A person without values is left out.
    """
    found = [own for own in values if len(own)]
    return np.array([own.mean() for own in found]) if len(found) > 1 else np.concatenate([*found, np.empty(0)])


def interval_of_persons(values: Sequence[NDArray], level: float = LEVEL) -> tuple[float, float]:
    """Return the interval of the mean of `of_persons` from the same values: Student's for several persons, as a
    bootstrap of a few is too narrow; of one person `mean_interval`."""
    sample = of_persons(values)
    if sum(1 for own in values if len(own)) < 2:
        return mean_interval(sample, level)
    reach = float(t.ppf(0.5 + level / 2, len(sample) - 1) * np.std(sample, ddof=1) / np.sqrt(len(sample)))
    return float(sample.mean()) - reach, float(sample.mean()) + reach


def known_sign(values: Sequence[NDArray]) -> int:
    """Return the sign of the mean of `of_persons` from the same values, 1 or -1, or 0 where it is not known.

    It is known if the interval leaves 0 out, or if all persons have it and are `LEAST_AGREEING` or more.
    """
    sample = of_persons(values)
    if len(sample) < 2:
        return 0
    low, high = interval_of_persons(values)
    agreeing = all(map(len, values)) and len(values) >= LEAST_AGREEING and abs(np.sign(sample).sum()) == len(sample)
    return int(np.sign(sample.mean())) if agreeing or low > 0.0 or high < 0.0 else 0


def visible(differences: NDArray) -> float | None:
    """Return the smallest true mean difference that n paired differences (n,) of this spread detect with the chance
    `POWER`, about: the sum of Student's two quantiles times the standard error. None for a single difference, and where
    all are 0."""
    if len(differences) < 2 or not differences.any():
        return None
    error = np.std(differences, ddof=1) / np.sqrt(len(differences))
    return float(t.ppf([0.5 + LEVEL / 2, POWER], len(differences) - 1).sum() * error)


def share_interval(count: int, total: int, level: float = LEVEL) -> tuple[float, float]:
    """Return Wilson's score interval [0, 1] of the fraction `count` / `total`."""
    interval = binomtest(count, total).proportion_ci(confidence_level=level, method="wilson")
    return float(interval.low), float(interval.high)


def paired_p(fell: NDArray, other: NDArray) -> float:
    """Return p of McNemar's exact test that two policies fall equally often.

    `fell` and `other` (n,) are True where the one and the other policy fell, in the same n episodes. Only episodes in
    which one of them fell and the other did not count; without any p is 1.
    """
    alone = int((fell & ~other).sum())
    other_alone = int((other & ~fell).sum())
    return float(binomtest(alone, alone + other_alone).pvalue) if alone + other_alone else 1.0
