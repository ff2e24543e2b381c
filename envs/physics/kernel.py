"""Compile kernels: the loops over bodies of a step besides its physics, in scalar equations.

For so few numbers a call of NumPy costs more than its arithmetic, and Python more still. A kernel takes records, one
row an environment, and fills those it is given. Row i of its results depends on row i of its arguments alone, by the
same operations in the same order for any N (no fast-math, no threads), so a batch of N gives the bits of N batches of
one.

numba compiles a kernel at its first call and keeps the code beside the source. It checks only the source file of the
called kernel for changes. So the name of a kernel, under which numba keeps the code, carries a fingerprint of its own
code and of everything that it uses: constants, and other kernels in whatever file. Therefore a kernel stands below
everything that it uses.
"""

import pickle
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile `function` with numba at its first call, and cache the code on disk; x / 0 is infinity, as in NumPy."""
    named = _with_fingerprint(function)
    compiled: Any = njit(error_model="numpy")(named)
    try:
        compiled._cache = _KernelCache(named)
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        _warn_of_compiling("no folder for them can be written")
    return compiled


def part(function: Function) -> Function:
    """Compile, as `kernel` does, a function that only kernels call; its code is cached as a part of theirs."""
    compiled: Any = njit(error_model="numpy")(_with_fingerprint(function))
    return compiled


class _KernelCache(FunctionCache):
    """numba's cache, made robust: damage costs compiling anew and nothing else.

    numba keeps kernels as pickles, beside the code or where NUMBA_CACHE_DIR says: a user with write access there can
    write code too, as with Python's own `__pycache__`. No file of a user's is read this way.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file: Any = _DigestedFile(self._cache_file)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the cached kernel; None if there is none, or if its files are damaged, which are then emptied."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # a file cut short ends in any exception of pickle
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write a compiled kernel into the cache; warn if its files cannot be written."""
        try:
            super().save_overload(sig, data)
        except Exception as error:
            _warn_of_compiling(str(error))


class _DigestedFile:
    """A file of numba's cache with a digest of each kernel: damaged machine code must not run."""

    def __init__(self, file: Any) -> None:
        self.flush = file.flush
        self._file = file

    def save(self, key: Any, data: Any) -> None:
        """Write a kernel under `key`, with its digest."""
        content = dumps(data)
        self._file.save(key, (sha256(content).digest(), content))

    def load(self, key: Any) -> Any:
        """Return the kernel under `key`, or None; raise `ValueError`, or an error of unpickling, for a damaged one."""
        found = self._file.load(key)
        if found is None:
            return None
        digest, content = found
        if sha256(content).digest() != digest:
            raise ValueError("damaged")
        return pickle.loads(content)  # noqa: S301  # written by numba here, and whole by its digest


@cache
def _warn_of_compiling(reason: str) -> None:
    """Warn, once for each `reason`, that compiled kernels cannot be kept, so that every start compiles them."""
    warnings.warn(
        f"compiled kernels cannot be kept, so that every start compiles them for half a minute: {reason}; "
        "NUMBA_CACHE_DIR names another folder for them",
        RuntimeWarning,
        stacklevel=3,
    )


def _with_fingerprint(function: Function) -> Function:
    """Return `function` itself, with its fingerprint behind its qualified name, under which numba caches the code."""
    function.__qualname__ += f"_{_fingerprint(function)}"
    return function


def _fingerprint(function: Callable[..., Any]) -> str:
    """Return the digest of a function's code and of the values of all names in it that its module knows.

    Functions that behave differently have different digests.
    """
    code: Any = function.__code__  # type: ignore[attr-defined]
    known: dict[str, Any] = function.__globals__  # type: ignore[attr-defined]
    found = [code.co_code.hex(), repr(code.co_consts), repr(code.co_varnames), repr(code.co_names)]
    found += [f"{name} = {_text_of(known[name])}" for name in code.co_names if name in known]
    return sha256("\n".join(found).encode()).hexdigest()[:12]


def _text_of(value: Any) -> str:
    """Return a text for the value of a name in a kernel's code, equal for values with which the kernel does the
    same."""
    if isinstance(value, Dispatcher):
        return value.py_func.__qualname__  # with its own fingerprint
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, type) and hasattr(value, "_fields"):
        return f"{value.__name__}{value._fields}"  # of a named tuple
    return getattr(value, "__name__", None) or repr(value)  # of modules and functions; of numbers and types of records
