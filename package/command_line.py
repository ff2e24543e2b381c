"""Run a command: read its flags, report bad input in one line, return an exit code."""

import ast
import dataclasses
import errno
import inspect
import io
import re
import signal
import sys
import textwrap
import threading
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import redirect_stderr
from difflib import SequenceMatcher
from itertools import pairwise
from types import MappingProxyType
from typing import Any, TypeVar

import tyro

from springfoot.errors import SpringfootError, printable, quoted
from springfoot.terminal import ENDING, INTERRUPTED, TERMINATED, restore_signals

Flags = TypeVar("Flags")
LONGEST_WORD = 160
"""Most characters of a word in an error's line; longer words are cut in their middle; chosen, two lines of a
terminal."""
_NOT_WRITTEN = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO, errno.ENOENT})
"""System errors that end a writing: full, read-only, forbidden, broken, vanished."""
_REWORDED = {
    r"^Error parsing (--\S+): ": r"\1 ",
    r"invalid literal for int\(\) with base 10: ": "must be a whole number, got ",
    r"could not convert string to float: ": "must be a number, got ",
    r"no type matching .*: (must be a (whole )?number, got )": r"\1",  # of a number that may be left out
    r"^Missing value for argument '(\S+)'. Expected 1 values": r"\1 needs a value",
    r"^Missing value for argument '(\S+)'. Expected (\d+) values": r"\1 needs \2 values",
}
"""tyro's wording -> ours."""


def parse(
    flags: type[Flags],
    words: Sequence[str] | None,
    program: str,
    repeatable: Collection[str] = frozenset(),
    synonyms: Mapping[str, str] = MappingProxyType({}),
) -> Flags:
    """Return the flags of a command line as the dataclass `flags`; `--help` exits with 0.

    The command line is `words`, or with None that of the process. `program` is the command's name in messages. A bad
    flag, and one that is given twice unless it is `repeatable`, exits with 2 after one line on standard error that
    names the flag and its fault. `synonyms` are flags that mean the same as others: a line has one of the two.
    """
    words = list(sys.argv[1:] if words is None else words)
    _join_help_lines(flags)
    output = io.StringIO()
    try:
        with redirect_stderr(output):
            parsed = tyro.cli(flags, args=words, prog=program)
    except SystemExit as end:
        if end.code == 2:
            print(f"{program}: error: {_one_line(_message_in_box(output.getvalue()))}", file=sys.stderr)
        raise
    if repeated := _repeated_flag(words, repeatable, synonyms):
        print(f"{program}: error: {repeated} is given twice; give it once", file=sys.stderr)
        raise SystemExit(2)
    return parsed


def field_help(settings: type) -> dict[str, str]:
    """Return field -> the docstring below it in the source of the dataclass `settings`, on one line."""
    body = ast.parse(textwrap.dedent(inspect.getsource(settings))).body[0].body  # type: ignore[attr-defined]
    # A field with a text right below it.
    return {
        item.target.id: " ".join(str(doc.value.value).split())
        for item, doc in pairwise(body)
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and isinstance(doc, ast.Expr)
        and isinstance(doc.value, ast.Constant)
    }


def _join_help_lines(flags: type) -> None:
    """Give tyro the help of each field of a dataclass on one line, as it keeps breaks before indented lines."""
    help_of = {}
    for owner in reversed(flags.__mro__):
        help_of |= field_help(owner) if dataclasses.is_dataclass(owner) else {}
    for item in dataclasses.fields(flags):
        if item.name in help_of:
            item.metadata = MappingProxyType({**item.metadata, "help": help_of[item.name]})  # tyro's name for it


def _repeated_flag(words: Sequence[str], repeatable: Collection[str], synonyms: Mapping[str, str]) -> str:
    """Return the first flag that stands twice among the words and may not, "" if none does; tyro would take the last
    silently."""
    # --name=value and --name, with - or _ for the parts of the name.
    flags = [word.partition("=")[0].replace("_", "-") for word in words if word.startswith("--")]
    counts = Counter(synonyms.get(flag, flag) for flag in flags)
    return next((flag for flag, count in counts.items() if count > 1 and flag not in repeatable), "")


