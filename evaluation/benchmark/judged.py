"""Read the judged submissions below a folder, the rows of the leaderboard."""

import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.files.json_file import read_object

from .submission import JUDGED, LARGEST_RETURN, Submission, read_submission
from .task_walks import EPISODES

_SEED = re.compile(r", seed \d+$")
"""End of a submission's name that tells the trainings of one learner apart."""
_COPY = 5e-4
"""Median difference of the returns, relative, within which a submission is a copy of another [-]; chosen, a third of
the least between trainings that differ in their seed alone."""


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

    Raises `SpringfootError` for a bad submission, for two with nearly the same returns on a task, and for a judgement
    that is damaged, of another policy or task, or with impossible numbers. A judgement is trusted: the folder's keeper
    makes it, by `springfoot judge`.
    """
    rows = []
    earlier: dict[str, list[Submission]] = defaultdict(list)  # of a task
    for path in sorted(folder.rglob(JUDGED)):
        submission = read_submission(path.parent)
        for other in earlier[submission.task]:
            if _is_copy(submission.walks.returns, other.walks.returns):
                raise SpringfootError(f"{path.parent} returns nearly the same as {other.folder}: keep one of them")
        earlier[submission.task].append(submission)
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


def _is_copy(returns: NDArray, other: NDArray) -> bool:
    """Return True if returns (N,) differ from those of another submission by less than two trainings do."""
    return bool(np.median(np.abs(returns - other)) <= _COPY * np.median(np.abs(other)))
