"""springfoot.gait: the science of walking. NumPy and SciPy only: no simulator, no learning."""

from .body import GRAVITY, Body
from .errors import SpringfootError
from .human import HumanGait, human_gait
from .plan import WalkPlan, plan_walk
from .stiffness import StiffnessSchedule, thesis_schedule

__all__ = [
    "GRAVITY",
    "Body",
    "HumanGait",
    "SpringfootError",
    "StiffnessSchedule",
    "WalkPlan",
    "human_gait",
    "plan_walk",
    "thesis_schedule",
]
