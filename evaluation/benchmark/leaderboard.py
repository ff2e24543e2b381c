"""Make the leaderboard of the benchmark from judged submissions."""

from dataclasses import dataclass
from pathlib import Path

from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.files.json_file import read_object
from springfoot.files.markdown import table
from springfoot.tasks import TASKS

from .submission import JUDGED, LARGEST_RETURN, Submission, read_submission
from .task_walks import EPISODES

MOST_ROWS = 8
"""Most rows of a task's table; chosen, a table that is read."""


@dataclass(frozen=True, kw_only=True)
class JudgedRow:
    """A submission with the numbers of its judgement; none is the submitter's."""

    submission: Submission
    return_mean: float
    falls: int
    drawn_return_mean: float
    drawn_falls: int

    @property
    def cells(self) -> list[str]:
        """Return its name, public return and falls, drawn return and falls."""
        return [
            self.submission.name,
            f"{self.return_mean:.0f}",
            f"{self.falls} of {EPISODES}",
            f"{self.drawn_return_mean:.0f}",
            f"{self.drawn_falls} of {EPISODES}",
        ]


def judged_rows(folder: Path) -> list[JudgedRow]:
    """Return the judged submissions anywhere below a folder, the highest public return first; those of equal return by
    name.

    Raises `SpringfootError` for a bad submission, for two with the same returns on a task, and for a judgement that is
    damaged, of another policy or task, or with impossible numbers. A judgement is trusted: the folder's keeper makes
    it, by `springfoot judge`.
    """
    rows = []
    folders: dict[tuple[str, bytes], Path] = {}  # of task and returns
    for path in sorted(folder.rglob(JUDGED)):
        submission = read_submission(path.parent)
        other = folders.setdefault((submission.task, submission.walks.returns.tobytes()), path.parent)
        if other != path.parent:
            raise SpringfootError(f"{path.parent} returns the same in every episode as {other}: keep one of them")
        judged = read_object(path, "judgement")
        if (judged.get("policy_digest"), judged.get("task")) != (submission.digest, submission.task):
            raise SpringfootError(f"{path} judges another policy or task than {path.parent} submits")
        try:
            for name in ("return_mean", "drawn_return_mean"):
                require_number(name, judged[name], -LARGEST_RETURN, LARGEST_RETURN)
            for name in ("falls", "drawn_falls"):
                require_count(name, judged[name], 0, EPISODES)
        except (KeyError, SpringfootError):
            raise SpringfootError(f"{path} is no judgement: its returns or falls are missing or impossible") from None
        rows.append(
            JudgedRow(
                submission=submission,
                return_mean=judged["return_mean"],
                falls=judged["falls"],
                drawn_return_mean=judged["drawn_return_mean"],
                drawn_falls=judged["drawn_falls"],
            )
        )
    return sorted(rows, key=lambda row: (-row.return_mean, row.submission.name))


def leaderboard(folder: Path) -> str:
    """Return Markdown with a section for each task that has judged submissions below a folder, its best `MOST_ROWS`."""
    rows = judged_rows(folder)
    head = ["submission", "return", "falls", "return, drawn", "falls, drawn"]
    parts = []
    for task in TASKS:
        of_task = [row.cells for row in rows if row.submission.task == task]
        if of_task:
            parts.append(f"## {task}\n\n{table(head, of_task[:MOST_ROWS])}")
            if len(of_task) > MOST_ROWS:
                parts.append(f"{len(of_task) - MOST_ROWS} more are not shown.")
    return "\n\n".join(parts)
