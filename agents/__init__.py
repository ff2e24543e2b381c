"""What needs a learner: training by PPO, policies as files, and the baselines they are held against.

Training and the stable-baselines3 environment import torch; they are imported when first asked for, so that a policy
can be loaded and run where torch is not installed.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from springfoot.extras import naming_extras

with naming_extras():
    from .policies.baselines import BASELINES, PolicyFunction, baseline
    from .policies.conversion import policy_from_mlp, policy_from_sb3
    from .policies.export import export_policy
    from .policies.foreign import ForeignPolicy
    from .policies.policy import Policy, load_policy, read_policy, save_policy
    from .training.config import PRESETS, TrainingConfig

if TYPE_CHECKING:
    from .training.multi_seed import train_seeds
    from .training.sb3_vec_env import SegmentedFootBipedVecEnv
    from .training.training import resume, train

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
    "SegmentedFootBipedVecEnv": "training.sb3_vec_env",
    "resume": "training.training",
    "train": "training.training",
    "train_seeds": "training.multi_seed",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists

    def __getattr__(name: str) -> Any:
        if name not in _NEEDS_TORCH:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        with naming_extras():
            return getattr(import_module(f"{__name__}.{_NEEDS_TORCH[name]}"), name)
