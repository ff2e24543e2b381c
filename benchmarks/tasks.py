"""Springs that learn nothing, and learners, as submissions to the frozen tasks that set stiffness, for the leaderboard.

    make benchmark
    make benchmark BENCHMARK="--learners sac --tasks Walk-v0"

Each is trained, submitted and judged once, in benchmarks/submissions; the same command goes on after a stop. The best
constant springs are the best of `ANKLES` x `TOES`, searched on from there by Nelder and Mead's simplex, by 24 episodes
with seeds that no submission has; where the feet differ, each leg has its own. Other learners than our PPO train by
examples/learners/sb3.py, in the virtual environment of `make test-learners`. On a Ray cluster our PPO trains in that of
`make test-rllib`:

    build/rllib/bin/python -m benchmarks.tasks --engine ray
"""

import argparse
import signal
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from scipy.optimize import minimize

from benchmarks.processes import Processes
from springfoot.agents.policies.baselines import constant
from springfoot.agents.training import Engine, train_missing
from springfoot.agents.training.config import processors, task_training
from springfoot.agents.training.returns import evaluate_returns
from springfoot.arrays import NDArray
from springfoot.envs import Biped
from springfoot.envs.control.stiffness_control import stiffness_ranges
from springfoot.envs.settings.settings import body_of
from springfoot.errors import SpringfootError, require_count
from springfoot.evaluation.benchmark.learner_scores import ENTRY_SEEDS
from springfoot.evaluation.benchmark.submission import JUDGED, SUBMISSION, judge_submission, read_submission, submit
from springfoot.evaluation.benchmark.task_walks import settings_of_task
from springfoot.extras import exiting_if_missing
from springfoot.tasks import STIFFNESS_TASKS, VERSION

Learner = Literal["ppo", "sb3-ppo", "sac", "tqc"]
"""Our PPO, and learners of stable-baselines3 and sb3-contrib."""
NAMES: dict[Learner, str] = {"ppo": "PPO", "sb3-ppo": "PPO of SB3", "sac": "SAC of SB3", "tqc": "TQC of sb3-contrib"}
"""Learner -> its name in the leaderboard."""
Run = tuple[str, int]
"""Task and seed of a training."""
SUBMISSIONS = Path(__file__).parent / "submissions"
RUNS = Path("runs", "benchmark")
SB3_EXAMPLE = Path(__file__).parents[1] / "examples" / "learners" / "sb3.py"
LEARNERS_VENV = Path("build", "learners", "many")
ANKLES, TOES = (150.0, 250.0, 400.0, 700.0), (10.0, 20.0, 40.0, 60.0)
"""Stiffness of constant springs [N m/rad] from which the search begins."""
CHOOSING_SEED, CHOOSING_EPISODES = 1000, 24
SEARCHED = 30
"""Springs that the search tries, for each number that it sets; chosen, two minutes a task."""
SIMPLEX = 1.25
"""Factor on one stiffness in each other corner of its first simplex; chosen, half a step of the grid."""


def best_constant(task: str) -> str:
    """Return the constant springs with the highest mean return that the search finds, as the name of a baseline."""
    settings = settings_of_task(task)
    biped = Biped(settings, CHOOSING_EPISODES, 2)
    legs = 1 if settings.left_foot == settings.right_foot else 2

    def loss(logarithms: NDArray) -> float:
        """Return the negative mean return with springs of these logarithms, one leg for both or left and right."""
        springs = constant(settings, np.exp(logarithms).reshape(-1, 2))
        return -float(evaluate_returns(biped, springs, CHOOSING_SEED)[0].mean())

    grid = [np.log((ankle, toe) * legs) for ankle in ANKLES for toe in TOES]
    begin = min(grid, key=loss)
    options = {
        "initial_simplex": begin + np.log(SIMPLEX) * np.eye(len(begin) + 1, len(begin), -1),
        "maxfev": SEARCHED * len(begin),
        "xatol": 0.01,
        "fatol": 0.1,
    }
    bounds = np.log(np.stack(stiffness_ranges(settings, body_of(settings)), 1)).tolist() * legs
    found = minimize(loss, begin, method="Nelder-Mead", bounds=bounds, options=options)
    return "constant:" + ",".join(f"{stiffness:.3g}" for stiffness in np.exp(found.x))


def submit_and_judge(policy: str | None, task: str, name: str, folder: Path) -> None:
    """Submit and judge a policy, as far as that is not done; None for one that was submitted before."""
    if policy is not None and not (folder / SUBMISSION).exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        submit(policy, task, name, folder, threads=2)
    if not (folder / JUDGED).exists():
        found = judge_submission(read_submission(folder), threads=2)
        if not found.passes:
            sys.exit(f"{folder} does not repeat its numbers: {found.repeated.summary}")
        print(f"{task}, {name}: {found.repeated.summary}; drawn: {found.drawn.summary}", flush=True)


