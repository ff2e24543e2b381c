"""The walking model in MuJoCo, as Gymnasium environments; importing it registers `SegmentedFootBiped-v0`."""

import gymnasium as gym

from .batch.biped_batch import Biped
from .batch.step_result import TERMINATIONS
from .env import SegmentedFootBiped
from .settings.settings import BipedSettings, body_of, reference_gait, settings_from, settings_to_json
from .vector_env import SegmentedFootBipedVector

__all__ = [
    "TERMINATIONS",
    "Biped",
    "BipedSettings",
    "SegmentedFootBiped",
    "SegmentedFootBipedVector",
    "body_of",
    "reference_gait",
    "settings_from",
    "settings_to_json",
]

gym.register(
    id="SegmentedFootBiped-v0",
    entry_point="springfoot.envs.env:SegmentedFootBiped",
    vector_entry_point="springfoot.envs.vector_env:SegmentedFootBipedVector",
)
