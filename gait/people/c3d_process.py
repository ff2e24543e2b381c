"""Read C3D files in a process of their own (`bounded_process`); arrays and JSON text come back, no pickles."""

import io
import json
import os
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.errors import SpringfootError, quoted
from springfoot.files.bounded_process import MOST_MEMORY, MOST_SECONDS, bound_resources, output_in_process
from springfoot.files.text_table import existing

from .gait_events import Contacts
from .motion_files import Trial

_CHILD = "from springfoot.gait.people.c3d_process import main; main()"


def c3d_trial(path: Path) -> Trial:
    """Return the walk in a C3D file, as `c3d_file.read_c3d` reads it; raise `SpringfootError` for an unreadable
    file."""
    if find_spec("ezc3d") is None:
        raise SpringfootError(f"{path.name}: reading C3D needs ezc3d; install springfoot[c3d]")
    output = output_in_process(_CHILD, str(existing(path).absolute()))
    if output is None:
        raise SpringfootError(
            f"{path.name} is damaged: ezc3d crashed on it, or took over {MOST_SECONDS} s or {MOST_MEMORY // 2**20} MiB"
        )
    with np.load(io.BytesIO(output)) as file:
        arrays = dict(file)
    return _trial(json.loads(str(arrays.pop("header"))), arrays)


def _trial(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> Trial:
    """Return the walk from the header and arrays that the child process (`main`) wrote; raise the child's error.

    The arrays are named leg/SIDE/CURVE, contacts/SIDE/EVENT and time//.
    """
    if "error" in header:
        raise SpringfootError(header["error"])
    legs: dict[str, dict[str, np.ndarray]] = {}
    contacts: dict[str, dict[str, np.ndarray]] = {}
    for name, values in arrays.items():
        kind, side, entry = name.split("/")
        if kind == "leg":
            legs.setdefault(side, {})[entry] = values
        elif kind == "contacts":
            contacts.setdefault(side, {})[entry] = values
    return Trial(
        name=header["name"],
        time=arrays["time//"],
        legs=legs,
        unscaled=tuple(header["unscaled"]),
        contacts={side: Contacts(**events) for side, events in contacts.items()},
        speed=header["speed"],
    )


def main() -> None:
    """Run the child process: read the C3D file named on the command line, write its curves to standard output."""
    import ezc3d  # noqa: F401  # before the bounds, which do not count the cost of imports

    from .c3d_file import read_c3d

    out = os.dup(1)
    os.dup2(2, 1)  # output of libraries goes to standard error
    bound_resources()
    arrays: dict[str, np.ndarray] = {}
    try:
        trial = read_c3d(Path(sys.argv[1]))
        header = {"name": trial.name, "unscaled": trial.unscaled, "speed": trial.speed}
        arrays["time//"] = trial.time
        for side, curves in trial.legs.items():
            arrays |= {f"leg/{side}/{name}": values for name, values in curves.items()}
        for side, events in trial.contacts.items():
            arrays |= {f"contacts/{side}/{name}": getattr(events, name) for name in ("heel_strikes", "toe_offs")}
    except SpringfootError as error:
        header = {"error": str(error)}
        arrays = {}
    except Exception as error:  # whatever a damaged file makes of ezc3d's answers
        fault = f"{Path(sys.argv[1]).name} is not a C3D file, or it is damaged"
        header = {"error": f"{fault}: {type(error).__name__}: {quoted(str(error))}"}
        arrays = {}
    with os.fdopen(out, "wb") as file:
        buffer = io.BytesIO()
        np.savez(buffer, header=np.array(json.dumps(header)), **dict[str, Any](arrays))
        file.write(buffer.getvalue())
