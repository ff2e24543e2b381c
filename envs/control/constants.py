"""Read the tuned constants of the leg controller (`envs.control.legs`): committed sets, interpolated over speed."""

import json
import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from importlib import resources
from typing import Any, TypeVar, get_args, get_type_hints

import numpy as np

from springfoot.errors import SpringfootError, require_within
from springfoot.gait.plan.plan import PLAN_SPEED_RANGE

TUNED_SPEED = 1.2
"""Speed [m/s] at 1.70 m of the constants without a speed in their name."""
KNOTS = np.arange(10) / 10
"""Stride phases of the knots of the corrections to the target's curves, which are periodic cubic splines."""
LARGEST_CONSTANT = 1e6
"""Largest constant, in its unit."""
LEAST_STIFFNESS: dict[str, float] = {
    "hip_stiffness": 1.0,
    "knee_stiffness": 1.0,
    "ankle_schedule": 1.0,
    "toe_schedule": 1.0,
}
"""Lower bounds of constants [N m/rad]."""

GENERIC = "generic"
"""Name of constants that nobody tuned (`generic_constants`), as a search's start."""

Constants = TypeVar("Constants", "LegConstants", "SlopeConstants")


@dataclass(frozen=True, kw_only=True)
class LegConstants:
    """Tuned constants of the leg controller, for 1.70 m and 63 kg."""

    hip_knots_deg: tuple[float, ...]
    """Added to the target's thigh angle at `KNOTS` [deg]."""
    knee_knots_deg: tuple[float, ...]
    """Added to the target's knee angle at `KNOTS` [deg]."""
    ankle_knots_deg: tuple[float, ...]
    """Added to the target's ankle angle at `KNOTS` in the planned equilibrium [deg]."""
    hip_stiffness: tuple[float, float]
    """Stiffness of the hip in stance, in swing [N m/rad]."""
    knee_stiffness: tuple[float, float]
    """Stiffness of the knee in stance, in swing [N m/rad]."""
    feedforward: tuple[float, float, float]
    """Fraction of the target's hip, knee and ankle moment that is fed forward."""
    period_factor: float
    """Period of the phase over the plan's stride time."""
    period_speed_gain: float
    """Relative increase of the phase's rate for each m/s that the body is too fast [s/m]."""
    trunk_pitch_deg: float
    """Held trunk pitch [deg]."""
    trunk_stiffness: float
    """Stance-hip torque for trunk pitch [N m/rad]."""
    trunk_damping: float
    """Stance-hip torque for trunk pitch rate [N m s/rad]."""
    speed_torque: float
    """Stance-hip torque for each m/s that the body is too fast [N s]."""
    trunk_rise: float
    """Stride phase in which the stance hip takes over the trunk [-]."""
    swing_speed_gain: float
    """Shift of the swing hip's target for each m/s that the body is too fast; negative: less flexed [rad s/m]."""
    neutral_deg: tuple[float, float]
    """Constant ankle and toe angle of `equilibrium="neutral"` [deg]."""
    toe_flat_deg: float
    """Planned rest angle of the toe from foot flat to toe-off [deg]; a negative one presses the toe down."""
    ankle_schedule: tuple[float, float, float, float, float]
    """Fixed ankle stiffness in loading, early stance, late stance, push-off, swing [N m/rad]."""
    toe_schedule: float
    """Fixed toe stiffness [N m/rad]."""


@dataclass(frozen=True, kw_only=True)
class SlopeConstants:
    """Change of the leg controller's targets on a slope, per radian of slope; the same for every body and speed.

    A joint has three coefficients: of 1, and of cosine and sine of 2 pi x stride phase.
    """

    hip: tuple[float, float, float]
    """Added to the hip's target."""
    knee: tuple[float, float, float]
    """Added to the knee's target."""
    ankle: tuple[float, float, float]
    """Added to the ankle's rest angle if that follows the stride."""
    trunk: float
    """Added to the held trunk pitch."""


def constants_name(equilibrium: str, cadence: str, speed: float = TUNED_SPEED, feedforward: str = "people") -> str:
    """Return the name of the constants for these settings and `speed` [m/s at 1.70 m] in a file of constants.

    The equilibria "angle" and "phase" share those of "planned". The cadence "effort" has those of people's.
    """
    name = "neutral" if equilibrium == "neutral" else "planned"
    if cadence == "thesis":
        name += f", {cadence} cadence"
    if feedforward != "people":
        name += f", {feedforward}'s moments"
    if speed != TUNED_SPEED:
        name += f", {speed:g} m/s"
    return name


