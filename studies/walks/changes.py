"""Hold the changes from a slower to a faster walk against those of people.

    springfoot study changes schedule predicted learned

A walk that looks like people's at one speed need not change as people do. The change of each joint's angle over the
stride stands beside people's own, which is the error of the prediction "nothing changes"; so do the changes of the
numbers in `QUANTITIES`. Those count that change in people by more than the spread between them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.arrays import NDArray
from springfoot.envs.control import reference_walk_at
from springfoot.envs.settings import BipedSettings
from springfoot.errors import SpringfootError, require_within
from springfoot.evaluation.numbers import Gait, measure
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.files.markdown import MISSING, span_text, table, text_of
from springfoot.files.writing import csv_text
from springfoot.gait.people import COLUMNS, PERCENT, HumanGait, correlation, human_gait, rmse
from springfoot.gait.plan import PLAN_SPEED_RANGE

from ..base.columns import COMPARED_JOINTS
from ..base.study import Answer, OnProgress, WalkingStudy

Measure = Callable[[NDArray, NDArray, float], tuple[float, float]]
"""Function of a curve, of its spread, both over a part of the stride, and of the time between samples [s] that returns
a number and its spread."""


def highest(curve: NDArray, spread: NDArray, tick: float) -> tuple[float, float]:
    """Return the highest value of `curve`, and `spread` at that sample."""
    at = int(np.argmax(curve))
    return float(curve[at]), float(spread[at])


def lowest(curve: NDArray, spread: NDArray, tick: float) -> tuple[float, float]:
    """Return the lowest value of `curve`, and `spread` at that sample."""
    value, spread_there = highest(-curve, spread, tick)
    return -value, spread_there


def extent(curve: NDArray, spread: NDArray, tick: float) -> tuple[float, float]:
    """Return the difference of the highest and the lowest value, and its spread if the two vary independently."""
    (high, high_spread), (low, low_spread) = highest(curve, spread, tick), lowest(curve, spread, tick)
    return high - low, hypot(high_spread, low_spread)


def positive_work(curve: NDArray, spread: NDArray, tick: float) -> tuple[float, float]:
    """Return the work [J/kg] of the positive part of the power `curve` [W/kg], and an upper bound of its spread: the
    work of `spread` where the power is positive."""
    return tick * float(np.maximum(curve, 0.0).sum()), tick * float(spread[curve > 0.0].sum())


def negative_work(curve: NDArray, spread: NDArray, tick: float) -> tuple[float, float]:
    """Return the size of the work of the negative part of the power `curve`, and its spread as in `positive_work`."""
    return positive_work(-curve, spread, tick)


@dataclass(frozen=True)
class Quantity:
    """A number of a stride's mean curves."""

    label: str
    """Its name and unit."""
    curve: str
    """The curve that it is of, a key of `COLUMNS`."""
    measure: Measure
    """Function that measures it."""
    part: tuple[int, int] = (0, 100)
    """Part of the stride that counts [%]."""


QUANTITIES = (
    Quantity("range of the thigh [°]", "thigh", extent),
    Quantity("range of the knee [°]", "knee", extent),
    Quantity("range of the ankle [°]", "ankle", extent),
    Quantity("knee flexion in loading [°]", "knee", highest, (5, 35)),
    Quantity("knee flexion in swing [°]", "knee", highest, (60, 90)),
    Quantity("dorsiflexion in stance [°]", "ankle", highest, (20, 60)),
    Quantity("ankle angle about toe-off [°]", "ankle", lowest, (50, 80)),
    Quantity("vertical force, first peak [BW]", "grf_vertical", highest, (5, 30)),
    Quantity("vertical force, valley [BW]", "grf_vertical", lowest, (20, 45)),
    Quantity("vertical force, second peak [BW]", "grf_vertical", highest, (35, 65)),
    Quantity("braking force [BW]", "grf_forward", lowest, (0, 35)),
    Quantity("forward force [BW]", "grf_forward", highest, (35, 65)),
    Quantity("ankle moment [N·m/kg]", "ankle_moment", highest, (30, 65)),
    Quantity("knee moment in loading [N·m/kg]", "knee_moment", highest, (5, 35)),
    Quantity("hip moment in early stance [N·m/kg]", "hip_moment", highest, (0, 30)),
    Quantity("ankle's push-off work [J/kg]", "ankle_power", positive_work, (40, 65)),
    Quantity("hip's positive work [J/kg]", "hip_power", positive_work),
    Quantity("knee's negative work [J/kg]", "knee_power", negative_work),
)
"""Numbers with changes that are told; listed before a walk was held against them."""
WITHIN = 2.0
"""Factor within which a change has the right size."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stride:
    """Mean curves of a stride, in the units of `COLUMNS`, and their spread between people."""

    curves: Mapping[str, NDArray]
    """Key of `COLUMNS` -> (101,)."""
    spreads: Mapping[str, NDArray]
    """Key of `COLUMNS` -> (101,), 0 where there is none."""
    stride_time: float
    """Duration [s]."""

    def number(self, quantity: Quantity) -> tuple[float, float]:
        """Return the value of `quantity` in its part of the stride, and its spread between people."""
        part = (quantity.part[0] <= PERCENT) & (quantity.part[1] >= PERCENT)
        return quantity.measure(
            self.curves[quantity.curve][part], self.spreads[quantity.curve][part], self.stride_time / 100
        )


def stride_of_gait(gait: HumanGait) -> Stride:
    """Return the mean curves of people's gait or of a plan, and their spread; curves that `gait` lacks are left out."""
    phase = PERCENT / 100
    units = {name: 180.0 / np.pi if column.endswith("_deg") else 1.0 for name, column in COLUMNS.items()}
    names = [name for name in COLUMNS if name in gait.mean_series]
    return Stride(
        curves={name: units[name] * gait.mean(name, phase) for name in names},
        spreads={name: units[name] * gait.sd(name, phase) for name in names},
        stride_time=gait.stride_time,
    )


