"""Policies: files, networks trained elsewhere, schedules and baselines."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .baselines import CONSTANT_STIFFNESS, PolicyFunction, and_copy, has_feedback, leg_phase, own_settings, schedule
    from .policy import BEST, LAST, RUN, SHIPPED, find_policy

__all__ = [
    "BEST",
    "CONSTANT_STIFFNESS",
    "LAST",
    "RUN",
    "SHIPPED",
    "PolicyFunction",
    "and_copy",
    "find_policy",
    "has_feedback",
    "leg_phase",
    "own_settings",
    "schedule",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "BEST": "policy",
            "CONSTANT_STIFFNESS": "baselines",
            "LAST": "policy",
            "RUN": "policy",
            "SHIPPED": "policy",
            "PolicyFunction": "baselines",
            "and_copy": "baselines",
            "find_policy": "policy",
            "has_feedback": "baselines",
            "leg_phase": "baselines",
            "own_settings": "baselines",
            "schedule": "baselines",
        },
    )
