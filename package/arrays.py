"""Define the type of every array; shape and unit stand in the docstring of its function or attribute."""

from typing import Any, TypeAlias

import numpy.typing as npt

NDArray: TypeAlias = npt.NDArray[Any]
"""Numbers, most of them float64. NumPy's own name without a dtype is unknown to a type checker."""
