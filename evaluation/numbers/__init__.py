"""The one measurer of a gait: strides, curves over the stride, metrics and criteria."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .criteria import HUMAN_LIKE, NO_FALLS, WALKS, Criterion, number_text, unmet, with_derived
    from .likeness import ANGLE_JOINTS, LATE_SWING_PERCENT, MOMENT_JOINTS, gait_numbers
    from .measured_effort import effort_numbers, mean_effort, stiffness_charge
    from .metrics import MOMENT_CURVES, Gait, measure
    from .per_leg import asymmetry, leg_numbers
    from .series import foot_contacts, mean_speed, strides_within
    from .tally import StrideTally, add_episode

__all__ = [
    "ANGLE_JOINTS",
    "HUMAN_LIKE",
    "LATE_SWING_PERCENT",
    "MOMENT_CURVES",
    "MOMENT_JOINTS",
    "NO_FALLS",
    "WALKS",
    "Criterion",
    "Gait",
    "StrideTally",
    "add_episode",
    "asymmetry",
    "effort_numbers",
    "foot_contacts",
    "gait_numbers",
    "leg_numbers",
    "mean_effort",
    "mean_speed",
    "measure",
    "number_text",
    "stiffness_charge",
    "strides_within",
    "unmet",
    "with_derived",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "ANGLE_JOINTS": "likeness",
            "HUMAN_LIKE": "criteria",
            "LATE_SWING_PERCENT": "likeness",
            "MOMENT_JOINTS": "likeness",
            "MOMENT_CURVES": "metrics",
            "NO_FALLS": "criteria",
            "WALKS": "criteria",
            "Criterion": "criteria",
            "Gait": "metrics",
            "StrideTally": "tally",
            "add_episode": "tally",
            "asymmetry": "per_leg",
            "foot_contacts": "series",
            "gait_numbers": "likeness",
            "leg_numbers": "per_leg",
            "effort_numbers": "measured_effort",
            "mean_effort": "measured_effort",
            "mean_speed": "series",
            "measure": "metrics",
            "number_text": "criteria",
            "with_derived": "criteria",
            "stiffness_charge": "measured_effort",
            "strides_within": "series",
            "unmet": "criteria",
        },
    )
