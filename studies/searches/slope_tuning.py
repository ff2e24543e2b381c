"""Find the change of the legs' targets on a slope (`slope` in `envs/control/legs.json`): CMA-ES on walks up and down.

    springfoot study slope-tuning --generations 20

Every candidate walks with the fixed schedule at each of `SLOPES_DEG`. Its cost counts falls, errors of speed, reward
lost against the same walk on level ground, and hard heel strikes. The result is then compared with the start on longer
walks from other seeds, and written only if it costs less there.
"""

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar

import cma
import numpy as np
import tyro
from tqdm import tqdm

from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.envs.control import SlopeConstants, action_of, slope_constants_from
from springfoot.envs.settings import BipedSettings
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.evaluation.numbers import SHORTEST_SPEED
from springfoot.evaluation.recording import TICK, Episodes, record_walk
from springfoot.files.writing import csv_text
from springfoot.gait.body import GRAVITY, Body

from ..base.study import Answer, OnProgress, Study
from .cma_search import generations
from .constants_file import CONSTANTS, read_constants, write_constants
from .leg_walks import tally_from

SLOPES_DEG = (-5.0, -2.5, 2.5, 5.0)
"""Slopes that every candidate walks."""
SETTLED = 2.0
"""Time from which speed and force are measured [s]."""
HEEL_STRIKE, HARD = 0.2, 1.5
"""Stride phase that ends the heel strike, and force of the heel from which it costs [body weights]."""
FALL_COST = 60.0
"""Cost of a fall at once, more than any poor walk; the cost of a later fall decreases with its time, to a third."""
TOLERANCE = {"speed": 0.06, "reward": 0.1, "heel": 0.3}
"""Error e [m/s, fraction of the level walk's reward, body weights] at which the cost sqrt(1 + (e / tolerance)^2) - 1 is
0.41."""
JUDGED_WALKS, JUDGED_SECONDS = 16, 10.0
"""Walks at each slope that decide on the result, and their length [s]."""


def constants_of(vector: NDArray) -> SlopeConstants:
    """Return the constants of a vector (10,): three coefficients each of hip, knee and ankle, and the trunk's one."""
    hip, knee, ankle = np.round(vector[:9], 3).reshape(3, 3).tolist()
    return slope_constants_from({"hip": hip, "knee": knee, "ankle": ankle, "trunk": round(float(vector[9]), 3)})


def vector_of(constants: SlopeConstants) -> NDArray:
    """Return the vector (10,) of constants."""
    return np.hstack([getattr(constants, field.name) for field in fields(SlopeConstants)])


def walk(
    constants: SlopeConstants | None, slopes_deg: tuple[float, ...], walks: int, seconds: float, seed: int, threads: int
) -> dict[str, NDArray]:
    """Walk `walks` times at each slope with the fixed schedule, and measure each walk.

    Returns four quantities by name, (slopes, walks) each: `missing`, 0 without a fall, else 1 for a fall at once,
    decreasing to 1/3 at the end; `speed`, the error of speed [m/s], and `heel`, the peak force of the heel [body
    weights], both from `SETTLED` on; `reward`, the mean of a step. `constants` None takes the committed constants.
    """
    settings = BipedSettings(episode_seconds=seconds + 1)
    num = len(slopes_deg) * walks
    biped = Biped(settings, num, threads, slope=constants)
    biped.subjects.slope[:] = np.repeat(np.radians(slopes_deg), walks)
    biped.reset(np.arange(num), [seed + index % walks for index in range(num)])

    def act(_observation: NDArray) -> NDArray:
        return action_of(biped.scheduled_stiffness(), settings, biped.body).reshape(num, -1)

    steps = round(seconds / biped.dt)
    episodes = Episodes.empty(num, steps * biped.windows_per_step)
    record_walk(biped, act, episodes, steps=steps)
    lived = episodes.ticks * TICK  # [s] until the walk's end or its fall
    numbers = {
        "missing": np.where(episodes.fall_reason == "", 0.0, 1.0 - 2.0 / 3.0 * lived / seconds),
        "speed": np.zeros(num),
        "heel": np.zeros(num),
        "reward": episodes.returns * biped.dt / lived,
    }
    for index in np.flatnonzero(numbers["missing"] == 0.0).tolist():
        series = episodes.episode(index)
        numbers["speed"][index] = tally_from(series, biped.settings, SETTLED).speed[0] - settings.speed
        numbers["heel"][index] = _heel_peak(series, biped.body)
    return {name: values.reshape(len(slopes_deg), walks) for name, values in numbers.items()}


def _heel_peak(series: dict[str, NDArray], body: Body) -> float:
    """Return the largest vertical force of a foot [body weights] early in its leg's stride, from `SETTLED` on."""
    settled = slice(round(SETTLED / TICK), None)
    force = series["force"][settled, ..., 1].sum(-1) / (body.total_mass * GRAVITY)
    return float(force[series["phase"][settled] < HEEL_STRIKE].max())


