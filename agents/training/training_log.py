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
    """Write the configuration to TensorBoard: as a text, and for its table HPARAMS, which compares several runs by
    it."""
    values = config_to_json(config)
    text = "```json\n" + json.dumps(values, indent=2) + "\n```"
    hyperparameters = HParam(_flatten(values), dict.fromkeys(METRICS, 0.0))
    for output in logger.output_formats:
        if isinstance(output, TensorBoardOutputFormat):
            both: dict[str, Any] = {"configuration": text, "hyperparameters": hyperparameters}
            output.write(both, dict.fromkeys(both, ()), 0)  # excluded from no format, at step 0


@contextmanager
def without_writer_tracebacks() -> Iterator[None]:
    """Suppress tracebacks of TensorBoard's writer threads inside the block: their errors are raised again where the
    training waits for them."""
    before = threading.excepthook

    def report(ended: threading.ExceptHookArgs) -> None:
        if not (isinstance(ended.exc_value, OSError) and type(ended.thread).__module__.startswith(_WRITERS)):
            before(ended)

    threading.excepthook = report
    try:
        yield
    finally:
        threading.excepthook = before


def _flatten(values: dict[str, Any], prefix: str = "") -> dict[str, bool | str | float | None]:
    """Return nested dictionaries as one: `{"environment": {"speed": 1.2}}` as `{"environment/speed": 1.2}`.

    Lists become JSON text; entries of None are left out.
    """
    flat: dict[str, bool | str | float | None] = {}
    for name, value in values.items():
        if isinstance(value, dict) and value:
            flat |= _flatten(value, f"{prefix}{name}/")
        elif value is not None:
            flat[f"{prefix}{name}"] = value if isinstance(value, (bool, int, float, str)) else json.dumps(value)
    return flat
