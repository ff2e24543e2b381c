"""Tell that numba compiles kernels, which makes the first start slow. Commands import this late: it imports numba."""

import sys

from numba.core import event
from tqdm import tqdm

NOTICE = "compiling kernels that no command has needed before: up to half a minute"
"""Line on standard error before the first compilation."""


class _Teller(event.Listener):
    """Print `NOTICE` at the first compilation of which numba tells; a kernel from its cache is none."""

    def __init__(self) -> None:
        self._told = False

    def on_start(self, event: object) -> None:
        """Print the notice, above a progress bar if there is one."""
        if not self._told:
            self._told = True
            tqdm.write(NOTICE, file=sys.stderr)
            sys.stderr.flush()

    def on_end(self, event: object) -> None:
        """Do nothing."""


def tell_of_compiling() -> None:
    """Print one line on standard error just before this process compiles its first kernel; none if all are cached."""
    event.register("numba:compile", _Teller())
