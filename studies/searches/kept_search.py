"""The generations of a CMA-ES search, kept as they come: a search that was stopped goes on with the same bits.

What CMA-ES asks follows from its seed and from what it was told. So the costs alone are kept, and told again.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cma
import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.writing import write_atomically

from ..base.study import Study

NOT_ASKED = frozenset(
    {"threads", "quick", "out", "page", "command", "log", "generations", "styles", "constants", "plan_file", "keep"}
)
"""Flags of a search that change nothing of what its generations pay."""


def asked_of(study: Study) -> dict[str, Any]:
    """Return the settings of a study that searches, as plain JSON values."""
    asked = {name: value for name, value in vars(study).items() if name not in NOT_ASKED}
    return {name: str(value) if isinstance(value, Path) else value for name, value in asked.items()}


def generations(
    strategy: cma.CMAEvolutionStrategy,
    count: int,
    price: Callable[[int, list[NDArray]], NDArray],
    kept: Path | None = None,
    asked: Any = None,
) -> Iterator[tuple[int, list[NDArray], NDArray]]:
    """Run `count` generations; each gives its number from 0, its candidates and what they paid, once told.

    `price` is given a generation and its candidates. What they paid is kept in the file `kept`; one that is there is
    gone on with. `asked`, plain JSON values, says what is searched for: raises `SpringfootError` for the file of
    another search.
    """
    asked = json.loads(json.dumps(asked))
    known = []
    if kept is not None and kept.is_file():
        try:
            table = json.loads(kept.read_text(encoding="utf-8"))
            before = table["asked"]
            known = [np.array(paid, float) for paid in table["paid"]]
        except (ValueError, TypeError, KeyError) as error:
            raise SpringfootError(f"{kept} is not what a search paid: {error}") from None
        if before != asked:
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
