"""Read a user's foot from a file: a torque-angle table (CSV), or the settings of a foot, or a schedule (JSON).

A table has a header and the columns `ankle_deg` and `ankle_torque_Nm`, `toe_deg` and `toe_torque_Nm`, or two of them:
dorsiflexion and toe up positive, torques with the sign of the angles, so that torque falls as the angle rises.
"""

from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError
from springfoot.files.json_file import read_object
from springfoot.files.text_table import read_csv

from .finite_states import read_states
from .stiffness import SPRINGS, StiffnessSchedule


def read_foot(path: str | Path) -> dict[str, Any]:
    """Return the foot described in a file, as a value of the settings `left_foot` and `right_foot`.

    A CSV file is a passive foot with these torques; a joint without columns has its defaults. A JSON file is a foot's
    dictionary; or for an adaptive foot that follows them, a `StiffnessSchedule` or finite states. Their K is the
    device's as written, for any body; their damping times are not read: the device damps as muscles do. Raises
    `SpringfootError` for another file; the numbers of a foot are checked when the setting is made.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        return {"kind": "passive"} | _torque_tables(path)
    foot = read_object(path, "foot (a JSON object, or a table in a file .csv)")
    if "kind" in foot:
        return foot
    if "states" in foot:
        springs = read_states(path).springs
    elif set(foot) == set(SPRINGS):
        try:
            springs = StiffnessSchedule.from_json(foot)
        except SpringfootError as error:
            raise SpringfootError(f"{path.name}: {error}") from None
    else:
        raise SpringfootError(
            f"{path.name} is no foot: it must have a 'kind', or the schedule of an adaptive foot: states, or ankle and "
            f"toe, got {', '.join(foot) or 'nothing'}"
        )
    return {"kind": "adaptive", "schedule": springs.to_json()}


def _torque_tables(path: Path) -> dict[str, list[list[float]]]:
    """Return `ankle_table` or `toe_table` -> pairs of angle [deg] and torque [N m], from a CSV file.

    A joint without columns is left out; raises `SpringfootError` for a file without any.
    """
    table = read_csv(path)
    tables = {}
    for joint in SPRINGS:
        angle = f"{joint}_deg"
        torque = f"{joint}_torque_Nm"
        if table.has(angle) != table.has(torque):
            raise SpringfootError(f"{table.name}, line 1: {angle} and {torque} go together")
        if table.has(angle):
            pairs = zip(table.ascending(angle).tolist(), table.numbers(torque).tolist(), strict=True)
            tables[f"{joint}_table"] = [list(pair) for pair in pairs]
    if not tables:
        names = ", ".join(f"{joint}_deg and {joint}_torque_Nm" for joint in SPRINGS)
        raise SpringfootError(f"{table.name}, line 1: needs {names}, or two of them, got {', '.join(table.columns)}")
    return tables
