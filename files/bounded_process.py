"""Read files with other people's code in a process of its own, with bounds on memory and time.

Libraries believe a file's claims about itself: a few changed bytes make them ask for gigabytes, run for ever or crash.
Here that ends the child process, and the parent says so in one line.
"""

import os
import subprocess
import sys
from pathlib import Path

MOST_MEMORY, MOST_SECONDS, MOST_WAIT = 2**29, 60, 300
"""Memory beyond the imports [bytes], processor time and wall time [s] of reading a file; chosen. A measured walk of ten
minutes takes a tenth of each."""


def output_in_process(code: str, *arguments: str) -> bytes | None:
    """Return the standard output of Python `code` in a new process; None if the process fails or is ended.

    `code` has to call `bound_resources` after its imports; it finds `arguments` in `sys.argv`.
    """
    try:
        finished = subprocess.run(
            [sys.executable, "-P", "-c", code, *arguments],  # -P: no modules of this folder
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=MOST_WAIT,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        return None
    return None if finished.returncode else finished.stdout


def bound_resources() -> None:
    """Bound this process to `MOST_MEMORY` more memory than now, and to `MOST_SECONDS` of processor time in all."""
    try:
        import resource  # not on every system
    except ImportError:
        return
    if Path("/proc/self/statm").exists():
        pages, *_ = Path("/proc/self/statm").read_text(encoding="ascii").split()  # of all its memory
        used = int(pages) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MOST_MEMORY, used + MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash leaves no file
