"""The science of walking. NumPy and SciPy only: no simulator, no learner."""

from springfoot.errors import SpringfootError

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
