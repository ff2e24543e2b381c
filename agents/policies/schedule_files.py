"""Read schedules in files as policies: K over the stride (CSV), or the springs of a few finite states (JSON).

An evaluation writes both of its walk (`springfoot.evaluation.report.schedule_tables`); docs/how-to/policies.md
describes their columns and entries. K scales with the body; a file without a body is of 1.70 m and 63 kg.
"""

from collections.abc import Callable
from math import sqrt
from pathlib import Path
from typing import Any, get_args

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.stiffness_control import FEET
from springfoot.envs.physics.model import SIDES, damping_times
from springfoot.envs.settings.settings import BipedSettings, Equilibrium, body_of
from springfoot.errors import SpringfootError, as_float, require_number
from springfoot.files.text_table import Table, read_csv
from springfoot.gait.body.body import REFERENCE_HEIGHT, REFERENCE_MASS
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.springs.finite_states import read_states
from springfoot.gait.springs.stiffness import SPRINGS, STIFFNESS_RANGE, StiffnessSchedule

from .baselines import PolicyFunction, follow, schedule

SAME_BETA = 1e-4
"""Difference of damping times that counts as rounding [s]."""


def schedule_file(
    name: str, settings_of_body: BipedSettings
) -> tuple[dict[str, Any], Callable[[BipedSettings], PolicyFunction]]:
    """Return the environment settings that a schedule file needs, and a function that builds the file's policy for an
    environment's settings.

    Args:
        name: path of the file, as an evaluation writes it: `.json` for finite states, else `.csv` for K over the
            stride.
        settings_of_body: settings of the body to which K is scaled; they count for nothing else. The environment has to
            have that body.

    The needed settings are absolute actions and the file's rest angles. Raises `SpringfootError` for a file of another
    content.
    """
    path = Path(name)
    if path.suffix.lower() == ".json":
        springs = _schedule_of_states(path, settings_of_body)
        needed = {"action_mode": "absolute", "equilibrium": "phase", "schedule": springs.to_json()}
        return needed, schedule  # the baseline, which plays the schedule of the settings
    table = read_csv(path)
    stiffness = _stiffness_curves(table) * _scale(_cell(table, "height_m"), _cell(table, "mass_kg"), settings_of_body)
    needed = {"action_mode": "absolute"} | _rest_angle_settings(table, stiffness)
    # One schedule serves all speeds: [None] is the axis of speeds, and its single entry may be any.
    return needed, lambda settings: follow(stiffness[None], np.zeros(1), settings, body_of(settings))


def _scale(height: float | None, mass: float | None, settings: BipedSettings) -> float:
    """Return the factor [-] by which stiffness is scaled from the body of a file to the body of `settings`.

    `height` [m] and `mass`, load included [kg], are the file's; None stands for 1.70 m or 63 kg.
    """
    height = require_number("height_m", REFERENCE_HEIGHT if height is None else height, 0.0, unit="m", above=True)
    mass = require_number("mass_kg", REFERENCE_MASS if mass is None else mass, 0.0, unit="kg", above=True)
    return body_of(settings).stiffness_scale / (mass / REFERENCE_MASS * height / REFERENCE_HEIGHT)


# K over the stride, in a CSV file ----------------------------------------------------------------------------


def _cell(table: Table, column: str) -> float | None:
    """Return the number in a column's first row; None without that column."""
    return float(table.numbers(column)[0]) if table.has(column) else None


def _columns(table: Table, quantity: str) -> list[list[str]]:
    """Return the column names of a spring quantity as [side][joint], such as `ankle_left_stiffness_Nm_per_rad`.

    A column without a side, `ankle_stiffness_Nm_per_rad`, serves both legs. Raises `SpringfootError` if a spring has no
    column.
    """
    # The first of the two possible names that the table has; "" if it has neither.
    names = [
        [
            next(
                (column for column in (f"{joint}_{side}_{quantity}", f"{joint}_{quantity}") if column in table.columns),
                "",
            )
            for joint in SPRINGS
        ]
        for side in SIDES
    ]
    for joint, *columns in zip(SPRINGS, *names, strict=True):
        if not all(columns):
            raise SpringfootError(
                f"{table.name}, line 1: needs a column {joint}_{quantity}, "
                f"or {joint}_left_{quantity} and {joint}_right_{quantity}"
            )
    return names


