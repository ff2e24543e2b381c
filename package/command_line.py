"""Run a command: tell bad input in one line, return an exit code, name its results."""

import errno
import io
import re
import signal
import sys
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr
from typing import Any, TypeVar

import tyro

from springfoot.errors import SpringfootError, printable, quoted
from springfoot.terminal import INTERRUPTED, TERMINATED

Flags = TypeVar("Flags")
LONGEST_WORD = 160
"""Most characters of a word in an error's line; longer words are cut in their middle; chosen, two lines of a
terminal."""
_NOT_WRITTEN = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO, errno.ENOENT})
"""System errors that end a writing: full, read-only, forbidden, broken, vanished."""
_OURS = {
    r"^Error parsing (--\S+): ": r"\1 ",
    r"invalid literal for int\(\) with base 10: ": "must be a whole number, got ",
    r"could not convert string to float: ": "must be a number, got ",
    r"^Missing value for argument '(\S+)'. Expected 1 values": r"\1 needs a value",
    r"^Missing value for argument '(\S+)'. Expected (\d+) values": r"\1 needs \2 values",
}
"""tyro's wording -> ours."""


def parse(flags: type[Flags], words: Sequence[str] | None, program: str) -> Flags:
    """Return the flags on the command line, `words` or those of the process; `--help` exits with 0.

    Bad flags, and a flag that is given twice, exit with 2, after one line on standard error that names the flag and its
    fault.
    """
    words = list(sys.argv[1:] if words is None else words)
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            parsed = tyro.cli(flags, args=words, prog=program)
    except SystemExit as end:
        if end.code == 2:
            print(f"{program}: error: {_in_a_line(_of_box(said.getvalue()))}", file=sys.stderr)
        raise
    if twice := _repeated_flag(words):
        print(f"{program}: error: {twice} is given twice; give it once", file=sys.stderr)
        raise SystemExit(2)
    return parsed


def _repeated_flag(words: Sequence[str]) -> str:
    """Return the first flag that stands twice among the words, or no text; tyro takes the last one without a word."""
    flags = [word.partition("=")[0].replace("_", "-") for word in words if word.startswith("--")]
    return next((flag for flag, count in Counter(flags).items() if count > 1), "")


def _of_box(text: str) -> str:
    """Return the text of one of tyro's drawn boxes in one line: its first part, and the first suggested flag."""
    lines = [line.strip("│ ") for line in text.splitlines() if not line.startswith(("╭", "╰"))]
    parts = re.split(r"\n[─-]{9,}\n", "\n".join(lines))
    if not text.startswith("╭"):  # where there is no UTF-8, the title is above a line of its own
        parts = parts[1:] or parts
    what = " ".join(parts[0].split())
    for theirs, ours in _OURS.items():
        what = re.sub(theirs, ours, what)
    what = what[:1].lower() + re.sub(r"(?<!\.)\.$", "", what[1:])
    meant = re.search(r"Perhaps you meant: (--\S+)", " ".join(" ".join(parts[1:]).split()))
    return f"{what}; perhaps {meant[1]}?" if meant else what


def exit_code(name: str, work: Callable[[], int | None]) -> int:
    """Run the `work` of the command `name` and return its exit code.

    The code is the value of `work` (0 for None); 2, after one line on standard error, for bad input, a file that cannot
    be read or written, or too little memory; 130 after Ctrl-C and 143 after SIGTERM, with a line too.
    """
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # closed
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # a pipe may know ASCII only
    in_main = threading.current_thread() is threading.main_thread()
    before = [(number, signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM)] if in_main else []
    try:
        return work() or 0
    except BrokenPipeError:  # no bad input: `springfoot.terminal` ends
        raise
    except (SpringfootError, OSError, MemoryError, UnicodeEncodeError) as error:
        print(f"{name}: error: {_in_a_line(_told(error))}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{name}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except _Terminated:
        print(f"{name}: ended by SIGTERM", file=sys.stderr)
        return TERMINATED
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def end_in_order() -> None:
    """Make SIGINT and SIGTERM raise from here on, so that unfinished writing is cleared up.

    A command calls it after its imports, and before it writes anything.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, _terminate)


class _Terminated(BaseException):
    pass


def _terminate(_number: int, _frame: object) -> None:
    raise _Terminated


def stopped_by(record: dict[str, Any]) -> int:
    """Return the exit code of a training that a signal ended in good order."""
    return TERMINATED if record.get("signal") == "SIGTERM" else INTERRUPTED


def _told(error: Exception) -> str:
    """Return the message of an error; if files cannot be written, with those that are safe."""
    if isinstance(error, MemoryError):
        return "not enough memory; results are written whole or not at all"
    if isinstance(error, UnicodeEncodeError):
        part = error.object[max(error.start - 40, 0) : error.end + 40]
        return f"a name must be UTF-8 text, got {quoted(part, LONGEST_WORD)}"
    if not isinstance(error, OSError) or error.strerror is None:
        return str(error)
    where = "" if error.filename is None else f": {error.filename}"
    safe = "; results are written whole or not at all" if error.errno in _NOT_WRITTEN else ""
    return f"{error.strerror}{where}{safe}"


def _in_a_line(text: str) -> str:
    """Return one line for a terminal, with words, such as names of files, cut to `LONGEST_WORD`."""
    half = LONGEST_WORD // 2 - 2
    return re.sub(rf"\S{{{LONGEST_WORD + 1},}}", lambda word: f"{word[0][:half]}...{word[0][-half:]}", printable(text))
