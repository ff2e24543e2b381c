"""Run the generations of a CMA-ES search, and keep their costs in a file, so that a stopped search goes on.

CMA-ES draws its candidates from its seed and the costs of earlier candidates. With the costs alone a search therefore
goes on with the bits of an uninterrupted one.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cma
import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.json_file import read_object
from springfoot.files.writing import write_atomically

from ..base.study import Study

WITHOUT_EFFECT = frozenset(
    (
        "threads",
        "processes",
        "quick",
        "out",
        "command",
        "log",
        "generations",
        "styles",
        "constants",
        "plan_file",
        "keep",
    )
)
"""Flags that do not change the cost of any candidate."""


def asked_of(study: Study) -> dict[str, Any]:
    """Return the flags of a search that change its costs, as JSON values: the argument `asked` of `generations`."""
    flags = {name: value for name, value in vars(study).items() if name not in WITHOUT_EFFECT}
    return {name: str(value) if isinstance(value, Path) else value for name, value in flags.items()}


def generations(
    strategy: cma.CMAEvolutionStrategy,
    count: int,
    costs_of: Callable[[int, list[NDArray]], NDArray],
    file: Path | None = None,
    asked: Any = None,
) -> Iterator[tuple[int, list[NDArray], NDArray]]:
    """Return an iterator that runs `count` generations, and yields for each its number, from 0, its candidates and
    their costs (candidates,).

    Args:
        strategy: the search, not yet begun.
        count: generations to run, kept ones included.
        costs_of: function of the generation's number and its candidates that returns their costs (candidates,).
        file: file of the costs. If it exists, the generations in it are not computed again.
        asked: plain JSON values that describe the search.

    Raises `SpringfootError`, before any generation, if `file` is of another kind or belongs to another search.
    """
    kept = [] if file is None or not file.exists() else _kept_costs(file, strategy.popsize, asked)
    return _run_generations(strategy, count, costs_of, file, asked, kept)


def _kept_costs(file: Path, candidates: int, asked: Any) -> list[NDArray]:
    """Return the costs (candidates,) of each generation in a file; raise `SpringfootError` unless it is of the search
    that `asked` describes."""
    table = read_object(file, "file of a search's costs")
    try:
        asked_before = table["asked"]
        kept = [_read_costs(costs, candidates) for costs in table["costs"]]
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        raise SpringfootError(f"{file} is no file of a search's costs: {error}") from None
    if json.dumps(asked_before, sort_keys=True) != json.dumps(asked, sort_keys=True):
        raise SpringfootError(f"{file} is of a search with other settings; choose another place")
    return kept


def _run_generations(
    strategy: cma.CMAEvolutionStrategy,
    count: int,
    costs_of: Callable[[int, list[NDArray]], NDArray],
    file: Path | None,
    asked: Any,
    kept: list[NDArray],
) -> Iterator[tuple[int, list[NDArray], NDArray]]:
    """Yield number, candidates and costs of each of `count` generations.

    The first have the costs `kept`; those of the others are computed by `costs_of`, added to `kept`, and written to
    `file` together with `asked`, which names their search.
    """
    for generation in range(count):
        vectors = [np.asarray(vector) for vector in strategy.ask()]
        if generation < len(kept):
            costs = kept[generation]
        else:
            costs = np.asarray(costs_of(generation, vectors), float)
            kept.append(costs)
            if file is not None:
                table = {"asked": asked, "costs": [of_generation.tolist() for of_generation in kept]}
                write_atomically(file, (json.dumps(table) + "\n").encode())
        strategy.tell(vectors, costs.tolist())
        yield generation, vectors, costs


def _read_costs(costs: Any, candidates: int) -> NDArray:
    """Return the costs of a generation in a file; raise `ValueError` unless they are a number for each candidate."""
    if not isinstance(costs, list) or len(costs) != candidates or not all(type(cost) in (int, float) for cost in costs):
        raise ValueError(f"each generation must have {candidates} costs, which are numbers")
    return np.array(costs, float)
