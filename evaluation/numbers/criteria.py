"""List the criteria of an evaluation, on the numbers of metrics.json, and tell which of them a gait misses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any, Literal

from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.settings.settings import settings_from

LOOSENED_BY, LOOSENED_R_BY = 0.2, 0.02
"""Loosening of criteria for each of several seeds: errors and forces as a fraction of the limit; r [-]."""


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """A number of an evaluation and its allowed range, ends included; numbers are those of `with_derived(metrics)`."""

    name: str
    """Name in messages and tables of several walks."""
    path: tuple[str, ...]
    """Keys of the number in `with_derived(metrics)`."""
    low: float = -inf
    """Least allowed number."""
    high: float = inf
    """Largest allowed number."""
    unit: str = ""
    """Unit of the number, with the space before it where it has one."""
    pattern: str = ".2f"
    """Format of the number as text."""
    loosen: Literal["share", "r", ""] = ""
    """Rule by which `loosened` widens the range."""
    label: str = ""
    """Name in the table of one walk; empty: the criterion's name."""

    def value(self, values: dict[str, Any]) -> float | None:
        """Return the criterion's number among `values`, from `with_derived`; None if it could not be measured."""
        value: Any = values
        for key in self.path:
            value = value[key]
        return value

    def holds(self, values: dict[str, Any]) -> bool:
        """Return True if the criterion's number among `values` was measured and lies in the range."""
        value = self.value(values)
        return value is not None and self.low <= value <= self.high

    def loosened(self) -> "Criterion":
        """Return the criterion with a wider range, for each of several seeds.

        `loosen` names the rule: each end moves by `LOOSENED_BY` of itself ("share"), the low end by `LOOSENED_R_BY`
        ("r"), or none ("")."""
        if self.loosen == "share":
            return replace(
                self, low=self.low - LOOSENED_BY * abs(self.low), high=self.high + LOOSENED_BY * abs(self.high)
            )
        if self.loosen == "r":
            return replace(self, low=self.low - LOOSENED_R_BY)
        return self

    @property
    def text(self) -> str:
        """Return the allowed range as text with its unit: `≤ 3.5°`, `≥ 0.98`, `59.0 … 65.0 %`, or one number."""
        low, high = (format(end, self.pattern) for end in (self.low, self.high))
        if self.low == -inf:
            return f"≤ {high}{self.unit}"
        if self.high == inf:
            return f"≥ {low}{self.unit}"
        if self.low == self.high:
            return low + self.unit
        return f"{low} … {high}{self.unit}"


def with_derived(metrics: dict[str, Any]) -> dict[str, Any]:
    """Return the metrics with two more keys for the criteria: `off` and `double_support_percent`.

    `off` holds absolute differences: of the speed from the commanded one [m/s], of step length and cadence from the
    plan's [%]. `double_support_percent` is one double support as a percent of the stride.
    """
    settings = settings_from(**metrics["environment"])
    plan = reference_walk_at(settings, settings.speed).plan
    cadence = metrics["cadence_steps_min"]
    double_support = metrics["double_support_s"]

    def percent_off(value: float | None, planned: float) -> float | None:
        """Return the absolute difference of a value from the plan's [%]."""
        return None if value is None else 100 * abs(value / planned - 1)

    speed = metrics["speed_m_s"]["mean"]
    off = {
        "speed_m_s": None if speed is None else abs(speed - settings.speed),
        "step_length_percent": percent_off(metrics["step_length_m"], plan.step_length),
        "cadence_percent": percent_off(cadence, 60 / plan.step_time),
    }
    # The stride is two steps: it lasts 120 / cadence [s], with the cadence in steps a minute.
    double_support_percent = None if double_support is None or not cadence else 100 * double_support * cadence / 120
    return metrics | {"off": off, "double_support_percent": double_support_percent}


def unmet(metrics: dict[str, Any], criteria: Sequence[Criterion]) -> list[str]:
    """Return those of `criteria` that an evaluation misses, each as its name, number and allowed range; empty if it
    meets all.

    `metrics` is the content of metrics.json.
    """
    values = with_derived(metrics)
    return [
        f"{criterion.name} {missed_text(criterion, values)}" for criterion in criteria if not criterion.holds(values)
    ]


