"""Finds what a slope adds to the legs' targets (`slope` in `envs/legs.json`): CMA-ES on walks up and down.

    python -m springfoot.studies.slope_tuning --generations 20

Every candidate walks with the fixed schedule at each of `SLOPES_DEG`. It pays for falls, for speeds other than the
commanded one, for reward that the same walk earns on level ground, and for heels that strike hard. What was found is
then held against what it began with, on longer walks from other starts, and written only if it pays less there.
"""

import json
import sys
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import cma
import numpy as np
import tyro
from numpy.typing import NDArray

from springfoot.agents.command_line import exit_code
from springfoot.envs.biped_batch import Biped
from springfoot.envs.control.foot_springs import action_of
from springfoot.envs.control.leg_constants import SlopeConstants, slope_constants_from
from springfoot.envs.settings import BipedSettings
from springfoot.envs.step_result import Tick
from springfoot.gait.body import GRAVITY
from springfoot.gait.errors import SpringfootError, require_count, require_number

from .leg_tuning import read_table

SLOPES_DEG = (-5.0, -2.5, 2.5, 5.0)
"""Walked on by every candidate."""
SETTLED = 2.0
"""Speed and force are measured from here on [s]."""
HEEL_STRIKE, HARD = 0.2, 1.5
"""Phase of a leg before which force is its heel's, and body weights from which it is paid for."""
FALL_COST = 60.0
"""Cost of falling at once; one that comes later costs proportionally less, down to a third: more than a poor walk."""
TOLERANCE = {"speed": 0.06, "reward": 0.1, "heel": 0.3}
"""Error e [m/s, share of the level walk's reward, body weights] at which sqrt(1 + (e / tolerance)^2) - 1 costs 0.41."""
JUDGED_WALKS, JUDGED_SECONDS = 16, 10.0
"""Walks at each slope that judge what was found, and their length [s]."""


@dataclass(frozen=True, kw_only=True)
class SlopeFlags:
    """Find the constants for slopes by CMA-ES and write them into a file of constants."""

    generations: int = 20
    """Generations of the search."""
    population: int = 12
    """Candidates in each."""
    sigma: float = 0.2
    """First spread, in the constants' own units."""
    walks: int = 3
    """Walks of a candidate at each slope."""
    seconds: float = 6.0
    """Length of each [s]."""
    seed: int = 0
    """Seed of the search and of the walks."""
    threads: int = 2
    """Threads of the physics."""
    out: Path = Path("envs/legs.json")
    """File of constants to begin with and to write."""


def constants_of(vector: NDArray) -> SlopeConstants:
    """The constants of a vector (10,): hip, knee, ankle, trunk."""
    hip, knee, ankle = np.round(vector[:9], 3).reshape(3, 3).tolist()
    return slope_constants_from({"hip": hip, "knee": knee, "ankle": ankle, "trunk": round(float(vector[9]), 3)})


def vector_of(constants: SlopeConstants) -> NDArray:
    """The vector (10,) of constants."""
    return np.hstack([getattr(constants, field.name) for field in fields(SlopeConstants)])


def walk(
    constants: SlopeConstants | None, slopes_deg: tuple[float, ...], walks: int, seconds: float, seed: int, threads: int
) -> dict[str, NDArray]:
    """Walk `walks` times at each slope with the fixed schedule: (slopes, walks) of each number.

    `missing` of the walk after a fall, 0 without one; `speed` too fast [m/s] and `heel` force peak [body weights], once
    settled; mean `reward` of a step. `constants` None: the committed ones.
    """
    settings, num = BipedSettings(episode_seconds=seconds + 1), len(slopes_deg) * walks
    biped = Biped(settings, num, threads, slope=constants)
    biped.subjects.slope[:] = np.repeat(np.radians(slopes_deg), walks)
    biped.reset(np.arange(num), [seed + index % walks for index in range(num)])
    active, lived, reward, heel, way = np.ones(num, bool), np.zeros(num), np.zeros(num), np.zeros(num), np.zeros(num)
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    for step in range(round(seconds / biped.dt)):
        action = action_of(biped.scheduled_stiffness(), settings, biped.body)
        ticks.clear()
        result = biped.step(action.reshape(num, -1), active)
        lived += active * biped.dt
        reward += result.reward
        if step * biped.dt >= SETTLED:
            way += active * biped.measurement.com_velocity[:, 0] * biped.dt
            for tick in ticks:
                load = tick.measurement.force[..., 1].sum(-1) / (biped.body.total_mass * GRAVITY)
                heel = np.maximum(heel, active * np.where(tick.phase < HEEL_STRIKE, load, 0.0).max(1))
        active &= ~result.terminated
        if not active.any():
            break
    numbers = {
        "missing": np.where(active, 0.0, 1.0 - 2.0 / 3.0 * lived / seconds),
        "speed": way / np.maximum(lived - SETTLED, biped.dt) - settings.speed,
        "heel": heel,
        "reward": reward * biped.dt / np.maximum(lived, biped.dt),
    }
    return {name: values.reshape(len(slopes_deg), walks) for name, values in numbers.items()}


