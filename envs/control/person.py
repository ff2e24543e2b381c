"""Return the leg constants of each side: the committed ones, or those of a person who has adapted to a foot.

The search for an adapted person gives a difference from the committed constants at one speed or more; the difference is
linear between those speeds and constant outside them.
"""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from springfoot.errors import SpringfootError

from ..settings.adapted import ADAPTED, LEGS, committed_feet
from ..settings.feet import FOOT_SETTINGS
from ..settings.settings import BipedSettings, plan_file_of
from .constants import LEAST_STIFFNESS, TUNED_SPEED, LegConstants, constants_from, constants_name, leg_constants

SOUND, OTHER = LEGS
HELD_BY_SOUND = (
    *("period_factor", "period_speed_gain", "trunk_pitch_deg", "trunk_stiffness", "trunk_damping", "speed_torque"),
    *("swing_speed_gain", "swing_place_gain"),
)
"""Constants of phase, trunk and speed, which both legs take from the sound leg."""


def adapted_foot(settings: BipedSettings) -> tuple[int, Any] | None:
    """Return the side (0 left, 1 right) of the foot to which the person has adapted, and the foot's `adapted`; None
    without such a foot.

    Raises `SpringfootError` if both feet have one, and for settings other than those of the search.
    """
    feet = settings.left_foot, settings.right_foot
    adapted = [(side, foot.adapted) for side, foot in enumerate(feet) if foot.adapted is not None]
    if not adapted:
        return None
    if len(adapted) > 1:
        raise SpringfootError("left_foot and right_foot: a person adapts to one foot, the other one sound; got both")
    named_by = settings.equilibrium, settings.cadence, TUNED_SPEED, settings.feedforward, settings.follows_plan
    if (name := constants_name(*named_by)) != "planned":
        raise SpringfootError(f"{FOOT_SETTINGS[adapted[0][0]]}: adapted legs are of 'planned' constants, got {name!r}")
    return adapted[0]


def person_constants(settings: BipedSettings, speed: float, side: int) -> LegConstants:
    """Return the constants of the leg of `side` at `speed` [m/s at 1.70 m]: the tuned ones, or an adapted person's."""
    named_by = settings.equilibrium, settings.cadence, speed, settings.feedforward, settings.follows_plan
    tuned = leg_constants(*named_by, plan_file_of(settings))
    adapted = adapted_foot(settings)
    if adapted is None:
        return tuned
    adapted_side, person = adapted
    sets = committed_feet()[person][ADAPTED] if isinstance(person, str) else person
    leg = OTHER if side == adapted_side else SOUND
    return _adapted_constants(tuned, {float(at): _both_legs(legs) for at, legs in sets.items()}, leg, speed)


def _both_legs(legs: Mapping[str, Any]) -> dict[str, LegConstants]:
    """Return the constants of both `LEGS` from their JSON form; raise `SpringfootError` for bad ones."""
    try:
        return {leg: constants_from(legs[leg]) for leg in LEGS}
    except SpringfootError as error:
        raise SpringfootError(f"adapted: {error}") from None


def _adapted_constants(
    tuned: LegConstants, sets: Mapping[float, Mapping[str, LegConstants]], leg: str, speed: float
) -> LegConstants:
    """Return the constants of a leg of an adapted person at `speed` [m/s at 1.70 m].

    At a speed of the `sets` they are the set's. Elsewhere they are the `tuned` ones of that speed, moved by the
    difference of adapted from tuned constants, which is linear between the speeds of the sets and constant outside.

    Args:
        tuned: constants of the leg before it adapted, at `speed`.
        sets: speed [m/s at 1.70 m] -> constants of each of `LEGS`.
        leg: one of `LEGS`. Both legs take the constants `HELD_BY_SOUND` of the sound leg.
        speed: see above.
    """
    speeds = sorted(sets)
    if speed in sets:
        of_leg = asdict(sets[speed][leg])
        return constants_from(of_leg | {name: getattr(sets[speed][SOUND], name) for name in HELD_BY_SOUND})
    values = {}
    for name, tuned_value in asdict(tuned).items():
        taken_from = SOUND if name in HELD_BY_SOUND else leg
        differences = [
            np.subtract(getattr(sets[at][taken_from], name), getattr(leg_constants("planned", "people", at), name))
            for at in speeds
        ]
        position = float(np.interp(speed, speeds, np.arange(len(speeds))))  # among the speeds, such as 1.5
        low = int(position)
        high = min(low + 1, len(speeds) - 1)  # the last speed has no next one
        moved = tuned_value + differences[low] + (position - low) * (differences[high] - differences[low])
        values[name] = np.maximum(moved, LEAST_STIFFNESS.get(name, -np.inf)).tolist()
    return constants_from(values)