def stride_of_walk(gait: Gait) -> Stride:
    """Return the mean curves of a measured walk over both legs' strides, with spreads of 0."""
    curves = {name: gait.both.mean(column) for name, column in COLUMNS.items() if column in gait.both.names}
    return Stride(
        curves=curves,
        spreads={name: np.zeros_like(curve) for name, curve in curves.items()},
        stride_time=120.0 / gait.metrics["cadence_steps_min"],
    )


@dataclass(frozen=True, kw_only=True)
class Changes(WalkingStudy):
    """Hold the changes from a slower to a faster walk against those of people."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = ("schedule",)
    """Policies to walk with; the plan of least effort stands beside them."""
    speeds: tuple[float, float] = (0.9, 1.5)
    """Slower and faster commanded speed [m/s]."""
    episodes: int = 6
    """Episodes of each policy and speed."""
    seconds: float = 12.0
    """Length of each episode."""
    plan_file: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="(default: the package's)")] = (
        None
    )
    """File of styles; their plans stand beside the policies."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 6.0}

    def check(self) -> None:
        """Refuse counts and lengths out of range, and speeds that do not ascend."""
        super().check()
        for speed in self.speeds:
            require_within("speeds", speed, PLAN_SPEED_RANGE, "m/s")
        if self.speeds[0] >= self.speeds[1]:
            raise SpringfootError(
                f"speeds must be a slower and a faster one, got {self.speeds[0]:g} {self.speeds[1]:g}"
            )

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(self.policies) * len(self.speeds) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every policy at both speeds; hold its changes, and the plan's, against people's."""
        people = [stride_of_gait(human_gait(speed)) for speed in self.speeds]
        walks: dict[str, list[Stride | None]] = {"the plan": [stride_of_gait(self._plan(s)) for s in self.speeds]}
        sentences = []
        for name in self.policies:
            gaits = [self._walk(name, speed, progress) for speed in self.speeds]
            walks[name] = [stride_of_walk(gait) if gait.both.count else None for gait in gaits]
            sentences += [_how_it_walked(name, speed, gait) for speed, gait in zip(self.speeds, gaits, strict=True)]
        whole = {name: [stride for stride in strides if stride] for name, strides in walks.items()}
        changed = {name: strides for name, strides in whole.items() if len(strides) == len(self.speeds)}
        about = f"From {self.speeds[0]:g} to {self.speeds[1]:g} m/s: {self.what_ran}. {' '.join(sentences)}"
        return Answer(
            text=f"{curves_table(people, changed)}\n\n{numbers_table(people, changed)}\n\n{about}",
            files={"changes.csv": changes_csv(people, changed)},
        )

    def _walk(self, name: str, speed: float, progress: OnProgress) -> Gait:
        """Record a policy's walk at a commanded speed [m/s]; return its measurements."""
        act, settings = policy_and_settings(name, {"speed": speed, "episode_seconds": self.seconds})
        return measure(record(act, settings, name=name, progress=progress, **self.how))

    def _plan(self, speed: float) -> HumanGait:
        """Return the plan of least effort at a speed [m/s]."""
        file = None if self.plan_file is None else str(self.plan_file)
        return reference_walk_at(BipedSettings(speed=speed, guide="plan", plan_file=file), speed).target


