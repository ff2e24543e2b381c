"""Record walks: a policy's episodes as 100 Hz series, all through one loop."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .open_loop import alike_legs
    from .policies import policy_and_settings, policy_label
    from .recording import (
        BATCH,
        TICK,
        WARM_UP,
        Episodes,
        Recording,
        planned_course,
        record,
        record_each,
        record_feet,
        record_policies,
        record_walk,
        recorded_steps,
    )

__all__ = [
    "BATCH",
    "TICK",
    "WARM_UP",
    "Episodes",
    "Recording",
    "alike_legs",
    "planned_course",
    "policy_and_settings",
    "policy_label",
    "record",
    "record_each",
    "record_feet",
    "record_policies",
    "record_walk",
    "recorded_steps",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "BATCH": "recording",
            "TICK": "recording",
            "WARM_UP": "recording",
            "Episodes": "recording",
            "Recording": "recording",
            "alike_legs": "open_loop",
            "planned_course": "recording",
            "policy_label": "policies",
            "policy_and_settings": "policies",
            "record": "recording",
            "record_each": "recording",
            "record_feet": "recording",
            "record_policies": "recording",
            "record_walk": "recording",
            "recorded_steps": "recording",
        },
    )
