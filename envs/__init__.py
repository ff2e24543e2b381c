"""The walking model in MuJoCo, as Gymnasium environments; importing it registers `SegmentedFootBiped-v0`."""

import gymnasium as gym

from .biped import Biped
from .faces import SegmentedFootBiped
from .settings import BipedSettings, settings_from, settings_to_json
from .vector import SegmentedFootBipedVector

__all__ = [
    "Biped",
    "BipedSettings",
    "SegmentedFootBiped",
    "SegmentedFootBipedVector",
    "settings_from",
    "settings_to_json",
]

gym.register(
    id="SegmentedFootBiped-v0",
    entry_point="springfoot.envs.faces:SegmentedFootBiped",
    vector_entry_point="springfoot.envs.vector:SegmentedFootBipedVector",
)
