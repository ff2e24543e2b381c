"""Read text files of measured walks, tables and OpenSim .mot and .sto, in the names, signs and units of `HumanGait`.

OpenSim: hip_flexion, ankle_angle and mtp_angle have our signs. knee_angle is negative in flexion in some models
(gait2392) and positive in others (Rajagopal): `strides.merge_trials` turns it and its moment if its mean is negative.
pelvis_tilt is positive backward, so thigh = hip_flexion + pelvis_tilt. A coordinate's moment (`hip_flexion_r_moment`,
of inverse dynamics) is positive as the coordinate, ours opposite.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from types import MappingProxyType

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.files.text_table import Table, make_table, text_lines

from .gait_events import Contacts
from .human import COLUMNS, FORCES
from .laboratory_names import laboratory_curves

FILE_CURVES = COLUMNS | {"toe_moment": "mtp_moment_Nm_per_kg"}
"""Curve that a file may have -> its column in CSV files: those of `HumanGait`, and the toe's moment, plantarflexion
positive, which of people is unknown."""
LONGEST_HEADER = 200
"""Most lines of a header; chosen."""
PELVIS = "pelvis_anterior_tilt_deg"
"""Column (forward positive) that turns hip into thigh if there is no thigh."""
TIME_COLUMNS = ("time_s", "time", "Time")
FILE_SIDES = ("left", "right")
PARAMETERS = {"speed": "speed_m_s", "stride_time": "stride_time_s", "step_length": "step_length_m"}
"""Number beside mean curves -> its column."""
HIGHEST_PELVIS = 20.0
"""Largest median height of the pelvis above the laboratory's zero [m]; chosen: people's is about 1 above the floor,
which may lie lower, and a minute uphill rises by several; in inches it is 37."""
WALKING_SPEED = 0.3
"""Speed of the body in the laboratory below which it walks on a treadmill [m/s]; chosen."""

Series = dict[str, NDArray]
NO_NAMES: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """A recorded walk."""

    name: str
    """The file's name."""
    time: NDArray
    """(T,) ascending [s]."""
    legs: Mapping[str, Series]
    """Side (left, right, or "" in a file of one leg) -> curve of `COLUMNS` -> (T,); rad, N m/kg, body weights."""
    unscaled: tuple[str, ...] = ()
    """Curves in N or N m, still to be divided by body weight or mass."""
    knee_as_read: bool = False
    """True if knee and knee moment have the sign of the model's coordinate, which only the angle can tell."""
    forces_along_x: bool = False
    """True if `grf_forward` is along the laboratory's x, which only the walk's direction can turn."""
    backward: bool = False
    """True if the file tells that the walk is towards the laboratory's -x."""
    contacts: Mapping[str, Contacts] = field(default_factory=dict)
    """Side -> events in the file."""
    speed: float | None = None
    """Walking speed [m/s]; None if the file has none."""
    speed_column: str = PARAMETERS["speed"]
    """Column that tells the speed."""
    columns: Sequence[str] = ()
    """Names of the file's columns, if it is a text file."""
    column_of: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """(side, curve) -> its column in the file, where that is not the one of `COLUMNS`."""
    notes: tuple[str, ...] = ()
    """Sentences on guesses."""


def csv_trial(table: Table) -> Trial:
    """Return the walk over time in a table with a column of `TIME_COLUMNS`, and curves in the columns of `FILE_CURVES`.

    Columns of one of two legs end in `_left` or `_right`. Raises `SpringfootError` for a table without time or curves.
    """
    time = next((name for name in TIME_COLUMNS if name in table.columns), None)
    if time is None:
        raise SpringfootError(
            f"{table.name}, line 1: needs a column percent (mean curves over 0..100) or time_s (a walk over time)"
        )
    speed = float(table.numbers("speed_m_s").mean()) if table.has("speed_m_s") else None
    legs = {side: our_columns(table, f"_{side}" if side else "") for side in ("", *FILE_SIDES)}
    legs = not_empty(table.name, legs)
    return Trial(name=table.name, time=table.ascending(time), legs=legs, speed=speed, columns=table.columns)


