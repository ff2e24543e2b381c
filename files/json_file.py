"""Read and write JSON files: an object or array, small enough for the memory, with a fitting digest if it has one."""

import json
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError, printable

from .digest import BLANK_DIGEST, DIGEST, require_unchanged, with_digest
from .text_table import read_bytes

MOST_JSON_BYTES = 2**23
"""Largest JSON file to read; chosen, hundreds of times a usual one: objects take twenty times the memory of their
text."""


def object_with_digest(values: Mapping[str, Any]) -> bytes:
    """Return the values as the content of a JSON file that also holds its digest (`digest`)."""
    return with_digest(json.dumps({**values, DIGEST: BLANK_DIGEST}, indent=2) + "\n").encode()


def read_object(path: Path, kind: str) -> dict[str, Any]:
    """Return the object in a JSON file, without its digest.

    Raises `SpringfootError` for any other file; the message calls it no `kind` ("FILE is no policy's settings").
    """
    value = _read(path, kind)
    if not isinstance(value, dict):
        raise SpringfootError(f"{path} is no {kind}: it must be an object in braces")
    return {name: entry for name, entry in value.items() if name != DIGEST}


def read_array(path: Path, kind: str) -> list[Any]:
    """Return the array in a JSON file; raise `SpringfootError` for any other file, as `read_object` does."""
    value = _read(path, kind)
    if not isinstance(value, list):
        raise SpringfootError(f"{path} is no {kind}: it must be an array in brackets")
    return value


def _read(path: Path, kind: str) -> Any:
    """Return the value in a JSON file; raise `SpringfootError` for any other file."""
    content = read_bytes(path, MOST_JSON_BYTES)
    require_unchanged(path, content)
    try:
        return json.loads(
            content, object_pairs_hook=keys_once, parse_float=_finite_number, parse_constant=_finite_number
        )
    except (ValueError, RecursionError) as error:
        raise SpringfootError(f"{path} is no {kind}: it is not JSON, {json_fault(error)}") from None


def keys_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the keys and values of a JSON object, `pairs`, as a dictionary; raise `ValueError` for a repeated key."""
    values: dict[str, Any] = {}
    for key, value in pairs:
        if key in values:
            raise ValueError(f"{key!r:.40} stands twice in an object")
        values[key] = value
    return values


def _finite_number(text: str) -> float:
    """Return the number in a JSON text; raise `ValueError` for NaN, infinity and numbers too large for a float."""
    value = float(text)
    if not isfinite(value):
        raise ValueError(f"{text:.40} is not a finite number")
    return value


def json_fault(error: Exception) -> str:
    """Return words for the fault of a text that is not JSON, from the `error` that reading it raised."""
    if isinstance(error, json.JSONDecodeError):
        return f"line {error.lineno}, column {error.colno}: {error.msg[0].lower()}{error.msg[1:]}"
    if isinstance(error, UnicodeDecodeError):
        return "it is no UTF-8 text"
    return "it is nested too deeply" if isinstance(error, RecursionError) else printable(str(error))[:80]
