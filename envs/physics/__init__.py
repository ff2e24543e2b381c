"""The body in MuJoCo: model, feet, contacts, simulation, measurement, energy and pictures."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .foot import INTACT, SOUND, Feet, Spring
    from .model import ANKLE, JOINT_RANGE_DEG, JOINTS, LEFT, RIGHT, SIDES, damping_times
    from .timing import ACTION_STEP

__all__ = [
    "ACTION_STEP",
    "ANKLE",
    "INTACT",
    "JOINTS",
    "JOINT_RANGE_DEG",
    "LEFT",
    "RIGHT",
    "SIDES",
    "SOUND",
    "Feet",
    "Spring",
    "damping_times",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "ACTION_STEP": "timing",
            "ANKLE": "model",
            "INTACT": "foot",
            "JOINTS": "model",
            "JOINT_RANGE_DEG": "model",
            "LEFT": "model",
            "RIGHT": "model",
            "SIDES": "model",
            "SOUND": "foot",
            "Feet": "foot",
            "Spring": "foot",
            "damping_times": "model",
        },
    )
