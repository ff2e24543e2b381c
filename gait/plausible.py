"""Are measured curves those of a person who walks, in the units and signs of `HumanGait`? Seen against people's curves.

A wrong unit makes a curve many times too large or too small, a wrong sign turns it, a wrong foot shifts it by half a
stride. People who walk otherwise, or a body that walks here, differ from people by far less than that.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from .arrays import NDArray
from .body import GRAVITY, REFERENCE_MASS
from .cycle import PERCENT
from .errors import SpringfootError
from .human import ANGLES, COLUMNS, HumanGait

_ALL_ANGLES = (*ANGLES, "hip")
_LEVERS = ("hip_moment", "knee_moment", "ankle_moment")
SIZES = {
    "angle": (0.1, 5.0),
    "moment": (0.1, 5.0),
    "power": (0.05, 8.0),
    "grf": (0.2, 4.0),
}
"""Least and largest excursion of a curve over people's [-]; chosen."""
SMALL_MEANS_NOTHING = ("toe", "knee_moment", "hip_power", "knee_power", "ankle_power", "grf_forward")
"""Curves that some who walk hardly have."""
MISTAKEN_UNITS = {
    "angle": {"radians": np.pi / 180, "degrees where radians must be": 180 / np.pi},
    "moment": {
        "percent of body weight times height": 100 / (GRAVITY * 1.7),
        "N m, not per kg": REFERENCE_MASS,
        "N mm/kg": 1e3,
        "N mm": 1e3 * REFERENCE_MASS,
    },
    "power": {"W, not per kg": REFERENCE_MASS, "mW/kg": 1e3},
    "grf": {"percent of body weight": 100.0, "N": GRAVITY * REFERENCE_MASS, "N/kg": GRAVITY, "kN": 1e-3},
}
"""What may be in place of our units, and by how much larger it makes a curve."""
LARGEST_KNEE = np.radians(100)
"""Largest mean flexion of a knee over the stride [rad]; chosen. More is the angle between thigh and shank."""
BORNE = (0.25, 0.8)
"""Least and largest mean vertical force over the stride [body weights]; chosen. Two feet bear one body weight, so that
each bears half of it."""
LEVERS = (0.03, 0.3)
"""Least and largest distance of the force from the ankle where its moment peaks, for moments in N m/kg and forces in
body weights [m]; chosen: it is about the length of the forefoot, 0.14 m."""
LEAST_LOAD = 0.3
"""Least vertical force where the ankle's moment peaks [body weights]; chosen."""
TURNED = -0.5
"""Correlation with people's curve below which a curve counts as turned; chosen."""
LEAST_SHIFT, SHIFT_GAIN = 12, 0.15
"""Least shift that counts [percent of the stride], and correlation that every curve must gain by it; chosen."""


def require_plausible(name: str, mean: Mapping[str, NDArray], people: HumanGait) -> None:
    """Raise `SpringfootError` for mean curves (101,) that no walk has, saying what was seen and what it may be.

    Args:
        name: of the file.
        mean: curve -> percent 0 to 100 of the stride, in the units of `HumanGait`.
        people: whose curves they are held against.
    """
    usual = {curve: people.mean(curve, PERCENT / 100) for curve in mean}
    for seen in _doubts(mean, usual):
        raise SpringfootError(f"{name}: {seen}; if it is right, trust_units takes it as it is")


def _doubts(mean: Mapping[str, NDArray], usual: Mapping[str, NDArray]) -> Iterator[str]:
    if "knee" in mean and mean["knee"].mean() > LARGEST_KNEE:
        yield (
            f"the knee is at {np.degrees(mean['knee']).mean():.0f} deg on the average: the angle between thigh and "
            "shank? flexion is 180 deg less that"
        )
    for curve in mean:
        kind = _kind(curve)
        size, (low, high) = np.ptp(mean[curve]) / np.ptp(usual[curve]), SIZES[kind]
        if size > high or (size < low and (curve not in SMALL_MEANS_NOTHING or _all_small(mean, usual, kind))):
            if size == 0:
                yield f"{COLUMNS[curve]} is {mean[curve][0] + 0.0:.3g} throughout the stride: was it measured?"
                continue
            factors = MISTAKEN_UNITS[kind]
            times = np.log10(size)
            guess = min(factors, key=lambda unit: abs(times - np.log10(factors[unit])))
            least, most = _as_written(curve, mean[curve])
            yield (
                f"{COLUMNS[curve]} goes from {least:.3g} to {most:.3g}, {size:.2g} times as far as people's: {guess}?"
            )
    yield from _shifted(mean, usual)
    fit = {curve: _likeness(mean[curve], usual[curve]) for curve in mean}
    turned = [curve for curve, r in fit.items() if r < TURNED]
    levers = [curve for curve in _LEVERS if curve in mean]
    if len(levers) > 1 and all(curve in turned for curve in levers):
        yield "hip, knee and ankle moments are opposite to people's: external moments? internal ones are needed"
    for curve in turned:
        yield f"{COLUMNS[curve]} is opposite to people's (r = {fit[curve]:.2f}): {_sign(curve)}"
    yield from _unborne(mean)


