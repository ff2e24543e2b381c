"""Train a policy in a folder as a part of a study that goes on after a stop."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from springfoot.agents.policies import RUN
from springfoot.agents.training import TrainingConfig, config_from_json, is_finished, read_record
from springfoot.errors import SpringfootError


def finish_training(
    config: TrainingConfig,
    folder: Path,
    begin_from: str | None = None,
    callbacks: Sequence[Callable[[dict[str, Any]], Any]] = (),
) -> None:
    """Train a policy in `folder`, or go on with its training there; do nothing if that is finished.

    `begin_from` and `callbacks` are those of `springfoot.agents.train`. Raises `SpringfootError` if the folder holds a
    training of another configuration, and `KeyboardInterrupt` if the user stops it.
    """
    from springfoot.agents import resume, train  # torch takes seconds, which --help need not wait for

    begun = (folder / RUN).is_file()
    if begun and replace(config_from_json(read_record(folder)["config"]), threads=config.threads) != config:
        raise SpringfootError(f"{folder} was trained with other settings; choose another folder")
    if begun and is_finished(folder):
        return
    if begun:
        record = resume(folder, threads=config.threads, callbacks=callbacks)
    else:
        record = train(config, folder, callbacks, begin_from)
    if record["status"] == "interrupted":
        raise KeyboardInterrupt