def number_text(criterion: Criterion, values: dict[str, Any]) -> str:
    """Return the criterion's number with its unit as text, "?" if it could not be measured."""
    value = criterion.value(values)
    return "?" if value is None else format(value, criterion.pattern) + criterion.unit


def missed_text(criterion: Criterion, values: dict[str, Any]) -> str:
    """Return the criterion's number and its allowed range as text: `2.59°, asked ≤ 2.50°`."""
    return f"{number_text(criterion, values)}, asked {criterion.text}"


_FORCES = {
    "vertical_peak1_bw": "vertical force, peak 1",
    "vertical_valley_bw": "vertical force, valley",
    "vertical_peak2_bw": "vertical force, peak 2",
    "vertical_max_bw": "vertical force, largest 10 ms of any stride",
    "vertical_r": "vertical force r",
    "braking_peak_bw": "fore-aft force, braking",
    "forward_peak_bw": "fore-aft force, forward",
    "forward_r": "fore-aft force r",
}
"""Name in `grf` of metrics.json -> label."""


def _force(name: str, low: float = -inf, high: float = inf) -> Criterion:
    """Return the criterion of a number of the ground reaction force [body weights]; `name` as in `_FORCES`."""
    label = _FORCES[name]
    return Criterion(name=name, path=("grf", name), low=low, high=high, unit=" BW", loosen="share", label=label)


def _rmse(joint: str, high: float) -> Criterion:
    """Return the criterion of the RMSE of a joint's angle to people's mean [deg]."""
    return Criterion(
        name=joint, path=("joints", joint, "rmse_deg"), high=high, unit="°", loosen="share", label=f"RMSE {joint}"
    )


def _correlation(name: str, path: tuple[str, ...], low: float) -> Criterion:
    """Return the criterion of a correlation with people's curve, at least `low`."""
    return Criterion(name=name, path=path, low=low, pattern=".3f", loosen="r", label=_FORCES.get(name, ""))


NO_FALLS = Criterion(name="falls", path=("falls",), high=0, pattern=".0f")
GROUND_GIVES_NOTHING = Criterion(
    name="contact work", path=("energy_J_kg", "contact"), high=0.0, unit=" J/kg", pattern=".3g"
)
"""Ground and joint stops can only take energy: over a stride of both legs they do no work on the body. More than that
is a fault of the simulation, most often of a physics step too coarse for stiff or strongly damped joints."""


def fault(metrics: dict[str, Any]) -> str:
    """Return in a sentence the fault of the simulation that an evaluation shows; empty if it shows none."""
    if GROUND_GIVES_NOTHING.value(metrics) is None or GROUND_GIVES_NOTHING.holds(metrics):
        return ""
    return (
        f"Fault of the simulation: ground and joint stops put {number_text(GROUND_GIVES_NOTHING, metrics)} a stride "
        "into the body, and can only take energy; its forces and energies are not to be trusted."
    )


WALKS = (
    NO_FALLS,
    GROUND_GIVES_NOTHING,
    Criterion(name="speed off by", path=("off", "speed_m_s"), high=0.03, unit=" m/s", pattern=".3f"),
    _rmse("thigh", 3.5),
    _rmse("knee", 4.5),
    _rmse("ankle", 4.0),
    _force("vertical_peak1_bw", high=1.3),
    _force("vertical_peak2_bw", high=1.3),
    _correlation("vertical_r", ("grf", "vertical_r"), 0.93),
)
"""Criteria of a walk: angles nearer to people's mean than one person's usually are, no hard landing."""