def cost(walked: dict[str, NDArray], level_reward: float) -> float:
    """What the `walk` of a candidate pays, the mean over its walks."""
    errors = {
        "speed": walked["speed"],
        "reward": 1.0 - walked["reward"] / level_reward,
        "heel": np.maximum(walked["heel"] - HARD, 0.0),
    }
    paid = sum(np.hypot(1.0, error / TOLERANCE[name]) - 1.0 for name, error in errors.items())
    return float(np.where(walked["missing"] > 0, FALL_COST * walked["missing"], paid).mean())


def search(flags: SlopeFlags) -> None:
    """Run the search, judge what it found, print both, and write the better.

    Raises `SpringfootError`, with nothing written, for numbers out of range or another kind of file.
    """
    for count, least in (("generations", 0), ("population", 4), ("walks", 1), ("seed", 0), ("threads", 1)):
        require_count(count, getattr(flags, count), least)
    require_number("sigma", flags.sigma, 0, above=True)
    require_number("seconds", flags.seconds, SETTLED, above=True)
    table = read_table(flags.out)
    try:
        began = slope_constants_from(table["slope"]["constants"])
    except (KeyError, TypeError):
        raise SpringfootError(f"{flags.out} has no constants for slopes to begin with") from None
    options = {"popsize": flags.population, "seed": flags.seed + 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(vector_of(began), flags.sigma, options)
    for generation in range(flags.generations):
        vectors, seed = strategy.ask(), flags.seed + 1000 * generation
        level = walk(None, (0.0,), flags.walks, flags.seconds, seed, flags.threads)["reward"].mean()
        found = [walk(constants_of(v), SLOPES_DEG, flags.walks, flags.seconds, seed, flags.threads) for v in vectors]
        paid = [cost(walked, level) for walked in found]
        strategy.tell(vectors, paid)
        print(f"generation {generation + 1}: best {min(paid):.2f}, median {np.median(paid):.2f}", flush=True)
    judged = {"began with": (began, _judge(began, flags))}
    if flags.generations:
        mean = constants_of(strategy.mean)
        judged["found"] = mean, _judge(mean, flags)
    best = min(judged, key=lambda name: judged[name][1])
    if best == "found":
        command = " ".join(["python -m springfoot.studies.slope_tuning", *sys.argv[1:]])
        table = read_table(flags.out)  # anew: another search may have written its own
        table["slope"] = table["slope"] | {"found_by": command, "constants": asdict(judged[best][0])}
        flags.out.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    print("wrote what it found" if best == "found" else "wrote nothing: what it began with pays no more")


def _judge(constants: SlopeConstants, flags: SlopeFlags) -> float:
    """Print how walks from starts that the search does not know go, and return what they pay."""
    seed = flags.seed + 1_000_000
    level = walk(constants, (0.0,), JUDGED_WALKS, JUDGED_SECONDS, seed, flags.threads)["reward"].mean()
    walked = walk(constants, SLOPES_DEG, JUDGED_WALKS, JUDGED_SECONDS, seed, flags.threads)
    paid = cost(walked, level)
    print(f"{json.dumps(asdict(constants))} pays {paid:.2f} in {walked['missing'].size} walks of {JUDGED_SECONDS:g} s")
    for row, slope_deg in enumerate(SLOPES_DEG):
        missing, speed, heel, reward = (walked[name][row] for name in ("missing", "speed", "heel", "reward"))
        print(
            f"  {slope_deg:+.1f} deg: {(missing > 0).sum()} fall, {speed.mean():+.3f} m/s too fast, heel peak "
            f"{heel.mean():.2f} body weights, reward {reward.mean() / level:.2f} of the level walk's",
            flush=True,
        )
    return paid


def main() -> int:
    """Exit code: 0 done, 2 bad input, 130 ended by Ctrl-C."""
    flags = tyro.cli(SlopeFlags, description=__doc__)
    return exit_code("slopes", lambda: search(flags))


if __name__ == "__main__":
    sys.exit(main())
