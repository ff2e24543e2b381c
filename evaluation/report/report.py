"""Write the files of an evaluation into its folder.

metrics.json                    every number
gait_cycle.csv, _left, _right   mean curves over percent of stride, and their spread
strides.npz                     the 100 Hz series behind all of it
every_stride.csv, .parquet      the curves of each stride
gait.png, stiffness.png, walk.gif   pictures
stiffness_schedule.csv, finite_states.json (or _left, _right)   K and theta_eq as tables, which are policies again
walk.mot, walk.sto, external_loads.xml, model.xml   the walk for OpenSim, the body for MuJoCo
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from springfoot.files.writing import csv_text
from springfoot.gait.people.gait_events import PERCENT

from ..numbers.curves import StrideCurves
from ..numbers.metrics import Gait
from ..recording.recording import Recording
from .animation import save_animation
from .every_stride import write_every_stride
from .exports import write_model, write_opensim
from .gait_figure import save_gait_figure, save_stiffness_figure
from .schedule_tables import write_schedules

FILES = (
    "metrics.json",
    "gait_cycle.csv",
    "gait_cycle_left.csv",
    "gait_cycle_right.csv",
    "every_stride.csv",
    "every_stride.parquet",
    "strides.npz",
    "gait.png",
    "stiffness.png",
    "walk.gif",
    "stiffness_schedule.csv",
    "finite_states.json",
    "finite_states_left.json",
    "finite_states_right.json",
    "walk.mot",
    "walk.sto",
    "external_loads.xml",
    "model.xml",
)
"""Files of an evaluation, which has one or two tables of finite states, or none, and Parquet only with pyarrow."""


def write_report(
    folder: Path, recording: Recording, gait: Gait, progress: Callable[[float], object] = lambda share: None
) -> None:
    """Write every file of an evaluation into the existing `folder`; call `progress` with the fraction newly done."""
    writers: tuple[Callable[[], object], ...] = (
        lambda: _write_numbers(folder, recording, gait),
        lambda: save_gait_figure(folder / "gait.png", recording, gait),
        lambda: save_stiffness_figure(folder / "stiffness.png", gait),
        lambda: save_animation(folder / "walk.gif", recording),
        lambda: write_every_stride(folder, recording),
        lambda: write_schedules(folder, recording),
        lambda: write_opensim(folder, recording),
        lambda: write_model(folder / "model.xml", recording),
    )
    for write in writers:
        write()
        progress(1 / len(writers))


def _write_numbers(folder: Path, recording: Recording, gait: Gait) -> None:
    """Write metrics.json, the tables of the gait cycle, and strides.npz."""
    text = json.dumps(gait.metrics, indent=2, allow_nan=False, ensure_ascii=False)
    (folder / "metrics.json").write_text(text + "\n", encoding="utf-8")
    left, right = gait.feet
    for name, curves in (("gait_cycle", gait.both), ("gait_cycle_left", left), ("gait_cycle_right", right)):
        write_gait_cycle(folder / f"{name}.csv", curves, gait.metrics)
    recording.save(folder / "strides.npz")


def write_gait_cycle(path: Path, curves: StrideCurves, metrics: dict[str, Any]) -> None:
    """Write one gait_cycle.csv: a row for each percent of the stride, each curve's mean and `_sd` over strides, empty
    where missing.

    `curves` are those of both legs or of one, `metrics` is the content of metrics.json. The leading columns repeat the
    whole gait's values on each row, as in the reference data.
    """
    cadence = metrics["cadence_steps_min"]
    leading = {
        "speed_m_s": metrics["speed_m_s"]["mean"],
        "condition": metrics["policy"],
        "source": "springfoot",
        "n": curves.count,
        "stride_time_s": 2 * 60 / cadence if cadence else None,
        "step_length_m": metrics["step_length_m"],
        "toe_off_percent": metrics["toe_off_percent"],
    }
    columns = {}
    for name in curves.names:
        columns[name] = curves.mean(name)
        columns[f"{name}_sd"] = curves.sd(name)
    rows = ([percent, *leading.values(), *(column[percent] for column in columns.values())] for percent in PERCENT)
    path.write_text(csv_text(["percent", *leading, *columns], rows), encoding="utf-8", newline="")
