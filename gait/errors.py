"""The one exception of springfoot, and the check that raises it most."""

from numbers import Real


class SpringfootError(ValueError):
    """Bad input or an impossible request: one line saying what was wrong and what is allowed."""


def require_within(name: str, value: object, allowed: tuple[float, float], unit: str = "") -> float:
    """`value` as a float, or `SpringfootError` if it is not a finite number in [low, high] of `unit`."""
    low, high = allowed
    number = float(value) if isinstance(value, Real) and not isinstance(value, bool) else None
    if number is None or not low <= number <= high:
        given = repr(value) if number is None else f"{number:.4g}"
        raise SpringfootError(f"{name} must be in [{low:g}, {high:g}] {unit}".rstrip() + f", got {given}")
    return number
