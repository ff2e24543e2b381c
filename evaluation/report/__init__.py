"""Write the files of an evaluation: tables, figures, pictures, and files for other tools."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .gait_figure import MODEL, PEOPLE, PLAN, PNG, STYLE
    from .gait_table import people_metrics
    from .schedule_tables import schedule_csv, states_json, table_of_states

__all__ = [
    "MODEL",
    "PEOPLE",
    "PLAN",
    "PNG",
    "STYLE",
    "people_metrics",
    "schedule_csv",
    "states_json",
    "table_of_states",
]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "MODEL": "gait_figure",
            "PEOPLE": "gait_figure",
            "PLAN": "gait_figure",
            "PNG": "gait_figure",
            "STYLE": "gait_figure",
            "people_metrics": "gait_table",
            "schedule_csv": "schedule_tables",
            "states_json": "schedule_tables",
            "table_of_states": "schedule_tables",
        },
    )
