"""How fast a walk is learned: curves of one training from several seeds, and whether each came to walk.

    python -m springfoot.studies.learning_curves runs/seed-0 runs/seed-1 runs/seed-2 --out docs/learning.png

Prints a markdown table: wall time of the whole training, when its policy first fell in no evaluation episode, and which
limits of a walk the best policy misses over 20 episodes of 20 s.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import matplotlib
import tyro
from matplotlib.figure import Figure

from springfoot.agents.command_line import exit_code
from springfoot.agents.training import RUN
from springfoot.evaluation.criteria import WALKS, unmet
from springfoot.evaluation.gait_figure import STYLE
from springfoot.evaluation.metrics import measure
from springfoot.evaluation.recording import prepare, record
from springfoot.gait.errors import SpringfootError

EPISODES, SECONDS = 20, 20.0
"""What the best policy is judged on."""


def first_without_falls(evaluations: list[dict[str, Any]]) -> dict[str, Any] | None:
    """The first periodic evaluation in which, and after which, no episode fell."""
    steady = None
    for entry in evaluations:
        steady = None if entry["falls"] else steady or entry
    return steady


def save_curves(path: Path, runs: dict[str, dict[str, Any]]) -> None:
    """Write the picture: return of the periodic evaluations over environment steps and over wall time, a line a run."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 3.0), layout="constrained")
        by_steps, by_time = figure.subplots(1, 2, sharey=True)
        for name, run in runs.items():
            entries = run["evaluations"]
            returns = [entry["return_mean"] for entry in entries]
            by_steps.plot([entry["timesteps"] / 1e6 for entry in entries], returns, label=name)
            by_time.plot([entry["seconds"] for entry in entries], returns)
        by_steps.set(
            xlabel="environment steps (millions)", ylabel="return of an evaluation episode (10 s)", ylim=(0, None)
        )
        by_time.set(xlabel="wall time (s)")
        by_steps.legend(frameon=False)
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Learning curves of several runs of the same training, and whether each came to walk."""

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN ...")]
    """Run folders of train.py."""
    out: Path = Path("learning.png")
    """The picture."""
    threads: int = 2
    """Threads of the physics."""


def run(flags: Flags) -> None:
    """Judge every run, print the table and write the picture."""
    if not flags.runs:
        raise SpringfootError("give one run folder of train.py or more")
    runs = {folder.name: _read(folder) for folder in flags.runs}
    print(f"| run | wall time s | steps | no falls from | missed over {EPISODES} episodes × {SECONDS:g} s |")
    print("| --- | --- | --- | --- | --- |")
    for folder, (name, record_of_run) in zip(flags.runs, runs.items(), strict=True):
        policy, settings = prepare(str(folder), {"episode_seconds": SECONDS})
        metrics = measure(record(policy, settings, name=name, episodes=EPISODES, threads=flags.threads)).metrics
        steady = first_without_falls(record_of_run["evaluations"])
        when = f"{steady['timesteps']:,} steps, {steady['seconds']:.0f} s" if steady else "–"
        seconds, steps = record_of_run["seconds"], record_of_run["timesteps"]
        print(f"| {name} | {seconds:.0f} | {steps:,} | {when} | {', '.join(unmet(metrics, WALKS)) or 'nothing'} |")
    print(f"\nMedian wall time {median(record_of_run['seconds'] for record_of_run in runs.values()):.0f} s.")
    save_curves(flags.out, runs)


def _read(folder: Path) -> dict[str, Any]:
    """The record of a finished run, with the time of every evaluation."""
    try:
        record_of_run = json.loads((folder / RUN).read_text(encoding="utf-8"))
        keys = ("seconds", "return_mean", "timesteps", "falls")
        numbers = [entry[key] for entry in record_of_run["evaluations"] for key in keys]
        float(sum(numbers) + record_of_run["seconds"] + record_of_run["timesteps"])
    except (OSError, ValueError, KeyError, TypeError):
        raise SpringfootError(
            f"{folder} holds no {RUN} with timed evaluations: give a run folder of train.py"
        ) from None
    return record_of_run


def main() -> int:
    """Exit code: 0 done, 2 bad input, 130 ended by Ctrl-C."""
    flags = tyro.cli(Flags, description=__doc__)
    return exit_code("learning_curves", lambda: run(flags))


if __name__ == "__main__":
    sys.exit(main())
