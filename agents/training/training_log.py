"""Write the configuration of a run to TensorBoard, as a text and as hyperparameters."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from stable_baselines3.common.logger import HParam, Logger, TensorBoardOutputFormat

from .config import TrainingConfig, config_to_json

_WRITERS = "tensorboard"
"""Package of the thread that writes events."""
METRICS = ("evaluation/return_mean", "evaluation/falls", "evaluation/seconds_mean")
"""Curves by which TensorBoard's table of hyperparameters compares runs."""


def log_configuration(logger: Logger, config: TrainingConfig) -> None:
    """Write the configuration to TensorBoard; its table HPARAMS compares several runs by it."""
    values = config_to_json(config)
    text = "```json\n" + json.dumps(values, indent=2) + "\n```"
    hyperparameters = HParam(_flat(values), dict.fromkeys(METRICS, 0.0))
    for output in logger.output_formats:
        if isinstance(output, TensorBoardOutputFormat):
            both: dict[str, Any] = {"configuration": text, "hyperparameters": hyperparameters}
            output.write(both, dict.fromkeys(both, ()), 0)


@contextmanager
def no_word_of_writers() -> Iterator[None]:
    """Suppress tracebacks of TensorBoard's writer threads inside the block; waiting for such a thread raises its error
    anyway."""
    before = threading.excepthook

    def told(ended: threading.ExceptHookArgs) -> None:
        if not (isinstance(ended.exc_value, OSError) and type(ended.thread).__module__.startswith(_WRITERS)):
            before(ended)

    threading.excepthook = told
    try:
        yield
    finally:
        threading.excepthook = before


def _flat(values: dict[str, Any], at: str = "") -> dict[str, bool | str | float | None]:
    """Return `{"environment": {"speed": 1.2}}` as `{"environment/speed": 1.2}`; lists as text, without entries of
    None."""
    flat: dict[str, bool | str | float | None] = {}
    for name, value in values.items():
        if isinstance(value, dict) and value:
            flat |= _flat(value, f"{at}{name}/")
        elif value is not None:
            flat[f"{at}{name}"] = value if isinstance(value, (bool, int, float, str)) else json.dumps(value)
    return flat
