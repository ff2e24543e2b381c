"""What a plan may choose of a walk whose steps are given: where and when the ZMP passes, how the CoM bobs, how feet
roll and swing. People's choice is the default of `plan_walk`.
"""

from dataclasses import dataclass

from .foot_style import FootStyle


@dataclass(frozen=True, kw_only=True)
class WalkStyle:
    """One way to walk at one step length and time."""

    double_support: float
    """Double support over step time [-]."""
    zmp_travel: tuple[float, float]
    """ZMP forward of the stance ankle at the start and end of single support [m at 1.70 m]."""
    rise: float
    """Rise and fall of the CoM over that of the stiff-legged compass gait, step_length^2 / (8 leg_length) [-]."""
    knee: float
    """Least knee flexion of the stride [rad], which sets the height of the CoM."""
    foot: FootStyle
    """How the feet roll and swing."""
