"""Check settings; each check raises `SpringfootError`, which names the setting and the allowed values."""

from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import fields
from difflib import get_close_matches
from functools import wraps
from math import isfinite
from numbers import Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, as_float, quoted, require_count, require_number
from springfoot.gait.people.human import harmonics
from springfoot.gait.plan.walk_style import styles_of
from springfoot.gait.springs.stiffness import STIFFNESS_RANGE

from ..physics.timing import CONTROL_WINDOW

Settings = TypeVar("Settings")

STIFFNESS_BOUNDS = (1e-3, STIFFNESS_RANGE[1])
"""Softest and stiffest spring of an action [N m/rad]; chosen: beyond, products of stiffnesses overflow."""
MOST_WEIGHT = 1e6
"""Largest magnitude of a reward's weight [-]; chosen."""
LONGEST_EPISODE = 1e9
"""Longest episode [s]; chosen, 30 years."""
MOST_PUSH = 1e5
"""Hardest push [N]; chosen."""
SHORTEST_PUSH_INTERVAL = 0.01
"""Shortest interval of pushes [s]: a control window, in which the force is held."""
_NO_NUMBERS = {
    "S": "bytes",
    "U": "text",
    "M": "dates",
    "m": "spans of time",
    "c": "complex numbers",
    "V": "records",
}
"""NumPy's kinds of arrays that are no real numbers, and their names for errors."""
MOST_ENVIRONMENTS = 1_000_000
"""Largest batch; chosen."""
CONSTRUCTOR_ARGUMENTS = ("render_mode", "num_envs", "num_threads", "autoreset_mode")
"""Arguments of the environments besides the settings, to suggest for a misspelled name."""


class UnknownSettingError(SpringfootError, TypeError):
    """A setting that does not exist; also the `TypeError` that Python raises for an unknown keyword argument."""


def check_people_file(name: object) -> None:
    """Refuse a value that is neither None nor the name of a file of people's data."""
    if name is not None:
        if not isinstance(name, str):
            raise SpringfootError(f"people_file must be the name of a file, got {quoted(name)}")
        harmonics(Path(name))  # raises for another kind of file


def check_guide(follows_plan: bool, human: object, plan_file: object, cadence: str) -> None:
    """Refuse the setting `human` with guide `plan` (`follows_plan`), `plan_file` and cadence `effort` with guide
    `people`, and that cadence without a `plan_file`."""
    if cadence == "effort" and not follows_plan:
        raise SpringfootError("cadence 'effort' needs guide 'plan', got 'people'")
    if cadence == "effort" and plan_file is None:
        raise SpringfootError("cadence 'effort' needs a plan_file, whose styles tell the step time")
    if follows_plan and human is not None:
        raise SpringfootError("human must be None with guide 'plan': the plan replaces human data")
    if plan_file is not None:
        if not isinstance(plan_file, str):
            raise SpringfootError(f"plan_file must be the name of a file, got {quoted(plan_file)}")
        if not follows_plan:
            raise SpringfootError("plan_file needs guide 'plan', got 'people'")
        styles_of(Path(plan_file))  # raises for another kind of file


def check_names(given: Iterable[str], names: Sequence[str]) -> None:
    """Refuse a given name that is no setting, as Python refuses an unknown keyword argument; `names` are the settings.

    The error names similar ones, or all settings if none is similar.
    """
    for name in given:
        if name not in names:
            likely = get_close_matches(name, [*names, *CONSTRUCTOR_ARGUMENTS], n=3, cutoff=0.5)
            which = f"likely: {', '.join(likely)}" if likely else f"valid: {', '.join(names)}"
            raise UnknownSettingError(f"got an unexpected keyword argument {name!r}, which is no setting; {which}")


def refusing_unknown(settings: type[Settings]) -> type[Settings]:
    """Return the dataclass `settings`, changed so that it refuses unknown names, as `check_names` does."""
    init = settings.__init__
    names = [item.name for item in fields(settings)]  # type: ignore[arg-type]

    @wraps(init)
    def checked(self: Any, *arguments: Any, **named: Any) -> None:
        check_names(named, names)
        init(self, *arguments, **named)

    settings.__init__ = checked
    return settings


def check_start(start: Any) -> None:
    """Refuse other values than "random", "standing" and a stride phase in [0, 1)."""
    named = isinstance(start, str) and start in ("random", "standing")
    is_phase = not isinstance(start, str) and is_number(start) and 0 <= start < 1
    if not (named or is_phase):
        raise SpringfootError(f"start must be 'random', 'standing' or a stride phase in [0, 1), got {quoted(start)}")


def check_seed(seed: Any) -> int | None:
    """Return a seed as a whole number, or None; refuse any other value."""
    return None if seed is None else require_count("seed", seed, 0, 2**63 - 1)


