"""Compute effects of conditions on walks, for each episode: every condition walks the same ones."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray

from ..base.walked_speeds import Row

Measured = Mapping[Any, Mapping[str, NDArray]]
"""Condition -> number -> its value in each of E episodes (E,), NaN where it is unknown."""
Effect = Callable[[Measured], NDArray]
"""Function that returns an effect in each episode (E,)."""


def by_condition(walks: Sequence[Row], conditions: Iterable[Any], names: Sequence[str]) -> Measured:
    """Return the numbers of each condition and episode, from rows with `condition`, `episode` and the `names`."""
    episodes = {
        key: sorted((row for row in walks if row["condition"] == key), key=lambda row: row["episode"])
        for key in conditions
    }
    return {
        key: {name: np.array([row[name] for row in rows], float) for name in names}  # None becomes NaN
        for key, rows in episodes.items()
    }


def difference(name: str, of: Any, against: Any) -> Effect:
    """Return the effect: the number `name` under the condition `of` less that under `against`."""
    return lambda measured: measured[of][name] - measured[against][name]


def change(name: str, of: Any, against: Any) -> Effect:
    """Return the effect: the change of the number `name` from the condition `against` to the condition `of` [%]."""
    return lambda measured: 100.0 * (measured[of][name] / measured[against][name] - 1.0)


def share(name: str, whole: str, of: Any, against: Any) -> Effect:
    """Return the effect: the change of the number `name` from the condition `against` to the condition `of`, in percent
    of the number `whole` under `against`."""
    return lambda measured: 100.0 * (measured[of][name] - measured[against][name]) / measured[against][whole]


def per_unit(name: str, at: Mapping[Any, float], factor: float = 1.0) -> Effect:
    """Return the effect: the slope (`slope`) of `factor` times the number `name` over conditions.

    `at` has the place of each condition on the axis, such as its load [kg].
    """
    return lambda measured: factor * slope(list(at.values()), [measured[key][name] for key in at])


def slope(places: ArrayLike, values: ArrayLike) -> NDArray:
    """Return for each of E episodes (E,) the slope of the line of least squares through `values` (C, E) over `places`,
    (C,) or (C, E), of C conditions."""
    y = np.asarray(values)
    x = np.asarray(places)
    x = np.broadcast_to(x[:, None] if x.ndim == 1 else x, y.shape)
    x = x - x.mean(0)
    return (x * y).sum(0) / (x * x).sum(0)


def mean_of(effects: Mapping[str, Effect]) -> Effect:
    """Return the effect: in each episode the mean of several `effects`."""
    return lambda measured: np.mean([effect(measured) for effect in effects.values()], axis=0)
