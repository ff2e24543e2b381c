"""Define the settings of the walking task, and the feet that they name."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .checks import LONGEST_EPISODE
    from .feet import FOOT_SETTINGS, KINDS, SPRING_NUMBERS, FootSetting, foot_setting
    from .settings import (
        CONDITION_SETTINGS,
        DRAWN_SETTINGS,
        THEME_OF,
        THEMES,
        BipedSettings,
        Feedforward,
        body_of,
        reference_gait,
        settings_from,
        settings_to_json,
    )

__all__ = [
    "CONDITION_SETTINGS",
    "DRAWN_SETTINGS",
    "FOOT_SETTINGS",
    "KINDS",
    "LONGEST_EPISODE",
    "SPRING_NUMBERS",
    "THEMES",
    "THEME_OF",
    "BipedSettings",
    "Feedforward",
    "FootSetting",
    "body_of",
    "foot_setting",
    "reference_gait",
    "settings_from",
    "settings_to_json",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "CONDITION_SETTINGS": "settings",
            "DRAWN_SETTINGS": "settings",
            "FOOT_SETTINGS": "feet",
            "KINDS": "feet",
            "LONGEST_EPISODE": "checks",
            "SPRING_NUMBERS": "feet",
            "THEMES": "settings",
            "THEME_OF": "settings",
            "BipedSettings": "settings",
            "Feedforward": "settings",
            "FootSetting": "feet",
            "body_of": "settings",
            "foot_setting": "feet",
            "reference_gait": "settings",
            "settings_from": "settings",
            "settings_to_json": "settings",
        },
    )
