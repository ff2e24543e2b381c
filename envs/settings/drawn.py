"""Read the settings `drawn_feet` and `drawn_bodies`: feet and proportions of which every reset draws one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from math import exp, log
from typing import Any, Literal, TypeVar, get_args

import numpy as np

from springfoot.errors import SpringfootError, as_float, quoted, require_choice, require_number
from springfoot.gait.body.body import Body
from springfoot.gait.people.human import STEP_TIME_RATIO_RANGE

from ..physics.foot import Foot
from .feet import ENGAGES, TABLES, FootSetting, foot_setting

On = Literal["one", "both", "left", "right"]
FootPair = tuple[FootSetting | None, FootSetting | None]
"""Feet on the left and the right leg in place of the environment's own; None for its own."""
OWN_FEET: FootPair = (None, None)
"""The environment's own feet."""
_NO_RANGES = ("kind", ENGAGES, *TABLES, "schedule")
"""Entries of a foot's dictionary that hold no numbers to draw."""
Entry = TypeVar("Entry", "DrawnFoot", "DrawnBody")


@dataclass(frozen=True, kw_only=True)
class DrawnFoot:
    """A foot of `drawn_feet`, with ranges in place of numbers."""

    foot: str | dict[str, Any]
    """The foot in plain JSON values; a number to draw is a pair [low, high]."""
    on: On = "one"
    """Legs that it is put on: either side with equal chance, both, or one side."""
    weight: float = 1.0
    """Chance to be drawn, relative to the others' [-]."""

    def to_json(self) -> dict[str, Any]:
        """Return the plain JSON values."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @cached_property
    def example(self) -> Foot:
        """Return the foot with every range at its low end; cached. Draws differ from it in numbers alone."""
        return FootSetting(_end_of(self.foot, 0)).foot

    def draw(self, random: np.random.Generator) -> FootPair:
        """Return a pair of feet, None on a leg that keeps the environment's own foot.

        Draws the side where `on` is "one", then a number from each range, in the order of the dictionary.
        """
        side = random.integers(2) if self.on == "one" else ("left", "right", "both").index(self.on)
        foot = FootSetting(_with_numbers(self.foot, partial(_draw_number, random)))
        return ((foot, None), (None, foot), (foot, foot))[side]


@dataclass(frozen=True, kw_only=True)
class DrawnBody:
    """Proportions, load and step time of `drawn_bodies`; None for those of the settings."""

    leg_ratio: float | None = None
    foot_ratio: float | None = None
    carried_ratio: float | None = None
    step_time_ratio: float | None = None
    weight: float = 1.0
    """Chance to be drawn, relative to the others' [-]."""

    @property
    def ratios(self) -> dict[str, float]:
        """Return name -> value of the ratios that this entry sets."""
        names = [item.name for item in fields(self) if item.name != "weight"]
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    def to_json(self) -> dict[str, float]:
        """Return the plain JSON values."""
        return self.ratios | {"weight": self.weight}


def drawn_feet_setting(value: Any) -> tuple[DrawnFoot, ...] | None:
    """Return the checked setting `drawn_feet`, from plain JSON values or `DrawnFoot`s; None for None.

    Both ends of every range are checked as the setting of a foot. Raises `SpringfootError`, which names the entry.
    """

    def checked(name: str, entry: DrawnFoot) -> DrawnFoot:
        """Return the entry with its foot in checked JSON values, ranges included."""
        require_choice(f"{name}: on", entry.on, get_args(On))
        _check_ranges(name, entry.foot)
        low, high = (foot_setting(name, _end_of(entry.foot, end)).plain for end in (0, 1))
        return replace(entry, foot=_join_ends(low, high))

    return _entries("drawn_feet", value, DrawnFoot, checked)


def drawn_bodies_setting(value: Any, body: Body) -> tuple[DrawnBody, ...] | None:
    """Return the checked setting `drawn_bodies`, from plain JSON values or `DrawnBody`s; None for None.

    `body` is that of the settings. Raises `SpringfootError`, which names the entry.
    """

    def checked(name: str, entry: DrawnBody) -> DrawnBody:
        """Return the entry with floats for its ratios, with which the settings' body is possible."""
        try:
            require_number("step_time_ratio", entry.ratios.get("step_time_ratio", 1.0), *STEP_TIME_RATIO_RANGE)
            replace(body, **{name: value for name, value in entry.ratios.items() if name != "step_time_ratio"})
        except SpringfootError as error:
            raise SpringfootError(f"{name}: {error}") from None
        return replace(entry, **{ratio: float(number) for ratio, number in entry.ratios.items()})

    return _entries("drawn_bodies", value, DrawnBody, checked)


