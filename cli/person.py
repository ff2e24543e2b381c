"""Define the command that reads one person's motion files: `springfoot person`."""

from collections.abc import Sequence

from springfoot.studies.springs.person import Person

from .study import run_study


def person_main(arguments: Sequence[str], program: str = "springfoot person") -> int:
    """Run the command line; return its exit code: 0 done, 2 bad input, 130 Ctrl-C, 143 SIGTERM."""
    return run_study(Person, "person", arguments, program)
