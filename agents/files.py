"""Files and folders of results: written whole or not at all, and never over an older one."""

import csv
import io
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any

from springfoot.gait.errors import SpringfootError


def write_atomically(path: Path, content: bytes) -> None:
    """Write a whole file or nothing: readers see the old content or the new, never a part of it."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o644)  # mkstemp makes it private; a result is as readable as its neighbours
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def write_new(contents: Mapping[Path, bytes]) -> None:
    """Write several new files, all of them or none; raise `SpringfootError`, with nothing written, if one exists."""
    require_new_files(contents)
    written: list[Path] = []
    try:
        for path, content in contents.items():
            make_folder(path.parent)
            write_atomically(path, content)
            written.append(path)
    except BaseException:
        for path in written:
            path.unlink(missing_ok=True)
        raise


def require_new_files(paths: Iterable[Path]) -> None:
    """Raise `SpringfootError` if one of these files exists."""
    for path in paths:
        if path.exists():
            raise SpringfootError(f"{path} already exists; out must be a new file")


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """A folder to write into, which becomes the new folder `out` where the block ends well and vanishes elsewhere."""
    out.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name}."))
    try:
        yield part
        part.chmod(0o755)  # mkdtemp makes it private
        part.rename(out)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def csv_text(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A CSV file: numbers to six significant digits, nothing for None and for what is not finite."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    if not isinstance(value, float):
        return value
    return f"{value:.6g}" if isfinite(value) else ""


def require_new(out: str | Path) -> Path:
    """Return `out` as a path; raise `SpringfootError` if it exists and is not an empty folder."""
    out = Path(out)
    if out.exists() and not (out.is_dir() and not any(out.iterdir())):
        raise SpringfootError(f"{out} already exists; out must be a new or an empty folder")
    return out


def make_folder(out: Path) -> None:
    """Make the folder and those above it; raise `SpringfootError` where that is impossible."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SpringfootError(f"cannot make the folder {out}: {error.strerror}") from None


def next_free(folder: Path, stem: str) -> Path:
    """`folder`/`stem`-N with the first N from 1 on that is free."""
    number = 1
    while (path := folder / f"{stem}-{number}").exists():
        number += 1
    return path
