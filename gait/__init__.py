"""springfoot.gait: the science of walking. NumPy and SciPy only: no simulator, no learning."""

from .body import GRAVITY, Body
from .errors import SpringfootError

__all__ = ["GRAVITY", "Body", "SpringfootError"]
