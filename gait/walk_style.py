"""What a plan may choose of a walk whose steps are given: where and when the ZMP passes, how the CoM bobs, how feet
roll and swing. People's choice is the default of `plan_walk`; `least_work.json` has the choices of least effort, which
know no curve of people's (`springfoot study plan-tuning`).
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from .errors import SpringfootError
from .foot_style import FootStyle
from .json_file import MOST_JSON_BYTES
from .text_table import read_bytes

STYLES = Path(str(resources.files("springfoot.gait") / "least_work.json"))
"""The package's own file of styles."""

STYLE_PAIRS = ("zmp_travel", "rise_again", "heel_rise")
"""Of a style, what is two numbers."""
STYLE_ROWS = ("zmp_way", "via_forward", "via_up", "via_pitch")
"""Of a style, what is any number of numbers."""
STYLE_OPTIONAL = ("zmp_way", "heel_rise", "flat", "heel_off", "toe_swing")
"""Of a style, what may be None."""


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
    """Parts of its travel that the ZMP has done a third and two thirds through single support; None: these parts."""
    lowest: float = 0.5
    """Part of double support after which the CoM is lowest."""
    rise_again: tuple[float, float] = (0.0, 0.0)
    """Second harmonic of the CoM's height (`cart_table.Bob`): cosine and sine over half of `rise` [-]."""
    lean: float = 0.0
    """Pitch at which the trunk is held [rad], forward positive, 0 with its CoM upright over the hip."""
    foot: FootStyle
    """How the feet roll and swing."""

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; `style_from` is the inverse."""
        return json.loads(json.dumps(asdict(self)))


def style_from(values: Mapping[str, Any]) -> WalkStyle:
    """The style of JSON values (lists for tuples); raises `ValueError`, `TypeError` or `KeyError` for others."""
    own = dict(values)
    style = WalkStyle(**_tupled(own | {"foot": FootStyle(**_tupled(own["foot"]))}))
    for name, value in (asdict(style) | asdict(style.foot)).items():
        if name == "foot" or (value is None and name in STYLE_OPTIONAL):
            continue
        many = name in STYLE_PAIRS or name in STYLE_ROWS
        each = value if many and isinstance(value, tuple) else (value,)
        if not all(_is_finite(x) for x in each) or (name in STYLE_PAIRS and len(each) != 2):
            what = "2 finite numbers" if name in STYLE_PAIRS else "finite numbers" if many else "a finite number"
            raise ValueError(f"{name} must be {what}, got {value!r}")
        if many and not isinstance(value, tuple):
            raise ValueError(f"{name} must be a list of numbers, got {value!r}")
    if len({len(each) for each in (style.foot.via_forward, style.foot.via_up, style.foot.via_pitch)}) > 1:
        raise ValueError("via_forward, via_up and via_pitch must be equally many")
    return style


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def least_work(speed: float, file: Path | None = None) -> WalkStyle:
    """The style of least cost at `speed` [m/s at 1.70 m], the committed one or that of `file`: linear between the
    speeds it was searched at, and beyond them that of the nearest. Raises `SpringfootError` for a file of no styles."""
    table = _committed() if file is None else styles_of(file)
    speeds = sorted(table)
    place = float(np.interp(speed, speeds, np.arange(len(speeds))))
    low, high = table[speeds[int(place)]], table[speeds[min(int(place) + 1, len(speeds) - 1)]]
    return style_from(_mixed(low.to_json(), high.to_json(), place - int(place)))


def _mixed(low: Any, high: Any, weight: float) -> Any:
    if low is None:
        return None
    if isinstance(low, dict):
        return {name: _mixed(low[name], high[name], weight) for name in low}
    return (np.array(low) + weight * (np.array(high) - np.array(low))).tolist()


def _tupled(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}


@cache
def _committed() -> dict[float, WalkStyle]:
    return styles_of(STYLES)


def styles_of(file: Path) -> dict[float, WalkStyle]:
    """Speed [m/s at 1.70 m] -> the style of a file; raises `SpringfootError` for one that has none."""
    try:
        styles = json.loads(read_bytes(file, MOST_JSON_BYTES))["styles"]
        found = {float(speed): style_from(values) for speed, values in styles.items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise SpringfootError(f"{file} is not a file of styles of walks: {error}") from None
    if not found:
        raise SpringfootError(f"{file} has no style of any walk")
    return found
