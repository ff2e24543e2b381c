"""Springs that learn nothing, and our PPO, as submissions to the frozen tasks that set stiffness, for the leaderboard.

    make benchmark

Each is submitted and judged once, in benchmarks/submissions; the same command goes on after a stop. The best constant
springs are chosen from `ANKLES` x `TOES` by 24 episodes with seeds that no submission has.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import get_args

from springfoot.agents.policies.baselines import constant
from springfoot.agents.training import Engine, train_missing
from springfoot.agents.training.config import task_training
from springfoot.agents.training.returns import evaluate_returns
from springfoot.envs import Biped
from springfoot.errors import SpringfootError, require_count
from springfoot.evaluation.benchmark.submission import JUDGED, SUBMISSION, judge_submission, read_submission, submit
from springfoot.evaluation.benchmark.task_walks import settings_of_task
from springfoot.tasks import STIFFNESS_TASKS, VERSION

SUBMISSIONS = Path(__file__).parent / "submissions"
RUNS = Path("runs", "benchmark")
ANKLES, TOES = (150.0, 250.0, 400.0, 700.0), (20.0, 40.0, 60.0)
"""Stiffness of the constant springs [N m/rad]."""
CHOOSING_SEED, CHOOSING_EPISODES = 1000, 24


def best_constant(task: str) -> str:
    """Return the constant springs of the grid with the highest mean return on a task, as the name of a baseline."""
    settings = settings_of_task(task)
    biped = Biped(settings, CHOOSING_EPISODES, 2)
    pairs = [(ankle, toe) for ankle in ANKLES for toe in TOES]
    means = [evaluate_returns(biped, constant(settings, pair), CHOOSING_SEED)[0].mean() for pair in pairs]
    ankle, toe = max(zip(means, pairs, strict=True))[1]
    return f"constant:{ankle:g},{toe:g}"


def submit_and_judge(policy: str, task: str, name: str, folder: Path) -> None:
    """Submit and judge a policy, as far as that is not done."""
    if not (folder / SUBMISSION).exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        submit(policy, task, name, folder, threads=2)
    if not (folder / JUDGED).exists():
        found = judge_submission(read_submission(folder), threads=2)
        if not found.passes:
            sys.exit(f"{folder} does not repeat its numbers: {found.repeated.summary}")
        print(f"{task}, {name}: {found.repeated.summary}; drawn: {found.drawn.summary}", flush=True)


def main() -> None:
    """Submit springs to each task, then PPO of some seeds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, help="trainings of each task (default: 5)")
    parser.add_argument("--timesteps", type=int, default=500_000, help="of each training (default: 500,000)")
    parser.add_argument("--engine", choices=get_args(Engine), default="here", help="where to train (default: here)")
    flags = parser.parse_args()
    tasks = [f"{name}-{VERSION}" for name in STIFFNESS_TASKS]
    runs = [(task, seed, f"ppo-{flags.timesteps}-seed-{seed}") for seed in range(flags.seeds) for task in tasks]
    try:
        require_count("seeds", flags.seeds, 0)
        jobs = [
            (replace(task_training(task), seed=seed, timesteps=flags.timesteps), RUNS / task / label, f"{task} {label}")
            for task, seed, label in runs
        ]
    except SpringfootError as error:
        parser.error(str(error))
    for task in tasks:
        for policy in ("random", "schedule"):
            submit_and_judge(policy, task, policy, SUBMISSIONS / task / policy)
        if not (SUBMISSIONS / task / "constant" / JUDGED).exists():
            springs = best_constant(task)
            submit_and_judge(springs, task, f"best {springs}", SUBMISSIONS / task / "constant")
    if train_missing(jobs, flags.engine) != "finished":
        sys.exit("a training failed or was stopped; the same command goes on")
    for task, seed, label in runs:
        name = f"PPO, {flags.timesteps:,} steps, seed {seed}"
        submit_and_judge(str(RUNS / task / label), task, name, SUBMISSIONS / task / label)


if __name__ == "__main__":
    main()
