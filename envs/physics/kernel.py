"""Kernels: what a step does besides its physics, as compiled loops over bodies in scalar equations.

NumPy costs more per call than these few numbers are worth, and Python more still. A kernel fills arrays it is given.
Row i of what it writes depends on row i of what it reads, by the same operations in the same order for any N (no
fast-math, no threads): a batch of N gives the bits of N batches of one. Code is compiled at first use and kept beside
the source, where it is found stale only when that file changes: so a kernel calls only functions of its own file, and
numbers of other files reach it as arguments; of `envs.physics.model` it may know the order of axes.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile `function` with numba at its first call; dividing by zero gives infinity, as in NumPy."""
    compiled: Any
    try:
        compiled = njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        compiled = njit(error_model="numpy")(function)
    return compiled
