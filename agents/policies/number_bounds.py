"""Bound the numbers in files: weights of a network, Adam's moments, running statistics."""

from collections.abc import Mapping

import numpy as np

from springfoot.errors import SpringfootError

LARGEST_WEIGHT = 1e6
"""Largest magnitude of a weight or bias [-]; chosen, a hundred thousand times a usual one."""
LARGEST_MOMENT = 1e12
"""Largest magnitude of Adam's moments [-]; chosen. Gradients are clipped to 0.5 before."""
LARGEST_STATISTIC = 1e30
"""Largest magnitude of a mean, variance or count; chosen, so that its root and its square are finite."""
_MOMENTS = frozenset({"step", "exp_avg", "exp_avg_sq"})


def require_bounded(path: object, tensors: Mapping[str, np.ndarray]) -> None:
    """Raise `SpringfootError` for numbers that no training can produce; a tensor's name decides the range.

    `path` is the file, or another subject of the error.
    """
    for name, values in tensors.items():
        bounds = _bounds(name)
        if bounds is not None and values.size:
            low, high = bounds
            least = float(values.min())
            most = float(values.max())
            if not low <= least <= most <= high:  # false for NaN too
                outside = most if least >= low else least  # NaN is the least and the largest
                raise SpringfootError(f"{path}: {name} must be in [{low:g}, {high:g}], has {outside:.4g}")


def _bounds(name: str) -> tuple[float, float] | None:
    """Return the least and the largest allowed number in the tensor `name`; None for unknown names.

    The first part of the name tells the kind, the last one the item: `adam.3.exp_avg`, `observation.mean`.
    """
    kind, _, rest = name.partition(".")
    item = rest.rpartition(".")[2]
    if kind in ("network", "layer"):
        return -LARGEST_WEIGHT, LARGEST_WEIGHT
    if kind == "adam":
        return (-LARGEST_MOMENT if item == "exp_avg" else 0.0), LARGEST_MOMENT
    if kind in ("observation", "return"):
        return (-LARGEST_STATISTIC if item == "mean" else 0.0), LARGEST_STATISTIC
    return None


def require_moments(path: object, names: Mapping[str, object], parameters: int) -> None:
    """Raise `SpringfootError` unless a state has Adam's moments of all parameters of the network, or of none.

    `path` is the file, or another subject of the error; `names` are those of the state's tensors, `parameters` the
    number of the network's.
    """
    present = {name for name in names if name.startswith("adam.")}
    expected = {f"adam.{index}.{item}" for index in range(parameters) for item in _MOMENTS}
    if present and (missing := sorted(expected - present)):
        raise SpringfootError(f"{path} has no {missing[0]}")
