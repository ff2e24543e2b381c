"""Draw the learners of the leaderboard: performance profiles over the tasks, and how our PPO's score grows.

    python -m benchmarks.task_curves

It reads the judged submissions and draws docs/results/benchmark.png. The curves are those of
docs/results/csv/benchmark_curves.csv, into which the finished runs of `make benchmark` that lie here go first.
"""

import argparse
import csv
from collections.abc import Mapping
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from benchmarks.tasks import RUNS, SUBMISSIONS, label_of
from springfoot.agents.training import read_record
from springfoot.arrays import NDArray
from springfoot.evaluation.benchmark.judged import judged_rows
from springfoot.evaluation.benchmark.learner_scores import (
    CONSTANT,
    ENTRY_SEEDS,
    RANDOM,
    LearnerScores,
    baseline_returns,
    interquartile_mean,
    learner_scores,
    profile,
)
from springfoot.evaluation.report import PNG, STYLE
from springfoot.files.writing import csv_text
from springfoot.tasks import STIFFNESS_TASKS, VERSION

RESULTS = Path(__file__).parents[1] / "docs" / "results"
THRESHOLDS = np.linspace(0.0, 2.0, 201)
"""Scores at which profiles are drawn."""
TIMESTEPS = 500_000
"""Steps of the runs with curves: the default of `make benchmark`."""
CURVES = RESULTS / "csv" / "benchmark_curves.csv"
Curves = Mapping[str, tuple[NDArray, NDArray]]
"""Task -> (E,) environment steps of the periodic evaluations, and (E,) interquartile mean of their returns."""


def kept_curves() -> Curves:
    """Return the curves of the committed CSV."""
    with CURVES.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    curves = {}
    for task in dict.fromkeys(row["task"] for row in rows):
        own = [row for row in rows if row["task"] == task]
        curves[task] = np.array([int(row["timesteps"]) for row in own]), np.array([float(row["return"]) for row in own])
    return curves


def learning_curves() -> Curves:
    """Return the curve of each task with finished runs of all seeds here, in the run's own evaluation episodes."""
    curves = {}
    for task in (f"{name}-{VERSION}" for name in STIFFNESS_TASKS):
        folders = [RUNS / task / label_of("ppo", TIMESTEPS, seed) for seed in range(ENTRY_SEEDS)]
        if all(folder.is_dir() for folder in folders):
            entries = [read_record(folder)["evaluations"] for folder in folders]
            returns = np.array([[entry["return_mean"] for entry in own] for own in entries])
            curves[task] = np.array([entry["timesteps"] for entry in entries[0]]), interquartile_mean(returns, axis=0)
    return curves


def draw(scores: LearnerScores, ends: Mapping[tuple[str, str], float], curves: Curves, path: Path) -> None:
    """Draw profiles of the learners that ran on every task beside the learning curves; `ends` are the returns of the
    baselines at scores 0 and 1, in which scores are linear."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 3.2), layout="constrained")
        profiles, over_steps = figure.subplots(1, 2)
        for learner, by_task in scores.items():
            if len(by_task) == len(STIFFNESS_TASKS):
                profiles.plot(THRESHOLDS, profile(list(by_task.values()), THRESHOLDS), label=learner)
        profiles.axvline(1.0, color="0.6", linewidth=0.8)
        profiles.set(xlabel="score", ylabel="fraction of trainings above it", ylim=(0, 1.02))
        profiles.legend(frameon=False)
        for task, (steps, middle) in curves.items():
            low, high = ends[RANDOM, task], ends[CONSTANT, task]
            over_steps.plot(steps / 1e6, (middle - low) / (high - low), label=task)
        over_steps.axhline(1.0, color="0.6", linewidth=0.8)
        over_steps.set(xlabel="environment steps (millions)", ylabel="score of our PPO")
        over_steps.legend(frameon=False, fontsize=7)
        figure.savefig(path, dpi=110, **PNG)


def main() -> None:
    """Write the curves' CSV and the picture."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    rows = judged_rows(SUBMISSIONS)
    curves = {**kept_curves(), **learning_curves()}
    lines = [
        [task, int(step), f"{value:.1f}"]
        for task, (steps, middle) in curves.items()
        for step, value in zip(steps, middle, strict=True)
    ]
    CURVES.write_text(csv_text(["task", "timesteps", "return"], lines), encoding="utf-8")
    draw(learner_scores(rows), baseline_returns(rows), curves, RESULTS / "benchmark.png")


if __name__ == "__main__":
    main()