def draw_index(entries: Sequence[DrawnFoot] | Sequence[DrawnBody], random: np.random.Generator) -> int:
    """Draw an index with a probability in proportion to each entry's weight."""
    ends = np.cumsum([entry.weight for entry in entries])
    drawn = int(np.searchsorted(ends, random.uniform(0.0, ends[-1]), side="right"))
    return min(drawn, len(entries) - 1)  # `uniform` may round up to its end


def draw_feet(entries: Sequence[DrawnFoot], random: np.random.Generator) -> FootPair:
    """Return a pair of feet from one of the entries, drawn by their weights: its `DrawnFoot.draw`."""
    return entries[draw_index(entries, random)].draw(random)


def _entries(
    name: str, value: Any, kind: type[Entry], checked: Callable[[str, Entry], Entry]
) -> tuple[Entry, ...] | None:
    """Return the entries of the setting `name`, each made a `kind` and passed through `checked(label, entry)`.

    None for None. Raises `SpringfootError`, which names the entry, for a `value` of another form or a bad weight.
    """
    if value is None:
        return None
    keys = [item.name for item in fields(kind)]
    if not isinstance(value, (list, tuple)) or not value:
        raise SpringfootError(
            f"{name} must be None or a list of dictionaries of {', '.join(keys)}, got {quoted(value)}"
        )
    entries = []
    for index, given in enumerate(value):
        label = f"{name}[{index}]"
        plain = given.to_json() if isinstance(given, kind) else given
        if not isinstance(plain, Mapping):
            raise SpringfootError(f"{label} must be a dictionary of {', '.join(keys)}, got {quoted(plain)}")
        if unknown := [key for key in plain if key not in keys]:
            raise SpringfootError(f"{label} has no {unknown[0]!r:.40}; valid: {', '.join(keys)}")
        if kind is DrawnFoot and "foot" not in plain:
            raise SpringfootError(f"{label} needs a foot")
        weight = require_number(f"{label}: weight", plain.get("weight", 1.0), 0.0, 1e6, above=True)
        named: dict[str, Any] = {**plain, "weight": weight}
        entries.append(checked(label, kind(**named)))
    return tuple(entries)


def _is_range(key: str, value: Any) -> bool:
    """Return True if the entry `key` of a foot's dictionary is a range: a list in place of a number."""
    return isinstance(value, (list, tuple)) and key not in _NO_RANGES


def _is_on_log_scale(key: str) -> bool:
    """Return True for a number that is drawn evenly on the log scale: stiffness and damping."""
    return key.endswith("_stiffness") or key == "damping_time"


def _check_ranges(name: str, foot: Any) -> None:
    """Raise `SpringfootError` for a range of a foot that is no pair low < high, on the log scale 0 < low < high."""
    if not isinstance(foot, Mapping):
        return
    for key, value in foot.items():
        if isinstance(value, Mapping) and key not in _NO_RANGES:
            _check_ranges(f"{name}: {key}", value)
        elif _is_range(str(key), value):
            low, high = map(as_float, value) if len(value) == 2 else (np.nan, np.nan)
            least = "0 < " if _is_on_log_scale(str(key)) else ""
            if not low < high or (least and not low > 0.0):
                raise SpringfootError(
                    f"{name}: {key} must be a number or [low, high] with {least}low < high, got {quoted(value)}"
                )


def _end_of(foot: Any, end: int) -> Any:
    """Return a foot with every range replaced by its low end (0) or its high one (1)."""
    return _with_numbers(foot, lambda key, low, high: (low, high)[end])


def _with_numbers(foot: Any, number: Callable[[str, float, float], float]) -> Any:
    """Return a foot, or part of it, with number(name, low end, high end) in place of every range."""
    if not isinstance(foot, Mapping):
        return foot
    plain = {}
    for key, value in foot.items():
        if _is_range(key, value):
            plain[key] = number(key, *value)
        else:
            plain[key] = value if key in _NO_RANGES else _with_numbers(value, number)
    return plain


def _join_ends(low: Any, high: Any) -> Any:
    """Return the foot with ranges from its checked low and high ends, of the same keys."""
    if isinstance(low, dict):
        return {key: _join_ends(value, high[key]) for key, value in low.items()}
    return low if low == high else [low, high]


def _draw_number(random: np.random.Generator, key: str, low: float, high: float) -> float:
    """Draw the number `key` of a foot from [low, high]: stiffness and damping on the log scale, all else evenly."""
    if _is_on_log_scale(key):
        return min(max(exp(random.uniform(log(low), log(high))), low), high)  # `exp` may round beyond an end
    return random.uniform(low, high)