def label_of(learner: Learner, timesteps: int, seed: int) -> str:
    """Return the name of a learner's training in folders, such as ppo-500000-seed-0."""
    return f"{learner}-{timesteps}-seed-{seed}"


def train_ours(runs: Sequence[Run], timesteps: int, engine: Engine) -> dict[Run, str]:
    """Train our PPO as far as that is not done; return the policy of each run."""
    folders = {run: RUNS / run[0] / label_of("ppo", timesteps, run[1]) for run in runs}
    jobs = [
        (replace(task_training(task), seed=seed, timesteps=timesteps), folder, f"{task} seed {seed}")
        for (task, seed), folder in folders.items()
    ]
    if train_missing(jobs, engine) != "finished":
        sys.exit("a training failed or was stopped; the same command goes on")
    return {run: str(folder) for run, folder in folders.items()}


def train_others(learner: Learner, runs: Sequence[Run], timesteps: int) -> dict[Run, str]:
    """Train a learner of another library as far as that is not done, as many at a time as there are processors; return
    the policy of each run."""
    python = LEARNERS_VENV / "bin" / "python"
    if not python.is_file():
        sys.exit(f"no virtual environment {LEARNERS_VENV}; make benchmark makes it")
    files = {run: RUNS / run[0] / f"{label_of(learner, timesteps, run[1])}.safetensors" for run in runs}
    processes = Processes()

    def train(run: Run) -> None:
        """Train one run in a process of its own, unless its policy is there."""
        (task, seed), out = run, files[run]
        if out.exists():
            return
        out.parent.mkdir(parents=True, exist_ok=True)
        part = out.with_suffix(".part.safetensors")
        words = ["--algorithm", learner.removeprefix("sb3-"), "--task", task, "--seed", str(seed)]
        words += ["--timesteps", str(timesteps), "--out", str(part)]
        done = processes.run([python, SB3_EXAMPLE, *words], Path.cwd())
        if done.code != 0:
            sys.exit(f"{task}, {learner}, seed {seed} failed:\n{done.output}")
        part.rename(out)
        print(f"{task}, {learner}, seed {seed}: {done.output.strip()}", flush=True)

    list(processes.in_parallel(train, list(runs), processors()))
    return {run: str(file) for run, file in files.items()}


def main() -> None:
    """Submit springs to each task, then the learners' trainings."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tasks = [f"{name}-{VERSION}" for name in STIFFNESS_TASKS]
    known = get_args(Learner)
    parser.add_argument("--learners", nargs="*", choices=known, default=["ppo"], help="who learns (default: ppo, ours)")
    parser.add_argument("--tasks", nargs="+", choices=tasks, default=tasks, help="tasks (default: all)")
    parser.add_argument(
        "--seeds", type=int, default=ENTRY_SEEDS, help=f"trainings of each task (default: {ENTRY_SEEDS})"
    )
    parser.add_argument("--timesteps", type=int, default=500_000, help="of each training (default: 500,000)")
    parser.add_argument("--engine", choices=get_args(Engine), default="here", help="where PPO trains (default: here)")
    flags = parser.parse_args()
    runs = [(task, seed) for seed in range(flags.seeds) for task in flags.tasks]
    try:
        require_count("seeds", flags.seeds)
        replace(task_training(flags.tasks[0]), timesteps=flags.timesteps)
    except SpringfootError as error:
        parser.error(str(error))
    if flags.engine != "here" and flags.learners != ["ppo"]:
        parser.error(f"engine {flags.engine} trains our PPO alone: --learners ppo")
    for task in flags.tasks:
        for policy in ("random", "schedule"):
            submit_and_judge(policy, task, policy, SUBMISSIONS / task / policy)
        if not (SUBMISSIONS / task / "constant" / JUDGED).exists():
            springs = best_constant(task)
            submit_and_judge(springs, task, f"best {springs}", SUBMISSIONS / task / "constant")
    for learner in flags.learners:
        folders = {run: SUBMISSIONS / run[0] / label_of(learner, flags.timesteps, run[1]) for run in runs}
        left = [run for run in runs if not (folders[run] / SUBMISSION).exists()]
        if learner == "ppo":
            with exiting_if_missing():  # Ray
                policies = train_ours(left, flags.timesteps, flags.engine)
        else:
            policies = train_others(learner, left, flags.timesteps)
        for run in runs:
            task, seed = run
            name = f"{NAMES[learner]}, {flags.timesteps:,} steps, seed {seed}"
            submit_and_judge(policies.get(run), task, name, folders[run])


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("stopped; the same command goes on")
