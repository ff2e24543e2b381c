"""Read the judged submissions below a folder, the rows of the leaderboard."""

import re
from dataclasses import dataclass
from pathlib import Path

from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.files.json_file import read_object

from .submission import JUDGED, LARGEST_RETURN, Submission, read_submission
from .task_walks import EPISODES

_SEED = re.compile(r", seed \d+$")
"""End of a submission's name that tells the trainings of one learner apart."""


@dataclass(frozen=True, kw_only=True)
class JudgedRow:
    """A submission with the numbers of its judgement; none is the submitter's."""

    submission: Submission
    return_mean: float
    falls: int
    drawn_return_mean: float
    drawn_falls: int

    @property
    def entry(self) -> str:
        """Return the submission's name without the seed of its training."""
        return _SEED.sub("", self.submission.name)


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
