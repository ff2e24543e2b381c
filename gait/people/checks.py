"""Check that measured curves are those of a walking person, in the units and signs of `HumanGait`, by people's curves.

A wrong unit makes a curve many times too large or too small, another zero moves it, a wrong sign turns it, a wrong foot
shifts it by half a stride, time that runs backward reverses it, noise roughens it. People with another walk, or a body
that walks here on any of its feet, slopes and speeds, differ from people by less than that.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..body.body import GRAVITY, REFERENCE_MASS
from .gait_events import PERCENT
from .human import COLUMNS, HumanGait
from .strides import ANGLE_CURVES, MeasuredWalk, cut_strides

_ZEROS = {"thigh": "upright", "hip": "a thigh in line with the pelvis", "ankle": "a shank at right angles to the sole"}
_ZEROS |= {"toe": "a toe in line with the sole"}
_LEVERS = ("hip_moment", "knee_moment", "ankle_moment")


class Limits(NamedTuple):
    """Limits of a right curve."""

    least: float
    """Least excursion over people's [-]."""
    most: float
    """Largest excursion over people's [-]."""
    likeness: float
    """Least correlation with people's curve."""


CURVE_LIMITS = {
    "thigh": Limits(0.1, 2.5, 0.35),  # 0.43 to 1.76, 0.53
    "hip": Limits(0.1, 2.5, 0.35),  # 0.43 to 1.75, 0.53
    "knee": Limits(0.1, 1.75, -0.35),  # 0.49 to 1.45, -0.26
    "ankle": Limits(0.1, 2.2, -0.3),  # 0.23 (rigid 0.004) to 1.55, 0.02
    "toe": Limits(0.1, 3.0, -0.85),  # 0.001 to 1.40, -0.72
    "hip_moment": Limits(0.1, 4.0, -0.3),  # 0.32 to 2.62, -0.01
    "knee_moment": Limits(0.1, 8.0, -0.7),  # 0.43 to 5.17, -0.54
    "ankle_moment": Limits(0.1, 3.5, 0.1),  # 0.36 to 2.66, 0.18
    "hip_power": Limits(0.05, 10.0, -0.5),  # 0.25 to 4.80, -0.16
    "knee_power": Limits(0.05, 12.0, -0.7),  # 0.36 to 7.08, -0.44
    "ankle_power": Limits(0.05, 12.0, -0.5),  # 0.02 to 6.48, -0.09
    "grf_vertical": Limits(0.2, 3.5, 0.35),  # 0.59 to 2.26, 0.53
    "grf_forward": Limits(0.2, 5.0, 0.0),  # 0.38 to 3.25, 0.23
}
"""Limits of each curve, and behind them the least and largest excursion and the least likeness of right curves. Chosen
from the extremes of some 600 right ones: Bovi's people at 0.85 to 1.96 m/s, with habits drawn as in the tests, and
walks here without a fall: 8 policies and springs at 0.6 to 1.8 m/s, on slopes of -5 to 5 deg, on all kinds of feet,
with legs tuned for sound feet and with legs searched for each, by people's curves or a plan."""
SMALL_MEANS_NOTHING = ("toe", "knee_moment", "hip_power", "knee_power", "ankle_power", "grf_forward")
"""Curves that are small in some walks; with a rigid ankle, which its power tells, the ankle's curves too."""
ALONE = 1.65
"""Largest excursion of the ankle's moment over people's in a file without forces, unless the user gave the mass that
divides it [-]; chosen. With forces the lever is checked instead (`LEVERS`)."""
ROUGHNESS = {"angle": 0.04, "moment": 0.08, "power": 0.08, "grf": 0.08}
"""Largest median of second differences from percent to percent, over the excursion, or people's if larger [-]; chosen.
Right curves have 0.013, 0.046, 0.042 and 0.051; noise of a tenth of the excursion 0.05, of a fifth 0.09."""
LARGEST_OFFSET = np.radians(30)
"""Largest difference of an angle's mean from people's [rad]; chosen. Right curves have 23 deg at the hip, on a slope
downward, and 13 deg elsewhere."""
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
"""Mistaken unit -> the factor by which it makes a curve larger."""
MISTAKEN_BEFORE_MASS = {
    "moment": {"N m/kg where N m must be": 1 / REFERENCE_MASS, "N mm where N m must be": 1e3, "kN m": 1e-3},
    "power": {"W/kg where W must be": 1 / REFERENCE_MASS, "mW": 1e3},
    "grf": {
        "body weights where N must be": 1 / (GRAVITY * REFERENCE_MASS),
        "percent of body weight where N must be": 100 / (GRAVITY * REFERENCE_MASS),
        "N/kg where N must be": 1 / REFERENCE_MASS,
        "kN where N must be": 1e-3,
    },
}
"""As `MISTAKEN_UNITS`, of curves that are divided by mass or weight after reading."""
UNITS_TOLD = {"angle": "deg", "moment": "N m/kg", "power": "W/kg", "grf": "body weights"}
"""Unit in which a curve is told that has a column of another name than in `COLUMNS`."""
NEAR_UNIT = 2.5
"""Largest factor between a curve and people's curve in a mistaken unit for that unit to be the guess; chosen."""
LARGEST_KNEE = np.radians(100)
"""Largest mean flexion of a knee over the stride [rad]; chosen. A larger one is the angle between thigh and shank."""
BORNE = (0.25, 0.8)
"""Least and largest mean vertical force over the stride [body weights]; chosen. Two feet bear one body weight, so each
bears half of it; right curves have 0.30 (limping) to 0.66 (with a load)."""
LEVERS = (0.03, 0.21)
"""Least and largest distance of the force from the ankle at the peak of its moment, for moments in N m/kg and forces in
body weights [m]; chosen: it is about the length of the forefoot, 0.14 m. Right curves have 0.077 to 0.169; 1.9 times
people's is 0.217 to 0.236."""
LEAST_LOAD = 0.3
"""Least vertical force at the peak of the ankle's moment [body weights]; chosen."""
TURNED = -0.5
"""Correlation with people's curve below which the sign of a curve counts as wrong; chosen."""
LEAST_SHIFT, SHIFT_GAIN = 12, 0.15
"""Least shift that counts [percent of the stride], and correlation that every curve must gain by it; chosen."""
REVERSED_GAIN = 0.5
"""Mean correlation that curves must gain by running backward, with no curve losing; chosen. Two or more right curves
gain 0.34 at most, reversed ones 0.75 at least."""
HALF_A_STRIDE, HALF_GAIN = slice(35, 66), 0.6
"""Shifts that count as half a stride, and correlation that a single curve must gain by one of them; chosen."""
SHAPED = ("thigh", "hip", "knee", "ankle", "hip_moment", "ankle_moment", "grf_vertical", "grf_forward")
"""Curves that are checked for a shift of half a stride: right ones gain 0.38 at most, people's half a stride late 1.0
at least."""


