"""Checks that more than one setting needs; each raises `SpringfootError`, naming the setting and what is allowed."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from math import isfinite
from typing import Any

from springfoot.gait.errors import SpringfootError, as_float


class UnknownSettingError(SpringfootError, TypeError):
    """A setting that does not exist; also the `TypeError` that Python raises for an unknown keyword argument."""


def check_names(given: Iterable[str], names: Sequence[str]) -> None:
    """Refuse what is none of `names`, the settings, as Python refuses an unknown keyword argument."""
    for name in given:
        if name not in names:
            likely = get_close_matches(name, names, n=3, cutoff=0.5)
            which = f"likely: {', '.join(likely)}" if likely else f"valid: {', '.join(names)}"
            raise UnknownSettingError(f"got an unexpected keyword argument {name!r}, which is no setting; {which}")


def check_start(start: Any) -> None:
    """Refuse what is neither "random" nor "standing" nor a stride phase in [0, 1)."""
    if start not in ("random", "standing") and not (is_number(start) and 0 <= start < 1):
        raise SpringfootError(f"start must be 'random', 'standing' or a stride phase in [0, 1), got {start!r}")


def is_number(value: Any) -> bool:
    """Whether a value is a finite number."""
    return isfinite(as_float(value))


def check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    """Refuse a value that is none of `choices`."""
    if value not in choices:
        raise SpringfootError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")


def check_range(name: str, value: Any, unit: str) -> None:
    """Refuse what is not a pair 0 < low < high."""
    numbers = isinstance(value, tuple) and len(value) == 2 and all(map(is_number, value))
    if not numbers or not 0 < value[0] < value[1]:
        raise SpringfootError(f"{name} must be (low, high) with 0 < low < high {unit}, got {value!r}")


def check_span(name: str, value: Any, allowed: tuple[float, float], unit: str) -> None:
    """Refuse what is neither None nor a pair low < high within `allowed`."""
    numbers = isinstance(value, tuple) and len(value) == 2 and all(map(is_number, value))
    if value is not None and not (numbers and allowed[0] <= value[0] < value[1] <= allowed[1]):
        raise SpringfootError(
            f"{name} must be (low, high) with low < high in [{allowed[0]:g}, {allowed[1]:g}] {unit}, got {value!r}"
        )


def check_weights(weights: Any, defaults: dict[str, float]) -> None:
    """Refuse unknown reward terms, and weights whose sign is not that of the term's in `defaults`, where 0 is a cost."""
    if not isinstance(weights, dict):
        raise SpringfootError(f"reward_weights must map names of reward terms to numbers, got {weights!r}")
    for name, weight in weights.items():
        if name not in defaults:
            raise SpringfootError(f"reward_weights has no term {name!r}; valid: {', '.join(defaults)}")
        cost = defaults[name] <= 0
        if not is_number(weight) or (weight > 0 if cost else weight < 0):
            allowed = "<= 0 (a cost)" if cost else ">= 0 (a reward)"
            raise SpringfootError(f"reward_weights[{name!r}] must be a finite number {allowed}, got {weight!r}")
