"""Define the command that compares feet on learned persons: `springfoot feet`."""

from collections.abc import Sequence

from springfoot.studies.feet.foot_choice import FootChoice

from .study import run_study


def feet_main(arguments: Sequence[str], program: str = "springfoot feet") -> int:
    """Run the command line; return its exit code: 0 done, 2 bad input, 130 Ctrl-C, 143 SIGTERM."""
    return run_study(FootChoice, "feet", arguments, program)
