"""Read text files of numbers under a line of names, of bounded size; errors name file, line and column."""

import csv
import io
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from math import isfinite
from pathlib import Path
from stat import S_ISREG
from typing import BinaryIO

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from .digest import require_unchanged

MOST_TEXT_BYTES, LONGEST_LINE, MOST_COLUMNS, MOST_CELLS = 2**26, 2**20, 2000, 3_000_000
"""Largest text file to read: bytes, letters of a line, columns, cells; chosen: 25 minutes of 20 curves at 100 Hz, which
take less than half a gigabyte."""
LARGEST_VALUE = 1e12
"""Largest magnitude of a number in a cell; chosen, so that means and squares are finite."""


_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")
"""A number with a decimal comma."""
_NO_WAIT = getattr(os, "O_NONBLOCK", 0)
"""Flag with which opening a pipe does not wait for its other end."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """Rows of text with a header; errors name file, line and column."""

    name: str
    columns: list[str]
    rows: list[tuple[int, list[str]]]
    """Line number in the file, cells."""

    def has(self, column: str) -> bool:
        """Tell whether the table has the column, with at least one cell that is not empty."""
        return column in self.columns and any(cells[self.columns.index(column)].strip() for _, cells in self.rows)

    def numbers(self, column: str, gaps: bool = False) -> NDArray:
        """Return a column's cells as finite numbers; raise `SpringfootError` for any other cell.

        With `gaps` an empty cell is NaN.
        """
        index = self.columns.index(column)
        return np.array(
            [
                np.nan if gaps and not cells[index].strip() else self._number(line, column, cells[index])
                for line, cells in self.rows
            ]
        )

    def ascending(self, column: str) -> NDArray:
        """Return a column's cells as `numbers` does; raise `SpringfootError` unless each is greater than the one
        before."""
        values = self.numbers(column)
        # Each value after the first, with its line and the value before.
        for (line, _), before, value in zip(self.rows[1:], values[:-1], values[1:], strict=True):
            if value <= before:
                raise self.error(line, column, f"{value:g} must be greater than {before:g} in the row before")
        return values

    def renamed(self, names: Mapping[str, str]) -> "Table":
        """Return the table with other names of columns; `names` is old -> new. A column that has a new name already is
        left out, and old names that the table lacks change nothing."""
        names = {old: new for old, new in names.items() if old in self.columns}
        hidden = set(names.values()) & set(self.columns) - names.keys()
        kept = [index for index, column in enumerate(self.columns) if column not in hidden]
        columns = [names.get(self.columns[index], self.columns[index]) for index in kept]
        return replace(
            self, columns=columns, rows=[(line, [cells[index] for index in kept]) for line, cells in self.rows]
        )

    def error(self, line: int, column: str, fault: str) -> SpringfootError:
        """Return the error that names the cell in `line` and `column`, and its `fault`, in one line."""
        return SpringfootError(f"{self.name}, line {line}, column {column}: {fault}")

    def _number(self, line: int, column: str, cell: str) -> float:
        """Return a cell as a finite number; raise `SpringfootError` otherwise."""
        try:
            value = float(cell)
        except ValueError:
            raise self.error(line, column, f"must be a number, got {cell.strip()!r:.40}") from None
        if not isfinite(value):
            raise self.error(line, column, f"must be a finite number, got {cell.strip()}")
        if abs(value) > LARGEST_VALUE:
            raise self.error(line, column, f"must be within ±{LARGEST_VALUE:g}, got {value:.4g}")
        return value


def existing(path: Path) -> Path:
    """Return the path if it is a regular file; raise `SpringfootError` otherwise."""
    if not path.is_file():
        raise SpringfootError(f"{path} is not a regular file" if path.exists() else f"no file {path}")
    return path


def open_file(path: Path) -> BinaryIO:
    """Open a regular file for reading; raise `SpringfootError` for anything else.

    The opened file is checked again, as another may have taken its name since; opening a pipe does not wait.
    """

    def opener(name: str, flags: int) -> int:
        return os.open(name, flags | _NO_WAIT)

    file = open(existing(path), "rb", opener=opener)  # noqa: SIM115  # the caller closes it
    if not S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise SpringfootError(f"{path} is not a regular file")
    return file


def read_bytes(path: Path, most: int = MOST_TEXT_BYTES) -> bytes:
    """Return the content of a file; raise `SpringfootError` if it is missing or larger than `most` bytes.

    A file that grows meanwhile is read up to `most` bytes only, and a read never waits for more content.
    """
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        # One byte more than allowed shows that it has grown; a read that would have to wait gives None.
        content = (file.read(most + 1) or b"") if size <= most else b""
    if max(size, len(content)) > most:
        raise SpringfootError(f"{path.name} must have at most {most:,} bytes, has {max(size, len(content)):,}")
    return content


def has_content(path: Path, content: bytes) -> bool:
    """Tell whether a file has exactly this content; a file of another size is not read."""
    return path.is_file() and path.stat().st_size == len(content) and read_bytes(path, len(content)) == content


def read_csv(path: Path) -> Table:
    """Read a CSV file: a header, then rows of as many cells. Raises `SpringfootError` for any other file.

    Cells are separated by commas; in a file without commas in its header, by semicolons or tabs, and its numbers may
    then have decimal commas.
    """
    lines = text_lines(path)
    head = []  # up to the line of names
    for line in lines:
        head.append(line)
        if line.strip():
            break
    names = head[-1] if head else ""
    separator = next((mark for mark in ",;\t" if mark in names), ",")
    cells = enumerate(csv.reader(chain(head, lines), delimiter=separator, strict=True), 1)
    if separator != ",":
        cells = ((line, [_with_decimal_point(cell) for cell in row]) for line, row in cells)
    try:
        return make_table(path.name, cells)
    except csv.Error as error:
        raise SpringfootError(f"{path.name} is not a CSV file: {error}") from None


def _with_decimal_point(cell: str) -> str:
    """Return a cell with a decimal point if it is a number with a decimal comma."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def text_lines(path: Path) -> Iterator[str]:
    """Yield the lines of a text file with a fitting digest or none; raise `SpringfootError` for any other file."""
    content = read_bytes(path)
    require_unchanged(path, content)
    if b"\0" in content:
        raise SpringfootError(f"{path.name} is not a text file")
    try:
        # utf-8-sig leaves out the mark with which spreadsheets begin a file.
        for number, line in enumerate(io.TextIOWrapper(io.BytesIO(content), encoding="utf-8-sig"), 1):
            if len(line) > LONGEST_LINE:
                raise SpringfootError(f"{path.name}, line {number}: more than {LONGEST_LINE:,} letters")
            yield line
    except UnicodeDecodeError:
        raise SpringfootError(f"{path.name} is not a text file") from None