def is_number(value: Any) -> bool:
    """Return True if a value is a finite number."""
    return isfinite(as_float(value))


def check_range(name: str, value: Any, unit: str) -> None:
    """Refuse any value but a tuple (low, high) of finite numbers with 0 < low < high."""
    numbers = isinstance(value, tuple) and len(value) == 2 and all(map(is_number, value))
    if not numbers or not 0 < value[0] < value[1]:
        raise SpringfootError(f"{name} must be (low, high) with 0 < low < high {unit}, got {quoted(value)}")


def check_bounds(settings: Any) -> None:
    """Refuse values of settings with which an observation or a reward might not be finite."""
    low, high = STIFFNESS_BOUNDS
    for name in ("ankle_stiffness_range", "toe_stiffness_range"):
        softest, stiffest = getattr(settings, name)
        if softest < low or stiffest > high:
            raise SpringfootError(
                f"{name} must be within [{low:g}, {high:g}] N m/rad, got {quoted((softest, stiffest))}"
            )
    require_number("episode_seconds", settings.episode_seconds, 0.0, LONGEST_EPISODE, "s")
    require_number("push_newton", settings.push_newton, 0.0, MOST_PUSH, "N")
    require_number("push_interval", settings.push_interval, SHORTEST_PUSH_INTERVAL, unit="s")
    for name, weight in settings.reward_weights.items():
        require_number(f"reward_weights[{name!r}]", weight, -MOST_WEIGHT, MOST_WEIGHT)


def check_span(name: str, value: Any, allowed: tuple[float, float], unit: str) -> None:
    """Refuse other values than None and a pair low < high within `allowed`."""
    numbers = isinstance(value, tuple) and len(value) == 2 and all(map(is_number, value))
    if value is not None and not (numbers and allowed[0] <= value[0] < value[1] <= allowed[1]):
        raise SpringfootError(
            f"{name} must be (low, high) with low < high in [{allowed[0]:g}, {allowed[1]:g}] {unit}, "
            f"got {quoted(value)}"
        )


def check_windows(name: str, delay: float | tuple[float, ...] | None) -> None:
    """Refuse a delay, or ends of a range of delays [s], that is not a multiple of the control window."""
    delays = delay if isinstance(delay, tuple) else (delay,)
    ends = [end for end in delays if end is not None]
    if any(abs(end / CONTROL_WINDOW - round(end / CONTROL_WINDOW)) > 1e-9 for end in ends):  # 1e-9: rounding
        raise SpringfootError(f"{name} must be whole steps of {CONTROL_WINDOW:g} s, got {delay!r}")


def check_weights(weights: Any, defaults: dict[str, float]) -> None:
    """Refuse unknown reward terms, and weights that make a cost of a reward or a reward of a cost.

    `defaults` has the default weight of each term: positive for a reward, negative or 0 for a cost.
    """
    if not isinstance(weights, dict):
        raise SpringfootError(f"reward_weights must map names of reward terms to numbers, got {quoted(weights)}")
    for name, weight in weights.items():
        if name not in defaults:
            raise SpringfootError(f"reward_weights has no term {quoted(name)}; valid: {', '.join(defaults)}")
        cost = defaults[name] <= 0
        if not is_number(weight) or (weight > 0 if cost else weight < 0):
            allowed = "<= 0 (a cost)" if cost else ">= 0 (a reward)"
            raise SpringfootError(f"reward_weights[{name!r}] must be a finite number {allowed}, got {quoted(weight)}")


def real_numbers(name: str, value: Any) -> NDArray:
    """Return `value` as a new array of float64.

    Refuses text, dates, complex numbers, records and rows of unequal length; `name` is that of the value in the error.
    """
    try:
        array = np.asarray(value)
        kind = array.dtype.kind
        if kind in _NO_NUMBERS:
            raise SpringfootError(f"{name} must be real numbers, got {_NO_NUMBERS[kind]}")
        if kind == "O" and any(isinstance(item, (str, bytes, complex)) for item in array.flat):
            raise TypeError  # NumPy would read numbers out of text
        return np.array(array, float, order="C")
    except (TypeError, OverflowError):  # OverflowError: an integer too large for a float
        refused = quoted(value)
    except SpringfootError:
        raise  # it is a ValueError too
    except ValueError:
        refused = "rows of unequal length"
    raise SpringfootError(f"{name} must be real numbers, got {refused}")


def with_python_types(value: Any) -> Any:
    """Return a setting's value with Python floats for numbers (also NumPy's), tuples for lists, and copies of all
    else."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return as_float(value)
    if isinstance(value, (list, tuple)):
        return tuple(with_python_types(item) for item in value)
    return deepcopy(value)
