"""Read and write the parts of a run besides its learning: the record `run.json`, and TensorBoard's events."""

import os
from collections.abc import Mapping
from math import inf
from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.files.json_file import object_with_digest, read_object
from springfoot.files.writing import write_atomically

from ..policies.policy import RUN
from .config import config_from_json

EVENTS = "events.out.tfevents.*"
"""Pattern of the names of TensorBoard's event files."""
RLLIB = "rllib"
"""Name of the engine in the record of a run that RLlib trained."""


def read_record(out: Path) -> dict[str, Any]:
    """Return the content of run.json in a run's folder; raise `SpringfootError` if it is missing or malformed."""
    record = read_object(out / RUN, "record of a run")
    try:
        if not isinstance(record["config"], dict):
            raise ValueError("config must be an object")
        config_from_json(record["config"])
        require_past(record)
        require_count("timesteps", record.get("timesteps", 0), 0)
        require_number("seconds", record.get("seconds", 0.0), 0.0, unit="s")
        if not isinstance(record.get("best", {}), dict | None):
            raise ValueError("best must be an object or null")
    except (KeyError, TypeError, ValueError) as error:
        raise SpringfootError(f"{out / RUN} is not the record of a run: {error!r}") from None
    return record


def require_past(record: Mapping[str, Any]) -> None:
    """Raise KeyError or ValueError if the past of a run, `sessions` or `evaluations` of its record, is malformed."""
    for name in ("sessions", "evaluations"):
        if not isinstance(record[name], list) or not all(isinstance(entry, dict) for entry in record[name]):
            raise ValueError(f"{name} must be a list of objects")
    remeasured = [session["best"] for session in record["sessions"] if "best" in session]
    if not all(isinstance(best, dict) for best in remeasured):
        raise ValueError("best must be an object")
    for entry in (*record["evaluations"], *remeasured):
        for name in ("timesteps", "return_mean", "return_sd", "falls", "episodes"):
            require_number(name, entry[name], -inf)
    for session in record["sessions"]:
        require_count("from_timesteps", session.get("from_timesteps", 0), 0)


def runs_within(out: Path) -> list[Path]:
    """Return the folders of the runs in a folder of several seeds, in the order of the seeds."""
    folders = (path.parent for path in out.glob(f"seed-*/{RUN}"))
    return sorted(folders, key=lambda path: (len(path.name), path.name))  # seed-9 before seed-10


def write_record(out: Path, record: Mapping[str, Any]) -> None:
    """Write `record` as run.json into the folder `out`, with a digest, whole or not at all."""
    write_atomically(out / RUN, object_with_digest(dict(record)))


def is_of_rllib(record: Mapping[str, Any]) -> bool:
    """Return True if a run's record says that RLlib trained it."""
    engine = record.get("engine")
    return isinstance(engine, dict) and engine.get("name") == RLLIB


def best_of(record: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the entry with the highest mean return of `evaluations_of_one_task`, the first of equal ones; None without
    evaluations."""
    return max(evaluations_of_one_task(record), key=lambda entry: entry["return_mean"], default=None)


def evaluations_of_one_task(record: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the entries of `evaluations` with comparable returns, in their order.

    After a session that changed the task and measured the best policy anew, they are that measurement and the later
    evaluations; earlier ones are left out.
    """
    entries: list[dict[str, Any]] = record["evaluations"]
    for session in reversed(record["sessions"]):
        if "best" in session:
            return [session["best"], *(entry for entry in entries if entry["timesteps"] > session["from_timesteps"])]
    return entries


def same_source(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Return True if two sessions of run.json ran the same code (commit, `modified`) with the same `versions`."""
    return all(one.get(name) == other.get(name) for name in ("commit", "modified", "versions"))


def event_sizes(out: Path) -> dict[str, int]:
    """Return name -> size [bytes] of each of TensorBoard's event files in the folder `out`."""
    return {path.name: path.stat().st_size for path in sorted(out.glob(EVENTS))}


def cut_events(out: Path, sizes: Mapping[str, int]) -> None:
    """Cut the event files to `sizes` [bytes by name], of `event_sizes` at a checkpoint, and remove others.

    A run that is resumed from that checkpoint writes the later events again.
    """
    for path in out.glob(EVENTS):
        size = sizes.get(path.name, 0)  # 0 for a file that did not exist at the checkpoint
        if size == 0:
            path.unlink()
        elif path.stat().st_size > size:
            os.truncate(path, size)
