"""Turn recorded walks into a verdict: how human a walk is.

A name is imported at its first use: drawing needs matplotlib and Pillow, criteria and curves need no simulator.
"""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .numbers.criteria import HUMAN_LIKE, WALKS, Criterion, unmet
    from .numbers.curves import StrideCurves
    from .numbers.metrics import Gait, measure
    from .recording.open_loop import open_loop_copy
    from .recording.policies import policy_and_settings
    from .recording.recording import Recording, load_recording, record, record_each
    from .report.animation import save_animation
    from .report.gait_figure import save_gait_figure
    from .report.gait_table import print_table
    from .report.report import write_gait_cycle, write_report

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
    "policy_and_settings",
    "print_table",
    "record",
    "record_each",
    "save_animation",
    "save_gait_figure",
    "unmet",
    "write_gait_cycle",
    "write_report",
]

_MODULE = {
    "Criterion": "numbers.criteria",
    "Gait": "numbers.metrics",
    "HUMAN_LIKE": "numbers.criteria",
    "Recording": "recording.recording",
    "StrideCurves": "numbers.curves",
    "WALKS": "numbers.criteria",
    "load_recording": "recording.recording",
    "measure": "numbers.metrics",
    "open_loop_copy": "recording.open_loop",
    "policy_and_settings": "recording.policies",
    "print_table": "report.gait_table",
    "record": "recording.recording",
    "record_each": "recording.recording",
    "save_animation": "report.animation",
    "save_gait_figure": "report.gait_figure",
    "unmet": "numbers.criteria",
    "write_gait_cycle": "report.report",
    "write_report": "report.report",
}

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(__name__, _MODULE)