def our_columns(table: Table, suffix: str = "") -> Series:
    """Return the curves of a table's columns named as in `FILE_CURVES` with `suffix` behind (as `_sd`), in SI units.

    A missing thigh is computed from hip and pelvis. `_left` and `_right` also bring a laboratory's names.
    """
    curves = laboratory_curves(table, suffix[1:]) if suffix[1:] in FILE_SIDES else {}
    for name, column in FILE_CURVES.items():
        if table.has(column + suffix):
            values = table.numbers(column + suffix)
            curves[name] = np.radians(values) if column.endswith("_deg") else values
    # The pelvis has a column with the suffix, or one for both legs; a spread of the thigh does not follow from spreads.
    pelvis = next((PELVIS + end for end in (suffix, "") if table.has(PELVIS + end)), None)
    if "hip" in curves and "thigh" not in curves and pelvis and not suffix.endswith("_sd"):
        curves["thigh"] = curves["hip"] - np.radians(table.numbers(pelvis))
    return curves


_OPENSIM = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle", "mtp_angle": "toe"}
"""Coordinate of a model -> curve."""
_OPENSIM_FORCE = {
    "right": (
        "ground_force_v",
        "ground_force_1_v",
        "ground_force_r_v",
        "r_ground_force_v",
        "ground_force_calcn_r_v",
        "ground_force_right_v",
    ),
    "left": (
        "1_ground_force_v",
        "ground_force_2_v",
        "ground_force_l_v",
        "l_ground_force_v",
        "ground_force_calcn_l_v",
        "ground_force_left_v",
    ),
}
"""Side -> beginnings of the names of its forces, before x or y; the last two are AddBiomechanics' and OpenCap's."""


def known_columns() -> set[str]:
    """Return all names of columns that the readers of text files know, but for those of laboratories."""
    known = {*TIME_COLUMNS, "percent", *PARAMETERS.values(), "toe_off_percent", "n", "condition"}
    sides = ("", *(f"_{side}" for side in FILE_SIDES))
    known |= {
        f"{column}{side}{sd}" for column in (*FILE_CURVES.values(), PELVIS) for side in sides for sd in ("", "_sd")
    }
    known |= {"pelvis_tilt", "pelvis_tx", *(f"toe_off_percent_{side}" for side in FILE_SIDES)}
    known |= {f"{coordinate}_{side}{end}" for coordinate in _OPENSIM for side in "lr" for end in ("", "_moment")}
    return known | {f"{start}{axis}" for starts in _OPENSIM_FORCE.values() for start in starts for axis in "xy"}


MOST_RADIANS = 4.0
"""Largest excursion of a leg's angles in radians; a larger one is in degrees; chosen, people's knees make 1.1."""


