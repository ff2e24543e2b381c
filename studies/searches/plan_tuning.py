"""Find the styles of `gait/plan/least_work.json`: CMA-ES on plans, without a simulation and without people's curves.

    springfoot study plan-tuning --speeds 1.2
    springfoot study plan-tuning --speeds 0.8 1.2 1.6

A plan has people's step length and time at its speed, or with `--cadence effort` those that the search chooses. The
search chooses everything else by the least effort of the plan's inverse dynamics (`springfoot.gait.plan.effort`), with
the swing foot clear of the floor and joints within their range. It starts at round numbers. At several speeds it finds
one style that changes linearly with speed: plans of least effort differ much at nearly the same price, so separate
searches would add their luck to the change with speed.
"""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from signal import SIG_IGN, SIGINT, signal
from typing import Annotated, Any, ClassVar, Literal

import cma
import numpy as np
import tyro
from tqdm import tqdm

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, quoted, require_count, require_number, require_within
from springfoot.files.markdown import span_text
from springfoot.files.writing import csv_text, write_atomically
from springfoot.gait.body import GRAVITY, HEEL_RADIUS, Body
from springfoot.gait.people import STEP_TIME_RATIO_RANGE, HumanGait, human_gait
from springfoot.gait.plan import (
    AS_IS,
    PER_DEGREE,
    PLAN_SPEED_RANGE,
    PRICES,
    STYLES,
    Effort,
    Muscle,
    WalkPlan,
    WalkStyle,
    effort_of,
    gait_of,
    least_work,
    plan_walk,
    style_from,
)

from ..base.columns import COMPARED_JOINTS
from ..base.study import Answer, OnProgress, Study
from ..walks.changes import spans_table, stride_of_gait
from .cma_search import asked_of, generations
from .constants_file import read_styles
from .prediction_table import prediction_numbers, prediction_table

PlanCadence = Literal["people", "effort"]
"""Cadences that a search of plans takes."""
CHOICES: dict[str, tuple[float, float, float, float]] = {
    "double_support": (0.2, 0.05, 0.06, 0.4),  # of the step time
    "lowest": (0.5, 0.2, -0.5, 1.5),  # of double support
    "zmp_from": (-0.02, 0.03, -0.08, 0.1),  # m from the ankle
    "zmp_to": (0.14, 0.02, 0.0, 0.16),  # the front of the toe's contact
    "zmp_way_1": (0.4, 0.1, 0.02, 0.97),  # of its travel
    "zmp_way_2": (0.7, 0.1, 0.03, 0.98),
    "rise": (0.5, 0.2, 0.0, 2.0),  # of the compass gait
    "rise_again_1": (0.0, 0.15, -1.0, 1.0),  # of half of the rise
    "rise_again_2": (0.0, 0.15, -1.0, 1.0),
    "lean": (0.0, 0.02, -0.2, 0.2),  # rad
    "knee": (0.1, 0.05, 0.02, 1.0),  # rad
    "heel_strike_pitch": (0.3, 0.1, 0.01, 1.0),  # rad
    "flat": (0.5, 0.15, 0.1, 1.0),  # of double support
    "heel_off": (0.2, 0.1, 0.0, 0.6),  # of the step
    "toe_off_pitch": (0.8, 0.2, 0.1, 2.0),  # rad
    "roll_pitch": (0.3, 0.15, 0.0, 2.0),
    "heel_rise_1": (0.3, 0.08, 0.05, 0.6),
    "heel_rise_2": (1.5, 0.4, 0.0, 4.0),
    "roll_from": (0.2, 0.1, 0.0, 0.9),  # of double support
    "roll_power": (2.5, 0.5, 2.0, 9.0),  # below, the pitch's rate would jump
    "via_forward_1": (0.25, 0.05, 0.0, 1.0),  # of the way of the ankle
    "via_forward_2": (0.5, 0.05, 0.0, 1.0),
    "via_forward_3": (0.75, 0.05, 0.0, 1.0),
    "via_up_1": (0.15, 0.03, 0.0, 1.0),  # m
    "via_up_2": (0.12, 0.02, 0.0, 1.0),
    "via_up_3": (0.1, 0.02, 0.0, 1.0),
    "via_pitch_1": (-0.5, 0.25, -2.0, 1.0),  # rad
    "via_pitch_2": (-0.25, 0.15, -2.0, 1.0),
    "via_pitch_3": (0.0, 0.15, -2.0, 1.0),
    "toe_swing": (0.0, 0.1, -0.3, 1.0),  # rad
}
"""Choice of the search -> its start, one unit step, and its least and largest value."""
STEP_TIME = {"step_time_ratio": (1.0, 0.1, 0.7, 1.4)}
"""Further choice with the cadence `effort`, in the form of `CHOICES`: step time over people's at the speed."""
CHOICES_OF = {"people": CHOICES, "effort": CHOICES | STEP_TIME}
"""Cadence -> the choices of a search."""
GROUPS = {"via_forward": 3, "via_up": 3, "via_pitch": 3, "heel_rise": 2, "zmp_way": 2, "rise_again": 2}
"""Entry of a style that holds several numbers -> how many; `CHOICES` has them one by one, as `NAME_1`, `NAME_2`."""
LEAST_ADVANCE = 0.005
"""Least fraction of its travel that the ZMP advances in the second third of single support [-]; chosen."""
LEAST_CLEARANCE = 0.015
"""Least height of ball and heel in mid-swing [m at 1.70 m]; chosen, to clear uneven ground."""
LOWEST_SOLE = -0.001
"""Height of the lowest point of the swing foot below which it counts as too low [m]; chosen."""
PER_METRE_LOW, PER_UNIT = 200.0, 10.0
"""Cost of a swing foot that is too low [1/m], and of a choice outside its bounds, squared; chosen."""
NEARLY_LEAST, MOST_NEAR = 1.1, 50
"""Cost over the least cost up to which a plan counts as nearly as good, and how many of those that a search meets are
held against people; chosen. The spread of their numbers tells how much least effort leaves open."""
BEFORE_LANDING = 0.05
"""Fraction of the stride before heel strike at which the ankle's angle is told; chosen."""
PER_LANDING = 0.01
"""Cost of that angle's distance from the flag `landing_deg`, squared [1/deg^2]; chosen: 1° costs 0.7 % of a plan."""
IMPOSSIBLE = 30.0
"""Cost of an impossible plan, to which the distance of its choices from the start is added; chosen."""