def leg_constants(
    equilibrium: str, cadence: str, speed: float = TUNED_SPEED, feedforward: str = "people"
) -> LegConstants:
    """Return the committed constants for a setting at `speed` [m/s at 1.70 m].

    Constants are linear in speed between the sets of the file; outside their speeds the nearest set holds. Raises
    `SpringfootError` for a setting without a set.
    """
    name = constants_name(equilibrium, cadence, feedforward=feedforward)
    table = _package_constants()
    if name not in table:
        raise SpringfootError(
            f"there are no tuned leg constants for equilibrium {equilibrium!r}, cadence {cadence!r} and "
            f"{feedforward}'s moments; equilibrium 'neutral' needs cadence 'people'"
        )
    return constants_at(_sets(table, name), speed)


def _sets(table: Mapping[str, Any], name: str) -> dict[float, LegConstants]:
    """Return speed [m/s] -> constants: of the set `name` at `TUNED_SPEED`, and of each set "NAME, SPEED m/s" of that
    name at its speed."""
    at_speeds = [re.fullmatch(rf"{re.escape(name)}, ([\d.]+) m/s", key) for key in table]
    names = {TUNED_SPEED: name} | {float(match[1]): match[0] for match in at_speeds if match}
    return {
        require_within("speed", speed, PLAN_SPEED_RANGE, "m/s"): constants_from(table[name_at_speed])
        for speed, name_at_speed in names.items()
    }


def constants_at(sets: Mapping[float, LegConstants], speed: float) -> LegConstants:
    """Return the constants at `speed` [m/s], linear between the `sets` by speed; outside, those of the nearest set."""
    speeds = sorted(sets)
    position = float(np.interp(speed, speeds, np.arange(len(speeds))))  # among the speeds, such as 1.5
    lower = sets[speeds[int(position)]]
    weight = position - int(position)
    if weight == 0.0:
        return lower
    upper = sets[speeds[int(position) + 1]]
    values = {}
    for field in fields(LegConstants):
        low, high = (np.array(getattr(constants, field.name), float) for constants in (lower, upper))
        values[field.name] = (low + weight * (high - low)).tolist()
    return constants_from(values)


def constants_from(values: Mapping[str, Any]) -> LegConstants:
    """Return `LegConstants` from its JSON form (lists for tuples); raise `SpringfootError` for any other value."""
    return _from_json(LegConstants, values)


def slope_constants() -> SlopeConstants:
    """Return the committed constants for slopes."""
    return _from_json(SlopeConstants, _file()["slope"]["constants"])


def _from_json(kind: type[Constants], values: Any) -> Constants:
    """Return constants of the class `kind` from their JSON form.

    Raises `SpringfootError` for missing or unknown names, and unless each has as many finite numbers as its field.
    """
    required = [field.name for field in fields(kind) if field.default is MISSING]
    known = {field.name for field in fields(kind)}
    if not isinstance(values, Mapping) or not set(required) <= set(values) <= known:
        raise SpringfootError(f"constants must be a dictionary with {', '.join(required)}")
    checked: dict[str, Any] = {}
    for name, hint in get_type_hints(kind).items():
        if name not in values:
            continue
        value = values[name]
        if hint is float:  # one number; all other fields are tuples
            checked[name] = _checked_number(name, value)
            continue
        item_hints = get_args(hint)
        count = len(KNOTS) if Ellipsis in item_hints else len(item_hints)  # `tuple[float, ...]` has one for each knot
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise SpringfootError(f"{name} must be {count} numbers")
        checked[name] = tuple(_checked_number(name, number) for number in value)
    return kind(**checked)


def _checked_number(name: str, value: Any) -> float:
    """Return `value`, of the constant `name`, as a float.

    Raises `SpringfootError` below `LEAST_STIFFNESS`, and beyond `LARGEST_CONSTANT` in either direction.
    """
    return require_within(name, value, (LEAST_STIFFNESS.get(name, -LARGEST_CONSTANT), LARGEST_CONSTANT))


def _package_constants() -> dict[str, dict]:
    """Return name (`constants_name`) -> leg constants of the package, in JSON form."""
    return _file()["constants"]


@cache
def _file() -> dict[str, dict]:
    """Return the content of the package's file of constants, `legs.json`; cached: do not change it."""
    return json.loads(resources.files("springfoot.envs.control").joinpath("legs.json").read_text(encoding="utf-8"))


def generic_constants() -> LegConstants:
    """Return leg constants without tuning: searches begin at them, and so do persons that follow the plan.

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