MOST_SPREAD = 2.0
"""Largest standard deviation over the range of a curve, its own or people's; chosen. A limping person here has
1.02."""
Curves = Mapping[str, NDArray]
AS_IT_IS = "if it is right, trust_units takes it as it is"


def require_plausible(
    name: str,
    mean: Curves,
    people: HumanGait,
    sd: Curves | None = None,
    mass_given: bool = False,
    columns: Mapping[str, str] = COLUMNS,
    divided: Collection[str] = (),
) -> None:
    """Raise `SpringfootError` for mean curves (101,) that no walk has, with the likeliest cause, such as a wrong unit.

    Args:
        name: of the file.
        mean: curve -> percent 0 to 100 of the stride, in the units of `HumanGait`.
        people: gait to compare the curves with.
        sd: spreads (101,) of some of the curves.
        mass_given: True if moments in N m were divided by a mass that the user gave.
        columns: curve -> its column in the file.
        divided: curves that were divided by mass or weight after reading.
    """
    usual = {curve: people.mean(curve, PERCENT / 100) for curve in COLUMNS}
    if doubt := next(_doubts(mean, usual, mass_given, columns, divided), None):
        raise SpringfootError(f"{name}: {doubt}; {AS_IT_IS}")
    for curve, spread in (sd or {}).items():
        if not 0 <= spread.min() <= spread.max() <= MOST_SPREAD * max(np.ptp(usual[curve]), np.ptp(mean[curve])):
            raise SpringfootError(
                f"{name}: {COLUMNS[curve]}_sd must lie from 0 to {MOST_SPREAD:g} times the range of its curve, or of "
                f"people's if that is larger; {AS_IT_IS}"
            )