def style_at(vector: NDArray, cadence: PlanCadence = "people") -> WalkStyle:
    """Return the style at a vector of the search, in unit steps from the start of each choice of `CHOICES_OF`."""
    values = {}
    for (name, (start, unit, least, most)), step in zip(CHOICES_OF[cadence].items(), vector, strict=True):
        values[name] = round(float(np.clip(start + unit * step, least, most)), 5)
    groups = {name: [values.pop(f"{name}_{k + 1}") for k in range(count)] for name, count in GROUPS.items()}
    travel = [values.pop("zmp_from"), values.pop("zmp_to")]
    way = groups["zmp_way"]  # the ZMP's place after a third and two thirds of single support
    way[1] = max(way[1], way[0] + LEAST_ADVANCE)
    # A style has entries of the walk, and the others in an object `foot`.
    entries = values | groups | {"zmp_travel": travel, "heel_radius": HEEL_RADIUS}
    names = {field.name for field in fields(WalkStyle)}
    of_walk = {name: value for name, value in entries.items() if name in names}
    of_foot = {name: value for name, value in entries.items() if name not in names}
    return style_from(of_walk | {"foot": of_foot})


def vector_of(style: WalkStyle, cadence: PlanCadence = "people") -> NDArray:
    """Return the vector of the search for a style, the inverse of `style_at`."""
    values: dict[str, Any] = style.to_json()
    values |= values.pop("foot")
    values["zmp_from"], values["zmp_to"] = values.pop("zmp_travel")
    for name, count in GROUPS.items():
        group = values.pop(name) or ()
        if len(group) != count:
            raise SpringfootError(f"a search cannot begin at a style with {len(group)} of {name}, it needs {count}")
        values |= {f"{name}_{k + 1}": value for k, value in enumerate(group)}
    return np.array([(values[name] - start) / unit for name, (start, unit, *_) in CHOICES_OF[cadence].items()])


