"""The one exception of springfoot, and the check that raises it most."""

from math import isfinite
from numbers import Real


class SpringfootError(ValueError):
    """Bad input or an impossible request: one line saying what was wrong and what is allowed."""


def require_within(name: str, value: object, allowed: tuple[float, float], unit: str = "") -> float:
    """`value` as a float, or `SpringfootError` if it is not a finite number in [low, high] of `unit`."""
    low, high = allowed
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not is_number or not isfinite(value) or not low <= value <= high:
        given = f"{float(value):.4g}" if is_number else repr(value)
        raise SpringfootError(f"{name} must be in [{low:g}, {high:g}] {unit}".rstrip() + f", got {given}")
    return float(value)
