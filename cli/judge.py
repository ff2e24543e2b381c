"""Define the command that judges submissions to the benchmark: `springfoot judge`."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from springfoot.command_line import end_in_order, exit_code, parse
from springfoot.errors import MOST_THREADS, SpringfootError, require_count
from springfoot.files.markdown import table


@dataclass(frozen=True, kw_only=True)
class JudgeFlags:
    """Repeat submissions, and walk each on seeds and bodies drawn from its policy's digest.

    A submission with numbers that repeat gets judged.json, with which it may enter the leaderboard.
    """

    folders: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="FOLDER ...")]
    """Folders of springfoot submit."""
    threads: int = 2
    """Threads of the physics; the numbers are the same with any number."""


def judge_main(arguments: Sequence[str] | None = None, program: str = "springfoot judge") -> int:
    """Run the command line; return its exit code: 0 all repeat, 1 one does not, 2 bad input, 130 Ctrl-C, 143
    SIGTERM."""
    flags = parse(JudgeFlags, arguments, program)
    return exit_code(program, lambda: run_judge(flags))


def run_judge(flags: JudgeFlags) -> int:
    """Judge the submissions, print a table, and return the exit code."""
    from springfoot.compiling import tell_of_compiling
    from springfoot.evaluation.benchmark.submission import (
        JUDGED,
        judge_submission,
        read_submission,
    )  # help needs no simulator
    from springfoot.evaluation.benchmark.task_walks import policy_on_task
    from springfoot.files.writing import is_taken

    require_count("threads", flags.threads, 1, MOST_THREADS)
    if not flags.folders:
        raise SpringfootError("name one or more folders of springfoot submit")
    if len({os.path.realpath(folder) for folder in flags.folders}) < len(flags.folders):
        raise SpringfootError("name each folder once")
    submissions = [read_submission(folder) for folder in flags.folders]
    for each in submissions:  # all are read before the first walks
        policy_on_task(each.policy, each.task)
    if judged := [folder for folder in flags.folders if is_taken(folder / JUDGED)]:
        raise SpringfootError(f"{judged[0]} was judged before: remove its {JUDGED} to judge it again")
    end_in_order()
    tell_of_compiling()
    judgements = [judge_submission(each, flags.threads) for each in submissions]
    rows = []
    for each, found in zip(submissions, judgements, strict=True):
        verdict = "same bits" if found.same_bits else "same to 1e-6" if found.passes else "DOES NOT REPEAT"
        rows.append([each.name, each.task, each.walks.summary, found.repeated.summary, verdict, found.drawn.summary])
    print(table(["submission", "task", "submitted", "repeated", "verdict", "drawn from its digest"], rows))
    return 0 if all(found.passes for found in judgements) else 1
