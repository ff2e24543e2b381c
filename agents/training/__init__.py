"""Training by PPO: configuration, runs, checkpoints, several seeds."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .config import PASSIVE_RANGES, PRESETS, TrainingConfig, config_from_json
    from .multi_seed import Engine, is_finished, train_missing
    from .run_record import read_record

__all__ = [
    "PASSIVE_RANGES",
    "PRESETS",
    "Engine",
    "TrainingConfig",
    "config_from_json",
    "is_finished",
    "read_record",
    "train_missing",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "Engine": "multi_seed",
            "PASSIVE_RANGES": "config",
            "PRESETS": "config",
            "TrainingConfig": "config",
            "config_from_json": "config",
            "is_finished": "multi_seed",
            "read_record": "run_record",
            "train_missing": "multi_seed",
        },
    )
