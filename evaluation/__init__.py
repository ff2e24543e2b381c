"""From recorded walks to a verdict: how human a walk is.

What draws imports matplotlib and Pillow; it is imported when first asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from springfoot.extras import naming_extras

from .criteria import HUMAN_LIKE, WALKS, Criterion, unmet
from .metrics import Gait, measure
from .open_loop import open_loop_copy
from .policies import prepare
from .recording import Recording, load_recording, record, record_each
from .stride_curves import StrideCurves

if TYPE_CHECKING:
    from .animation import save_animation
    from .gait_figure import save_gait_figure
    from .gait_table import print_table
    from .report import write_gait_cycle, write_report

__all__ = [
    "HUMAN_LIKE",
    "WALKS",
    "Criterion",
    "Gait",
    "Recording",
    "StrideCurves",
    "load_recording",
    "measure",
    "open_loop_copy",
    "prepare",
    "print_table",
    "record",
    "record_each",
    "save_animation",
    "save_gait_figure",
    "unmet",
    "write_gait_cycle",
    "write_report",
]

_DRAWS = {
    "print_table": "gait_table",
    "save_animation": "animation",
    "save_gait_figure": "gait_figure",
    "write_gait_cycle": "report",
    "write_report": "report",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists

    def __getattr__(name: str) -> Any:
        if name not in _DRAWS:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        with naming_extras():
            return getattr(import_module(f"{__name__}.{_DRAWS[name]}"), name)