def _message_in_box(text: str) -> str:
    """Return one line for the error that tyro has printed in a box: its first part, and the suggested flags.

    tyro tells its errors to no program: the hook beside the printing is private, and may change in any release.
    """
    lines = [line.strip("│ ") for line in text.splitlines() if not line.startswith(("╭", "╰"))]
    # Rules of dashes divide the box into its error and its suggestions.
    parts = re.split(r"\n[─-]{9,}\n", "\n".join(lines))
    if not text.startswith("╭"):  # where there is no UTF-8, the title is above a line of its own
        parts = parts[1:] or parts
    message = " ".join(parts[0].split())
    if message.startswith("Missing from "):  # then each missing argument, indented, with its help further in
        needed = re.findall(r"^[│ ] {5}(\S.*?) *│?$", text, re.MULTILINE)
        return f"give {' and '.join(words.strip() for words in needed if '--help' not in words)}; --help tells more"
    for pattern, wording in _REWORDED.items():
        message = re.sub(pattern, wording, message)
    # As the rest of a line: a small first letter, no full stop; an ellipsis stays.
    message = message[:1].lower() + re.sub(r"(?<!\.)\.$", "", message[1:])
    _, _, similar = text.partition("Perhaps you meant:")
    suggested = _nearest_flags(message, re.findall(r"^[│ ] {5}(--\S+)", similar, re.MULTILINE))
    return f"{message}; perhaps {suggested}?" if suggested else message


def _nearest_flags(message: str, flags: Sequence[str]) -> str:
    """Return words that name the three of tyro's suggested `flags` nearest to the flag in the `message`, nearest first.

    tyro lists them by the alphabet. "" without flags.
    """
    wrong = next((word for word in message.split() if word.startswith("--")), "").rstrip(",")
    ordered = sorted(dict.fromkeys(flags), key=lambda flag: -SequenceMatcher(None, wrong, flag).ratio())
    *others, last = ordered[:3] or [""]
    return f"{', '.join(others)} or {last}" if others else last


def exit_code(name: str, work: Callable[[], int | None]) -> int:
    """Run the `work` of the command `name` and return its exit code.

    The code is the value that `work` returns (0 for None), or, after one line on standard error:
    2 for bad input, a file that cannot be read or written, or too little memory; 130 after Ctrl-C; 143 after SIGTERM.
    """
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # None: closed
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # a pipe may know ASCII only
    # The work may set handlers of signals, as `end_in_order` does; only the main thread can put them back.
    in_main = threading.current_thread() is threading.main_thread()
    before: dict[int, Any] = {number: signal.getsignal(number) for number in ENDING} if in_main else {}
    try:
        return work() or 0
    except BrokenPipeError:  # no bad input: `springfoot.terminal` ends
        raise
    except (SpringfootError, OSError, MemoryError, UnicodeEncodeError) as error:
        print(f"{name}: error: {_one_line(_error_message(error))}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{name}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except _Terminated:
        print(f"{name}: ended by SIGTERM", file=sys.stderr)
        return TERMINATED
    finally:
        restore_signals(before)


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
    """Return the exit code of a training that a signal ended in good order; its `record` names the signal."""
    return TERMINATED if record.get("signal") == "SIGTERM" else INTERRUPTED


def _error_message(error: Exception) -> str:
    """Return the message of an error, and after a failed writing that nothing half-written is left."""
    if isinstance(error, MemoryError):
        return "not enough memory; results are written whole or not at all"
    if isinstance(error, UnicodeEncodeError):
        part = error.object[max(error.start - 40, 0) : error.end + 40]
        return f"a name must be UTF-8 text, got {quoted(part, LONGEST_WORD)}"
    if not isinstance(error, OSError) or error.strerror is None:  # None: raised by a library with a text alone
        return str(error)
    where = "" if error.filename is None else f": {error.filename}"
    safe = "; results are written whole or not at all" if error.errno in _NOT_WRITTEN else ""
    return f"{error.strerror}{where}{safe}"


def _one_line(text: str) -> str:
    """Return a text as one line for a terminal, with words such as names of files cut to `LONGEST_WORD`."""
    half = LONGEST_WORD // 2 - 2  # characters kept at each end, the three dots between
    return re.sub(rf"\S{{{LONGEST_WORD + 1},}}", lambda word: f"{word[0][:half]}...{word[0][-half:]}", printable(text))
