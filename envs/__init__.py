"""The walking model in MuJoCo, as Gymnasium environments; importing it registers `SegmentedFootBiped-v0`."""

import gymnasium as gym

from .settings import BipedSettings, settings_from, settings_to_json

__all__ = ["BipedSettings", "settings_from", "settings_to_json"]

gym.register(
    id="SegmentedFootBiped-v0",
    entry_point="springfoot.envs.faces:SegmentedFootBiped",
    vector_entry_point="springfoot.envs.vector:SegmentedFootBipedVector",
)
