"""People who have adapted to a foot: the leg constants that go with it, as `adapted` in the foot's dictionary.

A committed one is named; one of your own is a dictionary: the speed for which it was found [m/s at 1.70 m] as text ->
`sound` and `other`, the `LegConstants` of the leg with the sound foot and of the leg with this one, in JSON form.
`springfoot study adapt` finds both. Trunk, speed and period are held by the constants of `sound`.
"""

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any

from springfoot.errors import SpringfootError, as_float, quoted, require_within
from springfoot.gait.plan.plan import PLAN_SPEED_RANGE

ADAPTED = "adapted"
"""Key of the adapted person in a foot's dictionary."""
LEGS = ("sound", "other")
"""The leg with the sound foot, and the leg with the foot to which the person has adapted."""


def adapted_setting(name: str, kind: str, value: Any) -> str | dict[str, dict[str, dict[str, Any]]]:
    """Return the checked `adapted` of a foot in plain JSON values: a name, or leg constants by speed (see above).

    Args:
        name: the setting, for the error.
        kind: kind of the foot. A named person must have adapted to a foot of that kind; its numbers may be others.
        value: the given `adapted`.

    Raises `SpringfootError` for any other value.
    """
    if isinstance(value, str):
        if value not in (known := committed_feet()):
            raise SpringfootError(f"{name}: adapted must be one of {', '.join(map(repr, known))}, got {quoted(value)}")
        if (persons_kind := known[value]["kind"]) != kind:
            raise SpringfootError(
                f"{name}: adapted {value!r} is a person on a foot of kind {persons_kind!r}, got kind {kind!r}"
            )
        return value
    if not isinstance(value, Mapping) or not value:
        raise SpringfootError(
            f"{name}: adapted must be a name or a dictionary of speed -> {' and '.join(LEGS)}, got {quoted(value)}"
        )
    plain = {}
    for key, legs in value.items():
        speed = _number(key) if isinstance(key, str) else as_float(key)
        require_within(f"{name}: adapted: speed", speed, PLAN_SPEED_RANGE, "m/s")
        if not isinstance(legs, Mapping) or set(legs) != set(LEGS) or not all(map(_are_leg_constants, legs.values())):
            raise SpringfootError(f"{name}: adapted at {speed:g} m/s must be {' and '.join(LEGS)}, leg constants both")
        plain[f"{speed:g}"] = {leg: _constants_to_json(legs[leg]) for leg in LEGS}
    return plain


def committed_feet() -> dict[str, dict[str, Any]]:
    """Return name -> the committed foot, a setting with its `adapted` people."""
    return _file()["feet"]


def without_person(foot: Mapping[str, Any]) -> dict[str, Any]:
    """Return a foot's dictionary without its `adapted`."""
    return {key: value for key, value in foot.items() if key != ADAPTED}


@cache
def _file() -> dict[str, Any]:
    """Return the content of the package's file of adapted feet."""
    return json.loads(resources.files("springfoot.envs.control").joinpath("adapted.json").read_text(encoding="utf-8"))


def _number(text: str) -> float:
    """Return the number in a text; NaN if it is none."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _are_leg_constants(values: Any) -> bool:
    """Return True if a value has the form of leg constants: names -> numbers or lists of numbers, below 1e6 in size.

    Names and bounds are checked by `envs.control.constants`, which stands above the settings and is not imported here;
    1e6 is its `LARGEST_CONSTANT`.
    """
    return isinstance(values, Mapping) and all(
        abs(as_float(number)) < 1e6
        for value in values.values()
        for number in (value if isinstance(value, (list, tuple)) else (value,))
    )


def _constants_to_json(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return leg constants by name with floats for numbers and lists for tuples."""
    return {
        key: [float(number) for number in value] if isinstance(value, (list, tuple)) else float(value)
        for key, value in values.items()
    }
