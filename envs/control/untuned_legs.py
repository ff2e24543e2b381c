"""Make leg constants that nobody tuned, at which learned persons that follow the plan begin, and searches."""

from .constants import KNOTS, LegConstants

GENERIC = "generic"
"""Name of these constants as a search's start."""


def generic_constants() -> LegConstants:
    """Return leg constants without tuning.

    No curve is corrected, all moments are fed forward, springs are equally stiff at every phase, and the trunk is
    upright.
    """
    uncorrected = (0.0,) * len(KNOTS)
    stance_and_swing = (200.0, 200.0)
    return LegConstants(
        hip_knots_deg=uncorrected,
        knee_knots_deg=uncorrected,
        ankle_knots_deg=uncorrected,
        hip_stiffness=stance_and_swing,
        knee_stiffness=stance_and_swing,
        feedforward=(1.0, 1.0, 1.0),
        period_factor=1.0,
        period_speed_gain=0.0,
        trunk_pitch_deg=0.0,
        trunk_stiffness=200.0,
        trunk_damping=20.0,
        speed_torque=0.0,
        trunk_rise=0.05,
        swing_speed_gain=0.0,
        neutral_deg=(0.0, 0.0),
        toe_flat_deg=0.0,
        ankle_schedule=(200.0, 200.0, 200.0, 200.0, 200.0),
        toe_schedule=30.0,
    )
