"""Compare feet where they walk equally fast: a spring slows a walk, and effort for a metre depends on the speed."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from springfoot.files.writing import csv_text

ASKED_SPEEDS = (0.8, 1.0, 1.2, 1.4, 1.6)
"""Commanded speeds [m/s]."""
WALKED_SPEEDS = (0.9, 1.1, 1.3)
"""Walked speeds at which walks are compared [m/s]."""
Row = Mapping[str, Any]
TWO_PRICES = ("fibre_J_kg_m", "effort")
"""Columns of the two prices of a walk: fibre work, and all of the effort."""


def price_numbers(metrics: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the share of episodes that fall, walked speed [m/s] and both prices of a walk, from its metrics; None
    where they cannot be measured."""
    return {
        "falls": metrics["falls"] / metrics["episodes"],
        "walked_m_s": metrics["speed_m_s"]["mean"],
        TWO_PRICES[0]: metrics["effort"]["fibre_J_kg_m"],
        TWO_PRICES[1]: metrics["effort"]["total"],
    }


def at_walked_speeds(
    rows: Sequence[Row], keys: Sequence[str], speeds: Sequence[float], numbers: Sequence[str] = TWO_PRICES
) -> list[dict[str, Any]]:
    """Return a row for each case and each of the walked `speeds` [m/s], with `numbers`, usually both prices.

    Numbers are linear between two neighbouring commanded speeds without a fall; None where a case has no such pair
    around the speed: it falls, or walks at other speeds.

    Args:
        rows: walks with `keys`, `numbers`, `speed_m_s` (commanded), `walked_m_s` and `falls`.
        keys: columns that tell one case from another.
        speeds: walked speeds at which cases are compared [m/s].
        numbers: columns that are compared.
    """
    compared = []
    for speed in speeds:
        for case in dict.fromkeys(tuple(row[key] for key in keys) for row in rows):
            walks = [row for row in rows if tuple(row[key] for key in keys) == case]
            walks.sort(key=lambda row: row["speed_m_s"])
            between = [found for pair in pairwise(walks) if (found := _numbers_at(speed, *pair, numbers))]
            line: dict[str, Any] = {**dict(zip(keys, case, strict=True)), "speed_m_s": speed, "walked_m_s": speed}
            line |= between[0] if between else dict.fromkeys(numbers)
            compared.append(line)
    return compared


def _numbers_at(speed: float, slow: Row, fast: Row, numbers: Sequence[str]) -> dict[str, float] | None:
    """Return the columns `numbers` at a walked `speed` [m/s], linear between the walks `slow` and `fast`; None if it
    does not lie between theirs, if one of them falls, or if one of the numbers is None."""
    unmeasured = any(walk[name] is None for walk in (slow, fast) for name in numbers)
    if slow["falls"] or fast["falls"] or unmeasured:
        return None
    low = slow["walked_m_s"]
    high = fast["walked_m_s"]
    if not low <= speed <= high:
        return None
    return {name: float(np.interp(speed, [low, high], [slow[name], fast[name]])) for name in numbers}


def lowest(walked: Mapping[float, float]) -> tuple[float, float]:
    """Return the stiffness with the least price, and that price; `walked` is stiffness, ascending -> price.

    It is the lowest point of the parabola through the cheapest stiffness and its two neighbours, or the cheapest one
    itself if it is the first or the last.
    """
    stiffness = list(walked)
    cheapest = min(walked, key=lambda k: walked[k])
    index = stiffness.index(cheapest)
    around = stiffness[max(index - 1, 0) : index + 2]
    if len(around) < 3:
        return cheapest, walked[cheapest]
    parabola = np.poly1d(np.polyfit(around, [walked[k] for k in around], 2))
    best = float(-parabola.c[1] / (2.0 * parabola.c[0]))
    return best, float(parabola(best))


def rows_csv(rows: Sequence[Row]) -> str:
    """Return rows of the same columns as CSV text."""
    return csv_text(list(rows[0]), [list(row.values()) for row in rows])
