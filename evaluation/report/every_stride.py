"""Write every_stride.csv and every_stride.parquet: the curves of each stride, one row for each percent.

Parquet needs pyarrow (extra `parquet`); other tools read it a hundred times faster than text.
"""

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.settings import body_of
from springfoot.gait.people.gait_events import PERCENT

from ..numbers.series import GAIT_CYCLE_COLUMNS, foot_contacts, stride_curves, strides_within
from ..recording.recording import Recording

STRIDE_KEYS = ("episode", "side", "stride", "begin_s", "stride_time_s", "fell", "percent")
"""Columns that identify the stride of a row, before `GAIT_CYCLE_COLUMNS`."""


def write_every_stride(folder: Path, recording: Recording) -> None:
    """Write `every_stride.csv` of a recording into `folder`, and `every_stride.parquet` where pyarrow is installed."""
    strides = list(each_stride(recording))
    with (folder / "every_stride.csv").open("w", encoding="utf-8", newline="") as file:
        file.write(",".join((*STRIDE_KEYS, *GAIT_CYCLE_COLUMNS)) + "\n")
        for keys, curves in strides:
            stride_cells = ",".join(str(value) for value in keys.values())
            pattern = ",".join(["%.7g"] * curves.shape[1])  # seven digits: all that float32 has
            rows = map(tuple, curves.tolist())
            file.writelines(f"{stride_cells},{percent},{pattern % row}\n" for percent, row in enumerate(rows))
    if find_spec("pyarrow") is not None:
        _write_parquet(folder / "every_stride.parquet", strides)


def each_stride(recording: Recording) -> Iterator[tuple[dict[str, Any], NDArray]]:
    """Yield each stride behind the mean curves: the values of `STRIDE_KEYS` without percent, and its curves (101, C).

    Curves are float32, in the order of `GAIT_CYCLE_COLUMNS`.
    """
    body = body_of(recording.settings)
    for episode, ticks in enumerate(recording.ticks.tolist()):
        if not ticks:
            continue
        series = recording.episode(episode)
        fell = int(recording.fall_reason[episode] != "")
        for side, foot in enumerate(foot_contacts(series["force"][..., 1].sum(axis=2), body)):
            strides = strides_within(foot, recording.measured_span)
            curves = stride_curves(series, side, body, strides).astype(np.float32)
            for stride, ((start, _, stop), curve) in enumerate(zip(strides.tolist(), curves, strict=True)):
                key_values = (episode, SIDES[side], stride, round(start, 6), round(stop - start, 6), fell)
                yield dict(zip(STRIDE_KEYS, key_values, strict=False)), curve  # the last key, percent, is the row's


def _write_parquet(path: Path, strides: Sequence[tuple[dict[str, Any], NDArray]]) -> None:
    """Write the strides of `each_stride` as a Parquet table, a row for each percent of each stride; needs pyarrow."""
    import pyarrow as pa  # pyright: ignore[reportMissingImports]  # optional
    import pyarrow.parquet as pq  # pyright: ignore[reportMissingImports]

    # Types of `STRIDE_KEYS` but the last one, percent, which differs between a stride's rows.
    kinds = (pa.int32(), pa.string(), pa.int32(), pa.float64(), pa.float64(), pa.int8())
    columns = {
        name: pa.array([keys[name] for keys, _ in strides for _ in PERCENT], kind)
        for name, kind in zip(STRIDE_KEYS, kinds, strict=False)
    }
    columns["percent"] = pa.array(np.tile(PERCENT, len(strides)), pa.int8())
    # The empty first part gives a walk without strides its columns.
    curves = np.concatenate([np.empty((0, len(GAIT_CYCLE_COLUMNS)), np.float32), *(curve for _, curve in strides)])
    columns |= {name: pa.array(curve) for name, curve in zip(GAIT_CYCLE_COLUMNS, curves.T, strict=True)}
    pq.write_table(pa.table(columns), path, compression="zstd")
