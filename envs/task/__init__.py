"""Define the task: observation, reward, ground, pushes, start and end of an episode."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .scales import ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT

__all__ = ["ANKLE_STIFFNESS_UNIT", "TOE_STIFFNESS_UNIT"]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {"ANKLE_STIFFNESS_UNIT": "scales", "TOE_STIFFNESS_UNIT": "scales"},
    )