def require_plausible_legs(walk: MeasuredWalk, side: str, mass: float | None, people: HumanGait) -> None:
    """Raise `SpringfootError` unless each leg alone walks as people do: a mean of both would hide a wrong one.

    Legs with too few strides for a mean are not checked. Arguments as in `cut_strides`.
    """
    for leg, series in walk.legs.items():
        if side not in ("both", leg):
            continue
        name = f"{walk.name}, the {leg} leg"
        if _bears_downward(series.get("grf_vertical", np.zeros(1))):
            raise SpringfootError(
                f"{name}: the vertical force is below 0 while the foot bears weight: up must be positive; {AS_IT_IS}"
            )
        try:
            _, curves = cut_strides(walk, leg, mass)
        except SpringfootError:  # too few strides
            continue
        mean = {curve: values.mean(axis=0) for curve, values in curves.items()}
        columns = COLUMNS | {curve: column for (side_of, curve), column in walk.columns.items() if side_of == leg}
        # `cut_strides` has divided the file's unscaled curves by the mass.
        divided = {curve for side_of, curve in walk.unscaled if side_of == leg}
        require_plausible(name, mean, people, mass_given=is_mass_given(walk, mass), columns=columns, divided=divided)


def is_mass_given(walk: MeasuredWalk, mass: float | None) -> bool:
    """Tell whether moments in N m are divided by a `mass` [kg] that the user gave."""
    return mass is not None and any(curve == "ankle_moment" for _, curve in walk.unscaled)


def _bears_downward(force: NDArray) -> bool:
    """Tell whether a vertical force (T,) has the wrong sign: it is below 0 often, but not always.

    An empty plate shows noise, or an offset: it is below 0 hardly ever, or all the time.
    """
    least = force.min(initial=0.0)
    # A foot bears in about half of the samples, 25 to 90 %; there the force is beyond half of its extreme.
    return bool(-least > force.max(initial=0.0) and 0.25 < np.mean(force < 0.5 * least) < 0.9)


def _doubts(
    mean: Curves, usual: Curves, mass_given: bool, columns: Mapping[str, str], divided: Collection[str]
) -> Iterator[str]:
    """Yield texts that say why mean curves (101,) cannot be right, the surest first.

    `usual` are people's curves, the rest is as in `require_plausible`.
    """
    if "knee" in mean and mean["knee"].mean() > LARGEST_KNEE:
        yield (
            f"the knee is at {np.degrees(mean['knee']).mean():.0f} deg on the average: the angle between thigh and "
            "shank? flexion is 180 deg less that"
        )
    sizes = {curve: float(np.ptp(mean[curve]) / np.ptp(usual[curve])) for curve in mean}
    yield from _doubts_of_noise(mean, usual, columns)
    yield from _doubts_of_size(mean, sizes, mass_given, columns, divided)
    large_enough = [curve for curve in mean if sizes[curve] >= CURVE_LIMITS[curve].least]
    # Entry k is the correlation after a shift of k % of the stride: entry 0 is that of the curve as it is.
    likeness = {curve: _likeness(mean[curve], usual[curve]) for curve in large_enough}
    backward = {curve: _likeness(mean[curve][::-1], usual[curve]) for curve in large_enough}
    yield from _doubts_of_time(likeness, backward)
    moments = [curve for curve in _LEVERS if curve in mean]
    if len(moments) > 1 and all(curve in likeness and likeness[curve][0] < TURNED for curve in moments):
        yield "hip, knee and ankle moments are opposite to people's: external moments? internal ones are needed"
    unlike = [
        curve
        for curve in large_enough
        if likeness[curve][0] < CURVE_LIMITS[curve].likeness
        or (curve in SHAPED and likeness[curve][HALF_A_STRIDE].max() - likeness[curve][0] > HALF_GAIN)
    ]
    # A curve unlike people's gets a guess of the cause. Those of the wrong sign are surer than the next two checks.
    guesses = {
        curve: _guess(curve, mean[curve], usual, likeness[curve], backward[curve][0], columns) for curve in unlike
    }
    for curve in unlike:
        if guesses[curve] == _OPPOSITE:
            yield f"{columns[curve]} is opposite to people's (r = {likeness[curve][0]:.2f}): {_needed_sign(curve)}"
    yield from _doubts_of_zero(mean, usual, columns)
    yield from _doubts_of_forces(mean, columns)
    for curve, guess in guesses.items():
        yield f"{columns[curve]} is not like people's (r = {likeness[curve][0]:.2f}){guess}?"


def _doubts_of_noise(mean: Curves, usual: Curves, columns: Mapping[str, str]) -> Iterator[str]:
    """Yield a text for each mean curve (101,) with more noise than `ROUGHNESS`; arguments as in `_doubts`."""
    for curve, values in mean.items():
        jump = float(np.median(np.abs(np.diff(values, 2))))
        if jump > ROUGHNESS[_kind(curve)] * max(np.ptp(values), np.ptp(usual[curve])):
            yield f"{columns[curve]} jumps up and down from percent to percent: noise? filter it, or take more strides"


