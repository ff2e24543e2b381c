"""Read the springs of a few finite states of the stride from a file in JSON, as evaluations write it.

docs/how-to/policies.md describes the entries. It is a policy (`springfoot.agents.policies.schedule_files`), or a foot
(`foot_file`).
"""

from math import radians
from pathlib import Path
from typing import Any, NamedTuple

from springfoot.errors import SpringfootError, require_number, require_within
from springfoot.files.json_file import read_object

from .stiffness import SPRINGS, Segment, StiffnessSchedule

SPRING_KEYS = ("stiffness_Nm_per_rad", "damping_time_s", "equilibrium_deg")
"""Entries of each spring in a state."""
STATES_FILE = "table of finite states"


class FiniteStates(NamedTuple):
    """The content of a file of finite states."""

    springs: StiffnessSchedule
    """K and rest angle of ankle and toe, constant in each state; K of the file's body."""
    damping: tuple[tuple[Any, ...], ...]
    """Of ankle and toe each state's damping time [s] as written, unchecked; None where the file has none."""
    height: Any
    """Height of the file's body [m] as written, unchecked; None if the file has none."""
    mass: Any
    """Mass of the file's body, load included [kg]; as `height`."""


def read_states(path: Path) -> FiniteStates:
    """Return the finite states in a JSON file.

    Raises `SpringfootError` for a file of another form, and for stiffness and angles out of range.
    """
    table = read_object(path, STATES_FILE)
    try:
        # [state][joint] -> (phase of the state's start, K, damping time, rest angle)
        entries = [
            [(state["phase"], *(state[joint].get(key) for key in SPRING_KEYS)) for joint in SPRINGS]
            for state in table["states"]
        ]
    except (LookupError, TypeError, AttributeError):  # an entry is missing, or a list or a number in place of an object
        raise SpringfootError(
            f"{path} is no {STATES_FILE}: an object with states, a list in which each has phase, ankle and "
            f"toe, and these {', '.join(SPRING_KEYS)}"
        ) from None
    of_joints = list(zip(*entries, strict=True)) or [()] * len(SPRINGS)
    courses = []  # of ankle and toe: each a tuple of segments
    for joint, states in zip(SPRINGS, of_joints, strict=True):
        segments = []
        for phase, stiffness, _, rest_deg in states:
            stiffness = require_number(
                f"{path.name}: {joint} {SPRING_KEYS[0]}", stiffness, 0.0, unit="N m/rad", above=True
            )
            rest = radians(require_within(f"{path.name}: {joint} {SPRING_KEYS[2]}", rest_deg, (-180.0, 180.0), "deg"))
            segments.append(Segment(phase, stiffness, rest))
        courses.append(tuple(segments))
    try:
        springs = StiffnessSchedule(*courses)
    except (SpringfootError, TypeError) as error:
        raise SpringfootError(f"{path.name}: {error}") from None
    damping = tuple(tuple(beta for _, _, beta, _ in states) for states in of_joints)
    return FiniteStates(springs, damping, table.get("height_m"), table.get("mass_kg"))
