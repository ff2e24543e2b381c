"""The file of constants that searches begin with and write to: `envs/control/legs.json`."""

import json
from importlib import resources
from pathlib import Path
from typing import Any

from springfoot.agents.files import write_atomically
from springfoot.gait.errors import SpringfootError

CONSTANTS = Path(str(resources.files("springfoot.envs.control") / "legs.json"))
"""The package's own: in a clone, what is committed."""


def read_constants(path: Path) -> dict[str, Any]:
    """A file of constants."""
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        table = None
    if not isinstance(table, dict) or not isinstance(table.get("constants"), dict):
        raise SpringfootError(f"{path} is not a file of leg constants")
    return table


def write_constants(path: Path, table: dict[str, Any]) -> None:
    """Write a file of constants, whole or not at all."""
    write_atomically(path, (json.dumps(table, indent=1) + "\n").encode())