def _doubts_of_size(
    mean: Curves, sizes: Mapping[str, float], mass_given: bool, columns: Mapping[str, str], divided: Collection[str]
) -> Iterator[str]:
    """Yield a text for each curve that is too large or too small, with the mistaken unit if there is one.

    `sizes` are excursions over people's, the rest is as in `_doubts`.
    """
    for curve, size in sizes.items():
        kind = _kind(curve)
        low, high, _ = CURVE_LIMITS[curve]  # the third limit is that of the likeness
        if curve == "ankle_moment" and "grf_vertical" not in mean and not mass_given:
            high = ALONE
        if size > high or (size < low and not _may_be_small(curve, sizes)):
            if size == 0:
                value = mean[curve][0] + 0.0  # no -0
                yield f"{columns[curve]} is {value:.3g} throughout the stride: was it measured?"
                continue
            least, most = _range_as_written(curve, mean[curve])
            unit = "" if columns[curve] == COLUMNS[curve] else f" {UNITS_TOLD[kind]}"
            yield (
                f"{columns[curve]} goes from {least:.3g} to {most:.3g}{unit}, {size:.2g} times as far as people's: "
                f"{_mistaken_unit(kind, size, curve in divided)}?"
            )


def _may_be_small(curve: str, sizes: Mapping[str, float]) -> bool:
    """Tell whether a curve may be this small because some walks hardly have it, and not by a wrong unit.

    In a wrong unit all curves of its kind would be small. `sizes` is curve -> excursion over people's.
    """
    rigid = curve == "ankle" and sizes.get("ankle_power", np.inf) < CURVE_LIMITS["ankle"].least
    others = [size >= CURVE_LIMITS[name].least for name, size in sizes.items() if _kind(name) == _kind(curve)]
    return (rigid or curve in SMALL_MEANS_NOTHING) and any(others)


def _mistaken_unit(kind: str, size: float, divided: bool) -> str:
    """Return the mistaken unit that makes a curve about `size` times as large as people's, or a vaguer cause; `divided`
    is True for a curve divided by mass or weight after reading."""
    factors = MISTAKEN_BEFORE_MASS[kind] if divided else MISTAKEN_UNITS[kind]
    nearest = min(factors, key=lambda unit: abs(np.log(size / factors[unit])))
    near = abs(np.log(size / factors[nearest])) < np.log(NEAR_UNIT)
    return nearest if near else "another scale, or another joint's"


def _doubts_of_zero(mean: Curves, usual: Curves, columns: Mapping[str, str]) -> Iterator[str]:
    """Yield a text for each angle with a mean far from people's, as if counted from another zero; arguments as in
    `_doubts`."""
    for curve in (name for name in mean if name in ANGLE_CURVES):
        offset = float(mean[curve].mean() - usual[curve].mean())
        if abs(offset) > LARGEST_OFFSET:
            yield (
                f"{columns[curve]} is {np.degrees(mean[curve].mean()):.0f} deg on the average, "
                f"{np.degrees(abs(offset)):.0f} deg {'more' if offset > 0 else 'less'} than people's: from another "
                f"zero? 0 is {_ZEROS.get(curve, 'a straight leg')}"
            )


def _kind(curve: str) -> str:
    """Return the kind of a curve: angle, moment, power or grf."""
    if curve in ANGLE_CURVES:
        return "angle"
    return "grf" if curve.startswith("grf") else curve.rpartition("_")[2]


def _range_as_written(curve: str, values: NDArray) -> tuple[float, float]:
    """Return a curve's least and largest value in the unit of its column: degrees for angles."""
    unit = 180 / np.pi if curve in ANGLE_CURVES else 1.0
    return float(values.min()) * unit, float(values.max()) * unit


def _doubts_of_time(likeness: Curves, backward: Curves) -> Iterator[str]:
    """Yield a text if one shift of all curves, or their reversal in time, brings each nearer to people's.

    `likeness` and `backward` are curve -> correlations (100,) of the curve and of the reversed curve (`_likeness`).
    """
    if len(likeness) < 2:
        return
    unshifted = np.array([[correlations[0]] for correlations in likeness.values()])
    shift_gain = np.array([*likeness.values()]) - unshifted
    reversed_gain = np.array([*backward.values()]) - unshifted
    # The shift, the same for all curves, that gains most in sum; shifts near 0 and 100 % do not count.
    shift = LEAST_SHIFT + int(shift_gain.sum(axis=0)[LEAST_SHIFT : 101 - LEAST_SHIFT].argmax())
    is_shifted = shift_gain[:, shift].min() > SHIFT_GAIN
    # A reversed curve may need any shift besides.
    reversed_shift = int(reversed_gain.sum(axis=0).argmax())
    if reversed_gain[:, reversed_shift].min() > 0 and reversed_gain[:, reversed_shift].mean() > max(
        REVERSED_GAIN, shift_gain[:, shift].mean() if is_shifted else 0.0
    ):
        yield "its curves are people's backward in time: were the samples reversed?"
    elif is_shifted:
        yield (
            f"its curves are people's {shift} % of the stride late: does it begin at the other foot's heel strike? "
            "0 % must be that of the same foot"
        )