def price(
    body: Body,
    speed: float,
    vector: NDArray,
    weights: tuple[float, ...] = PRICES,
    muscle: Muscle = AS_IS,
    cadence: PlanCadence = "people",
    human: HumanGait | None = None,
) -> tuple[float, WalkPlan | None, Effort | None]:
    """Return the cost of the plan at a vector, the plan and its effort; None for both if the plan is impossible.

    Args:
        body: body that walks.
        speed: speed of the plan [m/s].
        vector: vector of the search (`style_at`).
        weights: weights of work, activation, its rate, and acceleration.
        muscle: muscles with effort that counts.
        cadence: step length and time, people's or those of the vector.
        human: gait in place of people's.

    The cost is the weighted effort and a price for a low swing foot, joints beyond their range, and choices beyond
    their bounds.
    """
    outside = sum(
        max(0.0, least - start - unit * x, start + unit * x - most) ** 2
        for (start, unit, least, most), x in zip(CHOICES_OF[cadence].values(), vector, strict=True)
    )
    try:
        plan = plan_walk(body, speed, cadence, style=style_at(vector, cadence), human=human)
        effort = effort_of(plan, muscle)
    except SpringfootError:
        return IMPOSSIBLE + PER_UNIT * outside + float(np.linalg.norm(vector)), None, None
    too_low = max(0.0, LOWEST_SOLE - plan.feet.lowest_swing) + max(
        0.0, LEAST_CLEARANCE * body.length_scale - plan.feet.clearance
    )
    cost = (
        float(np.dot(weights, effort.terms))
        + PER_METRE_LOW * too_low
        + PER_DEGREE * effort.beyond_range
        + PER_UNIT * outside
    )
    return cost, plan, effort


def distances_deg(plan: WalkPlan, speed: float) -> NDArray:
    """Return how far a plan's angles are from people's at `speed` [m/s], (3,), rms over the stride [deg], in the order
    of `COMPARED_JOINTS`."""
    joints = prediction_numbers(gait_of(plan), human_gait(speed))["joints"]
    return np.array([joints[joint]["rmse_deg"] for joint in COMPARED_JOINTS])


def landing_ankle_deg(gait: HumanGait) -> float:
    """Return the ankle's mean angle at `BEFORE_LANDING` [deg], dorsiflexion positive."""
    return float(np.degrees(gait.mean("ankle", 1.0 - BEFORE_LANDING)))


