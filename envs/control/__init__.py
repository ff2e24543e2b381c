"""Control the body: stiffness of ankles and toes, rest angles, hips and knees, standing."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .constants import (
        GENERIC,
        KNOTS,
        TUNED_SPEED,
        LegConstants,
        constants_from,
        constants_name,
        generic_constants,
        leg_constants,
    )
    from .equilibrium import PLATEAUS, REFERENCE_STIFFNESS, TOE_OFF, foot_curves, plateau_curve
    from .phase_table import GRID
    from .reference_walk import FED, reference_walk_at, tabulated_speeds
    from .standing import SLOW_SPEED
    from .stiffness_control import FEET, action_of, stiffness_of, stiffness_ranges
    from .subjects import DRAWN, Subjects

__all__ = [
    "DRAWN",
    "FED",
    "FEET",
    "GENERIC",
    "GRID",
    "KNOTS",
    "PLATEAUS",
    "REFERENCE_STIFFNESS",
    "SLOW_SPEED",
    "TOE_OFF",
    "TUNED_SPEED",
    "LegConstants",
    "Subjects",
    "action_of",
    "constants_from",
    "constants_name",
    "foot_curves",
    "generic_constants",
    "leg_constants",
    "plateau_curve",
    "reference_walk_at",
    "stiffness_of",
    "stiffness_ranges",
    "tabulated_speeds",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "DRAWN": "subjects",
            "FED": "reference_walk",
            "FEET": "stiffness_control",
            "GENERIC": "constants",
            "GRID": "phase_table",
            "KNOTS": "constants",
            "PLATEAUS": "equilibrium",
            "REFERENCE_STIFFNESS": "equilibrium",
            "SLOW_SPEED": "standing",
            "TOE_OFF": "equilibrium",
            "TUNED_SPEED": "constants",
            "LegConstants": "constants",
            "Subjects": "subjects",
            "action_of": "stiffness_control",
            "constants_from": "constants",
            "constants_name": "constants",
            "foot_curves": "equilibrium",
            "generic_constants": "constants",
            "leg_constants": "constants",
            "plateau_curve": "equilibrium",
            "reference_walk_at": "reference_walk",
            "stiffness_of": "stiffness_control",
            "stiffness_ranges": "stiffness_control",
            "tabulated_speeds": "reference_walk",
        },
    )
