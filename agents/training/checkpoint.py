"""Keep the newest few checkpoints of a run, each a whole file of a `resume_state`; a damaged one is passed over."""

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
from typeguard import CollectionCheckStrategy, TypeCheckError, check_type

from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.files.tensor_file import read_tensors, write_tensors

from .config import config_from_json
from .resume_state import Learning
from .run_record import require_past

Checkpoint = tuple[dict[str, Any], dict[str, np.ndarray]]
"""Header, as in `Header`, and arrays by name."""
STATE_KEY = "springfoot-training"
"""Entry of a checkpoint file's header."""
KEPT_CHECKPOINTS = 3
"""Checkpoints that a run keeps; chosen."""
_NAME = re.compile(r"state-(\d{1,15})\.safetensors")


class Header(TypedDict):
    """Content of a checkpoint's header."""

    timesteps: int
    """Environment steps trained so far."""
    config: dict[str, Any]
    """Configuration of the training, in JSON form."""
    fingerprint: dict[str, str]
    """Fingerprint of its environment."""
    record: dict[str, list[dict[str, Any]]]
    """Sessions and evaluations so far, as in run.json."""
    seconds: float
    """Wall time of the training so far [s]."""
    events: dict[str, int]
    """Size of each of TensorBoard's event files [bytes]."""
    learning: Learning
    """JSON part of the learning's state."""


def checkpoints(out: Path) -> list[Path]:
    """Return the paths of the checkpoints in the folder `out`, the one of the most timesteps first."""
    paths = [path for path in out.iterdir() if _NAME.fullmatch(path.name)]
    return sorted(paths, key=_timesteps, reverse=True)


def write_checkpoint(
    out: Path, header: dict[str, Any], arrays: Mapping[str, np.ndarray], kept: int = KEPT_CHECKPOINTS
) -> None:
    """Write the checkpoint after `header["timesteps"]` steps into the folder `out`; then remove all but the newest
    `kept`.

    `header` is as in `Header`, `arrays` holds the state's arrays by name.
    """
    write_tensors(out / f"state-{header['timesteps']}.safetensors", STATE_KEY, header, arrays)
    for path in checkpoints(out)[kept:]:
        path.unlink(missing_ok=True)


def read_checkpoint(path: Path) -> Checkpoint:
    """Return header and arrays of the checkpoint in the file `path`.

    Raises `SpringfootError` for a damaged file, and for any other file.
    """
    names = Header.__annotations__
    header, arrays = read_tensors(path, STATE_KEY, "training state", set(names), finite=False, needs_digest=True)
    if missing := [name for name in names if name not in header]:
        raise SpringfootError(f"{path} is of another version of springfoot: it has no {missing[0]}")
    try:
        _require_header(header)
    except (KeyError, TypeError, ValueError) as error:
        reason = f"it has no {error}" if isinstance(error, KeyError) else error  # of KeyError the text is the key
        raise SpringfootError(f"{path} is damaged: {reason}") from None
    return header, arrays


def _require_header(header: dict[str, Any]) -> None:
    """Raise `SpringfootError`, KeyError, TypeError or ValueError for a header that no training writes."""
    json.dumps(header, allow_nan=False)  # raises for a number that is not finite
    try:
        check_type(header, Header, collection_check_strategy=CollectionCheckStrategy.ALL_ITEMS)
    except TypeCheckError as error:
        raise SpringfootError(f"in its header, {error}") from None
    config_from_json(header["config"])
    require_count("timesteps", header["timesteps"], 0)
    require_number("seconds", header["seconds"], 0.0, unit="s")
    require_past(header["record"])
    if not header["record"]["sessions"]:
        raise SpringfootError("sessions must be one or more")
    for name, size in header["events"].items():
        require_count(f"size of {name}", size, 0)


def newest_checkpoint(out: Path) -> Checkpoint | None:
    """Return header and arrays of the newest whole checkpoint in the folder `out`; None if it has no checkpoints.

    Damaged ones are renamed to end in `.damaged`, with a warning on standard error. Raises `SpringfootError`, with
    nothing changed, if all are damaged.
    """
    damaged: list[tuple[Path, SpringfootError]] = []
    for path in checkpoints(out):
        try:
            checkpoint = read_checkpoint(path)
        except SpringfootError as error:
            damaged.append((path, error))
            continue
        for damaged_path, reason in damaged:
            damaged_path.replace(damaged_path.with_name(f"{damaged_path.name}.damaged"))
            print(f"Warning: {reason}; going on from {path.name}", file=sys.stderr, flush=True)
        return checkpoint
    if damaged:
        _, reason = damaged[0]
        raise SpringfootError(f"{reason}, and so are all other checkpoints in {out}" if damaged[1:] else reason)
    return None


def _timesteps(path: Path) -> int:
    """Return the timesteps N in the file name `state-N.safetensors` of a checkpoint."""
    match = _NAME.fullmatch(path.name)
    assert match is not None
    return int(match[1])
