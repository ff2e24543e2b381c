"""Describe how people walk: curves by walking speed or from files of your own, their strides, and scores against
them.
"""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .checks import AS_IT_IS
    from .gait_events import CONTACT_THRESHOLD_BW, PERCENT, Contacts, find_contacts, find_steps, on_percent, sample
    from .human import COLUMNS, STEP_TIME_RATIO_RANGE, HumanGait, human_gait
    from .measured_person import PARTLY, MeasuredPerson, read_person
    from .motion_files import FILE_CURVES
    from .own_data import TOE_OFF_COLUMN, read_gait
    from .scores import (
        LOADING_END_PERCENT,
        PUSH_OFF_BEGIN_PERCENT,
        correlation,
        force_features,
        mean_sd,
        rmse,
        stride_work,
    )
    from .strides import FILTER, FINE_PERCENT

__all__ = [
    "AS_IT_IS",
    "COLUMNS",
    "CONTACT_THRESHOLD_BW",
    "FILE_CURVES",
    "FILTER",
    "FINE_PERCENT",
    "LOADING_END_PERCENT",
    "PARTLY",
    "PERCENT",
    "PUSH_OFF_BEGIN_PERCENT",
    "STEP_TIME_RATIO_RANGE",
    "TOE_OFF_COLUMN",
    "Contacts",
    "HumanGait",
    "MeasuredPerson",
    "correlation",
    "find_contacts",
    "find_steps",
    "force_features",
    "human_gait",
    "mean_sd",
    "on_percent",
    "read_gait",
    "read_person",
    "rmse",
    "sample",
    "stride_work",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "AS_IT_IS": "checks",
            "COLUMNS": "human",
            "FILTER": "strides",
            "FINE_PERCENT": "strides",
            "TOE_OFF_COLUMN": "own_data",
            "FILE_CURVES": "motion_files",
            "MeasuredPerson": "measured_person",
            "PARTLY": "measured_person",
            "read_person": "measured_person",
            "CONTACT_THRESHOLD_BW": "gait_events",
            "LOADING_END_PERCENT": "scores",
            "PERCENT": "gait_events",
            "PUSH_OFF_BEGIN_PERCENT": "scores",
            "STEP_TIME_RATIO_RANGE": "human",
            "Contacts": "gait_events",
            "HumanGait": "human",
            "correlation": "scores",
            "find_contacts": "gait_events",
            "find_steps": "gait_events",
            "force_features": "scores",
            "human_gait": "human",
            "mean_sd": "scores",
            "on_percent": "gait_events",
            "read_gait": "own_data",
            "rmse": "scores",
            "sample": "gait_events",
            "stride_work": "scores",
        },
    )
