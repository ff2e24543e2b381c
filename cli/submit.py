"""Define the command that submits a policy to the benchmark: `springfoot submit`."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from springfoot.command_line import end_in_order, exit_code, parse
from springfoot.errors import MOST_THREADS, SpringfootError, require_count


@dataclass(frozen=True, kw_only=True)
class SubmitFlags:
    """Walk a policy on the public seeds of a frozen task, and write it with its returns as a submission.

    The folder holds the policy and submission.json; springfoot judge repeats it. It takes about a minute.
    """

    policy: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="POLICY")]
    """A .safetensors file, a run folder (its best policy), pretrained, or a baseline such as constant:300,40."""
    task: Annotated[str, tyro.conf.arg(metavar="TASK")]
    """Task with its version, such as Walk-v0; docs/how-to/benchmark.md lists all."""
    name: Annotated[str | None, tyro.conf.arg(metavar="NAME", help_behavior_hint="(default: POLICY)")] = None
    """Name in the leaderboard."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER", help_behavior_hint="(default: runs/submission-N)")] = (
        None
    )
    """New folder of the submission."""
    threads: int = 2
    """Threads of the physics; the numbers are the same with any number."""


def submit_main(arguments: Sequence[str] | None = None, program: str = "springfoot submit") -> int:
    """Run the command line; return its exit code: 0 written, 2 bad input, 130 ended by Ctrl-C, 143 SIGTERM."""
    flags = parse(SubmitFlags, arguments, program)
    return exit_code(program, lambda: run_submit(flags))


def run_submit(flags: SubmitFlags) -> None:
    """Write the submission; print its returns and the next command."""
    from springfoot.compiling import tell_of_compiling
    from springfoot.evaluation.benchmark.submission import submit  # not above: help needs no simulator
    from springfoot.evaluation.recording import policy_label
    from springfoot.files.writing import is_taken

    require_count("threads", flags.threads, 1, MOST_THREADS)
    if flags.out is not None and is_taken(flags.out):
        raise SpringfootError(f"{flags.out} exists already: out must be a new folder")
    end_in_order()
    tell_of_compiling()
    name = policy_label(flags.policy) if flags.name is None else flags.name
    written = submit(flags.policy, flags.task, name, flags.out, flags.threads)
    print(f"{written.name} on {written.task}: return {written.walks.summary}")
    print(f"Results: {written.folder}")
    print(f"Next:    springfoot judge {shlex.quote(str(written.folder))}")
