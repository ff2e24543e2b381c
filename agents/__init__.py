"""Train policies by PPO, keep them as files, and define the baselines to compare them with.

A name is imported at its first use: a policy can be loaded and run without torch, and the configuration of a training
needs no simulator.
"""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .policies.baselines import BASELINES, PolicyFunction, baseline
    from .policies.cards import policy_card
    from .policies.conversion import policy_from_mlp, policy_from_sb3
    from .policies.export import export_policy
    from .policies.foreign import ForeignPolicy
    from .policies.policy import Policy, load_policy, read_policy, save_policy
    from .training.config import PRESETS, TrainingConfig
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
    "policy_card",
    "policy_from_mlp",
    "policy_from_sb3",
    "read_policy",
    "resume",
    "save_policy",
    "train",
    "train_seeds",
]

_MODULE = {
    "BASELINES": "policies.baselines",
    "ForeignPolicy": "policies.foreign",
    "PRESETS": "training.config",
    "Policy": "policies.policy",
    "PolicyFunction": "policies.baselines",
    "SegmentedFootBipedVecEnv": "training.sb3_vec_env",
    "TrainingConfig": "training.config",
    "baseline": "policies.baselines",
    "export_policy": "policies.export",
    "load_policy": "policies.policy",
    "policy_card": "policies.cards",
    "policy_from_mlp": "policies.conversion",
    "policy_from_sb3": "policies.conversion",
    "read_policy": "policies.policy",
    "resume": "training.training",
    "save_policy": "policies.policy",
    "train": "training.training",
    "train_seeds": "training.multi_seed",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(__name__, _MODULE)
