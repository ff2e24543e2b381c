"""What every command does around its work: tell bad input in one line, return an exit code, name its results."""

import sys
from collections.abc import Callable
from pathlib import Path

from springfoot.gait.errors import SpringfootError, printable

from .baselines import FROZEN, SCHEDULE_SUFFIXES


def exit_code(name: str, work: Callable[[], int | None]) -> int:
    """Run the `work` of the command `name` and return its exit code.

    That is what `work` returns (0 for None); 2 after one line on standard error for bad input, a file that cannot be
    read or written, or too little memory; 130 after Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # a pipe may know ASCII only
    try:
        return work() or 0
    except BrokenPipeError:  # no bad input: `springfoot.terminal` ends
        raise
    except (SpringfootError, OSError, MemoryError) as error:
        print(f"{name}: error: {printable(str(error))}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def policy_label(name: str) -> str:
    """What results call a policy: its own name, that of its run or that of its file, without folders."""
    kind, _, other = name.partition(":")
    if kind == FROZEN and other:
        return f"{FROZEN}-{policy_label(other)}"
    path = Path(name)
    if path.suffix not in (".safetensors", ".onnx", *SCHEDULE_SUFFIXES):
        return path.resolve().name.replace(":", "-").replace(",", "-")
    return f"{path.resolve().parent.name}-{path.stem}" if path.stem in ("best", "last") else path.stem
