"""springfoot.gait: the science of walking. NumPy and SciPy only: no simulator, no learning."""

from .body import GRAVITY, Body
from .errors import SpringfootError
from .human import HumanGait, human_gait

__all__ = ["GRAVITY", "Body", "HumanGait", "SpringfootError", "human_gait"]
