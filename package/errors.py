"""The one exception of springfoot, and the checks that raise it most."""

from math import inf, isfinite, isinf, isnan, nan
from numbers import Integral, Real

MOST_COUNT = 10**12
"""Largest count of anything; chosen."""
MOST_THREADS = 1024
"""Most threads of the physics; chosen, beyond all machines."""


class SpringfootError(ValueError):
    """Bad input or an impossible request: one printable line saying what was wrong and what is allowed."""

    def __init__(self, message: object = "") -> None:
        super().__init__(printable(str(message)))


def printable(text: str) -> str:
    """`text` as one line that does nothing to a terminal: control characters as Python writes them."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def quoted(value: object, most: int = 60) -> str:
    """Return the quotation of a bad value in a message: its `repr`, or the beginning of it beyond `most` letters."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits
        text = f"{type(value).__name__} too long to print"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def as_float(value: object) -> float:
    """Return a number as a float, infinite if too large for one; NaN for what is no number."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return nan
    try:
        return float(value)
    except OverflowError:
        return -inf if value < 0 else inf


def require_within(name: str, value: object, allowed: tuple[float, float], unit: str = "") -> float:
    """`value` as a float, or `SpringfootError` if it is not a finite number in [low, high] of `unit`."""
    low, high = allowed
    number = as_float(value)
    if not low <= number <= high:
        given = quoted(value) if isnan(number) else f"{number:.4g}"
        raise SpringfootError(f"{name} must be in [{low:g}, {high:g}] {unit}".rstrip() + f", got {given}")
    return number


def require_number(
    name: str, value: object, low: float, high: float = inf, unit: str = "", *, above: bool = False
) -> float:
    """`value` as a float, or `SpringfootError` if it is not finite and in [low, high], (low, high] with `above`."""
    number = as_float(value)
    if not (isfinite(number) and low <= number <= high) or (above and number == low):
        bounds = f"{'>' if above else '>='} {low:g}" + ("" if high == inf else f" and <= {high:.4g}")
        given = "infinity" if isinf(number) else quoted(value)
        raise SpringfootError(f"{name} must be a finite number {bounds} {unit}".rstrip() + f", got {given}")
    return number


def require_count(name: str, value: object, least: int = 1, most: int = MOST_COUNT) -> int:
    """`value` as an int, or `SpringfootError` if it is not a whole number in [least, most]."""
    count = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if count is None or not least <= count <= most:
        bounds = f">= {least}" + ("" if most == MOST_COUNT and (count is None or count <= most) else f" and <= {most}")
        given = "infinity" if isinf(as_float(value)) else quoted(value)
        raise SpringfootError(f"{name} must be a whole number {bounds}, got {given}")
    return count
