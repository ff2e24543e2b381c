"""Read and write the files of constants that searches start from and write: leg constants and styles of walks."""

import json
from importlib import resources
from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError
from springfoot.files.json_file import read_object
from springfoot.files.writing import write_atomically

CONSTANTS = Path(str(resources.files("springfoot.envs.control") / "legs.json"))
"""The package's leg constants; in a clone, the committed file."""


def read_constants(path: Path) -> dict[str, Any]:
    """Return the content of a file of leg constants: `constants` by name, and `found_by`, the commands."""
    return _read_table(path, "constants", "leg constants")


def read_styles(path: Path) -> dict[str, Any]:
    """Return the content of a file of styles of walks, as `styles` and `found_by`; empty ones if there is no file."""
    return _read_table(path, "styles", "styles of walks") if path.exists() else {"found_by": {}, "styles": {}}


def _read_table(path: Path, key: str, content: str) -> dict[str, Any]:
    """Return the object in a JSON file, which must have an object `key`; `found_by` is added if it is missing.

    Raises `SpringfootError`, which says that the file is not one of `content`, for any other file.
    """
    try:
        table = read_object(path, content)
    except (OSError, SpringfootError):
        table = {}
    if not isinstance(table.get(key), dict) or not isinstance(table.setdefault("found_by", {}), dict):
        raise SpringfootError(f"{path} is not a file of {content}")
    return table


def write_constants(path: Path, table: dict[str, Any]) -> None:
    """Write a file of constants, whole or not at all."""
    write_atomically(path, (json.dumps(table, indent=1) + "\n").encode())
