"""What needs a learner: training by PPO, policies as files, and the baselines they are held against.

Training and the stable-baselines3 environment import torch; they are imported when first asked for, so that a policy
can be loaded and run where torch is not installed.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from springfoot.extras import naming_extras

with naming_extras():
    from .baselines import BASELINES, PolicyFunction, baseline
    from .config import PRESETS, TrainingConfig
    from .conversion import policy_from_mlp, policy_from_sb3
    from .export import export_policy
    from .foreign_policy import ForeignPolicy
    from .policy import Policy, load_policy, read_policy, save_policy

if TYPE_CHECKING:
    from .multi_seed import train_seeds
    from .sb3_vec_env import SegmentedFootBipedVecEnv
    from .training import resume, train

__all__ = [
    "BASELINES",
    "PRESETS",
    "ForeignPolicy",
    "Policy",
    "PolicyFunction",
    "SegmentedFootBipedVecEnv",
    "TrainingConfig",
    "baseline",
    "export_policy",
    "load_policy",
    "policy_from_mlp",
    "policy_from_sb3",
    "read_policy",
    "resume",
    "save_policy",
    "train",
    "train_seeds",
]

_NEEDS_TORCH = {
    "SegmentedFootBipedVecEnv": "sb3_vec_env",
    "resume": "training",
    "train": "training",
    "train_seeds": "multi_seed",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists

    def __getattr__(name: str) -> Any:
        if name not in _NEEDS_TORCH:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        with naming_extras():
            return getattr(import_module(f"{__name__}.{_NEEDS_TORCH[name]}"), name)
