"""Finds the leg constants of `envs/control/legs.json`: CMA-ES on simulated walks, all candidates in one batch.

    springfoot study leg-tuning --equilibrium planned --cadence people
    springfoot study leg-tuning --speed 0.8 --start planned --sigma 0.4 --generations 100

Least squares on the same ruler then refine the best of the search. What a candidate pays stands in `leg_cost`. The
result is a fit to people's curves, not a prediction.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import cma
import numpy as np
import tyro
from numpy.typing import NDArray
from scipy.optimize import least_squares
from tqdm import tqdm

from springfoot.agents.files import csv_text
from springfoot.envs.control.leg_constants import TUNED_SPEED, LegConstants, constants_from, constants_name
from springfoot.envs.settings import BipedSettings, Feedforward
from springfoot.gait.errors import SpringfootError, require_count, require_number
from springfoot.gait.plan import Cadence

from .constants_file import CONSTANTS, read_constants, write_constants
from .leg_cost import FALL_COST, REFINED_SECONDS, all_misses, cost
from .study import Answer, OnProgress, Study

KNOT_STEP, GAIN_STEP = 2.0, 0.15
"""One unit of the search: degrees of a knot, relative change of a gain."""
ADDITIVE_STEP = {
    "toe_flat_deg": 3.0,
    "trunk_pitch_deg": 1.0,
    "swing_speed_gain": 0.05,
    "speed_torque": 15.0,
    "period_speed_gain": 0.03,
}
"""One unit of the search for constants that may change sign or vanish, in their own units."""
DIFFERENCE = 0.08
"""Step of the refinement's differences [units of the search]; chosen: less drowns in what a walk changes by itself."""
STEEPEST = 5.0
"""Largest derivative it believes [tolerances per unit]; beyond, the walk tipped over."""
KEPT = 0.17
"""What a constant pays in the refinement for each unit that it leaves its start [tolerances]."""


class Search:
    """Constants as a vector of unit steps from where the search began."""

    def __init__(self, start: LegConstants):
        self._start = {name: np.atleast_1d(np.array(value, float)) for name, value in asdict(start).items()}
        self.size = sum(value.size for value in self._start.values())

    def constants(self, vector: NDArray) -> LegConstants:
        """The constants at a vector (size,)."""
        values, place = {}, 0
        for name, start in self._start.items():
            step = vector[place : place + start.size]
            place += start.size
            if name.endswith("knots_deg") or name == "neutral_deg":
                value = start + KNOT_STEP * step
            elif name in ADDITIVE_STEP:
                value = start + ADDITIVE_STEP[name] * step
            else:
                value = start * np.exp(GAIN_STEP * step)
            values[name] = [float(round(x, 5)) for x in value] if start.size > 1 else float(round(value[0], 5))
        return constants_from(values)


