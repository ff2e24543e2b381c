"""Make the leaderboard of the benchmark from judged submissions."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError
from springfoot.files.json_file import read_object
from springfoot.files.markdown import table
from springfoot.tasks import TASKS

from .submission import JUDGED, SUBMISSION

MOST_ROWS = 8
"""Most rows of a task's table; chosen, a table that is read."""


@dataclass(frozen=True, kw_only=True)
class JudgedRow:
    """A judged submission."""

    task: str
    name: str
    submitted: dict[str, Any]
    judged: dict[str, Any]

    @property
    def cells(self) -> list[str]:
        """Return its name, public return and falls, drawn return and falls."""
        public, drawn = self.submitted, self.judged
        episodes = len(public["returns"])
        return [
            self.name,
            f"{public['return_mean']:.0f}",
            f"{public['falls']} of {episodes}",
            f"{drawn['drawn_return_mean']:.0f}",
            f"{drawn['drawn_falls']} of {episodes}",
        ]


def judged_rows(folder: Path) -> list[JudgedRow]:
    """Return the judged submissions anywhere below a folder, the highest public return first; those of equal return by
    name.

    Raises `SpringfootError` for a damaged file, and for a judgement of another policy.
    """
    rows = []
    for path in sorted(folder.rglob(JUDGED)):
        judged = read_object(path, "judgement")
        submitted = read_object(path.parent / SUBMISSION, "submission")
        if judged.get("policy_sha256") != submitted.get("policy_sha256"):
            raise SpringfootError(f"{path} judges another policy than {path.parent / SUBMISSION} submits")
        rows.append(JudgedRow(task=submitted["task"], name=submitted["name"], submitted=submitted, judged=judged))
    return sorted(rows, key=lambda row: (-row.submitted["return_mean"], row.name))


def leaderboard(folder: Path) -> str:
    """Return Markdown with a section for each task that has judged submissions below a folder, its best `MOST_ROWS`."""
    rows = judged_rows(folder)
    head = ["submission", "return", "falls", "return, drawn", "falls, drawn"]
    parts = []
    for task in TASKS:
        of_task = [row.cells for row in rows if row.task == task]
        if of_task:
            parts.append(f"## {task}\n\n{table(head, of_task[:MOST_ROWS])}")
            if len(of_task) > MOST_ROWS:
                parts.append(f"{len(of_task) - MOST_ROWS} more are below these.")
    return "\n\n".join(parts)
