"""Define the one exception of springfoot, and the checks that most often raise it."""

from collections.abc import Iterable
from difflib import get_close_matches
from math import inf, isfinite, isinf, isnan, nan
from numbers import Integral, Real

MOST_COUNT = 10**12
"""Largest count of anything; chosen."""
MOST_THREADS = 1024
"""Most threads of the physics; chosen, beyond all machines."""


class SpringfootError(ValueError):
    """Bad input or an impossible request: one printable line with the fault and the allowed values."""

    def __init__(self, message: object = "") -> None:
        super().__init__(printable(str(message)))


def printable(text: str) -> str:
    """Return `text` as one line that is harmless to a terminal: control characters escaped (as `\\n`)."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def quoted(value: object, most: int = 60) -> str:
    """Return the `repr` of a bad value for a message, cut to `most` letters."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits
        text = f"{type(value).__name__} too long to print"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def perhaps(word: str, known: Iterable[str], before: str = "") -> str:
    """Return the end of a message on an unknown `word`, "; perhaps NAME?" with the most similar of the `known` names
    and the text `before` it; "" if none is similar."""
    similar = get_close_matches(word, known, n=1)
    return f"; perhaps {before}{similar[0]}?" if similar else ""


def as_float(value: object) -> float:
    """Return a number as a float, infinite if it is too large; NaN for any other value."""
    if not isinstance(value, Real) or isinstance(value, bool):  # True is the number 1 to Python, a mistake to us
        return nan
    try:
        return float(value)
    except OverflowError:
        return -inf if value < 0 else inf


def require_within(name: str, value: object, allowed: tuple[float, float], unit: str = "") -> float:
    """Return `value` as a float; raise `SpringfootError` unless it is a finite number in [low, high] of `unit`."""
    low, high = allowed
    number = as_float(value)
    if not low <= number <= high:
        rounded = f"{number:.4g}"
        reads_allowed = low <= float(rounded) <= high
        given = quoted(value) if isnan(number) else repr(number) if reads_allowed else rounded
        raise SpringfootError(f"{name} must be in [{low:g}, {high:g}] {unit}".rstrip() + f", got {given}")
    return number


def require_number(
    name: str, value: object, low: float, high: float = inf, unit: str = "", *, above: bool = False
) -> float:
    """Return `value` as a float; raise `SpringfootError` unless it is a finite number in [low, high] of `unit`.

    With `above` it must be above `low` itself. Messages call the value `name`.
    """
    number = as_float(value)
    is_allowed = isfinite(number) and low <= number <= high and not (above and number == low)
    if not is_allowed:
        bounds = f"{'>' if above else '>='} {low:g}" + ("" if high == inf else f" and <= {high:.4g}")
        given = "infinity" if isinf(number) else quoted(value)
        raise SpringfootError(f"{name} must be a finite number {bounds} {unit}".rstrip() + f", got {given}")
    return number


def require_count(name: str, value: object, least: int = 1, most: int = MOST_COUNT) -> int:
    """Return `value` as an int; raise `SpringfootError` unless it is a whole number in [least, most]."""
    count = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if count is None or not least <= count <= most:
        # The largest count of anything is told only to a larger one.
        names_most = most != MOST_COUNT or (count is not None and count > most)
        bounds = f">= {least}" + (f" and <= {most}" if names_most else "")
        given = "infinity" if isinf(as_float(value)) else quoted(value)
        raise SpringfootError(f"{name} must be a whole number {bounds}, got {given}")
    return count


def require_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Raise `SpringfootError` for a value that is not in `choices`."""
    if not isinstance(value, str) or value not in choices:
        raise SpringfootError(f"{name} must be one of {', '.join(map(repr, choices))}, got {quoted(value)}")
