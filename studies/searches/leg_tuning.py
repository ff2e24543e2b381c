"""Find the leg constants of `envs/control/legs.json`: CMA-ES on simulated walks, all candidates in one batch.

    springfoot study leg-tuning --equilibrium planned --cadence people
    springfoot study leg-tuning --speed 0.8 --start planned --sigma 0.4 --generations 100

Steps of least squares on the same misses may come first: they bring the walk near its target, and the generations make
it stand pushes. `leg_cost` computes the cost of a candidate. The result is a fit to people's curves, not a prediction.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import cma
import numpy as np
import tyro
from tqdm import tqdm

from springfoot.arrays import NDArray
from springfoot.envs.control import (
    GENERIC,
    TUNED_SPEED,
    LegConstants,
    constants_from,
    constants_name,
    generic_constants,
    reference_walk_at,
)
from springfoot.envs.settings import BipedSettings, Feedforward
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.files.writing import csv_text
from springfoot.gait.plan import Cadence

from ..base.study import Answer, OnProgress, Study
from .cma_search import asked_of, generations
from .constants_file import CONSTANTS, read_constants, write_constants
from .leg_cost import REFINED_SECONDS, all_misses, cost
from .leg_vector import Search

DIFFERENCE = 0.08
"""Step of the refinement's finite differences [units of the search]; chosen: the scatter of a walk hides a smaller
step."""
STEEPEST = 5.0
"""Largest derivative that the refinement uses [tolerances per unit]; a steeper one comes from a fall."""
DAMPINGS = np.array([0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0])
"""Dampings that a step of the refinement tries, as factors on the damping of the last improvement [-]; chosen."""
PARTS_OF_STEP = (1.0, 0.4)
"""Fractions of each step that the refinement tries [-]; chosen."""
LONGEST_STEP = 1.5
"""Largest change of a constant in a step of the refinement [units of the search]; chosen."""
KEPT = 0.17
"""Cost in the refinement of moving a constant one unit from its start [tolerances]."""


@dataclass(frozen=True, kw_only=True)
class LegTuning(Study):
    """Find leg constants by CMA-ES and write them into a file of constants, every ten generations and at the end."""

    equilibrium: Literal["planned", "neutral"] = "planned"
    """Equilibrium of the constants; `angle` and `phase` use those of `planned`."""
    cadence: Cadence = "people"
    """Cadence of the constants."""
    speed: float = TUNED_SPEED
    """Speed of the constants [m/s]."""
    feedforward: Feedforward = "people"
    """Source of the moments that are fed forward."""
    start: str = ""
    """Name of the constants to start from; empty: those to be replaced."""
    generations: int = 150
    """Generations of the search."""
    population: int = 20
    """Candidates of each generation."""
    refinements: int = 0
    """Steps of least squares before the generations."""
    sigma: float = 0.5
    """First spread, in units of the search."""
    ease: int = 0
    """Generations over which the rest angles change from the planned ones to those of `equilibrium`; 0: at once."""
    push_newton: float = 150.0
    """Size of the pushes in pushed walks [N]."""
    pushed_from: int = 0
    """First generation with pushed walks."""
    foreign: float = 1.0
    """Price of walks with springs that were not tuned for the candidate; 0 leaves them out."""
    seed: int = 0
    """Seed of the search and of the walks."""
    threads: int = 2
    """Threads of the physics."""
    constants: Annotated[Path, tyro.conf.arg(metavar="FILE")] = CONSTANTS
    """File of constants to read and to write."""
    people_file: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """File of people's data, in place of the package's."""
    log: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """File of the costs of each generation: a search that was stopped goes on from it with the same bits."""

    QUICK: ClassVar[dict[str, Any]] = {"generations": 1, "population": 2, "refinements": 0}
    UNIT: ClassVar[str] = " steps"

    def check(self) -> None:
        """Refuse numbers out of range."""
        least = {
            "generations": 1,
            "population": 2,
            "refinements": 0,
            "threads": 1,
            "seed": 0,
            "ease": 0,
            "pushed_from": 0,
        }
        for count, bound in least.items():
            require_count(count, getattr(self, count), bound)
        require_number("sigma", self.sigma, 0, above=True)
        require_number("foreign", self.foreign, 0)

    @property
    def total(self) -> float:
        """Return the number of generations and steps of refinement."""
        return self.generations + self.refinements

    def ask(self, progress: OnProgress) -> Answer:
        """Search, and write the constants.

        Raises `SpringfootError`, with nothing written, for a file of another kind, and for a `start` that the file does
        not have.
        """
        settings = BipedSettings(
            equilibrium=self.equilibrium,
            cadence=self.cadence,
            speed=self.speed,
            feedforward=self.feedforward,
            people_file=self.people_file and str(self.people_file),
            episode_seconds=REFINED_SECONDS + 1,
        )
        name = constants_name(self.equilibrium, self.cadence, self.speed, self.feedforward)
        known = read_constants(self.constants)["constants"]
        if self.start == GENERIC:
            known = known | {GENERIC: asdict(generic_constants())}
        if (start := self.start or name) not in known:  # by default those to be replaced
            raise SpringfootError(
                f"no constants {start!r} to start from in {self.constants}; start can be {', '.join(known)}"
            )
        begin = constants_from(known[start])
        target = reference_walk_at(settings, self.speed, [begin]).target
        report = ""
        if self.refinements:
            begin, misses = self._refine(begin, settings, lambda better: self._keep(name, better), progress)
            report = f"misses {misses[0]:.2f} to {misses[-1]:.2f}; then "
        search = Search(begin, self.speed, target)
        options = {"popsize": self.population, "seed": self.seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(np.zeros(search.size), self.sigma, options)
        lines = []

        def costs_of(generation: int, vectors: list[NDArray]) -> NDArray:
            """Return the costs of a generation's candidates, which all walk from the same seeds."""
            ease = max(0.0, 1.0 - generation / self.ease) if self.ease else 0.0
            candidates = [search.constants(v) for v in vectors]
            push = self.push_newton if generation >= self.pushed_from else 0.0
            seed = self.seed + 1000 * generation
            return cost(settings, candidates, seed, self.threads, push, ease, self.foreign)

        asked = asked_of(self) | {"from": asdict(begin)}
        for generation, _, costs in generations(strategy, self.generations, costs_of, self.log, asked):
            lines.append([generation + 1, costs.min(), np.median(costs)])
            progress(1)
            if generation % 10 == 9 or generation == self.generations - 1:
                self._keep(name, search.constants(strategy.mean))
                tqdm.write(_generation_text(*lines[-1]))
        result = search.constants(strategy.mean)
        text = f"{json.dumps({name: asdict(result)})}\n\n{report}{_generation_text(*lines[-1])}"
        return Answer(text=text, files={"generations.csv": csv_text(["generation", "best", "median"], lines)})

    def _refine(
        self,
        start: LegConstants,
        settings: BipedSettings,
        keep: Callable[[LegConstants], None],
        progress: OnProgress,
    ) -> tuple[LegConstants, list[float]]:
        """Minimise the sum of squares of `leg_cost.all_misses` from `start`; call `keep` with each improvement.

        Returns the constants, and the length of the vector of misses at the start and after each step.

        The method is damped Gauss-Newton (Levenberg-Marquardt): (J'J + damping (1 + diag J'J)) step = -J' misses. One
        batch walks the finite differences of all constants, and another the steps at all dampings, whole and in part:
        walks scatter too much to rely on a single step.
        """
        target = reference_walk_at(settings, settings.speed, [start]).target
        search = Search(start, settings.speed, target)

        def misses_at(vectors: NDArray) -> list[NDArray | None]:
            """Return the misses at search vectors (V, size), distance from the start appended; None for a fall."""
            walked = all_misses(settings, [search.constants(vector) for vector in vectors], self.threads)
            return [
                None if misses is None else np.append(misses, KEPT * vector)
                for misses, vector in zip(walked, vectors, strict=True)
            ]

        vector = np.zeros(search.size)
        identity = np.eye(search.size)
        (misses,) = misses_at(vector[None])
        if misses is None:
            raise SpringfootError(
                "the constants to start from fall, so that they cannot be refined: refinements must be 0"
            )
        lengths = [float(np.linalg.norm(misses))]
        damping = 1.0
        for _ in range(self.refinements):
            # Jacobian of the misses by finite differences; a constant with a change that falls has no slope.
            changed = misses_at(vector + DIFFERENCE * identity)
            columns = [np.zeros(len(misses)) if near is None else (near - misses) / DIFFERENCE for near in changed]
            jacobian = np.clip(np.stack(columns, -1), -STEEPEST, STEEPEST)
            normal = jacobian.T @ jacobian
            downhill = -jacobian.T @ misses
            # Steps at every damping, whole and in part; the best of all is taken if it is an improvement.
            tried = []
            for tried_damping in damping * DAMPINGS:
                step = np.linalg.solve(normal + tried_damping * (identity + np.diag(np.diag(normal))), downhill)
                step *= min(1.0, LONGEST_STEP / np.abs(step).max())
                tried += [(tried_damping, vector + part * step) for part in PARTS_OF_STEP]
            tried_misses = misses_at(np.array([candidate for _, candidate in tried]))
            tried_lengths = [
                np.inf if tried_miss is None else float(np.linalg.norm(tried_miss)) for tried_miss in tried_misses
            ]
            best = int(np.argmin(tried_lengths))
            best_misses = tried_misses[best]
            if best_misses is not None and tried_lengths[best] < lengths[-1]:
                damping, vector = tried[best]
                misses = best_misses
                keep(search.constants(vector))
            else:
                damping *= 10.0
            lengths.append(float(np.linalg.norm(misses)))
            progress(1)
        return search.constants(vector), lengths

    def _keep(self, name: str, constants: LegConstants) -> None:
        """Write the best constants so far, as `name`, and this command into the file of constants; with --quick
        nothing."""
        if self.quick:
            return
        content = read_constants(self.constants)  # anew: another search may have written its constants
        content["constants"][name] = asdict(constants)
        content.setdefault("found_by", {})[name] = self.command
        write_constants(self.constants, content)


def _generation_text(generation: int, best: float, median: float) -> str:
    """Return a generation's number, from 1, and its best and median cost, in words."""
    return f"generation {generation}: best {best:.2f}, median {median:.2f}"
