"""Make the leaderboard of the benchmark from judged submissions.

Submissions of one name but for ", seed N" are one entry: the trainings of a learner.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from springfoot.arrays import NDArray
from springfoot.files.markdown import MISSING, table
from springfoot.tasks import STIFFNESS_TASKS, TASKS, VERSION

from .judged import JudgedRow, judged_rows
from .learner_scores import (
    CONSTANT,
    ENTRY_SEEDS,
    RANDOM,
    SCHEDULE,
    LearnerScores,
    interquartile_mean,
    interval,
    interval_text,
    learner_scores,
)
from .task_walks import EPISODES

MOST_ROWS = 8
"""Most rows of a task's table; chosen, a table that is read."""
_OF_MAKE = re.compile(r"(?P<learner>.+)-(?P<timesteps>\d+)-seed-\d+")
"""Name of the folder of a training by `make benchmark`: its flags `--learners` and `--timesteps`."""


def leaderboard(folder: Path) -> str:
    """Return Markdown of the judged submissions below a folder: the scores of learners, then a section for each task
    that has submissions."""
    rows = judged_rows(folder)
    public, drawn = learner_scores(rows), learner_scores(rows, "drawn_return_mean")
    parts = [text] if (text := _scores_section(public, drawn)) else []
    parts += [text] if (text := _not_run(rows, public)) else []
    head = ["entry", "return", "falls", "return, drawn", "falls, drawn"]
    for task in TASKS:
        entries: dict[str, list[JudgedRow]] = {}
        for row in rows:
            if row.submission.task == task:
                entries.setdefault(row.entry, []).append(row)
        if entries:
            shown = _shown(entries)
            parts.append(f"## {task}\n\n{table(head, [_cells(name, entries[name]) for name in shown])}")
            if len(entries) > len(shown):
                parts.append(f"{len(entries) - len(shown)} more are not shown.")
    return "\n\n".join(parts)


def _shown(entries: Mapping[str, Sequence[JudgedRow]]) -> list[str]:
    """Return the names of a task's best `MOST_ROWS` entries, best first; the best of random stiffness and of constant
    springs are always among them."""
    best = sorted(entries, key=lambda name: -interquartile_mean(np.array([row.return_mean for row in entries[name]])))
    kinds = {name: entries[name][0].submission.policy.partition(":")[0] for name in best}
    ends = {next(name for name in best if kinds[name] == kind) for kind in (RANDOM, CONSTANT) if kind in kinds.values()}
    kept = ends.union([name for name in best if name not in ends][: MOST_ROWS - len(ends)])
    return [name for name in best if name in kept]


def _cells(name: str, rows: Sequence[JudgedRow]) -> list[str]:
    """Return the cells of an entry: name and seeds, public return and falls, drawn return and falls."""
    name = rows[0].submission.name if len(rows) == 1 else f"{name} ({len(rows)} seeds)"
    walks = len(rows) * EPISODES
    return [
        name,
        interval_text([np.array([row.return_mean for row in rows])], ".0f"),
        f"{sum(row.falls for row in rows)} of {walks}",
        interval_text([np.array([row.drawn_return_mean for row in rows])], ".0f"),
        f"{sum(row.drawn_falls for row in rows)} of {walks}",
    ]


def _scores_section(public: LearnerScores, drawn: LearnerScores) -> str:
    """Return the Markdown section of the learners' scores: two tables with a row for each task that sets stiffness;
    empty without learners."""
    learners = [name for name in public if name != SCHEDULE]
    if not learners:
        return ""
    tasks = [f"{name}-{VERSION}" for name in STIFFNESS_TASKS]
    run = [task for task in tasks if any(task in public[name] for name in learners)]
    above = [task for task in run if any(_beats_springs(task, public[name], drawn.get(name, {})) for name in learners)]
    words = [
        "0 is random stiffness, 1 the best constant springs. Some learner is better than these, with all of both "
        f"intervals, on: {', '.join(above) or 'no task'}."
    ]
    if below := [task for task in run if task not in above]:
        words.append(f"Not better: {', '.join(below)}.")
    tables = [_scores_table("score", tasks, public), _scores_table("score, drawn", tasks, drawn)]
    return "\n\n".join(["## Learners", *tables, " ".join(words)])


def _not_run(rows: Sequence[JudgedRow], scores: LearnerScores) -> str:
    """Return a Markdown list of the commands that run the learners of `make benchmark` on the tasks where they have
    fewer than `ENTRY_SEEDS` trainings; empty if there are none."""
    lines = []
    for learner, by_task in scores.items():
        tasks = [f"{name}-{VERSION}" for name in STIFFNESS_TASKS]
        left = [task for task in tasks if len(by_task.get(task, ())) < ENTRY_SEEDS]
        folders = [row.submission.folder.name for row in rows if row.entry == learner]
        made = next(filter(None, map(_OF_MAKE.fullmatch, folders)), None)
        if left and made:
            flags = f"--learners {made['learner']} --timesteps {made['timesteps']} --tasks {' '.join(left)}"
            lines.append(f'- {learner}: `make benchmark BENCHMARK="{flags}"`')
    return "\n".join([f"Commands of the cells that are not run with {ENTRY_SEEDS} seeds:", "", *lines]) if lines else ""


def _scores_table(head: str, tasks: Sequence[str], scores: LearnerScores) -> str:
    """Return the Markdown table of scores: a row for each of `tasks`, and one for all of them together. Where a learner
    has fewer than `ENTRY_SEEDS` trainings, their number is told."""

    def cell(learner: str, task: str) -> str:
        """Return the text of a learner's scores on a task."""
        found = scores[learner].get(task)
        if found is None:
            return "not run"
        is_whole = learner == SCHEDULE or len(found) >= ENTRY_SEEDS
        return interval_text([found], ".2f") + ("" if is_whole else f", {len(found)} seeds")

    lines = [[task, *(cell(learner, task) for learner in scores)] for task in tasks]
    whole = [[by_task[task] for task in tasks] if {*tasks} <= by_task.keys() else None for by_task in scores.values()]
    lines.append(["all", *(MISSING if each is None else interval_text(each, ".2f") for each in whole)])
    return table([head, *scores], lines)


def _beats_springs(task: str, *scores: Mapping[str, NDArray]) -> bool:
    """Return whether a learner's score on a task lies above 1 with all of its interval, by each of `scores`, task ->
    scores of `ENTRY_SEEDS` trainings or more."""
    found = (by_task.get(task) for by_task in scores)
    return all(own is not None and len(own) >= ENTRY_SEEDS and interval([own])[1] > 1.0 for own in found)
