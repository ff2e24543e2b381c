"""Define the observation entries of body and feet, for learned persons."""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import Body

from ..physics.foot import INTACT, Feet, Foot, leg_segments
from .scales import ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT

OF_FOOT = 11
"""Entries of one foot, those of `envs.task.observation_entries`."""
WORN = 2 * OF_FOOT + 3
"""Entries of both feet and the body."""


def worn_entries(body: Body, feet: Feet) -> NDArray:
    """Return the values of the (WORN,) entries of a person's observation: left foot, right foot, the body's ratios."""
    of_feet = [_foot_entries(body, foot) for foot in feet]
    return np.array([*of_feet[0], *of_feet[1], body.leg_ratio, body.foot_ratio, body.carried_ratio])


def _foot_entries(body: Body, foot: Foot) -> tuple[float, ...]:
    """Return the `OF_FOOT` entries of one foot in their order; a device has no strength of muscles and is never slack.

    A brace of stiffness 0 counts as none.
    """
    at_ankle = foot.ankle.orthosis
    braces = [joint.orthosis.stiffness if joint.orthosis else 0.0 for joint in foot.joints]
    units = ANKLE_STIFFNESS_UNIT * body.stiffness_scale, TOE_STIFFNESS_UNIT * body.stiffness_scale
    slack = at_ankle.slack if at_ankle and at_ankle.stiffness > 0.0 else (0.0, 0.0)
    rests = [joint.device.rest if joint.device else joint.rest or 0.0 for joint in foot.joints]
    mass, intact_mass = (sum(leg_segments(body, either).mass[1:]) for either in (foot, INTACT))  # [1:]: below the knee
    return (
        *(float(joint.has_muscles) for joint in foot.joints),
        foot.ankle.strength,
        float(foot.ankle.acts_in_swing),
        *rests,
        *(brace / unit for brace, unit in zip(braces, units, strict=True)),
        *slack,
        (mass - intact_mass) / body.mass,
    )
