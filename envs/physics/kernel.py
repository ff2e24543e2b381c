"""Kernels: what a step does besides its physics, as compiled loops over bodies in scalar equations.

For so few numbers a call of NumPy costs more than its arithmetic, and Python more still. A kernel fills the arrays that
it is given. Row i of what it writes depends on row i of what it reads, by the same operations in the same order for any
N (no fast-math, no threads), so a batch of N gives the bits of N batches of one. numba compiles a kernel at its first
call and keeps the code beside the source, until that source file changes. A change in another file goes unnoticed;
therefore a kernel calls only functions of its own file, and takes numbers of other files as arguments. It may use the
order of axes in `envs.physics.model`, which never changes.
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
