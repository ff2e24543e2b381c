"""Write a policy with its returns on a frozen task as a submission, read it back, and judge it.

A submission is a folder: `submission.json`, and `policy.safetensors` unless it is a baseline, which has no file.
Judging it repeats its numbers and adds `judged.json`. No code is in it, and none of its files is run.
"""

import re
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.agents.policies.baselines import BASELINES
from springfoot.agents.policies.policy import find_policy
from springfoot.errors import SpringfootError, printable, quoted
from springfoot.files.json_file import object_with_digest, read_object
from springfoot.files.provenance import versions_and_commit
from springfoot.files.text_table import read_bytes
from springfoot.files.writing import require_new_files, whole_folder, write_new

from .task_walks import (
    EPISODES,
    TaskWalks,
    is_baseline,
    policy_on_task,
    settings_of_task,
    walk_drawn_from,
    walk_publicly,
)

SUBMISSION, POLICY, JUDGED = "submission.json", "policy.safetensors", "judged.json"
"""Files of a submission's folder."""
MOST_NAME_LETTERS = 60
"""Most letters of a submission's name; chosen, a cell of a table."""
MOST_POLICY_BYTES = 2**26
"""Largest policy file [bytes]; chosen, a thousand times a usual one."""
SAME = 1e-6
"""Largest relative difference of a return that counts as the same on another processor [-]; chosen."""
LARGEST_RETURN = 1e6
"""Largest magnitude of an episode's return [-]; chosen, a hundred times the highest that weights allow."""
_NAME = re.compile(r"[A-Za-z0-9 ,.:()+-]+")
"""Letters of a submission's name: none that Markdown or HTML reads, and none that looks like another."""
_BASELINE = re.compile(rf"\s*(?:best\s+)?(?P<baseline>{'|'.join(BASELINES)})\b", re.IGNORECASE)
"""Begin of a baseline's name: a baseline has its own, and no other submission has one."""
_PACKAGES = ("springfoot", "mujoco", "numpy", "gymnasium")


@dataclass(frozen=True, kw_only=True, eq=False)
class Submission:
    """A policy with its returns on the public seeds of one task."""

    folder: Path
    name: str
    """Name in the leaderboard."""
    task: str
    policy: str
    """Path of its file, or the name of a baseline."""
    digest: str
    """SHA-256 of the policy's file, or of the baseline's name."""
    walks: TaskWalks


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """Result of repeating a submission."""

    repeated: TaskWalks
    """The public seeds again."""
    drawn: TaskWalks
    """Seeds and bodies drawn from the policy's digest."""
    same_bits: bool
    """Whether every return was repeated to the last bit."""
    passes: bool
    """Whether every return agrees within `SAME`, and the falls agree."""


def submit(policy: str, task: str, name: str, out: Path | None, threads: int) -> Submission:
    """Walk a policy on the public seeds of a task and write the submission; return it.

    `out` is a new folder, by default the next free one of runs/submission. Raises `SpringfootError`, with nothing
    written, for a policy that the task does not take.
    """
    settings_of_task(task)  # an unknown task first
    _require_name(name, policy)
    policy_on_task(policy, task)  # one that the task does not take
    content = None if is_baseline(policy) else read_bytes(find_policy(policy), MOST_POLICY_BYTES)
    digest = _digest_of(policy, content)
    walks = walk_publicly(policy, task, threads)
    values = {
        "name": name,
        "task": task,
        "policy": policy if content is None else POLICY,
        "policy_digest": digest,
        "return_mean": float(walks.returns.mean()),
        "falls": int(walks.fell.sum()),
        "returns": walks.returns.tolist(),
        "fell": walks.fell.astype(int).tolist(),
        "made_with": versions_and_commit(_PACKAGES),
    }
    with whole_folder(out, Path("runs", "submission")) as (part, folder):
        (part / SUBMISSION).write_bytes(object_with_digest(values))
        if content is not None:
            (part / POLICY).write_bytes(content)
    path = policy if content is None else str(folder / POLICY)
    return Submission(folder=folder, name=name, task=task, policy=path, digest=digest, walks=walks)


def _digest_of(policy: str, content: bytes | None) -> str:
    """Return the SHA-256 digest of a policy: of its file's `content`, or of the name of a baseline."""
    return sha256(policy.encode() if content is None else content).hexdigest()


