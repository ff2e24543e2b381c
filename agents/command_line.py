"""What every command line does around its work: one line for bad input, an exit code, names of results."""

import sys
from collections.abc import Callable
from pathlib import Path

from springfoot.gait.errors import SpringfootError


def exit_code(name: str, work: Callable[[], int | None]) -> int:
    """Does the `work` of the command `name`; returns its exit code.

    What `work` returns, 0 for None; 2 after one line on standard error for bad input, a file that cannot be read or
    written, or too little memory; 130 after Ctrl-C.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # a pipe may know ASCII only
    try:
        return work() or 0
    except (SpringfootError, OSError, MemoryError) as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def policy_label(name: str) -> str:
    """What a policy is called in results: its name, its run's, or its file's; without folders."""
    path = Path(name)
    if path.suffix != ".safetensors":
        return path.resolve().name.replace(":", "-").replace(",", "-")
    return f"{path.resolve().parent.name}-{path.stem}" if path.stem in ("best", "last") else path.stem