def _how_it_walked(name: str, speed: float, gait: Gait) -> str:
    """Return a sentence with a walk's speed and its falls."""
    metrics = gait.metrics
    walked = text_of(metrics["speed_m_s"]["mean"], ".2f")
    return f"{name}, {speed:g} m/s: {walked} m/s, {metrics['falls']} of {metrics['episodes']} fall."


def _changes(strides: Sequence[Stride], quantity: Quantity) -> tuple[float, float]:
    """Return the change of `quantity` from the slower to the faster of two `strides`, and its spread in the slower."""
    (before, spread), (after, _) = (stride.number(quantity) for stride in strides)
    return after - before, spread


def curves_table(people: Sequence[Stride], walks: Mapping[str, Sequence[Stride]]) -> str:
    """Return the Markdown table of the changes of angles over the stride, from the slower to the faster speed.

    `people` and each of `walks` are the strides at the two speeds. A cell has the rms distance of a change from
    people's [°], and in brackets r with it.
    """
    change = {joint: people[1].curves[joint] - people[0].curves[joint] for joint in COMPARED_JOINTS}
    lines = [["nothing changes", *(text_of(rmse(values, 0.0 * values), ".1f") for values in change.values())]]
    for name, strides in walks.items():
        cells = []
        for joint, values in change.items():
            own = strides[1].curves[joint] - strides[0].curves[joint]
            cells.append(f"{text_of(rmse(own, values), '.1f')} ({text_of(correlation(own, values), '.2f')})")
        lines.append([name, *cells])
    return table(["error of the change ° (r)", *COMPARED_JOINTS], lines)


def numbers_table(people: Sequence[Stride], walks: Mapping[str, Sequence[Stride]]) -> str:
    """Return the Markdown table of the changes of `QUANTITIES`; `people` and `walks` as in `curves_table`.

    The last lines count right signs and right sizes, of the quantities that change in people by more than their spread.
    """
    lines = []
    right = dict.fromkeys(walks, 0)
    alike = dict.fromkeys(walks, 0)
    judged = 0
    for quantity in QUANTITIES:
        change, spread = _changes(people, quantity)
        counts = abs(change) > spread
        judged += counts
        cells = []
        for name, strides in walks.items():
            own, _ = _changes(strides, quantity)
            right[name] += counts and own * change > 0.0
            alike[name] += counts and 1.0 / WITHIN <= own / change <= WITHIN
            cells.append(f"{own:+.2f}")
        lines.append([quantity.label, f"{change:+.2f} ± {spread:.2f}{'' if counts else ', not judged'}", *cells])
    lines.append([f"sign right, of {judged}", MISSING, *(str(count) for count in right.values())])
    lines.append([f"size within {WITHIN:g}, of {judged}", MISSING, *(str(count) for count in alike.values())])
    return table(["change", "people ± SD", *walks], lines)


def spans_table(people: Sequence[Stride], walks: Sequence[Sequence[Stride]]) -> str:
    """Return the Markdown table of the changes of several walks that are one answer: the first, and the least and the
    largest of all.

    It has the errors of `curves_table` and the changes of `QUANTITIES`; `people` and each of `walks` are the strides at
    the two speeds.
    """
    lines = []
    for joint in COMPARED_JOINTS:
        change = people[1].curves[joint] - people[0].curves[joint]
        errors = [rmse(walk[1].curves[joint] - walk[0].curves[joint], change) or 0.0 for walk in walks]
        nothing = f"{text_of(rmse(change, 0.0 * change), '.1f')}, if nothing changes"
        lines.append([f"error of the {joint}'s change [°]", nothing, f"{errors[0]:.1f}", span_text(errors, ".1f")])
    for quantity in QUANTITIES:
        change, spread = _changes(people, quantity)
        own = [_changes(walk, quantity)[0] for walk in walks]
        lines.append([quantity.label, f"{change:+.2f} ± {spread:.2f}", f"{own[0]:+.2f}", span_text(own, "+.2f")])
    return table(["change", "people ± SD", "the first", f"all {len(walks)}"], lines)


def changes_csv(people: Sequence[Stride], walks: Mapping[str, Sequence[Stride]]) -> str:
    """Return all changes as CSV text, those of people with their spread."""
    rows = [
        [quantity.label, *_changes(people, quantity), *(_changes(strides, quantity)[0] for strides in walks.values())]
        for quantity in QUANTITIES
    ]
    return csv_text(["change", "people", "people_sd", *walks], rows)