_OPPOSITE = ": opposite"


def _guess(
    curve: str, values: NDArray, usual: Curves, likeness: NDArray, backward: float, columns: Mapping[str, str]
) -> str:
    """Return words for the change that makes a curve most like people's: turned, reversed, shifted, or another's name.

    `likeness` (100,) is the curve's `_likeness`, `backward` the correlation of the reversed curve; `columns` as in
    `_doubts`.
    """
    # The best shift; shifts near 0 and 100 % do not count.
    shift = LEAST_SHIFT + int(likeness[LEAST_SHIFT : 101 - LEAST_SHIFT].argmax())
    others = [other for other in usual if other != curve and _kind(other) == _kind(curve)]
    likeness_of_others = {other: _likeness(values, usual[other])[0] for other in others}
    likest = max(likeness_of_others, key=lambda other: likeness_of_others[other])
    # Words for a change -> correlation with people's curve after it.
    correlations = {
        _OPPOSITE: -likeness[0],
        ": backward in time": backward,
        f", but so {shift} % of the stride late: of the other foot": likeness[shift],
        f", but like {columns[likest]}: were columns interchanged": likeness_of_others[likest],
    }
    return max(correlations, key=lambda change: correlations[change])


def _doubts_of_forces(mean: Curves, columns: Mapping[str, str]) -> Iterator[str]:
    """Yield a text if the vertical force does not bear half a body, or does not fit the ankle's moment; arguments as in
    `_doubts`."""
    if "grf_vertical" not in mean:
        return
    force = mean["grf_vertical"]
    least, most = BORNE
    nearest, farthest = LEVERS
    borne = float(force[:-1].mean())  # percent 100 is percent 0 of the next stride
    if not least <= borne <= most:
        guess = "both feet together, or not per body weight?" if borne > most else "not per body weight?"
        yield f"{columns['grf_vertical']} is {borne:.2g} on the average, where each foot bears half of 1: {guess}"
    if "ankle_moment" not in mean:
        return
    peak = int(mean["ankle_moment"].argmax())
    column = columns["ankle_moment"]
    # [N m/kg] over [body weights] x g is the distance [m] of the force from the ankle.
    lever = float(mean["ankle_moment"][peak] / (GRAVITY * max(force[peak], LEAST_LOAD)))
    if force[peak] < LEAST_LOAD:
        yield (
            f"{column} peaks at {peak} % of the stride, where the foot bears {force[peak]:.2g} body weights: "
            "moment and force of one foot?"
        )
    elif not nearest <= lever <= farthest:
        comparison = "longer" if lever > farthest else "shorter"
        yield (
            f"{column} at its peak is the force at a lever of {lever:.2g} m, {comparison} than a foot's: N m/kg and "
            "body weights?"
        )


def _likeness(values: NDArray, usual: NDArray) -> NDArray:
    """Return (100,) correlations of a curve (101,) with people's, `usual`, after shifts of 0 to 99 % of the stride.

    Shifts are towards earlier. It is a circular cross-correlation, by Fourier transform.
    """
    # Percent 100 repeats percent 0. A constant curve has a scale of 0, and then correlations of 0.
    centred, usual_centred = (curve[:-1] - curve[:-1].mean() for curve in (values, usual))
    scale = float(np.sqrt((centred @ centred) * (usual_centred @ usual_centred))) or 1.0
    return np.fft.irfft(np.fft.rfft(centred) * np.conj(np.fft.rfft(usual_centred)), len(centred)) / scale


def _needed_sign(curve: str) -> str:
    """Return a text that says which direction of a curve must be positive."""
    positive = {"knee_moment": "extension", "hip_moment": "extension", "ankle_moment": "plantarflexion"}
    positive |= {"ankle": "dorsiflexion", "toe": "toe-up", "grf_vertical": "up", "grf_forward": "forward"}
    default = "generation" if curve.endswith("power") else "flexion"
    return f"{positive.get(curve, default)} must be positive"
