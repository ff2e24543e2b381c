"""Describe the choices of a plan at given steps: travel and timing of the ZMP, bob of the CoM, roll and swing of feet.

The default of `plan_walk` is people's choice. `least_work.json` has the choices of least effort, found without people's
curves (`springfoot study plan-tuning`).
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from springfoot.errors import SpringfootError, as_float, quoted
from springfoot.files.json_file import MOST_JSON_BYTES
from springfoot.files.text_table import read_bytes

from .foot_style import FootStyle

STYLES = Path(str(resources.files("springfoot.gait.plan") / "least_work.json"))
"""The package's own file of styles."""
PAIR = tuple[float, float]
"""Type of a pair of numbers."""
LARGEST_NUMBER = 10.0
"""Largest number of a style, in its unit: rad, m and fractions of a step alike are about 1."""
POWERS = ("toe_rocker_power", "roll_power")
"""Numbers of a foot that must be positive."""


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
    zmp_way: tuple[float, float] | None = None
    """Fractions of its travel that the ZMP has covered after one and two thirds of single support; None: one and two
    thirds."""
    lowest: float = 0.5
    """Fraction of double support after which the CoM is lowest."""
    rise_again: tuple[float, float] = (0.0, 0.0)
    """Second harmonic of the CoM's height (`cart_table.Bob`): cosine and sine over half of `rise` [-]."""
    lean: float = 0.0
    """Pitch of the trunk [rad], forward positive; at 0 the trunk's CoM is upright over the hip."""
    step_time_ratio: float = 1.0
    """Step time over people's at the same speed [-]; it counts with the cadence `effort` alone."""
    foot: FootStyle
    """Style of the feet's roll and swing."""

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON values; `style_from` is the inverse."""
        return json.loads(json.dumps(asdict(self)))  # through text, so that tuples become lists


def style_from(values: Mapping[str, Any]) -> WalkStyle:
    """Build a style from JSON values (lists for tuples); raise `ValueError`, `TypeError` or `KeyError` for other
    values."""
    fields = dict(values)
    style = WalkStyle(**_with_tuples(fields | {"foot": FootStyle(**_with_tuples(fields["foot"]))}))
    for part in (style, style.foot):
        for name, hint in get_type_hints(type(part)).items():
            value = getattr(part, name)
            types = get_args(hint) if isinstance(hint, UnionType) else (hint,)
            if not any(_is_a(type_, value) for type_ in types):
                allowed = "a number" if float in types else "2 numbers" if PAIR in types else "numbers"
                raise ValueError(f"{name} must be {allowed} within ±{LARGEST_NUMBER:g}, got {quoted(value)}")
    for name in POWERS:
        if getattr(style.foot, name) <= 0.0:
            raise ValueError(f"{name} must be > 0, got {getattr(style.foot, name):g}")
    if style.step_time_ratio <= 0.0:
        raise ValueError(f"step_time_ratio must be > 0, got {style.step_time_ratio:g}")
    if not 0.0 <= style.foot.roll_from <= 1.0:
        raise ValueError(f"roll_from must be in [0, 1], got {style.foot.roll_from:g}")
    if style.foot.heel_radius < 0.0:
        raise ValueError(f"heel_radius must be >= 0 m, got {style.foot.heel_radius:g}")
    if len({len(via) for via in (style.foot.via_forward, style.foot.via_up, style.foot.via_pitch)}) > 1:
        raise ValueError("via_forward, via_up and via_pitch must be equally many")
    return style


def _is_a(type_: Any, value: Any) -> bool:
    """Tell whether a value has the type `type_` of a field, with numbers of at most `LARGEST_NUMBER`."""
    if get_origin(type_) is tuple:
        right_length = isinstance(value, tuple) and (type_ != PAIR or len(value) == 2)
        return right_length and all(abs(as_float(number)) <= LARGEST_NUMBER for number in value)
    return abs(as_float(value)) <= LARGEST_NUMBER if type_ is float else isinstance(value, type_)


def least_work(speed: float, file: Path | None = None) -> WalkStyle:
    """Return the style of least effort at `speed` [m/s at 1.70 m], from `file` or else from the package.

    Linear between the speeds of the searches; outside them the nearest style. Raises `SpringfootError` for a file
    without styles.
    """
    table = _package_styles() if file is None else styles_of(file)
    speeds = sorted(table)
    position = float(np.interp(speed, speeds, np.arange(len(speeds))))  # 1.25: a quarter from speed 1 to speed 2
    low = table[speeds[int(position)]]
    high = table[speeds[min(int(position) + 1, len(speeds) - 1)]]  # the last speed has no next one
    return style_from(_interpolate(low.to_json(), high.to_json(), position - int(position)))


def _interpolate(low: Any, high: Any, weight: float) -> Any:
    """Interpolate between the JSON values of two styles, number by number: `low` at weight 0, `high` at 1."""
    if low is None:  # a choice that styles leave open, both of them
        return None
    if isinstance(low, dict):
        return {name: _interpolate(low[name], high[name], weight) for name in low}
    return (np.array(low) + weight * (np.array(high) - np.array(low))).tolist()


def _with_tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the dictionary of JSON values with a tuple in place of each list."""
    return {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}


@cache
def _package_styles() -> dict[float, WalkStyle]:
    """Return speed [m/s at 1.70 m] -> style of the file `STYLES` of the package; cached."""
    return styles_of(STYLES)


def styles_of(file: Path) -> dict[float, WalkStyle]:
    """Read speed [m/s at 1.70 m] -> style from a file; raise `SpringfootError` for a file without styles."""
    try:
        styles = json.loads(read_bytes(file, MOST_JSON_BYTES))["styles"]
        by_speed = {float(speed): style_from(values) for speed, values in styles.items()}
    # All that reading other contents raises; RecursionError: nested too deeply.
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise SpringfootError(f"{file} is not a file of styles of walks: {error}") from None
    if not by_speed:
        raise SpringfootError(f"{file} has no style of any walk")
    return by_speed