@dataclass(frozen=True, kw_only=True)
class PlanTuning(Study):
    """Find the plans of least effort by CMA-ES, and write their styles into a file."""

    speeds: tuple[float, ...] = (1.2,)
    """Speeds [m/s] at 1.70 m, ascending. The search prices plans at all of them by their mean; styles are found for the
    first and the last, and are linear in speed in between."""
    cadence: PlanCadence = "people"
    """Step length and time of the plans: people's, or those of least effort."""
    step_time_ratio: float = 1.0
    """Step time over people's at the same speed, with the cadence `people`."""
    generations: int = 200
    """Generations of the search."""
    population: int = 20
    """Candidates of each generation."""
    sigma: float = 0.5
    """First spread, in units of the search."""
    seed: int = 0
    """Seed of the search."""
    weights: tuple[float, float, float, float] = PRICES
    """Weights of work, of activation, of its rate, and of acceleration."""
    tissue: float = 1.0
    """Factor on passive moments of tissue."""
    tendon: float = 1.0
    """Factor on the give of the Achilles tendon."""
    toe_tendon: float = 1.0
    """Factor on the give of the toes' tendons."""
    likeness: float = 0.0
    """Weight of the angles' mean squared distance from people's [1/deg^2], to tell how near to people plans of little
    effort come; a prediction has none."""
    landing_deg: float | None = None
    """Angle of the ankle shortly before heel strike, dorsiflexion positive, that the search pays for missing, to tell
    what people's landing costs; a prediction has none."""
    start: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """File of styles to begin at, in place of round numbers."""
    styles: Annotated[Path, tyro.conf.arg(metavar="FILE")] = STYLES
    """File of styles to write to."""
    processes: int = 1
    """Processes that price plans; the results are the same with any number."""
    log: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """File of the costs of each generation: a search that was stopped goes on from it with the same bits."""

    QUICK: ClassVar[dict[str, Any]] = {"generations": 1, "population": 4}
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse counts out of range, and speeds that do not ascend."""
        for count, least in (("generations", 1), ("population", 4), ("seed", 0), ("processes", 1)):
            require_count(count, getattr(self, count), least)
        require_number("sigma", self.sigma, 0, above=True)
        for name in ("tissue", "tendon", "toe_tendon", "likeness"):
            require_number(name, getattr(self, name), 0)
        for weight in self.weights:
            require_number("weights", weight, 0)
        if self.landing_deg is not None:
            require_number("landing_deg", self.landing_deg, -30.0, 30.0, unit="deg")
        require_number("step_time_ratio", self.step_time_ratio, *STEP_TIME_RATIO_RANGE)
        if self.cadence != "people" and self.step_time_ratio != 1.0:
            raise SpringfootError(f"step_time_ratio needs cadence 'people', got {self.cadence!r}")
        for speed in self.speeds:
            require_within("speeds", speed, PLAN_SPEED_RANGE, "m/s")
        if not self.speeds or any(faster <= slower for slower, faster in pairwise(self.speeds)):
            raise SpringfootError(f"speeds must be one or more ascending numbers, got {quoted(list(self.speeds))}")

    @property
    def total(self) -> float:
        """Return the number of generations."""
        return self.generations

    @property
    def found_speeds(self) -> tuple[float, ...]:
        """Return the speeds of the styles that the search finds [m/s]: the first and the last."""
        return tuple(dict.fromkeys((self.speeds[0], self.speeds[-1])))

    def ask(self, progress: OnProgress) -> Answer:
        """Search, and write the styles."""
        with self._mapping() as on_each:
            return self._search(progress, on_each)

    @contextmanager
    def _mapping(self) -> Iterator[Callable[..., Iterable[float]]]:
        """Yield the equivalent of `map` that calls the function in `processes` of one thread each: with threads of BLAS
        beside them a price takes two to three times as long."""
        os.environ.setdefault("OMP_NUM_THREADS", "1")  # for their NumPy; that of this process has begun
        # They leave Ctrl-C to this process. None is a copy of this one: a copy would lack its threads.
        how = {"mp_context": get_context("spawn"), "initializer": signal, "initargs": (SIGINT, SIG_IGN)}
        with ProcessPoolExecutor(self.processes, **how) as pool:
            yield pool.map

    def _search(self, progress: OnProgress, on_each: Callable[..., Iterable[float]]) -> Answer:
        """Search, and write the styles; `on_each` maps a function on candidates."""
        body = Body()
        options = {"popsize": self.population, "seed": self.seed + 1, "verbose": -9}
        begin = np.zeros((len(self.found_speeds), len(CHOICES_OF[self.cadence])))
        asked = asked_of(self)
        if self.start is not None:
            styles = [least_work(speed, self.start) for speed in self.found_speeds]
            begin = np.stack([vector_of(style, self.cadence) for style in styles])
            asked["start"] = begin.tolist()  # of the file its content counts, which may change, not its place
        strategy = cma.CMAEvolutionStrategy(begin.ravel(), self.sigma, options)
        lines = []
        met: list[tuple[float, NDArray]] = []  # cost and candidate

        def costs_of(_: int, candidates: list[NDArray]) -> NDArray:
            """Return the costs of a generation's candidates."""
            return np.array(list(on_each(partial(self._mean_price, body), candidates)))

        for generation, vectors, costs in generations(strategy, self.generations, costs_of, self.log, asked):
            met += zip(costs.tolist(), vectors, strict=True)
            lines.append([generation + 1, float(costs.min()), float(np.median(costs))])
            progress(1)
            if generation % 10 == 9:
                tqdm.write(f"generation {generation + 1}: best {lines[-1][1]:.4f}, median {lines[-1][2]:.4f}")
        met.sort(key=lambda one: one[0])
        least, best = met[0]
        near = [candidate for cost, candidate in met if cost <= NEARLY_LEAST * least]
        found = {speed: style_at(self._vector_at(best, speed), self.cadence) for speed in self.found_speeds}
        self._write_styles(found)
        parts = [f"{speed:g} m/s: {json.dumps(style.to_json())}" for speed, style in found.items()]
        close = self._plans_of(near, body)
        for speed in self.speeds:
            cost, plan, effort = self._price(body, speed, self._vector_at(best, speed))
            parts.append(f"{speed:g} m/s: paid {cost:.4f}: {effort}")
            if plan is not None and close:
                parts.append(self._beside_people(plan, [plans[speed] for plans in close], speed))
        if len(self.found_speeds) > 1 and close:
            parts.append(self._changes(close))
        return Answer(
            text="\n\n".join(parts), files={"generations.csv": csv_text(["generation", "best", "median"], lines)}
        )

    def _beside_people(self, plan: WalkPlan, close: Sequence[tuple[WalkPlan, Effort]], speed: float) -> str:
        """Return the table of people and the best `plan` at `speed` [m/s], and of the spread of plans `close` to it in
        cost, each with its effort."""
        human = human_gait(speed)
        plans = [one for one, _ in close]
        people, best, *numbers = (prediction_numbers(gait, human) for gait in (human, *map(gait_of, (plan, *plans))))
        spans = {f"plans within {NEARLY_LEAST - 1:.0%} of its cost": numbers}
        text = prediction_table({"people": people, "the plan": best}, ("the plan",), spans)
        works = [effort.work * GRAVITY for _, effort in close]
        landings = [landing_ankle_deg(gait) for gait in (human, *map(gait_of, (plan, *plans)))]
        return (
            f"{text}\n\nThe spread is that of {len(close)} plans, which take {span_text(works, '.2f')} J/kg/m of fibre "
            f"work. Their ankle is at {span_text(landings[2:], '.1f')}° {BEFORE_LANDING:.0%} of the stride before heel "
            f"strike, the plan's at {landings[1]:.1f}°, people's at {landings[0]:.1f}° (dorsiflexion positive)."
        )

    def _changes(self, close: Sequence[Mapping[float, tuple[WalkPlan, Effort]]]) -> str:
        """Return the table of the changes from the first to the last speed: of people, and of plans `close` to the best
        in cost, by speed [m/s]; the best is the first."""
        ends = self.found_speeds
        people = [stride_of_gait(human_gait(speed)) for speed in ends]
        walks = [[stride_of_gait(gait_of(plans[speed][0])) for speed in ends] for plans in close]
        return f"{spans_table(people, walks)}\n\nChanges from {ends[0]:g} to {ends[1]:g} m/s."

    def _plans_of(self, near: Sequence[NDArray], body: Body) -> list[dict[float, tuple[WalkPlan, Effort]]]:
        """Return plan and effort at each of the flag `speeds` [m/s], of at most `MOST_NEAR` of the candidates `near`
        the best in cost, the first among them; those with an impossible plan are left out."""
        found = []
        for k in np.unique(np.linspace(0, len(near) - 1, MOST_NEAR).astype(int)):
            plans = {}
            for speed in self.speeds:
                _, plan, effort = self._price(body, speed, self._vector_at(near[k], speed))
                if plan is not None and effort is not None:
                    plans[speed] = plan, effort
            if len(plans) == len(self.speeds):
                found.append(plans)
        return found

    def _vector_at(self, candidate: NDArray, speed: float) -> NDArray:
        """Return the vector of a candidate's style at `speed` [m/s], linear between its vectors at `found_speeds`."""
        ends = candidate.reshape(len(self.found_speeds), -1)
        if len(ends) == 1:
            return ends[0]
        slowest, fastest = self.found_speeds
        return ends[0] + (speed - slowest) / (fastest - slowest) * (ends[1] - ends[0])

    def _mean_price(self, body: Body, candidate: NDArray) -> float:
        """Return the mean over the flag `speeds` of a candidate's cost: that of `price`, and those of the flags
        `likeness` and `landing_deg`."""
        costs = []
        for speed in self.speeds:
            cost, plan, _ = self._price(body, speed, self._vector_at(candidate, speed))
            if self.likeness and plan is not None:
                cost += self.likeness * float(np.mean(np.square(distances_deg(plan, speed))))
            if self.landing_deg is not None and plan is not None:
                cost += PER_LANDING * (landing_ankle_deg(gait_of(plan)) - self.landing_deg) ** 2
            costs.append(cost)
        return float(np.mean(costs))

    def _price(self, body: Body, speed: float, vector: NDArray) -> tuple[float, WalkPlan | None, Effort | None]:
        """Return cost, plan and effort of `price` at a vector, with the weights and muscles of the flags."""
        human = None if self.step_time_ratio == 1.0 else human_gait(speed).paced(self.step_time_ratio)
        muscle = Muscle(tissue=self.tissue, tendon=self.tendon, toe_tendon=self.toe_tendon)
        return price(body, speed, vector, self.weights, muscle, self.cadence, human)

    def _write_styles(self, styles: dict[float, WalkStyle]) -> None:
        """Write `styles` by speed [m/s], and the command that found them, into the file of styles; those at other
        speeds stay. With --quick write nothing."""
        if self.quick:
            return
        table = read_styles(self.styles)
        for speed, style in styles.items():
            table["styles"][f"{speed:g}"] = style.to_json()
            table["found_by"][f"{speed:g}"] = self.command
        write_atomically(self.styles, (json.dumps(table, indent=1) + "\n").encode())