def cost(walked: dict[str, NDArray], level_reward: float) -> float:
    """Return the cost of a candidate, averaged over its walks.

    `walked` comes from `walk`; `level_reward` is the mean reward of a step on level ground.
    """
    errors = {
        "speed": walked["speed"],
        "reward": 1.0 - walked["reward"] / level_reward,
        "heel": np.maximum(walked["heel"] - HARD, 0.0),
    }
    of_errors = sum(np.hypot(1.0, error / TOLERANCE[name]) - 1.0 for name, error in errors.items())
    return float(np.where(walked["missing"] > 0, FALL_COST * walked["missing"], of_errors).mean())


@dataclass(frozen=True, kw_only=True)
class SlopeTuning(Study):
    """Find the constants for slopes by CMA-ES, and write them into a file of constants if they cost less there."""

    generations: int = 20
    """Generations of the search."""
    population: int = 12
    """Candidates of each generation."""
    sigma: float = 0.2
    """First spread, in the units of the constants."""
    walks: int = 3
    """Walks of each candidate at each slope."""
    seconds: float = 6.0
    """Length of each walk [s]."""
    seed: int = 0
    """Seed of the search and of the walks."""
    threads: int = 2
    """Threads of the physics."""
    constants: Annotated[Path, tyro.conf.arg(metavar="FILE")] = CONSTANTS
    """File of constants to start from and to write."""

    QUICK: ClassVar[dict[str, Any]] = {"generations": 1, "population": 4, "walks": 1, "seconds": 3.0}
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse numbers out of range."""
        for count, least in (("generations", 0), ("population", 4), ("walks", 1), ("seed", 0), ("threads", 1)):
            require_count(count, getattr(self, count), least)
        require_number("sigma", self.sigma, 0, above=True)
        require_number("seconds", self.seconds, SETTLED + SHORTEST_SPEED)

    @property
    def total(self) -> float:
        """Return the number of generations."""
        return self.generations

    def ask(self, progress: OnProgress) -> Answer:
        """Search, compare the result with the start, and write it if it is better; with --quick never.

        Raises `SpringfootError`, with nothing written, for another kind of file.
        """
        known = read_constants(self.constants)
        try:
            began = slope_constants_from(known["slope"]["constants"])
        except (KeyError, TypeError, SpringfootError):
            raise SpringfootError(f"{self.constants} has no constants for slopes to begin with") from None
        options = {"popsize": self.population, "seed": self.seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(vector_of(began), self.sigma, options)
        length = self.walks, self.seconds  # of each candidate at each slope

        def costs_of(generation: int, vectors: list[NDArray]) -> NDArray:
            """Return the costs of a generation's candidates, which all walk from the same seeds."""
            seed = self.seed + 1000 * generation
            level_reward = walk(None, (0.0,), *length, seed, self.threads)["reward"].mean()
            walks = [walk(constants_of(vector), SLOPES_DEG, *length, seed, self.threads) for vector in vectors]
            return np.array([cost(walked, level_reward) for walked in walks])

        lines = []
        for generation, _, costs in generations(strategy, self.generations, costs_of):
            lines.append([generation + 1, costs.min(), np.median(costs)])
            tqdm.write(f"generation {generation + 1}: best {costs.min():.2f}, median {np.median(costs):.2f}")
            progress(1)
        start_cost, report = self._judge(began)
        verdict = "wrote nothing: the constants it began with cost no more"
        if self.generations:
            result = constants_of(strategy.mean)
            result_cost, result_report = self._judge(result)
            report = f"{report}\n{result_report}"
            if result_cost < start_cost:
                verdict = "wrote nothing: --quick" if self.quick else "wrote the constants it ended with"
                self._keep(result)
        files = {"generations.csv": csv_text(["generation", "best", "median"], lines)}
        return Answer(text=f"{report}\n{verdict}", files=files)

    def _keep(self, found: SlopeConstants) -> None:
        """Write the constants and this command into the file of constants; with --quick nothing."""
        if self.quick:
            return
        table = read_constants(self.constants)  # anew: another search may have written its own
        table["slope"] = table["slope"] | {"found_by": self.command, "constants": asdict(found)}
        write_constants(self.constants, table)

    def _judge(self, constants: SlopeConstants) -> tuple[float, str]:
        """Return the cost of these constants on walks from seeds that the search did not use, and a report."""
        walks, seconds = (1, 3.0) if self.quick else (JUDGED_WALKS, JUDGED_SECONDS)
        seed = self.seed + 1_000_000
        level_reward = walk(constants, (0.0,), walks, seconds, seed, self.threads)["reward"].mean()
        walked = walk(constants, SLOPES_DEG, walks, seconds, seed, self.threads)
        total = cost(walked, level_reward)
        count = walked["missing"].size
        lines = [f"{json.dumps(asdict(constants))} costs {total:.2f} in {count} walks of {seconds:g} s"]
        for row, slope_deg in enumerate(SLOPES_DEG):
            missing, speed, heel, reward = (walked[name][row] for name in ("missing", "speed", "heel", "reward"))
            lines.append(
                f"  {slope_deg:+.1f} deg: {(missing > 0).sum()} fall, speed error {speed.mean():+.3f} m/s, heel peak "
                f"{heel.mean():.2f} body weights, reward {reward.mean() / level_reward:.2f} of the level walk's"
            )
        return total, "\n".join(lines)
