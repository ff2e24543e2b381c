"""Show how fast a walk is learned: curves of one training from several seeds, and the criteria that each run misses.

springfoot study learning-curves runs/seed-0 runs/seed-1 runs/seed-2
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import matplotlib
import tyro
from matplotlib.figure import Figure

from springfoot.agents.policies import RUN
from springfoot.agents.training import read_record
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.evaluation.numbers import WALKS, measure, unmet
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.evaluation.report import PNG, STYLE
from springfoot.files.markdown import MISSING, table
from springfoot.files.writing import csv_text

from ..base.columns import walks_csv
from ..base.study import Answer, OnProgress, WalkingStudy

KEYS = ("timesteps", "seconds", "return_mean", "falls")
"""Numbers of a periodic evaluation that are drawn and kept."""


def first_without_falls(evaluations: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return the first of the periodic evaluations without a fall up to the last; None if the last has falls."""
    first = None
    for entry in evaluations:
        if entry["falls"]:
            first = None
        elif first is None:
            first = entry
    return first


def save_curves(path: Path, runs: dict[str, dict[str, Any]]) -> None:
    """Draw the return of the periodic evaluations over environment steps and over wall time, a line for each run.

    `runs` is name -> record of a finished run (`read_finished`).
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 3.0), layout="constrained")
        by_steps, by_time = figure.subplots(1, 2, sharey=True)
        for name, run in runs.items():
            entries = run["evaluations"]
            returns = [entry["return_mean"] for entry in entries]
            by_steps.plot([entry["timesteps"] / 1e6 for entry in entries], returns, label=name)
            by_time.plot([entry["seconds"] for entry in entries], returns)
        by_steps.set(xlabel="environment steps (millions)", ylabel="return of an evaluation episode", ylim=(0, None))
        by_time.set(xlabel="wall time (s)")
        by_steps.legend(frameon=False)
        figure.savefig(path, dpi=110, **PNG)


@dataclass(frozen=True, kw_only=True)
class LearningCurves(WalkingStudy):
    """Draw learning curves of several runs of the same training, and report whether each learned to walk.

    Reports the wall time of each whole training, the step from which no evaluation episode fell, and the criteria of a
    walk that its best policy misses.
    """

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN ...")] = ()
    """Run folders of train.py."""

    def check(self) -> None:
        """Refuse an empty list of runs."""
        super().check()
        if not self.runs:
            raise SpringfootError("give one run folder of train.py or more")

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(self.runs) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Evaluate the best policy of every run."""
        runs = {folder.name: read_finished(folder) for folder in self.runs}
        lines = []
        walks = []
        for folder, (name, run) in zip(self.runs, runs.items(), strict=True):
            policy, settings = policy_and_settings(str(folder), {"episode_seconds": self.seconds}, self.seed)
            metrics = measure(record(policy, settings, name=name, progress=progress, **self.how)).metrics
            steady = first_without_falls(run["evaluations"])
            no_falls_from = f"{steady['timesteps']:,} steps, {steady['seconds']:.0f} s" if steady else MISSING
            missed = ", ".join(unmet(metrics, WALKS)) or "nothing"
            lines.append([name, f"{run['seconds']:.0f}", f"{run['timesteps']:,}", no_falls_from, missed])
            walks.append(({"run": name} | {f"training_{key}": run[key] for key in ("seconds", "timesteps")}, metrics))
        head = ["run", "wall time s", "steps", "no falls from"]
        head.append(f"missed over {self.episodes} episodes × {self.seconds:g} s")
        text = f"{table(head, lines)}\n\nMedian wall time {median(run['seconds'] for run in runs.values()):.0f} s."
        evaluations = [
            [name, *(entry[key] for key in KEYS)] for name, run in runs.items() for entry in run["evaluations"]
        ]
        files = {
            "evaluations.csv": csv_text(["run", *KEYS], evaluations),
            "policies.csv": walks_csv(walks),
            "learning.png": partial(save_curves, runs=runs),
        }
        return Answer(text=text, files=files)


def read_finished(folder: Path) -> dict[str, Any]:
    """Return the record of a finished run: one with `seconds` and `timesteps` of its own and of every evaluation.

    Raises `SpringfootError` for others.
    """
    try:
        record_of_run = read_record(folder)
        for entry in (record_of_run, *record_of_run["evaluations"]):
            require_number("seconds", entry["seconds"], 0.0, unit="s")
            require_count("timesteps", entry["timesteps"], 0)
    except (SpringfootError, KeyError):
        raise SpringfootError(
            f"{folder} holds no {RUN} with timed evaluations: give a run folder of train.py"
        ) from None
    return record_of_run
