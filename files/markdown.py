"""Format Markdown tables and the numbers in them, and such text as HTML."""

import re
from collections.abc import Mapping, Sequence
from html import escape

MISSING = "–"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table: a line of headings, and rows of as many cells."""
    return "\n".join("| " + " | ".join(line) + " |" for line in (head, ("---",) * len(head), *rows))


def text_of(value: float | None, pattern: str) -> str:
    """Return a number as text in the format `pattern`, `MISSING` for None."""
    return MISSING if value is None else format(value, pattern)


def span_text(values: Sequence[float], pattern: str) -> str:
    """Return the least and the largest of `values` as text such as "1 to 3", each by the format `pattern`; one number
    if they read alike."""
    return " to ".join(dict.fromkeys(format(value, pattern) for value in (min(values), max(values))))


def plus_minus(spread: Mapping[str, float | None], pattern: str, *, alone: bool = True) -> str:
    """Return a dictionary {"mean", "sd"} as text "mean ± SD", each by the format `pattern`.

    If "sd" is None, the text is the mean `alone`, or with `alone=False` "mean ± –".
    """
    mean, sd = (text_of(spread[name], pattern) for name in ("mean", "sd"))
    return mean if alone and spread["sd"] is None else f"{mean} ± {sd}"


def html_of(text: str) -> str:
    """Return Markdown text as HTML: paragraphs, lists of `-` and tables of `table`, with empty lines between, and words
    in **bold**. All else is text, HTML too."""
    return "\n".join(_block_html(block.splitlines()) for block in re.split(r"\n\n+", text.strip()))


def _block_html(lines: Sequence[str]) -> str:
    """Return the HTML of the lines of a paragraph, a list or a table."""
    if len(lines) > 1 and re.fullmatch(r"[| -]+", lines[1]):
        head, _, *rows = (line[2:-2].split(" | ") for line in lines)
        return f"<table><thead>{_row_html(head, 'col')}</thead><tbody>{''.join(map(_row_html, rows))}</tbody></table>"
    if all(line.startswith("- ") for line in lines):
        return f"<ul>{''.join(f'<li>{_inline_html(line[2:])}</li>' for line in lines)}</ul>"
    return f"<p>{_inline_html(' '.join(lines))}</p>"


def _row_html(cells: Sequence[str], scope: str = "row") -> str:
    """Return the HTML of a table's row: the first cell is its heading, with the `scope` "col" all are."""
    headings = 1 if scope == "row" else len(cells)
    parts = [f'<th scope="{scope}">{_inline_html(cell)}</th>' for cell in cells[:headings]]
    return f"<tr>{''.join(parts)}{''.join(f'<td>{_inline_html(cell)}</td>' for cell in cells[headings:])}</tr>"


def _inline_html(text: str) -> str:
    """Return text as HTML, with its words in **bold**."""
    return re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", escape(text))
