"""Begin or resume a training in a folder that holds its policies, its state and its results; `session` runs it.

`best.safetensors` and `last.safetensors` are policies, `state-N.safetensors` the checkpoint after N timesteps;
`run.json` holds the configuration that repeats the run, and its results; TensorBoard's event files stand beside them.
Each file is written whole or not at all. A resumed run starts from the newest checkpoint and writes all other files
again.
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

from ..policies.policy import BEST, LAST, RUN, SHIPPED, Policy, read_policy
from .callbacks import UserCallback
from .checkpoint import Checkpoint, newest_checkpoint
from .config import Device, TrainingConfig, config_from_json, config_to_json
from .run_record import is_of_rllib, read_record, runs_within
from .session import BEST_FILE, Session


def train(
    config: TrainingConfig,
    out: str | Path,
    callbacks: Sequence[UserCallback] = (),
    begin_from: str | Path | None = None,
) -> dict[str, Any]:
    """Train a new policy in the new folder `out`; return the content of `run.json`.

    Each of `callbacks` is a stable-baselines3 callback, or a function called after each periodic evaluation with that
    evaluation's entry of `run.json` (a dictionary). One that returns False ends the training, with status
    `interrupted`. The first SIGINT or SIGTERM also ends it in good order: status `interrupted`, policies usable. A
    second one ends it at once. With `begin_from`, a run's folder, the network and the running statistics begin as that
    run's newest checkpoint has them; with a policy, its file or name, critic and exploration are untrained. Raises
    `SpringfootError`, with nothing written, if `out` exists and is not an empty folder, if another process writes into
    it, or if that network does not fit.
    """
    out = require_new(out)
    begin = None if begin_from is None else _beginning(begin_from)
    with owned(out):
        remove_temporary(require_new(out))  # checked again, now that no other process can write into it
        return Session(config, out, {"sessions": [], "evaluations": []}, callbacks=callbacks, begin=begin).learn()


def _beginning(source: str | Path) -> Checkpoint | Policy:
    """Return the beginning of another training: the newest checkpoint of the run in the folder `source`, or the policy
    in that file or of that name.

    Raises `SpringfootError` if there is none.
    """
    if str(source) in SHIPPED or Path(source).is_file():
        return read_policy(source)
    checkpoint = newest_checkpoint(Path(source)) if Path(source).is_dir() else None
    if checkpoint is None:
        raise SpringfootError(f"{source} holds no checkpoint to begin from: give the folder of a run, or a policy")
    return checkpoint


def resume(
    out: str | Path,
    timesteps: int | None = None,
    threads: int | None = None,
    callbacks: Sequence[UserCallback] = (),
    reward_weights: Mapping[str, float] | None = None,
    device: Device | None = None,
) -> dict[str, Any]:
    """Continue the run in `out` with its saved settings; return the content of `run.json`.

    Args:
        out: the run's folder.
        timesteps: how many more to train after those already done, the step size falling linearly to the new end;
            None finishes an interrupted run.
        threads: threads of the physics in place of the saved number; results are the same with any.
        callbacks: as for `train`; their state is not part of the checkpoint.
        reward_weights: weights of the reward from here on, in place of the saved ones of the same names. The best
            policy is measured anew by them, and the session in `run.json` keeps the saved ones as `changed_from`.
        device: processor of the network from here on, in place of the saved one.

    Starts from the newest whole checkpoint, and ends with the bits of an uninterrupted run, on the same versions and a
    processor of the same instructions; not on a GPU, where random numbers begin anew. Completes whatever an earlier end
    left unfinished in the folder. Raises `SpringfootError` for a folder without a run, and for a run that is finished,
    that another process writes, or that this version cannot continue.
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
        checkpoint = newest_checkpoint(out)
        if checkpoint is None and any("begun_from" in session for session in record["sessions"]):
            raise SpringfootError(f"{out} was stopped before its first checkpoint: train it anew")
        if checkpoint is None and record.get("timesteps"):
            raise SpringfootError(f"{out} holds no run to continue: no state-{record['timesteps']}.safetensors in it")
        header = checkpoint[0] if checkpoint else {"timesteps": 0, "record": {"sessions": [], "evaluations": []}}
        done = header["timesteps"]
        config = config_from_json(record["config"])
        if reward_weights is not None:
            weights = config.environment.reward_weights | dict(reward_weights)
            settings = settings_to_json(config.environment) | {"reward_weights": weights}
            config = dataclasses.replace(config, environment=settings_from(**settings))
        total = config.timesteps if timesteps is None else done + timesteps
        if total <= done and checkpoint and _is_complete(out, record, checkpoint):
            raise SpringfootError(f"{out} has done its {done:,} timesteps; timesteps must say how many more to train")
        if checkpoint:
            _require_same_shape(out, header["config"], config_to_json(config))
        config = dataclasses.replace(config, timesteps=total, device=device or config.device)
        return Session(config, out, header["record"], checkpoint, threads, callbacks).learn()


def _require_same_shape(out: Path, of_checkpoint: Mapping[str, Any], of_record: Mapping[str, Any]) -> None:
    """Raise `SpringfootError` if the configurations of checkpoint and run.json differ in a setting that decides the
    shape of the arrays; `out` is the run's folder."""
    of_checkpoint = {"mirrored": False, **of_checkpoint}  # as before it was a setting
    for name in ("num_envs", "hidden", "mirrored"):
        if of_checkpoint[name] != of_record[name]:
            raise SpringfootError(
                f"{out} was trained with {name} {of_checkpoint[name]}; its {RUN} says {of_record[name]}"
            )


def _is_complete(out: Path, record: dict[str, Any], checkpoint: Checkpoint) -> bool:
    """Return True if the run in `out` is finished, and its `record` and policies agree with its last `checkpoint`.

    Otherwise the run was killed as it wrote them, and a session of no steps has to write them again.
    """
    header, arrays = checkpoint
    same_record = all(record.get(name) == value for name, value in header["record"].items())
    evaluations = record["evaluations"]
    evaluated = bool(evaluations) and evaluations[-1]["timesteps"] == header["timesteps"]
    same_best = has_content(out / BEST, arrays[BEST_FILE].tobytes())
    return same_record and evaluated and same_best and (out / LAST).is_file() and record.get("status") == "finished"
