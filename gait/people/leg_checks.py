"""Is each leg of a walk over time one that a walk has? The mean over both would hide that one is not."""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from .checks import AS_IT_IS, require_plausible
from .human import HumanGait
from .strides import MeasuredWalk, cut_strides


def require_plausible_legs(walk: MeasuredWalk, side: str, mass: float | None, people: HumanGait) -> None:
    """`require_plausible` of each leg that has strides enough for a mean of its own; arguments as of `cut_strides`."""
    for leg, series in walk.legs.items():
        if side not in ("both", leg):
            continue
        name = f"{walk.name}, the {leg} leg"
        if _bears_downward(series.get("grf_vertical", np.zeros(1))):
            raise SpringfootError(
                f"{name}: the vertical force is below 0 where it bears: up must be positive; {AS_IT_IS}"
            )
        try:
            _, curves = cut_strides(walk, leg, mass)
        except SpringfootError:  # too few strides
            continue
        require_plausible(name, {curve: values.mean(axis=0) for curve, values in curves.items()}, people)


def _bears_downward(force: NDArray) -> bool:
    """Return whether a vertical force (T,) is that of a walk upside down: below 0 for a good part of the time, and not
    always.

    A plate that nobody trod on shows noise, or an offset.
    """
    least = force.min(initial=0.0)
    return bool(-least > force.max(initial=0.0) and 0.25 < np.mean(force < 0.5 * least) < 0.9)
