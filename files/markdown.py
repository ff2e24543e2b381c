"""Format Markdown tables and the numbers in them."""

from collections.abc import Mapping, Sequence

MISSING = "–"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table: a line of headings, and rows of as many cells."""
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, ("---",) * len(head), *rows))


def text_of(value: float | None, pattern: str) -> str:
    """Return a number as text in the format `pattern`, `MISSING` for None."""
    return MISSING if value is None else format(value, pattern)


def plus_minus(spread: Mapping[str, float | None], pattern: str, *, alone: bool = True) -> str:
    """Return a dictionary {"mean", "sd"} as text "mean ± SD", each by the format `pattern`.

    If "sd" is None, the text is the mean `alone`, or with `alone=False` "mean ± –".
    """
    mean, sd = (text_of(spread[name], pattern) for name in ("mean", "sd"))
    return mean if alone and spread["sd"] is None else f"{mean} ± {sd}"
