"""Guard a command against its terminal or pipe: gone, closed, full or narrow."""

import os
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

NARROWEST = 40
"""Least columns for help; with fewer, tyro never ends."""
READER_LEFT = 128 + 13
"""Exit code after the reader of a pipe has left, as a shell gives it for a program that SIGPIPE ends."""


INTERRUPTED, TERMINATED = 128 + 2, 128 + 15
"""Exit codes after Ctrl-C and SIGTERM, as a shell gives them for a program that these end."""
ENDING = (signal.SIGINT, signal.SIGTERM)
"""Signals that ask a command to end: Ctrl-C and `kill`."""
_SAID = {signal.SIGINT: (b"interrupted", INTERRUPTED), signal.SIGTERM: (b"ended by SIGTERM", TERMINATED)}


def at_terminal(command: Callable[[], int]) -> int:
    """Run a command and return its exit code; 141 if the reader of its output left, 2 if it cannot be written.

    Ctrl-C and SIGTERM end the process at once, with one line. A command that writes files handles these signals itself
    from before its first writing on (`command_line.end_in_order`).
    """
    _name_glfw_library()  # else glfw would start a process to look for it, which Ctrl-C would reach too
    before = take_signals(_end_at_once)
    try:
        return _run_and_flush(command)
    finally:
        restore_signals(before)


def take_signals(handler: Callable[[int, Any], object]) -> dict[int, Any]:
    """Give SIGINT and SIGTERM to `handler`; return the handlers before, by signal, for `restore_signals`.

    Outside the main thread, where Python lets none be set, change nothing and return an empty dictionary.
    """
    in_main = threading.current_thread() is threading.main_thread()
    return {number: signal.signal(number, handler) for number in ENDING} if in_main else {}


def restore_signals(before: Mapping[int, Any]) -> None:
    """Give signals back to the handlers `before`; a second time changes nothing."""
    for number, handler in before.items():
        signal.signal(number, handler)


def _name_glfw_library() -> None:
    """Set glfw's variable with the path of its library, so that glfw does not look for it."""
    spec = find_spec("glfw")
    if spec is None or spec.origin is None:
        return
    variant = "wayland" if os.environ.get("XDG_SESSION_TYPE") == "wayland" else "x11"
    library = Path(spec.origin).parent / variant / "libglfw.so"
    if library.is_file():
        os.environ.setdefault("PYGLFW_LIBRARY", str(library))


def _end_at_once(number: int, _frame: Any) -> None:
    """End the process with one line on standard error and the signal's exit code."""
    text, code = _SAID[signal.Signals(number)]
    with suppress(OSError):  # nobody reads it any more
        os.write(2, b"springfoot: " + text + b"\n")
    os._exit(code)  # an exception is lost in some imports, and is a traceback in others


def _run_and_flush(command: Callable[[], int]) -> int:
    """Run a command and flush its output; return the exit code, also if the output cannot be written."""
    for handle in (0, 1, 2):  # a closed one would be given to the next opened file, into which prints would then go
        try:
            os.fstat(handle)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # the starting process had closed it
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    if shutil.get_terminal_size().columns < NARROWEST:
        os.environ["COLUMNS"] = str(NARROWEST)
    try:
        try:
            return command()
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        _discard_buffer(sys.stdout)
        return READER_LEFT
    except OSError as error:  # only from the output: commands report their own files' errors
        _discard_buffer(sys.stdout)
        print(f"springfoot: error: cannot write the output: {error.strerror}", file=sys.stderr)
        return 2


def _discard_buffer(stream: object) -> None:
    """Discard the rest of a stream's buffer, which Python would try to write again at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())  # type: ignore[attr-defined]
    os.close(nowhere)
