"""Define the command that writes sets for offline learning: `springfoot datasets`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import tyro

from springfoot.command_line import end_in_order, exit_code, parse
from springfoot.errors import require_count
from springfoot.files.markdown import table

MOST_EPISODES = 10_000
"""Most episodes of a set; chosen, a gigabyte in memory."""


@dataclass(frozen=True, kw_only=True)
class DatasetsFlags:
    """Write walks on a frozen task as Minari sets springfoot/TASK/POLICY-v0, for learners that see no environment.

    Minari keeps them in ~/.minari, or in the folder of the variable MINARI_DATASETS_PATH.
    """

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = (
        "expert",
        "medium",
        "random",
    )
    """Policies that walk, a set each: .safetensors files, run folders, those of the package, or baselines."""
    task: str = "Walk-v0"
    """Frozen task of the benchmark."""
    episodes: int = 200
    """Episodes of each set, of ten seconds or until a fall."""
    seed: int = 0
    """Seed of the first episode; the following count on."""


def datasets_main(arguments: Sequence[str] | None = None, program: str = "springfoot datasets") -> int:
    """Run the command line; return its exit code: 0 written, 2 bad input, 130 ended by Ctrl-C."""
    flags = parse(DatasetsFlags, arguments, program)
    return exit_code(program, lambda: run_datasets(flags))


def run_datasets(flags: DatasetsFlags) -> None:
    """Write the sets; print the number of episodes, steps and falls in each, and its mean return."""
    from springfoot.compiling import tell_of_compiling
    from springfoot.evaluation.benchmark.minari_sets import write_sets  # not above: help needs no simulator

    require_count("episodes", flags.episodes, 1, MOST_EPISODES)
    require_count("seed", flags.seed, 0)
    end_in_order()
    tell_of_compiling()
    summaries = write_sets(flags.policies, flags.task, flags.episodes, flags.seed)
    rows = [
        [own, str(row["episodes"]), f"{row['steps']:,}", f"{row['return_mean']:.0f}", str(row["falls"])]
        for own, row in summaries.items()
    ]
    print(table(["set", "episodes", "steps", "mean return", "falls"], rows))
    first = next(iter(summaries))
    print(f'\nNext:    python -c "import minari; print(minari.load_dataset({first!r}).total_episodes)"')
