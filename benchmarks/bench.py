"""Measure the cost of a step beside its physics, the gain of batches, and the speed of training beside the study's.

    make bench

Everything compared takes turns within one process and on one recorded walk; figures are medians. CPU time is that of
all threads and worker processes together. Simulated seconds per core-second compare environments of different steps.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import tyro

from springfoot.agents.training.config import PRESETS
from springfoot.command_line import exit_code

from . import environments, learning
from .timing import Case, Figures, load, machine, measure
from .walking import STEP, batch_case, record_walk, step_over_physics, step_over_plain

OVERHEAD_SIZES = (64, 8, 1)
BATCH_SIZES = (1, 8, 32, 64, 256)
VECTOR_SIZES = (2, 8, 32)
THREADS = (1, 2)


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Time everything in turn; prints tables and writes a JSON file."""

    out: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("build/bench.json")
    """Where the figures go."""
    quick: bool = False
    """Everything once and tiny: shows that it runs; the figures mean nothing."""


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How long to look."""

    steps: int = 100
    """Length of the recorded walk in environment steps."""
    rounds: int = 4
    """Rounds over the walk for the overhead at N = 64; smaller batches get more."""
    repeats: int = 9
    """Blocks of each environment."""
    updates: int = 4
    """PPO updates of each recipe."""
    starts: int = 9
    """New processes of each environment."""
    sizes: Sequence[int] = BATCH_SIZES
    vectors: Sequence[int] = VECTOR_SIZES
    update_steps: int | None = None
    study_steps: int = 512


QUICK = Effort(
    steps=3, rounds=1, repeats=1, updates=1, starts=1, sizes=(1, 8, 64), vectors=(2,), update_steps=128, study_steps=16
)


def bench(effort: Effort) -> dict[str, Any]:
    """All figures, printed as they come; see `Flags.out`."""
    busy = load()
    # Worker processes first: forked after a thread pool began, they can hang.
    forked = [environments.subprocesses(num) for num in effort.vectors]
    asynchronous = environments.walker_async(max(effort.vectors[:2]))
    walk = record_walk(max(max(effort.sizes), 64), effort.steps)

    start = environments.start_over_others(effort.starts)
    overhead = {}
    of_physics = {}
    sim_rate = 0.0
    study_rate = 0.0
    print("Full step of 20 ms beside its physics (mj_step alone, same states and controls), CPU time, one thread")
    for num in OVERHEAD_SIZES:
        spent, apart = step_over_physics(walk, num, effort.rounds * (1 if num == 64 else 4))
        full, ours, study = (1e6 * np.median(spent, axis=1) / num).tolist()
        overhead[str(num)] = float(np.median((spent[0] - spent[1]) / spent[2]))
        of_physics[str(num)] = float(np.median((spent[0] - spent[1]) / spent[1]))
        print(
            f"  N = {num:2d}: full {full:.1f} us, physics {ours:.1f}, physics at the study's settings {study:.1f}; "
            f"(full - physics) / physics {of_physics[str(num)]:.3f}, / study {overhead[str(num)]:.3f}; "
            f"same walk within {apart:.0e} rad"
        )
        if num == OVERHEAD_SIZES[0]:
            sim_rate = 1e6 * STEP / full
            study_rate = 1e6 * STEP / study

    of_plain = step_over_plain(walk, OVERHEAD_SIZES[0], effort.rounds)
    for name, ratio in of_plain.items():
        print(f"  N = {OVERHEAD_SIZES[0]}: {name.replace('_', ' ')} {ratio:.3f}")

    cases = [environments.batch(walk, num, threads) for num in effort.sizes for threads in THREADS]
    cases += [batch_case(walk, 64, threads) for threads in THREADS]
    cases += [environments.adapter(walk, 64, 2), environments.single(walk)]
    cases += [environments.dummy(walk, num) for num in effort.vectors]
    cases += [environments.subproc(walk, env) for env in forked]
    cases += environments.subjects(asynchronous, 8, 2, effort.steps)
    figures = _run("Environments", cases, effort.repeats)

    recipes = [learning.our_training(2, effort.update_steps), learning.study_training(effort.study_steps)]
    trained = _run("Training", recipes, effort.updates)
    ours, study = (trained[case.name].samples_per_second for case in recipes)
    planning = learning.planning_seconds(3 * effort.repeats)
    training = PRESETS["walk"].timesteps / ours
    two = figures["springfoot, N = 64, 2 threads"].samples_per_second
    return {
        "overhead_of_physics": dict(reversed(of_physics.items())),
        "overhead_of_study": dict(reversed(overhead.items())),
        **of_plain,
        "start_over_walker2d": start,
        "thread_speedup_64": two / figures["springfoot, N = 64, 1 thread"].samples_per_second,
        "vs_dummy": two / _best(figures, "DummyVecEnv"),
        "vs_subproc": two / _best(figures, "SubprocVecEnv"),
        "sim_seconds_per_core_second": sim_rate,
        "study_sim_seconds_per_core_second": study_rate,
        "ppo_vs_study": ours / study,
        "load": busy,
        "leg_kinematics_over_sine": learning.kinematics_over_sine(3 * effort.repeats),
        "planning_share_of_training": learning.PLANS_PER_TRAINING * planning / training,
        "machine": machine(),
        "cases": {name: asdict(each) for name, each in (figures | trained).items()},
    }


def _run(title: str, cases: list[Case], repeats: int) -> dict[str, Figures]:
    """Time the cases in turn and print them."""
    found = measure(cases, repeats)
    for case in cases:
        case.close()
    width = max(map(len, found))
    print(f"\n{title}; median of {repeats}, per environment step")
    print(f"  {'':{width}}  wall us  (quartiles)         CPU us  samples/s  simulated s per core-second")
    for name, each in found.items():
        low, high = each.wall_quartiles_us
        print(
            f"  {name:{width}} {each.wall_us:8.1f}  ({low:7.1f} to {high:7.1f}) {each.cpu_us:8.1f} "
            f"{each.samples_per_second:10,.0f} {each.sim_seconds_per_core_second:8.0f}"
        )
    return found


def _best(figures: dict[str, Figures], kind: str) -> float:
    return max(each.samples_per_second for name, each in figures.items() if name.startswith(kind))


def run(flags: Flags) -> None:
    """Measure, print and write."""
    about = machine()
    begin = perf_counter()
    versions = ", ".join(f"{name} {number}" for name, number in about["versions"].items())
    print(f"{about['processor']}, {about['processors']} processors, load {load():.2f}; {versions}\n")
    results = bench(QUICK if flags.quick else Effort())
    flags.out.parent.mkdir(parents=True, exist_ok=True)
    flags.out.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    print()
    for name, value in results.items():
        if isinstance(value, float) and name != "load":
            print(f"{name:36} {value:.4g}")
    print(
        f"load {results['load']:.2f} before, {load():.2f} after; {perf_counter() - begin:.0f} s; figures in {flags.out}"
    )


def main() -> int:
    """Exit code: 0 done, 2 a file that cannot be written, 130 ended by Ctrl-C."""
    return exit_code("bench", lambda: run(tyro.cli(Flags, prog="benchmarks.bench")))


if __name__ == "__main__":
    sys.exit(main())
