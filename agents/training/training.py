"""Run a training, new or resumed, in a folder that holds its policies, its state and its results.

`best.safetensors` and `last.safetensors` are policies, `state-N.safetensors` the checkpoint after N timesteps;
`run.json` holds the configuration that repeats the run, and its results; TensorBoard's event files stand beside them.
Each file is written whole or not at all. A checkpoint decides everything after it; a resumed run makes all other files
again from it.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from springfoot.envs.settings.settings import settings_from, settings_to_json
from springfoot.errors import SpringfootError
from springfoot.files.locks import owned
from springfoot.files.text_table import has_content
from springfoot.files.writing import remove_temporary, require_new

from ..policies.policy import BEST, LAST, RUN
from .callbacks import Onlooker
from .checkpoint import Checkpoint, newest_checkpoint
from .config import TrainingConfig, config_from_json, config_to_json
from .run_record import is_of_rllib, read_record, runs_within
from .session import BEST_FILE, Session


def train(config: TrainingConfig, out: str | Path, callbacks: Sequence[Onlooker] = ()) -> dict[str, Any]:
    """Train a new policy in the new folder `out`; return the content of `run.json`.

    `callbacks` watch: stable-baselines3's, and functions of each periodic evaluation, a dictionary as in `run.json`. A
    callback that returns False ends the training, with status `interrupted`. The training ends early, with status
    `interrupted` and usable policies, at the first SIGINT or SIGTERM, and at the second at once. Raises
    `SpringfootError`, with nothing written, if `out` exists and is not an empty folder, or if another process writes
    into it.
    """
    out = require_new(out)
    with owned(out):
        remove_temporary(require_new(out))
        return Session(config, out, {"sessions": [], "evaluations": []}, callbacks=callbacks).learn()


def resume(
    out: str | Path,
    timesteps: int | None = None,
    threads: int | None = None,
    callbacks: Sequence[Onlooker] = (),
    reward_weights: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Continue the run in `out` with its saved settings; return the content of `run.json`.

    Args:
        out: the run's folder.
        timesteps: how many more to train after those already done, the step size falling linearly to the new end;
            None finishes an interrupted run.
        threads: of the physics in place of the saved ones; results are the same with any number.
        callbacks: as for `train`; they keep their own state.
        reward_weights: of the reward from here on, in place of the saved ones. The best policy is measured anew by
            them, and the session in `run.json` keeps the saved ones as `changed_from`.

    Starts from the newest whole checkpoint, and ends with the bits of an uninterrupted run, on the same versions and a
    processor of the same instructions. Completes whatever an earlier end left unfinished in the folder. Raises
    `SpringfootError` for a folder without a run, and for a run that is finished, that another process writes, or that
    this version cannot continue.
    """
    out = Path(out)
    if not (out / RUN).is_file():
        within = ", ".join(map(str, runs_within(out)))
        several = f"; its runs are {within}" if within else ""
        raise SpringfootError(f"{out} holds no run to continue: no {RUN} in it{several}")
    with owned(out):
        remove_temporary(out)
        record = read_record(out)
        if is_of_rllib(record):
            raise SpringfootError(f"{out} was trained by RLlib: continue it by springfoot train --resume {out}")
        found = newest_checkpoint(out)
        if found is None and record.get("timesteps"):
            raise SpringfootError(f"{out} holds no run to continue: no state-{record['timesteps']}.safetensors in it")
        done = found[0]["timesteps"] if found else 0
        config = config_from_json(record["config"])
        if reward_weights is not None:
            settings = settings_to_json(config.environment) | {"reward_weights": dict(reward_weights)}
            config = dataclasses.replace(config, environment=settings_from(**settings))
        total = config.timesteps if timesteps is None else done + timesteps
        if total <= done and found and _in_order(out, record, found):
            raise SpringfootError(f"{out} has done its {done:,} timesteps; timesteps must say how many more to train")
        if found:
            _require_shape(out, found[0]["config"], config_to_json(config))
        told = found[0]["record"] if found else {"sessions": [], "evaluations": []}
        return Session(dataclasses.replace(config, timesteps=total), out, told, found, threads, callbacks).learn()


def _require_shape(out: Path, trained: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """Raise `SpringfootError` if the record has other settings of the shape of a state than the trained ones."""
    for name in ("num_envs", "hidden"):
        if trained[name] != asked[name]:
            raise SpringfootError(f"{out} was trained with {name} {trained[name]}; its {RUN} says {asked[name]}")


def _in_order(out: Path, record: dict[str, Any], found: Checkpoint) -> bool:
    """Tell whether the files of a run that has done its timesteps agree with its last checkpoint."""
    header, arrays = found
    told = all(record.get(name) == value for name, value in header["record"].items())
    evaluated = [entry["timesteps"] for entry in record["evaluations"]][-1:] == [header["timesteps"]]
    best = has_content(out / BEST, arrays[BEST_FILE].tobytes())
    return told and evaluated and best and (out / LAST).is_file() and record.get("status") == "finished"
