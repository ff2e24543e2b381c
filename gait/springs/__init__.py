"""Describe stiffness: the law of the joints, schedules over the stride, and springs identified from motion."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .foot_file import read_foot
    from .identification import PhaseSpring, identify
    from .identification_by_pushes import REACTS, SPRING, PushedSpring, identify_pushed
    from .quasi_stiffness import StancePhase, phase_slope, stance_phases
    from .spring_fit import Estimate
    from .stiffness import LOWEST_STIFFNESS, SPRINGS, Segment, StiffnessSchedule, ankle_events, toe_events, with_swing

__all__ = [
    "LOWEST_STIFFNESS",
    "REACTS",
    "SPRING",
    "SPRINGS",
    "Estimate",
    "PhaseSpring",
    "PushedSpring",
    "Segment",
    "StancePhase",
    "StiffnessSchedule",
    "ankle_events",
    "identify",
    "identify_pushed",
    "phase_slope",
    "read_foot",
    "stance_phases",
    "toe_events",
    "with_swing",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "ankle_events": "stiffness",
            "toe_events": "stiffness",
            "StancePhase": "quasi_stiffness",
            "phase_slope": "quasi_stiffness",
            "stance_phases": "quasi_stiffness",
            "with_swing": "stiffness",
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
