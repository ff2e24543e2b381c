"""What TensorBoard is told of a run beside its curves: the configuration, as a text and as hyperparameters."""

import json
from typing import Any

from stable_baselines3.common.logger import HParam, Logger, TensorBoardOutputFormat

from .config import TrainingConfig, config_to_json

METRICS = ("evaluation/return_mean", "evaluation/falls", "evaluation/seconds_mean")
"""Curves that TensorBoard's table of hyperparameters holds the runs against."""


def log_configuration(logger: Logger, config: TrainingConfig) -> None:
    """Tell TensorBoard the configuration; its table HPARAMS compares several runs by it."""
    values = config_to_json(config)
    text = "```json\n" + json.dumps(values, indent=2) + "\n```"
    hyperparameters = HParam(_flat(values), dict.fromkeys(METRICS, 0.0))
    for output in logger.output_formats:
        if isinstance(output, TensorBoardOutputFormat):
            both: dict[str, Any] = {"configuration": text, "hyperparameters": hyperparameters}
            output.write(both, dict.fromkeys(both, ()), 0)


def _flat(values: dict[str, Any], at: str = "") -> dict[str, bool | str | float | None]:
    """`{"environment": {"speed": 1.2}}` as `{"environment/speed": 1.2}`; lists as text, what is None left out."""
    flat: dict[str, bool | str | float | None] = {}
    for name, value in values.items():
        if isinstance(value, dict) and value:
            flat |= _flat(value, f"{at}{name}/")
        elif value is not None:
            flat[f"{at}{name}"] = value if isinstance(value, (bool, int, float, str)) else json.dumps(value)
    return flat
