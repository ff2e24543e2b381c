"""Compute statistics of a gait, each in a function of its own.

Curves are arrays (101,) over percent 0..100 of the stride (`gait_events.PERCENT`) unless said otherwise. A statistic
that cannot be computed (no data, no spread) is None, never NaN. The windows contain people's two force peaks and the
valley between them at every walking speed.
"""

from dataclasses import dataclass
from math import isfinite
from typing import SupportsFloat

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray

FIRST_PEAK_PERCENT = (3, 25)
"""Window of the vertical force's first peak (weight acceptance) [percent of stride]."""
VALLEY_PERCENT = (15, 45)
"""Window of the valley between the peaks (mid-stance) [percent of stride]."""
SECOND_PEAK_PERCENT = (35, 60)
"""Window of the second peak (push-off) [percent of stride]."""
LOADING_END_PERCENT = 10
"""End of the loading response, which begins at 0 [percent of stride]; chosen."""
PUSH_OFF_BEGIN_PERCENT = 45
"""Beginning of push-off, and end of mid-stance [percent of stride]; chosen. Push-off ends at toe-off."""
REST_SECONDS, REST_TRAVEL = 1.0, 0.01
"""Time at the end [s] in which the points of a body at rest stay within this distance in x and z [m]; chosen."""


def rmse(curve: ArrayLike, reference: ArrayLike) -> float | None:
    """Return the root mean square difference of two curves, in their unit; no offset removed.

    None for curves without samples, and for values that are not finite.
    """
    difference = np.asarray(curve, float) - np.asarray(reference, float)
    return _number(np.sqrt(np.mean(difference**2))) if difference.size else None


def correlation(curve: ArrayLike, reference: ArrayLike) -> float | None:
    """Return Pearson's r of two curves; None if either is constant, or not finite."""
    a, b = (np.asarray(values, float) for values in (curve, reference))
    # A constant curve keeps rounding errors of 1e-16 of its mean, which must not pass for a shape.
    floor = 1e-12 * np.sqrt(np.sum(a * a) * np.sum(b * b))
    a = a - np.mean(a)
    b = b - np.mean(b)
    scale = np.sqrt(np.sum(a * a) * np.sum(b * b))
    return _number(np.sum(a * b) / scale) if scale > floor else None


def share_within_sd(curve: ArrayLike, mean: ArrayLike, sd: ArrayLike) -> float | None:
    """Return the percentage of the curve's samples inside mean ± sd; None for a curve that is not finite."""
    inside = np.abs(np.asarray(curve, float) - np.asarray(mean)) <= np.asarray(sd)
    return _number(100 * np.mean(inside)) if np.all(np.isfinite(curve)) else None


@dataclass(frozen=True, kw_only=True)
class ForceFeatures:
    """Landmarks of one foot's ground reaction force (GRF) over the stride, in the curves' unit (body weights)."""

    vertical_peak1: float | None
    """Largest vertical force in 3 to 25 %."""
    vertical_valley: float | None
    """Smallest vertical force in 15 to 45 %."""
    vertical_peak2: float | None
    """Largest vertical force in 35 to 60 %."""
    braking_peak: float | None
    """Smallest fore-aft force, negative: backward on the body."""
    forward_peak: float | None
    """Largest fore-aft force."""


def force_features(vertical: NDArray, forward: NDArray) -> ForceFeatures:
    """Return peaks and valley of one foot's mean vertical and fore-aft force curves."""
    return ForceFeatures(
        vertical_peak1=_number(np.max(_window(vertical, FIRST_PEAK_PERCENT))),
        vertical_valley=_number(np.min(_window(vertical, VALLEY_PERCENT))),
        vertical_peak2=_number(np.max(_window(vertical, SECOND_PEAK_PERCENT))),
        braking_peak=_number(np.min(forward)),
        forward_peak=_number(np.max(forward)),
    )


def largest(curve: NDArray) -> tuple[float | None, int | None]:
    """Return the largest value of a curve and its percent; None for both if the curve is not finite throughout."""
    if not np.all(np.isfinite(curve)):
        return None, None
    percent = int(np.argmax(curve))
    return float(curve[percent]), percent


def stride_work(power: NDArray, stride_time: NDArray) -> tuple[NDArray, NDArray]:
    """Return positive and negative work of each stride (S,), the negative as a positive number.

    `power` (S, 101) [W] or [W/kg] over percent of strides lasting `stride_time` (S,) [s]; the work is in J or J/kg.
    Trapezoidal rule.
    """
    positive = np.maximum(power, 0.0)
    negative = np.maximum(-power, 0.0)
    spacing = np.asarray(stride_time) / 100  # from percent to percent [s]
    return np.trapezoid(positive, axis=-1) * spacing, np.trapezoid(negative, axis=-1) * spacing


def phase_means(curve: NDArray, toe_off_percent: float) -> dict[str, float | None]:
    """Return a curve's means in loading (0 to 10 %), mid_stance (10 to 45 %), push_off (45 % to toe-off) and swing.

    A percent belongs to the phase that it begins; percent 100 is percent 0 of the next stride and left out.
    None for a phase without a percent.
    """
    percent = np.arange(100)
    bounds = (0, LOADING_END_PERCENT, PUSH_OFF_BEGIN_PERCENT, toe_off_percent, 100)
    names = ("loading", "mid_stance", "push_off", "swing")
    means: dict[str, float | None] = {}
    for name, low, high in zip(names, bounds[:-1], bounds[1:], strict=True):
        values = curve[:100][(percent >= low) & (percent < high)]
        means[name] = _number(np.mean(values)) if values.size else None
    return means


def travel(position: NDArray, force: NDArray, least: float) -> float:
    """Return the path [m] along the ground of C contact points of a foot while they bear load.

    They are at `position` (T, C) [m] and bear `force` (T, C) [N]. Each point counts by its fraction of the foot's load,
    so that a rigid foot that slides by d travels d with any number of contact points. An interval between two samples
    counts only if the foot bears more than `least` [N] at both.
    """
    between = force[1:] + force[:-1]  # in each interval, twice the mean
    fraction = between / np.maximum(between.sum(axis=1, keepdims=True), 1e-12)  # no division by 0 in the air
    loaded = force.sum(axis=1) > least
    return float(np.sum((np.abs(np.diff(position, axis=0)) * fraction)[loaded[1:] & loaded[:-1]]))


def at_rest(*points: NDArray, tick: float) -> bool:
    """Tell whether points (T, 2) [m], sampled every `tick` [s], rest at the end.

    False for a series that is too short.
    """
    samples = round(REST_SECONDS / tick)
    return all(len(x) >= samples and np.ptp(x[-samples:], axis=0).max() <= REST_TRAVEL for x in points)


def mean_sd(values: ArrayLike) -> dict[str, float | None]:
    """Return {"mean", "sd"} of a sample; sd with n - 1, None for fewer than two."""
    values = np.asarray(values, float)
    mean = _number(np.mean(values)) if values.size else None
    return {"mean": mean, "sd": _number(np.std(values, ddof=1)) if values.size > 1 else None}


def _window(curve: NDArray, percent: tuple[int, int]) -> NDArray:
    """Return a curve's values from the first to the last percent of a window, both included."""
    return curve[percent[0] : percent[1] + 1]


def _number(value: SupportsFloat) -> float | None:
    """Return a value as a float; None if it is not finite."""
    number = float(value)
    return number if isfinite(number) else None
