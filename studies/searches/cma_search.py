"""Run the generations of a CMA-ES search and keep their costs, so that a stopped search goes on with the same bits.

CMA-ES draws its candidates from its seed and from the costs of earlier candidates. The file therefore holds the costs
alone.
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

NOT_ASKED = frozenset(
    {"threads", "quick", "out", "page", "command", "log", "generations", "styles", "constants", "plan_file", "keep"}
)
"""Flags that do not change the cost of any candidate."""


def asked_of(study: Study) -> dict[str, Any]:
    """Return the settings of a search that change its costs, as plain JSON values."""
    asked = {name: value for name, value in vars(study).items() if name not in NOT_ASKED}
    return {name: str(value) if isinstance(value, Path) else value for name, value in asked.items()}


def generations(
    strategy: cma.CMAEvolutionStrategy,
    count: int,
    price: Callable[[int, list[NDArray]], NDArray],
    kept: Path | None = None,
    asked: Any = None,
) -> Iterator[tuple[int, list[NDArray], NDArray]]:
    """Run `count` generations and yield the number of each, from 0, its candidates and their costs.

    Args:
        strategy: the search, not yet begun.
        count: generations to run, kept ones included.
        price: generation and candidates -> costs (candidates,).
        kept: file of the costs. If it exists, its generations are not computed again.
        asked: plain JSON values that describe the search. Raises `SpringfootError` if `kept` belongs to another search.
    """
    asked = json.loads(json.dumps(asked))
    known: list[NDArray] = []
    if kept is not None and kept.exists():
        table = read_object(kept, "file of a search's costs")
        try:
            before = table["asked"]
            known = [_costs(paid, strategy.popsize) for paid in table["paid"]]
        except (ValueError, TypeError, KeyError, OverflowError) as error:
            raise SpringfootError(f"{kept} is no file of a search's costs: {error}") from None
        if json.dumps(before, sort_keys=True) != json.dumps(asked, sort_keys=True):
            raise SpringfootError(f"{kept} is of a search with other settings; choose another place")
    for generation in range(count):
        vectors = [np.asarray(vector) for vector in strategy.ask()]
        if generation < len(known):
            paid = known[generation]
        else:
            paid = np.asarray(price(generation, vectors), float)
            known.append(paid)
            if kept is not None:
                table = {"asked": asked, "paid": [each.tolist() for each in known]}
                write_atomically(kept, (json.dumps(table) + "\n").encode())
        strategy.tell(vectors, paid.tolist())
        yield generation, vectors, paid


def _costs(paid: Any, candidates: int) -> NDArray:
    """Return the costs of a kept generation; raise `ValueError` unless they are so many finite numbers."""
    if not isinstance(paid, list) or len(paid) != candidates or not all(type(cost) in (int, float) for cost in paid):
        raise ValueError(f"each generation must have {candidates} costs, which are numbers")
    return np.array(paid, float)
