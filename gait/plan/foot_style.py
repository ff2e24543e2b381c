"""Describe how a foot rolls off the ground and swings: pitches at the events, and the shape of the path in between.

People's style is chosen and fitted near people's curves; a walk predicted from a body alone has another
style (`walk_style`).
"""

from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray

# Pairs of constants: over a flat toe (roll 0), and with people's roll over the tip (roll 1); linear in between. Pitches
# at roll 1 are people's; the other constants were found by least squares against people's thigh, knee
# and, weighing less, ankle curves at 0.8 to 1.7 m/s; at roll 1 by `python -m springfoot.gait.plan.fit_feet`.
HEEL_STRIKE_PITCH = ((0.293, 2), (0.336, 1))
"""Foot to ground at heel strike: a [rad] and n of a (step length / leg length)^n; the thesis's q_f = 0.13 at its 0.6 m,
and people's 0.24 at 1.2 m/s."""
TOE_OFF_PITCH = ((1.32, 1.5), (1.39, 0.5))
"""Foot to ground at toe-off: a [rad] and n of a (step length / leg length)^n; people's is 68 deg at 1.2 m/s."""
ROLL_PITCH = ((0.0, 0.5), (0.78, 0.5))
"""Toe to ground at toe-off: a [rad] and n of a (step length / leg length)^n; people's is 37 deg at 1.2 m/s."""
TOE_ROCKER_POWER = (2.12, 3.08)
"""Power of the time since heel-off with which the heel rises."""
ROLL_POWER = 2.22
"""Power of the time since the ZMP left the toe tip with which the toe joint rises."""

# The swing passes two via points, a third and two thirds through it, and leaves and lands at the rockers' position,
# velocity and acceleration.
VIA_FORWARD = ((0.237, 0.693), (0.319, 0.633))
"""Travel of the ankle at the via points of the swing, as a fraction of the travel from toe-off to heel strike."""
VIA_UP = ((0.225, 0.104), (0.175, 0.090))
"""Height of the ankle above the floor at the via points [m at 1.70 m]."""
VIA_PITCH = ((-1.0, -0.183), (-0.746, -0.039))
"""Pitch of the foot at the via points [rad]."""

HEEL_ROCKER_RATE = 4.5
"""Largest heel-strike pitch over duration of the heel rocker [rad/stride]; chosen: a quick foot flat needs a flat
landing."""
QUICKEST_ROLL = 12.0
"""Largest toe to ground at toe-off over duration of the roll [rad/stride]; chosen, above people's 6."""


@dataclass(frozen=True, kw_only=True)
class FootStyle:
    """One foot's pitches at the events and the shape of its path."""

    heel_strike_pitch: float
    """Foot to ground at heel strike [rad] (thesis q_f)."""
    toe_off_pitch: float
    """Foot to ground at toe-off, as a positive number [rad] (thesis q_b)."""
    roll_pitch: float
    """Toe to ground at toe-off, as a positive number [rad]."""
    toe_rocker_power: float = 2.0
    """Power of the time since heel-off with which the heel rises."""
    roll_power: float
    """Power of the time since the ZMP left the toe tip with which the toe joint rises."""
    via_forward: tuple[float, ...]
    """Travel of the ankle at the via points of the swing, as a fraction of the travel from toe-off to heel strike."""
    via_up: tuple[float, ...]
    """Height of the ankle above the floor at the via points [m at 1.70 m]."""
    via_pitch: tuple[float, ...]
    """Pitch of the foot at the via points [rad]."""
    heel_rise: tuple[float, float] | None = None
    """Fraction of the toe-off pitch that the foot has half-way from heel-off, and the rate of its pitch at toe-off over
    the mean rate; None: `toe_rocker_power`."""
    flat: float | None = None
    """Fraction of double support after which the landed foot is flat; None: when the ZMP passes the foot's heel."""
    heel_radius: float = 0.0
    """Radius of the heel on which the landing foot rolls [m at 1.70 m]; 0: the foot turns about the heel's back."""
    heel_off: float | None = None
    """Fraction of the step over which the heel rises before the other foot lands, unless the ZMP passes the toe joint
    later; None: from the moment at which the ZMP passes."""
    roll_from: float = 0.0
    """Fraction of double support after which the toe begins to roll over its tip, unless the ZMP leaves the tip later.
    Until then the foot's centre of pressure is under the flat toe."""
    toe_swing: float | None = None
    """Angle of the toe joint in swing [rad]; None: people's curve."""


def peoples_style(step_ratio: float, roll: float, heel_rocker: float, tip_rocker: float) -> FootStyle:
    """Return the style fitted so that the legs' joint angles follow people's.

    A short heel rocker or roll limits the pitch that it must turn through (`HEEL_ROCKER_RATE`, `QUICKEST_ROLL`).

    Args:
        step_ratio: step length over leg length.
        roll: roll of the toe over its tip late in stance: 0 for none, 1 for people's.
        heel_rocker, tip_rocker: durations [strides] of the foot's turn about the heel and the toe's roll over the tip.
    """
    return FootStyle(
        heel_strike_pitch=min(pitch_at(HEEL_STRIKE_PITCH, step_ratio, roll), HEEL_ROCKER_RATE * heel_rocker),
        toe_off_pitch=pitch_at(TOE_OFF_PITCH, step_ratio, roll),
        roll_pitch=min(pitch_at(ROLL_PITCH, step_ratio, roll), QUICKEST_ROLL * tip_rocker),
        toe_rocker_power=float(between(TOE_ROCKER_POWER, roll)),
        roll_power=ROLL_POWER,
        via_forward=_two_between(VIA_FORWARD, roll),
        via_up=_two_between(VIA_UP, roll),
        via_pitch=_two_between(VIA_PITCH, roll),
    )


def between(pair: tuple, roll: float) -> NDArray:
    """Interpolate a constant, or several, between the `pair` of its values at a `roll` of 0 and of 1."""
    return (1 - roll) * np.array(pair[0]) + roll * np.array(pair[1])


def pitch_at(pair: tuple, step_ratio: float, roll: float) -> float:
    """Return a pitch at an event [rad], positive: a `step_ratio`^n, with the step length over the leg length.

    `pair` has (a, n) for a `roll` of 0 and of 1; in between the pitch is linear in `roll`.
    """
    return float(between(tuple(a * step_ratio**n for a, n in pair), roll))


def _two_between(pair: tuple, roll: float) -> tuple[float, float]:
    """Interpolate a constant of two numbers between its values in `pair`, at a `roll` of 0 and of 1."""
    first, second = between(pair, roll)
    return float(first), float(second)
