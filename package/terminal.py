"""What a command does about the terminal or pipe that it writes to, whatever it is: gone, closed, full or narrow."""

import os
import shutil
import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

NARROWEST = 40
"""Columns that help is laid out in at least; in fewer, tyro never ends."""
READER_LEFT = 128 + 13
"""Exit code after the reader of a pipe has left, as a shell gives it for a program that SIGPIPE ends."""


INTERRUPTED = 128 + 2
"""Exit code after Ctrl-C, as a shell gives it for a program that SIGINT ends."""


def at_terminal(command: Callable[[], int]) -> int:
    """Run a command; returns its exit code, 141 where its reader left, 2 where its output cannot be written.

    Until the command handles Ctrl-C itself, as it does once it writes anything, Ctrl-C ends the process with one line.
    """
    in_main = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGINT, _end_at_once) if in_main else None
    try:
        return _written_out(command)
    finally:
        if in_main:
            signal.signal(signal.SIGINT, before)


def _end_at_once(_number: int, _frame: Any) -> None:
    os.write(2, b"springfoot: interrupted before it began\n")
    os._exit(INTERRUPTED)  # an exception is lost in some imports, and is a traceback in others


def _written_out(command: Callable[[], int]) -> int:
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started us
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    if shutil.get_terminal_size().columns < NARROWEST:
        os.environ["COLUMNS"] = str(NARROWEST)
    try:
        try:
            return command()
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        _forget(sys.stdout)
        return READER_LEFT
    except OSError as error:  # the commands tell of their own
        _forget(sys.stdout)
        print(f"springfoot: error: cannot write the output: {error.strerror}", file=sys.stderr)
        return 2


def _forget(stream: object) -> None:
    """Let what is left in a stream go nowhere, or Python would try again at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())  # type: ignore[attr-defined]
    os.close(nowhere)
