"""Read a user's foot from a file: a torque-angle table (CSV), or the settings of a foot or a schedule (JSON).

A table has a header and the columns `ankle_deg` and `ankle_torque_Nm`, `toe_deg` and `toe_torque_Nm`, or two of them:
dorsiflexion and toe up positive, torques with the sign of the angles, so that torque falls as the angle rises.
"""

from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError
from springfoot.files.json_file import read_object
from springfoot.files.text_table import read_csv

from .stiffness import SPRINGS


def read_foot(path: str | Path) -> dict[str, Any]:
    """Return the setting `left_foot` or `right_foot` in a file.

    A CSV is a passive foot with these torques; the other joint has its defaults. A JSON file is a foot's dictionary, or
    a `StiffnessSchedule` for an adaptive foot that follows it. Raises `SpringfootError` for another file; the setting
    checks the numbers.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        return {"kind": "passive"} | _tables(path)
    foot = read_object(path, "foot (a JSON object, or a table in a file .csv)")
    return {"kind": "adaptive", "schedule": foot} if set(foot) == set(SPRINGS) else foot


def _tables(path: Path) -> dict[str, list[list[float]]]:
    """Return joint -> torque-angle line [deg, N m] of a CSV file."""
    table = read_csv(path)
    found = {}
    for joint in SPRINGS:
        angle = f"{joint}_deg"
        torque = f"{joint}_torque_Nm"
        if table.has(angle) != table.has(torque):
            raise SpringfootError(f"{table.name}, line 1: {angle} and {torque} go together")
        if table.has(angle):
            pairs = zip(table.ascending(angle).tolist(), table.numbers(torque).tolist(), strict=True)
            found[f"{joint}_table"] = [list(pair) for pair in pairs]
    if not found:
        names = ", ".join(f"{joint}_deg and {joint}_torque_Nm" for joint in SPRINGS)
        raise SpringfootError(f"{table.name}, line 1: needs {names}, or two of them, got {', '.join(table.columns)}")
    return found
