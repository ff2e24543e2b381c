"""Define the task: observation, reward, ground, pushes, start and end of an episode."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .observation_entries import PERSON_OBSERVATION
    from .scales import ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT
    from .worn import WORN, worn_entries

__all__ = ["ANKLE_STIFFNESS_UNIT", "PERSON_OBSERVATION", "TOE_STIFFNESS_UNIT", "WORN", "worn_entries"]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "ANKLE_STIFFNESS_UNIT": "scales",
            "PERSON_OBSERVATION": "observation_entries",
            "TOE_STIFFNESS_UNIT": "scales",
            "WORN": "worn",
            "worn_entries": "worn",
        },
    )
