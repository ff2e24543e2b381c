"""Define the command that holds any gait against people: `springfoot score`."""

from collections.abc import Sequence

from springfoot.studies.walks.score import Score

from .study import run_study


def score_main(arguments: Sequence[str], program: str = "springfoot score") -> int:
    """Run the command line; return its exit code: 0 done, 2 bad input, 130 Ctrl-C, 143 SIGTERM."""
    return run_study(Score, "score", arguments, program)
