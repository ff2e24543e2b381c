"""The type of every array here. Its shape and its unit stand in the docstring of what has it."""

from typing import Any, TypeAlias

import numpy.typing as npt

NDArray: TypeAlias = npt.NDArray[Any]
"""Numbers, most of them float64. NumPy's own name without a dtype is unknown to a type checker."""