MOVES_LIKE_PEOPLE = (
    _rmse("thigh", 2.5),
    _rmse("knee", 3.5),
    _rmse("ankle", 2.5),
    *(_correlation(f"{joint} r", ("joints", joint, "r"), 0.98) for joint in ("thigh", "knee", "ankle")),
    *(
        Criterion(
            name=f"{joint} within SD", path=("joints", joint, "within_1sd_percent"), low=low, unit=" %", pattern=".0f"
        )
        for joint, low in (("thigh", 75.0), ("knee", 75.0), ("ankle", 75.0), ("toe", 80.0))
    ),
    Criterion(name="step length off by", path=("off", "step_length_percent"), high=5.0, unit=" %", pattern=".1f"),
    Criterion(name="cadence off by", path=("off", "cadence_percent"), high=5.0, unit=" %", pattern=".1f"),
    Criterion(name="toe-off", path=("toe_off_percent",), low=59.0, high=65.0, unit=" %", pattern=".1f"),
    Criterion(name="double support", path=("double_support_percent",), low=9.0, high=15.0, unit=" %", pattern=".1f"),
)
"""Human-like in motion: below the distance of one healthy person from the mean of many."""

LOADS_LIKE_PEOPLE = (
    _force("vertical_peak1_bw", 1.0, 1.12),
    _force("vertical_valley_bw", 0.75, 0.88),
    _force("vertical_peak2_bw", 1.05, 1.22),
    _force("vertical_max_bw", high=1.3),
    _correlation("vertical_r", ("grf", "vertical_r"), 0.97),
    _force("braking_peak_bw", -0.20, -0.12),
    _force("forward_peak_bw", 0.16, 0.25),
    _correlation("forward_r", ("grf", "forward_r"), 0.95),
    Criterion(
        name="ankle moment peak",
        path=("moments", "ankle", "peak_Nm_kg"),
        low=1.2,
        high=1.5,
        unit=" N·m/kg",
        loosen="share",
    ),
    Criterion(
        name="ankle moment peak at",
        path=("moments", "ankle", "peak_percent"),
        low=42,
        high=52,
        unit=" %",
        pattern=".0f",
    ),
    _correlation("ankle moment r", ("moments", "ankle", "r"), 0.95),
    _correlation("knee moment r", ("moments", "knee", "r"), 0.8),
    _correlation("hip moment r", ("moments", "hip", "r"), 0.9),
    Criterion(
        name="hip moment within 2 SD",
        path=("moments", "hip", "within_2sd_percent"),
        low=80.0,
        unit=" %",
        pattern=".0f",
    ),
    Criterion(
        name="hip moment in late swing",
        path=("moments", "hip", "late_swing_peak_Nm_kg"),
        high=0.35,
        unit=" N·m/kg",
        loosen="share",
    ),
)
"""Human-like in force: ground reaction forces and joint moments."""


def _work(joint: str, sign: str, low: float, high: float) -> Criterion:
    """Return the criterion of a joint's positive or negative work in a stride [J/kg]."""
    name = f"{joint} work {'+' if sign == 'positive' else '−'}"
    path = ("joint_work_J_kg", joint, sign)
    return Criterion(name=name, path=path, low=low, high=high, unit=" J/kg", pattern=".3f", loosen="share")


def _work_near_people(joint: str, sign: str, peoples_work: float) -> Criterion:
    """Return the criterion of work within 30 % or, if larger, 0.05 J/kg of people's work in a stride [J/kg]."""
    band = max(0.3 * peoples_work, 0.05)
    return _work(joint, sign, round(max(peoples_work - band, 0.0), 3), round(peoples_work + band, 3))


WORKS_LIKE_PEOPLE = (
    _work_near_people("hip", "positive", 0.18),
    _work_near_people("hip", "negative", 0.13),
    _work_near_people("knee", "positive", 0.04),
    _work_near_people("knee", "negative", 0.24),
    _work("ankle", "positive", 0.25, 0.45),
    _work("ankle", "negative", 0.08, 0.20),
    Criterion(name="cost of transport", path=("cost_of_transport",), high=0.115, pattern=".3f", loosen="share"),
)
"""Human-like in energy: work of each leg's joints in a stride; people's from their mean power at 1.2 m/s."""
HUMAN_LIKE = (NO_FALLS, *MOVES_LIKE_PEOPLE, *LOADS_LIKE_PEOPLE, *WORKS_LIKE_PEOPLE)
"""All criteria of a walk like people's: no falls, and those of movement, load and work."""
