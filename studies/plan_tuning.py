"""Finds the styles of `gait/least_work.json`: CMA-ES on plans, without a simulation or a curve of people's.

    springfoot study plan-tuning --speed 1.2

A plan has people's step length and time at a speed, as a planner may know them. All else is chosen by least effort of
its own inverse dynamics (`springfoot.gait.plan_effort`), with the swing foot clear of the floor and joints within their
range. The search begins at round numbers.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import cma
import numpy as np
import tyro
from tqdm import tqdm

from springfoot.agents.files import csv_text, write_atomically
from springfoot.gait.arrays import NDArray
from springfoot.gait.body import Body
from springfoot.gait.errors import SpringfootError, require_count, require_number
from springfoot.gait.plan import WalkPlan, plan_walk
from springfoot.gait.plan_effort import PlanEffort, effort_of
from springfoot.gait.walk_style import STYLES, WalkStyle, style_from

from .kept_search import asked_of, generations
from .study import Answer, OnProgress, Study

CHOICES: dict[str, tuple[float, float, float]] = {
    "double_support": (0.2, 0.05, 0.06),  # of the step time
    "zmp_from": (0.0, 0.03, -0.06),  # m from the ankle
    "zmp_to": (0.15, 0.02, 0.0),
    "rise": (0.5, 0.2, 0.0),  # of the compass gait
    "knee": (0.1, 0.05, 0.02),  # rad
    "heel_strike_pitch": (0.2, 0.1, 0.01),  # rad
    "toe_off_pitch": (0.8, 0.2, 0.1),
    "roll_pitch": (0.3, 0.15, 0.0),
    "toe_rocker_power": (2.5, 0.5, 2.0),  # below, the pitch's rate would jump
    "roll_power": (2.5, 0.5, 2.0),
    "via_forward_1": (1 / 3, 0.05, 0.0),  # of the way of the ankle
    "via_forward_2": (2 / 3, 0.05, 0.0),
    "via_up_1": (0.15, 0.03, 0.0),  # m
    "via_up_2": (0.10, 0.02, 0.0),
    "via_pitch_1": (-0.5, 0.25, -2.0),  # rad
    "via_pitch_2": (0.0, 0.15, -2.0),
    "toe_swing": (0.0, 0.1, -0.3),  # rad
}
"""What is chosen: where the search begins, one unit of it, and the least value."""
LEAST_CLEARANCE = 0.015
"""Least height of ball and heel in mid-swing [m at 1.70 m]; chosen, to clear uneven ground."""
PER_METRE_LOW, PER_DEGREE, PER_UNIT = 200.0, 0.1, 10.0
"""What a swing foot too low costs, a joint beyond its range, and a choice below its least value squared; chosen."""
IMPOSSIBLE = 30.0
"""What a plan that cannot be costs, besides how far its choices are from the start; chosen."""


def style_at(vector: NDArray) -> WalkStyle:
    """The style at a vector of the search."""
    values = {}
    for (name, (start, unit, least)), step in zip(CHOICES.items(), vector, strict=True):
        values[name] = round(float(max(start + unit * step, least)), 5)
    pairs = {
        name: [values.pop(f"{name}_1"), values.pop(f"{name}_2")] for name in ("via_forward", "via_up", "via_pitch")
    }
    travel = [values.pop("zmp_from"), values.pop("zmp_to")]
    walk = {name: values.pop(name) for name in ("double_support", "rise", "knee")}
    return style_from(walk | {"zmp_travel": travel, "foot": values | pairs})


def price(body: Body, speed: float, vector: NDArray) -> tuple[float, WalkPlan | None, PlanEffort | None]:
    """What the plan at a vector costs, the plan and its effort; none for a plan that cannot be."""
    below = sum(
        max(0.0, least - start - unit * x) ** 2
        for (start, unit, least), x in zip(CHOICES.values(), vector, strict=True)
    )
    try:
        plan = plan_walk(body, speed, style=style_at(vector))
    except SpringfootError:
        return IMPOSSIBLE + PER_UNIT * below + float(np.linalg.norm(vector)), None, None
    effort = effort_of(plan)
    lowest = float(plan.feet.swing_heights((0.005, 0.995)).min())
    low = max(0.0, -0.001 - lowest) + max(0.0, LEAST_CLEARANCE * body.length_scale - plan.feet.clearance)
    paid = effort.total + PER_METRE_LOW * low + PER_DEGREE * effort.beyond_range + PER_UNIT * below
    return paid, plan, effort


@dataclass(frozen=True, kw_only=True)
class PlanTuning(Study):
    """Find the way to walk of least effort by CMA-ES on plans, and write it into a file of styles."""

    speed: float = 1.2
    """Speed [m/s] at 1.70 m."""
    generations: int = 120
    """Generations of the search."""
    population: int = 14
    """Candidates in each."""
    sigma: float = 0.5
    """First spread, in units of the search."""
    seed: int = 0
    """Seed of the search."""
    styles: Annotated[Path, tyro.conf.arg(metavar="FILE")] = STYLES
    """File of styles to write to."""
    log: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """File that keeps what each generation paid: a search that was stopped goes on from there, by the same bits."""

    QUICK: ClassVar[dict[str, Any]] = {"generations": 1, "population": 4}
    PAGED: ClassVar[bool] = False
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse counts out of range."""
        for count, least in (("generations", 1), ("population", 4), ("seed", 0)):
            require_count(count, getattr(self, count), least)
        require_number("sigma", self.sigma, 0, above=True)

    @property
    def total(self) -> float:
        """Generations."""
        return self.generations

    def ask(self, progress: OnProgress) -> Answer:
        """Search."""
        body = Body()
        options = {"popsize": self.population, "seed": self.seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(np.zeros(len(CHOICES)), self.sigma, options)
        lines, best = [], (np.inf, np.zeros(len(CHOICES)))

        def priced(_: int, vectors: list[NDArray]) -> NDArray:
            return np.array([price(body, self.speed, vector)[0] for vector in vectors])

        for generation, vectors, paid in generations(strategy, self.generations, priced, self.log, asked_of(self)):
            best = min(best, (float(paid.min()), vectors[int(np.argmin(paid))]), key=lambda each: each[0])
            lines.append([generation + 1, float(paid.min()), float(np.median(paid))])
            progress(1)
            if generation % 10 == 9:
                tqdm.write(f"generation {generation + 1}: best {lines[-1][1]:.4f}, median {lines[-1][2]:.4f}")
        cost, _, effort = price(body, self.speed, best[1])
        style = style_at(best[1])
        self._keep(style)
        text = f"{json.dumps(style.to_json())}\n\npaid {cost:.4f}: {effort}"
        return Answer(text=text, files={"generations.csv": csv_text(["generation", "best", "median"], lines)})

    def _keep(self, style: WalkStyle) -> None:
        """Write what was found, and the command that did, into the file of styles; with --quick nothing."""
        if self.quick:
            return
        table = json.loads(self.styles.read_text(encoding="utf-8")) if self.styles.is_file() else {}
        table.setdefault("styles", {})[f"{self.speed:g}"] = style.to_json()
        table.setdefault("found_by", {})[f"{self.speed:g}"] = self.command
        write_atomically(self.styles, (json.dumps(table, indent=1) + "\n").encode())
