"""The science of walking. NumPy and SciPy only: no simulator, no learner."""

from typing import TYPE_CHECKING

from springfoot.errors import SpringfootError
from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .body.body import GRAVITY, Body
    from .body.leg_dynamics import FootLoad, LegMotion, inverse_dynamics, leg_motion, load_at, projection_moments
    from .people.gait_events import PERCENT
    from .people.human import HumanGait, human_gait
    from .people.own_data import OwnGait, read_gait
    from .plan.kinetics import foot_force, ground_reaction, planned_moments, projection_table
    from .plan.plan import WalkPlan, plan_walk
    from .springs.identification import PhaseSpring, identify
    from .springs.identification_by_pushes import PushedSpring, identify_pushed
    from .springs.stiffness import StiffnessSchedule, schedule_from_curves, thesis_schedule

__all__ = [
    "GRAVITY",
    "PERCENT",
    "Body",
    "FootLoad",
    "HumanGait",
    "LegMotion",
    "OwnGait",
    "PhaseSpring",
    "PushedSpring",
    "SpringfootError",
    "StiffnessSchedule",
    "WalkPlan",
    "foot_force",
    "ground_reaction",
    "human_gait",
    "identify",
    "identify_pushed",
    "inverse_dynamics",
    "leg_motion",
    "load_at",
    "plan_walk",
    "planned_moments",
    "projection_moments",
    "projection_table",
    "read_gait",
    "schedule_from_curves",
    "thesis_schedule",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "GRAVITY": "body.body",
            "PERCENT": "people.gait_events",
            "Body": "body.body",
            "FootLoad": "body.leg_dynamics",
            "HumanGait": "people.human",
            "LegMotion": "body.leg_dynamics",
            "OwnGait": "people.own_data",
            "PhaseSpring": "springs.identification",
            "PushedSpring": "springs.identification_by_pushes",
            "StiffnessSchedule": "springs.stiffness",
            "WalkPlan": "plan.plan",
            "foot_force": "plan.kinetics",
            "ground_reaction": "plan.kinetics",
            "human_gait": "people.human",
            "identify": "springs.identification",
            "identify_pushed": "springs.identification_by_pushes",
            "inverse_dynamics": "body.leg_dynamics",
            "leg_motion": "body.leg_dynamics",
            "load_at": "body.leg_dynamics",
            "plan_walk": "plan.plan",
            "planned_moments": "plan.kinetics",
            "projection_moments": "body.leg_dynamics",
            "projection_table": "plan.kinetics",
            "read_gait": "people.own_data",
            "schedule_from_curves": "springs.stiffness",
            "thesis_schedule": "springs.stiffness",
        },
    )