def _curves(table: Table, quantity: str) -> NDArray:
    """Return a quantity of the springs on `GRID`, (SAMPLES, side, joint), from a table of rows at percents of the
    stride.

    It is linear between rows, and periodic. `quantity` is the end of the column names, as in `_columns`. Raises
    `SpringfootError` for percents that are missing, not ascending or outside [0, 100].
    """
    if not table.has("percent"):
        raise SpringfootError(f"{table.name}, line 1: needs a column percent, of the leg's stride")
    percent = table.ascending("percent")
    for (line, _), value in zip(table.rows, percent, strict=True):
        if not 0.0 <= value <= PERCENT[-1]:
            raise table.error(line, "percent", f"must be in [0, 100], got {value:g}")
    inside = percent < PERCENT[-1]  # 100 is 0 again
    # [side][joint] (rows,), then (side, joint, SAMPLES)
    of_rows = [[table.numbers(column)[inside] for column in columns] for columns in _columns(table, quantity)]
    if not inside.any():
        raise SpringfootError(f"{table.name} needs a row of less than 100 percent")
    phase = percent[inside] / PERCENT[-1]
    on_grid = np.stack([[np.interp(GRID, phase, curve, period=1.0) for curve in curves] for curves in of_rows])
    return on_grid.transpose(2, 0, 1)


def _stiffness_curves(table: Table) -> NDArray:
    """Return K on `GRID`, (SAMPLES, side, joint) [N m/rad], of a table, not scaled; joints are ankle and toe.

    Raises `SpringfootError` for numbers outside `STIFFNESS_RANGE`, and as `_curves`.
    """
    stiffness = _curves(table, "stiffness_Nm_per_rad")
    low, high = STIFFNESS_RANGE
    if not (low < stiffness.min() and stiffness.max() <= high):
        raise SpringfootError(
            f"{table.name}: stiffness must be above {low:g} and at most {high:g} N m/rad, got "
            f"{stiffness.min():g} to {stiffness.max():g}"
        )
    return stiffness


def _rest_angle_settings(table: Table, stiffness: NDArray) -> dict[str, Any]:
    """Return the environment settings of a table's rest angles: `equilibrium`, and `schedule` if it is `phase`.

    `equilibrium` is the word in the column of that name, `planned` without the column. `schedule`, in JSON form, has
    for each percent of the stride K and rest angle at its start, averaged over the two legs, since a schedule has one
    course for both. `stiffness` (SAMPLES, side, joint) [N m/rad] is the table's, scaled to the body.
    """
    kinds = get_args(Equilibrium)
    kind = "planned"
    if table.has("equilibrium"):
        line, cells = table.rows[0]
        kind = cells[table.columns.index("equilibrium")].strip()
        if kind not in kinds:
            raise table.error(line, "equilibrium", f"must be one of {', '.join(kinds)}, got {kind!r:.40}")
    if kind != "phase":
        return {"equilibrium": kind}
    rest_angles = np.radians(_curves(table, "equilibrium_deg"))
    of_legs = np.stack([stiffness, rest_angles], -1)  # (SAMPLES, side, joint, (K, rest angle))
    samples_per_percent = len(GRID) // int(PERCENT[-1])
    springs = of_legs.mean(axis=1)[::samples_per_percent]  # (percent, joint, (K, rest angle)), the mean of both legs
    starts = np.broadcast_to(GRID[::samples_per_percent, None, None], (len(springs), len(SPRINGS), 1))
    # (joint, percent, (start, K, rest angle)): a list of segments for each joint, as a schedule is written
    segments = np.concatenate([starts, springs], axis=-1).swapaxes(0, 1).tolist()
    return {"equilibrium": kind, "schedule": dict(zip(SPRINGS, segments, strict=True))}


# Springs of finite states, in a JSON file --------------------------------------------------------------------


def _schedule_of_states(path: Path, settings: BipedSettings) -> StiffnessSchedule:
    """Return the schedule in a file of finite states: K and rest angle of ankle and toe, constant in each state.

    K is scaled to the body of `settings`. Raises `SpringfootError` as `read_states` does, and for a damping time other
    than the model's, which no policy can set.
    """
    states = read_states(path)
    scale = _scale(states.height, states.mass, settings)
    # Times of bodies of equal proportions are as the roots of their heights (Froude).
    time_scale = sqrt(settings.height / (REFERENCE_HEIGHT if states.height is None else states.height))
    for joint, betas, model_beta in zip(SPRINGS, states.damping, damping_times(body_of(settings))[FEET], strict=True):
        for beta in betas:
            if beta is not None and not abs(as_float(beta) * time_scale - model_beta) < SAME_BETA:
                allowed = f"{model_beta / time_scale:.4g} s, the model's"
                raise SpringfootError(f"{path.name}: {joint} damping_time_s must be {allowed}, got {beta!r:.40}")
    courses = (
        [segment._replace(stiffness=segment.stiffness * scale) for segment in getattr(states.springs, joint)]
        for joint in SPRINGS
    )
    try:
        return StiffnessSchedule(*map(tuple, courses))
    except SpringfootError as error:  # too stiff once scaled
        raise SpringfootError(f"{path.name}: {error}") from None
