"""Describe stiffness: the law of the joints, schedules over the stride, and springs identified from motion."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .foot_file import read_foot
    from .identification import PhaseSpring, identify
    from .identification_by_pushes import REACTS, SPRING, PushedSpring, identify_pushed
    from .spring_fit import Estimate
    from .stiffness import LOWEST_STIFFNESS, SPRINGS, Segment, StiffnessSchedule

__all__ = [
    "LOWEST_STIFFNESS",
    "REACTS",
    "SPRING",
    "SPRINGS",
    "Estimate",
    "PhaseSpring",
    "PushedSpring",
    "Segment",
    "StiffnessSchedule",
    "identify",
    "identify_pushed",
    "read_foot",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "LOWEST_STIFFNESS": "stiffness",
            "REACTS": "identification_by_pushes",
            "SPRING": "identification_by_pushes",
            "SPRINGS": "stiffness",
            "Estimate": "spring_fit",
            "PhaseSpring": "identification",
            "PushedSpring": "identification_by_pushes",
            "Segment": "stiffness",
            "StiffnessSchedule": "stiffness",
            "identify": "identification",
            "identify_pushed": "identification_by_pushes",
            "read_foot": "foot_file",
        },
    )