def _kind(curve: str) -> str:
    if curve in _ALL_ANGLES:
        return "angle"
    return "grf" if curve.startswith("grf") else curve.rpartition("_")[2]


def _all_small(mean: Mapping[str, NDArray], usual: Mapping[str, NDArray], kind: str) -> bool:
    """Whether every curve of this kind is too small, as a wrong unit makes them."""
    curves = [curve for curve in mean if _kind(curve) == kind]
    return all(np.ptp(mean[curve]) < SIZES[kind][0] * np.ptp(usual[curve]) for curve in curves)


def _as_written(curve: str, values: NDArray) -> tuple[float, float]:
    """Least and largest value in the unit of the column."""
    unit = 180 / np.pi if curve in _ALL_ANGLES else 1.0
    return float(values.min()) * unit, float(values.max()) * unit


def _shifted(mean: Mapping[str, NDArray], usual: Mapping[str, NDArray]) -> Iterator[str]:
    """The shift by which every curve comes nearer to people's."""
    gain = {}
    for late in range(LEAST_SHIFT, 101 - LEAST_SHIFT):
        gains = []
        for curve, values in mean.items():
            moved = np.roll(values[:-1], -late)
            gains.append(_likeness(moved, usual[curve][:-1]) - _likeness(values[:-1], usual[curve][:-1]))
        gain[late] = min(gains), sum(gains)
    best = max(gain, key=lambda late: gain[late][1])
    if len(mean) > 1 and gain[best][0] > SHIFT_GAIN:
        yield (
            f"its curves are people's {best} % of the stride late: does it begin at the other foot's heel strike? "
            "0 % must be that of the same foot"
        )


def _unborne(mean: Mapping[str, NDArray]) -> Iterator[str]:
    """Forces that bear no body, and an ankle moment that is not theirs times a foot's lever."""
    if "grf_vertical" not in mean:
        return
    force, (least, most), (nearest, farthest) = mean["grf_vertical"], BORNE, LEVERS
    borne = float(force[:-1].mean())
    if not least <= borne <= most:
        guess = "both feet together, or not per body weight?" if borne > most else "not per body weight?"
        yield f"{COLUMNS['grf_vertical']} is {borne:.2g} on the average, where each foot bears half of 1: {guess}"
    if "ankle_moment" not in mean:
        return
    peak, column = int(mean["ankle_moment"].argmax()), COLUMNS["ankle_moment"]
    lever = float(mean["ankle_moment"][peak] / (GRAVITY * max(force[peak], LEAST_LOAD)))
    if force[peak] < LEAST_LOAD:
        yield (
            f"{column} peaks at {peak} % of the stride, where the foot bears {force[peak]:.2g} body weights: "
            "moment and force of one foot?"
        )
    elif not nearest <= lever <= farthest:
        than = "longer" if lever > farthest else "shorter"
        yield (
            f"{column} at its peak is the force at a lever of {lever:.2g} m, {than} than a foot's: N m/kg and body "
            "weights?"
        )


def _likeness(values: NDArray, usual: NDArray) -> float:
    """Correlation, 0 for what does not change."""
    return float(np.corrcoef(values, usual)[0, 1]) if np.ptp(values) > 0 else 0.0


def _sign(curve: str) -> str:
    """What must be positive."""
    positive = {"knee_moment": "extension", "hip_moment": "extension", "ankle_moment": "plantarflexion"}
    positive |= {"ankle": "dorsiflexion", "toe": "toe-up", "grf_vertical": "up", "grf_forward": "forward"}
    default = "generation" if curve.endswith("power") else "flexion"
    return f"{positive.get(curve, default)} must be positive"