def opensim_trial(path: Path, renamed: Mapping[str, str] = NO_NAMES) -> Trial:
    """Return an OpenSim motion or storage file: header with `inDegrees`, `endheader`, column names, rows.

    Angles `hip_flexion_r`, `knee_angle_r`, `ankle_angle_r`, `mtp_angle_r`, `pelvis_tilt` (also as the paths of OpenSim
    4, `/jointset/.../value`), the same with `_moment` behind [N m], forces `ground_force_vx` (forward), `_vy` (up) [N],
    right; left as `_l`, and forces as in `_OPENSIM_FORCE`. `renamed` is a column in the file -> its name here. A header
    without `inDegrees` is guessed by the range of the angles.
    """
    lines = text_lines(path)
    header = []
    for line in islice(lines, LONGEST_HEADER):
        if line.strip().lower() == "endheader":
            break
        header.append(line)
    else:
        raise SpringfootError(f"{path.name}: no line 'endheader', so not an OpenSim .mot or .sto file")
    in_degrees = next((m[1].lower() for line in header if (m := re.match(r"\s*inDegrees\s*=\s*(\w+)", line))), "")
    end = len(header)
    # The line of names is two below the header's last line.
    as_read = make_table(path.name, ((n, _split(line)) for n, line in enumerate(lines, end + 2)))
    table = as_read.renamed(renamed)
    names = table.columns
    as_typed = {ours: theirs for theirs, ours in renamed.items()}
    column_of: dict[tuple[str, str], str] = {}
    if "time" not in names:
        raise SpringfootError(f"{path.name}, line {end + 2}: no column time")

    legs: dict[str, Series] = {side: {} for side in FILE_SIDES}
    tilt = table.numbers("pelvis_tilt") if "pelvis_tilt" in names else None
    for side, curves in legs.items():
        for coordinate, curve in _OPENSIM.items():
            if (column := f"{coordinate}_{side[0]}") in names:
                curves[curve] = table.numbers(column)
                column_of[side, curve] = as_typed.get(column, column)
        if "hip" in curves and tilt is not None:
            curves["thigh"] = curves["hip"] + tilt
            column_of[side, "thigh"] = f"{column_of[side, 'hip']} + pelvis_tilt"
    notes: tuple[str, ...] = ()
    rows = next((int(m[1]) for line in header if (m := re.match(r"\s*(?:nRows\s*=|datarows)\s*(\d+)", line))), None)
    if rows is not None and rows != len(table.rows):
        notes = (f"{path.name} says that it has {rows} rows, and has {len(table.rows)}: was it cut short?",)
    if any(legs.values()) and not in_degrees:
        widest = max(float(np.ptp(values)) for curves in legs.values() for values in curves.values())
        in_degrees = "yes" if widest > MOST_RADIANS else "no"
        unit_name = "degrees" if in_degrees == "yes" else "radians"
        notes += (
            f"{path.name} does not say inDegrees: its angles span {widest:.3g}, so they are taken as {unit_name}.",
        )
    if any(legs.values()) and in_degrees not in ("yes", "no"):
        raise SpringfootError(f"{path.name}: its header must say inDegrees=yes or inDegrees=no, got {in_degrees!r:.40}")
    unit = np.pi / 180 if in_degrees == "yes" else 1.0
    _require_metres(table)
    # The pelvis's first and last position tell the speed, and whether the walk is towards the laboratory's -x.
    travelled = table.numbers("pelvis_tx")[[0, -1]] if "pelvis_tx" in names else np.zeros(2)
    time = table.ascending("time")
    velocity = float(np.diff(travelled)[0] / (time[-1] - time[0])) if len(time) > 1 else 0.0
    for side, curves in legs.items():
        for name in curves:
            curves[name] = curves[name] * unit
        for coordinate, curve in _OPENSIM.items():
            if (column := f"{coordinate}_{side[0]}_moment") in names:
                curves[f"{curve}_moment"] = -table.numbers(column)
                column_of[side, f"{curve}_moment"] = as_typed.get(column, column)
        # Files differ in the case of the forces' names.
        lower = {name.lower(): name for name in names}
        force = next((name for name in _OPENSIM_FORCE[side] if f"{name}y" in lower), None)
        for axis, curve in (("y", "grf_vertical"), ("x", "grf_forward")):
            if force and (column := lower.get(f"{force}{axis}")):
                curves[curve] = table.numbers(column)
                column_of[side, curve] = as_typed.get(column, column)
    return Trial(
        name=path.name,
        time=time,
        legs=not_empty(path.name, legs),
        unscaled=(*(f"{curve}_moment" for curve in _OPENSIM.values()), *FORCES),
        knee_as_read=True,
        forces_along_x=True,
        backward=velocity < -WALKING_SPEED,
        speed=abs(velocity) if abs(velocity) > WALKING_SPEED else None,
        speed_column=as_typed.get("pelvis_tx", "pelvis_tx"),
        columns=as_read.columns,
        column_of=column_of,
        notes=notes,
    )


def _require_metres(table: Table) -> None:
    """Raise `SpringfootError` if the pelvis is higher than `HIGHEST_PELVIS`: its positions are in another unit."""
    if "pelvis_ty" in table.columns:
        height = float(np.median(table.numbers("pelvis_ty")))
        if height > HIGHEST_PELVIS:
            unit = "mm" if height > 300.0 else "cm"  # people's are about 900 and 90
            raise SpringfootError(f"{table.name}: pelvis_ty is {height:.3g} in the median, must be in m: {unit}?")


def not_empty(name: str, legs: Mapping[str, Series]) -> dict[str, Series]:
    """Return the legs with at least one curve; raise `SpringfootError` if there is none."""
    legs = {side: curves for side, curves in legs.items() if curves}
    if not legs:
        raise SpringfootError(
            f"{name} has none of the known curves: {', '.join(COLUMNS.values())}, or their OpenSim "
            "or Plug-in Gait names"
        )
    return legs


def _split(line: str) -> list[str]:
    """Return the cells of a line, which are separated by tabs or, in a line without tabs, by blanks."""
    return line.strip().split("\t") if "\t" in line.strip() else line.split()


def refuse_impossible_angles(name: str, curves: Mapping[str, NDArray]) -> None:
    """Raise `SpringfootError` for angles [rad] that no leg has: beyond half a turn, or of a knee bent backward.

    `curves` is curve -> (...) of the file `name`.
    """
    for joint in ("thigh", "hip", "knee", "ankle", "toe"):
        if joint in curves and (largest := np.abs(curves[joint]).max()) > np.pi:
            raise SpringfootError(f"{name}: the {joint} reaches {np.degrees(largest):.0f} deg; degrees or radians?")
    if "knee" in curves and curves["knee"].mean() < 0:
        raise SpringfootError(f"{name}: the knee is bent backward; flexion must be positive")