def read_submission(folder: Path) -> Submission:
    """Read a submission; raise `SpringfootError`, one line, if a file is missing, damaged, or not the policy walked."""
    path = folder / SUBMISSION
    values = read_object(path, "submission")
    try:
        name, task, policy, digest = (str(values[key]) for key in ("name", "task", "policy", "policy_digest"))
        returns = np.array(values["returns"], float)
        falls = list(values["fell"])
        mean, fallen = float(values["return_mean"]), int(values["falls"])
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        fault = f"has no {error}" if isinstance(error, KeyError) else f"has no numbers where it should: {error}"
        raise SpringfootError(f"{path} is no submission: it {printable(fault)}") from None
    try:
        _require_name(name, policy)
        settings_of_task(task)
    except SpringfootError as error:
        raise SpringfootError(f"{path} is no submission: {error}") from None
    if returns.shape != (EPISODES,) or len(falls) != EPISODES or any(fell not in (0, 1) for fell in falls):
        raise SpringfootError(f"{path} is no submission: it needs {EPISODES} returns, and falls of 0 or 1")
    if not np.all(np.abs(returns) <= LARGEST_RETURN):
        raise SpringfootError(f"{path} is no submission: a return must be within ±{LARGEST_RETURN:g}")
    if not np.isclose(mean, returns.mean(), rtol=SAME) or fallen != sum(falls):
        raise SpringfootError(f"{path} is no submission: return_mean and falls must be those of its episodes")
    if policy == POLICY:
        policy = str(folder / POLICY)
        found = _digest_of(policy, read_bytes(Path(policy), MOST_POLICY_BYTES))
    elif is_baseline(policy):
        found = _digest_of(policy, None)
    else:
        raise SpringfootError(f"{path} names the policy {quoted(policy)}: allowed are {POLICY} and baselines")
    if found != digest:
        raise SpringfootError(f"{policy} is not the policy that was submitted: its SHA-256 is {found[:12]}…")
    walks = TaskWalks(returns=returns, fell=np.array(falls, bool))
    return Submission(folder=folder, name=name, task=task, policy=policy, digest=digest, walks=walks)


def judge_submission(submission: Submission, threads: int) -> Judgement:
    """Walk a submission's public episodes again, and those drawn from its digest; write `JUDGED` if it passes.

    Raises `SpringfootError` for a submission judged before.
    """
    path = submission.folder / JUDGED
    require_new_files([path])
    repeated = walk_publicly(submission.policy, submission.task, threads)
    drawn = walk_drawn_from(submission.digest, submission.policy, submission.task, threads)
    passes = repeats(repeated, submission.walks, SAME)
    same_bits = repeats(repeated, submission.walks, 0.0)
    if passes:
        values: dict[str, Any] = {
            "task": submission.task,
            "policy_digest": submission.digest,
            "same_bits": same_bits,
            "return_mean": float(repeated.returns.mean()),
            "falls": int(repeated.fell.sum()),
            "drawn_return_mean": float(drawn.returns.mean()),
            "drawn_return_sd": float(drawn.returns.std()),
            "drawn_falls": int(drawn.fell.sum()),
            "made_with": versions_and_commit(_PACKAGES),
        }
        write_new({path: object_with_digest(values)})
    return Judgement(repeated=repeated, drawn=drawn, same_bits=same_bits, passes=passes)


def repeats(walks: TaskWalks, told: TaskWalks, within: float) -> bool:
    """Return True if the same episodes fall in `walks` as `told`, and every return is `within` that, relative [-]."""
    near = np.abs(walks.returns - told.returns) <= within * np.abs(told.returns)
    return bool(near.all() and np.array_equal(walks.fell, told.fell))


def _require_name(name: str, policy: str) -> None:
    """Raise `SpringfootError` unless a submission's name fits into a cell of a table, and begins with a baseline's
    exactly if the policy is that baseline."""
    if not name.strip() or len(name) > MOST_NAME_LETTERS or not _NAME.fullmatch(name):
        raise SpringfootError(
            f"name must be 1 to {MOST_NAME_LETTERS} letters a to z, digits, spaces and ,.:()+-, got {quoted(name)}"
        )
    begin = _BASELINE.match(name)
    if is_baseline(policy):
        own = policy.partition(":")[0]
        if begin is None or begin["baseline"].lower() != own:
            raise SpringfootError(f"name of the baseline {own} must begin with {own}, got {quoted(name)}")
    elif begin is not None:
        raise SpringfootError(f"name must not begin with a baseline's, {', '.join(BASELINES)}, got {quoted(name)}")