@dataclass(frozen=True, kw_only=True)
class LegTuning(Study):
    """Find leg constants by CMA-ES and write them into a file of constants, every ten generations and at the end."""

    equilibrium: Literal["planned", "neutral"] = "planned"
    """Which equilibrium the constants are for; angle and phase walk on those of planned."""
    cadence: Cadence = "people"
    """Which cadence they are for."""
    speed: float = TUNED_SPEED
    """Which speed they are for [m/s]."""
    feedforward: Feedforward = "people"
    """Whose moments are fed forward with them."""
    start: str = ""
    """Name of the constants to start from; empty: those to be replaced."""
    generations: int = 150
    """Generations of the search."""
    population: int = 20
    """Candidates in each."""
    refinements: int = 0
    """Steps of least squares after the generations, from where these end."""
    sigma: float = 0.5
    """First spread, in units of the search."""
    ease: int = 0
    """Generations over which the foot's equilibrium goes from the planned one to its own: 0, at once."""
    push_newton: float = 150.0
    """Size of the pushes of the pushed walks [N]."""
    seed: int = 0
    """Seed of the search and of the walks."""
    threads: int = 2
    """Threads of the physics."""
    constants: Annotated[Path, tyro.conf.arg(metavar="FILE")] = CONSTANTS
    """File of constants to read and to write."""

    QUICK: ClassVar[dict[str, Any]] = {"generations": 1, "population": 2, "refinements": 0}
    PAGED: ClassVar[bool] = False
    UNIT: ClassVar[str] = " steps"

    def check(self) -> None:
        """Refuse counts out of range."""
        for count, least in (
            *(("generations", 1), ("population", 2), ("refinements", 0)),
            *(("threads", 1), ("seed", 0), ("ease", 0)),
        ):
            require_count(count, getattr(self, count), least)
        require_number("sigma", self.sigma, 0, above=True)

    @property
    def total(self) -> float:
        """Generations and steps of refinement."""
        return self.generations + self.refinements

    def ask(self, progress: OnProgress) -> Answer:
        """Search.

        Raises `SpringfootError`, with nothing written, for a file of another kind, and for constants to start from that
        are not in it.
        """
        name = constants_name(self.equilibrium, self.cadence, self.speed, self.feedforward)
        known = read_constants(self.constants)["constants"]
        if (start := self.start or name) not in known:
            raise SpringfootError(
                f"no constants {start!r} to start from in {self.constants}; start can be {', '.join(known)}"
            )
        search = Search(constants_from(known[start]))
        settings = BipedSettings(
            equilibrium=self.equilibrium,
            cadence=self.cadence,
            speed=self.speed,
            feedforward=self.feedforward,
            episode_seconds=REFINED_SECONDS + 1,
        )
        options = {"popsize": self.population, "seed": self.seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(np.zeros(search.size), self.sigma, options)
        lines = []
        for generation in range(self.generations):
            vectors = strategy.ask()
            ease = max(0.0, 1.0 - generation / self.ease) if self.ease else 0.0
            candidates = [search.constants(v) for v in vectors]
            paid = cost(settings, candidates, self.seed + 1000 * generation, self.threads, self.push_newton, ease)
            strategy.tell(vectors, list(paid))
            lines.append([generation + 1, paid.min(), np.median(paid)])
            progress(1)
            if generation % 10 == 9 or generation == self.generations - 1:
                self._keep(name, search.constants(strategy.mean))
                tqdm.write(_told(*lines[-1]))
        found = search.constants(strategy.mean)
        told = _told(*lines[-1])
        if self.refinements:
            found, misses = self._refined(found, settings, lambda better: self._keep(name, better), progress)
            told += f"; then misses {misses[0]:.2f} to {misses[-1]:.2f}"
        text = f"{json.dumps({name: asdict(found)})}\n\n{told}"
        return Answer(text=text, files={"generations.csv": csv_text(["generation", "best", "median"], lines)})

    def _refined(
        self,
        start: LegConstants,
        settings: BipedSettings,
        keep: Callable[[LegConstants], None],
        progress: OnProgress,
    ) -> tuple[LegConstants, list[float]]:
        """The constants with the least squares of `leg_cost.all_misses` near `start`, and the length after each step.

        Derivatives are differences, all constants side by side; a candidate that falls is as far off as can be.
        """
        search, lengths = Search(start), []

        def missed(vectors: NDArray) -> list[NDArray | None]:
            return all_misses(settings, [search.constants(v) for v in vectors], self.threads, self.push_newton)

        def own(vector: NDArray) -> NDArray:
            (found,) = missed(vector[None])
            far = np.full(size, FALL_COST) if found is None else found
            return np.concatenate([far, KEPT * vector])

        def slopes(vector: NDArray) -> NDArray:
            here, *there = missed(vector + DIFFERENCE * np.eye(search.size + 1, search.size, -1))
            keep(search.constants(vector))
            lengths.append(float(np.linalg.norm(here)) if here is not None else FALL_COST)
            progress(1)
            columns = [np.zeros(size) if each is None or here is None else (each - here) / DIFFERENCE for each in there]
            return np.concatenate([np.clip(np.stack(columns, -1), -STEEPEST, STEEPEST), KEPT * np.eye(search.size)])

        (first,) = missed(np.zeros((1, search.size)))
        if first is None:
            raise SpringfootError("the constants that the generations end with fall, so that they cannot be refined")
        size = len(first)
        result = least_squares(own, np.zeros(search.size), slopes, max_nfev=self.refinements)
        return search.constants(result.x), [*lengths, float(np.linalg.norm(result.fun[:size]))]

    def _keep(self, name: str, found: LegConstants) -> None:
        """Write what was found so far, and the command that does, into the file of constants; with --quick nothing."""
        if self.quick:
            return
        known = read_constants(self.constants)  # anew: another search may have written its own
        known["constants"][name] = asdict(found)
        known.setdefault("found_by", {})[name] = self.command
        write_constants(self.constants, known)


def _told(generation: int, best: float, median: float) -> str:
    return f"generation {generation}: best {best:.2f}, median {median:.2f}"
