"""Run a study from a command line: its flags, signals and exit code."""

import shlex
from collections.abc import Sequence
from dataclasses import replace

from springfoot.command_line import end_in_order, exit_code, parse
from springfoot.studies.base.study import Study


def run_study(study_class: type[Study], name: str, words: Sequence[str], program: str) -> int:
    """Run a study with the flags in `words`, which signals end in good order; return the exit code.

    It is 0 done, 1 a training failed, 2 bad input, 130 Ctrl-C, 143 SIGTERM. `name` names its default folder, `program`
    is the command in messages.
    """
    study = parse(study_class, words, program, study_class.REPEATABLE)
    study = replace(study, command=shlex.join([*program.split(), *words]))

    def run() -> int:
        """Run the study; return the exit code."""
        from springfoot.compiling import tell_of_compiling  # numba, which help does not need

        end_in_order()
        tell_of_compiling()
        return study.run(name)

    return exit_code(program, run)
