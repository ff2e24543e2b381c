"""Markdown that a command writes: tables, and sections of a page that others write too."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from springfoot.errors import SpringfootError

from .writing import write_atomically

MISSING = "–"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A markdown table."""
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, ("---",) * len(head), *rows))


def text_of(value: float | None, pattern: str) -> str:
    """A number in a table, `MISSING` for None."""
    return MISSING if value is None else format(value, pattern)


def plus_minus(spread: Mapping[str, float | None], pattern: str, *, alone: bool = True) -> str:
    """A spread of `mean_sd` as "mean ± SD"; where there is no SD the mean `alone`, or else with `MISSING` for it."""
    mean, sd = (text_of(spread[name], pattern) for name in ("mean", "sd"))
    return mean if alone and spread["sd"] is None else f"{mean} ± {sd}"


def write_section(page: Path, name: str, text: str) -> None:
    """Put `text` between `<!-- NAME BEGIN -->` and `<!-- NAME END -->` of a page, at its end where it has neither.

    The page is made where there is none. Raises `SpringfootError` for a page with one marker, or with more than two.
    """
    before, after = page.read_text(encoding="utf-8") if page.exists() else "", ""
    begin, end = f"<!-- {name} BEGIN -->", f"<!-- {name} END -->"
    if begin in before or end in before:
        if (before.count(begin), before.count(end)) != (1, 1) or before.index(end) < before.index(begin):
            raise SpringfootError(f"{page} must have {begin} and {end} once each, in this order")
        before, after = before.split(begin)[0], before.split(end)[1]
    elif before:
        before = before.rstrip("\n") + "\n\n"
    write_atomically(page, "".join([before, begin, "\n", text.strip(), "\n", end, after or "\n"]).encode())