def make_table(name: str, lines: Iterable[tuple[int, list[str]]]) -> Table:
    """Return the table of numbered lines of cells: the first is the header, empty lines are left out.

    `name`, that of the file, stands in errors. Raises `SpringfootError` for a table without data, with rows of another
    length or a repeated column, and for one that is too large.
    """
    # Read line by line, so that a table too large is refused before it fills the memory.
    filled = ((line, cells) for line, cells in lines if any(cell.strip() for cell in cells))
    header, names = next(filled, (0, []))  # number and cells of the line of names; a file without lines has no names
    columns = [_coordinate_name(column.strip()) for column in names]
    if len(columns) > MOST_COLUMNS:
        raise SpringfootError(
            f"{name}, line {header}: must have at most {MOST_COLUMNS:,} columns, has {len(columns):,}"
        )
    if repeated := next((column for column, times in Counter(columns).items() if times > 1), None):
        raise SpringfootError(f"{name}, line {header}: column {repeated} stands twice")
    rows = []
    for line, cells in filled:
        if len(cells) != len(columns):
            raise SpringfootError(f"{name}, line {line}: {len(cells)} cells, but {len(columns)} columns")
        if (len(rows) + 1) * len(columns) > MOST_CELLS:
            raise SpringfootError(f"{name}, line {line}: more than {MOST_CELLS:,} cells; leave out columns or samples")
        rows.append((line, cells))
    if not rows:
        raise SpringfootError(f"{name} has no data: it needs a line of column names and rows of numbers")
    return Table(name=name, columns=columns, rows=rows)


def _coordinate_name(name: str) -> str:
    """Shorten OpenSim's `/jointset/knee_r/knee_angle_r/value` to `knee_angle_r`."""
    return name.split("/")[-2] if name.startswith("/") and name.endswith("/value") else name
