"""Plan walks by their zero-moment point (ZMP): CoM, feet, posture, forces, moments and effort."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .effort import ACTIVATION_TIME, AS_IS, PER_DEGREE, PRICES, Effort, Muscle, effort_of, effort_of_stride
    from .plan import PLAN_SPEED_RANGE, Cadence, WalkPlan, plan_walk
    from .plan_gait import gait_of
    from .walk_style import STYLES, WalkStyle, least_work, style_from

__all__ = [
    "ACTIVATION_TIME",
    "AS_IS",
    "PER_DEGREE",
    "PLAN_SPEED_RANGE",
    "PRICES",
    "STYLES",
    "Cadence",
    "Effort",
    "Muscle",
    "WalkPlan",
    "WalkStyle",
    "effort_of",
    "effort_of_stride",
    "gait_of",
    "least_work",
    "plan_walk",
    "style_from",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "ACTIVATION_TIME": "effort",
            "AS_IS": "effort",
            "PER_DEGREE": "effort",
            "PLAN_SPEED_RANGE": "plan",
            "PRICES": "effort",
            "STYLES": "walk_style",
            "Cadence": "plan",
            "Effort": "effort",
            "Muscle": "effort",
            "WalkPlan": "plan",
            "WalkStyle": "walk_style",
            "effort_of": "effort",
            "effort_of_stride": "effort",
            "gait_of": "plan_gait",
            "least_work": "walk_style",
            "plan_walk": "plan",
            "style_from": "walk_style",
        },
    )
