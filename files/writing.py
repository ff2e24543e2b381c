"""Write files and folders of results whole or not at all, and never over older ones."""

import csv
import io
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from math import isfinite
from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError

from .locks import OWNER, TakenError, is_marked, owned


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file so that it has the old content or all of the new, also after a crash, and never a part.

    The content goes to a temporary file, to the disk, and then takes the name.
    """
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)  # mkstemp makes it private; a result is as readable as its neighbours
        os.replace(temporary, path)
        _sync_folder(path.parent)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk, where the system can."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def remove_temporary(folder: Path) -> None:
    """Remove the temporary files that a killed `write_atomically` left in a folder without other writers."""
    for path in folder.glob(".*"):
        if _is_temporary(path):
            path.unlink(missing_ok=True)


def _is_temporary(path: Path) -> bool:
    """Tell whether a name is one that `write_atomically` gives a temporary file: .NAME.EXTENSION. and 8 letters."""
    return re.fullmatch(r"\..+\.(safetensors|json|png)\.[a-z0-9_]{8}", path.name) is not None


def is_taken(path: Path) -> bool:
    """Tell whether a name is in use: by a file, a folder or a link, also by a link to nothing."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):  # the latter: a file stands where its folder should
        return False
    return True


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
        if is_taken(path):
            raise SpringfootError(f"{path} already exists; out must be a new file")


@contextmanager
def whole_folder(out: Path | None, free: Path) -> Iterator[tuple[Path, Path]]:
    """Give a hidden folder to write into, and the new folder that it becomes if the block ends without an error.

    The new folder is `out`, or with None the first of `free`-1, `free`-2, … that neither exists nor is being made by
    another process. After an error nothing is left; leftovers of a killed process are removed. Raises `SpringfootError`
    for an existing `out`.
    """
    with ExitStack() as stack:  # holds the folder of the first free name until the block ends
        names = (free.with_name(f"{free.name}-{number}") for number in count(1)) if out is None else [out]
        for name in names:
            try:
                part = stack.enter_context(_hidden_folder(name))
            except TakenError:
                if out is not None:  # without an `out` the next number is tried
                    raise
            else:
                yield part, name
                break


@contextmanager
def _hidden_folder(out: Path) -> Iterator[Path]:
    """Give the hidden folder .NAME.part that becomes `out`, named NAME, if the block ends without an error.

    Raises `TakenError` if `out` exists or another process makes it, and if the hidden name is taken, but not by
    springfoot: by a link, a file, or a folder with something in it and without an owner's file.
    """
    part = out.parent / f".{out.name}.part"
    if not _is_ours(part):
        raise TakenError(f"{part} is not of springfoot's making: remove it, or choose another folder than {out}")
    try:
        with owned(part):
            if is_taken(out):
                raise TakenError(f"{out} exists already; out must be a new folder")
            try:
                _empty_folder(part)
                yield part
                _rename_finished(part, out)
            except BaseException:
                _empty_folder(part)
                raise
    finally:
        with suppress(OSError):  # it has become `out`, or it is not ours and has something in it
            part.rmdir()


def _is_ours(part: Path) -> bool:
    """Tell whether a hidden folder may be emptied: it does not exist, holds our mark, or has nothing to lose."""
    if part.is_symlink():
        return False
    if not part.exists():
        return True
    return part.is_dir() and (is_marked(part) or all(path.name == OWNER for path in part.iterdir()))


def _rename_finished(part: Path, out: Path) -> None:
    """Rename a finished folder; if another process has taken the name meanwhile, use another name and say so."""
    name = out
    # Try `out`, then out-2, out-3, ...
    for number in count(2):
        try:
            if not is_taken(name):
                part.rename(name)
                break
        except OSError:
            if not is_taken(name):  # the name is free: it failed for another reason
                raise
        name = out.with_name(f"{out.name}-{number}")
    (name / OWNER).unlink(missing_ok=True)
    if name != out:
        print(f"{out} exists by now: the results are in {name}", file=sys.stderr, flush=True)


def _empty_folder(folder: Path) -> None:
    """Empty a folder, except for its owner's file."""
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)  # as far as it goes: no error may hide the one that led here
        elif path.name != OWNER:
            path.unlink(missing_ok=True)


def csv_text(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return the text of a CSV file with a line of names and rows of values.

    Floats have six significant digits and no zeros at their end, as Python's format "g" writes them: 0.5, 12, 1e-07.
    None and floats that are not finite are empty cells.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    """Return a value as a cell of a CSV file: a float with six significant digits, "" if it is not finite."""
    if not isinstance(value, float):
        return value
    return f"{value:.6g}" if isfinite(value) else ""


def require_new(out: str | Path) -> Path:
    """Return `out` as a path; raise `SpringfootError` if it exists and is not an empty folder.

    Files that a process left which was killed before its first result do not count.
    """
    out = Path(out)
    if is_taken(out) and not (
        out.is_dir() and all(path.name == OWNER or _is_temporary(path) for path in out.iterdir())
    ):
        raise SpringfootError(f"{out} already exists; out must be a new or an empty folder")
    return out


def make_folder(out: Path) -> None:
    """Make the folder and those above it; raise `SpringfootError` if that is impossible."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SpringfootError(f"cannot make the folder {out}: {error.strerror}") from None
