"""The tidy tables of every stride: text and Parquet say the same, and their means are the mean curves."""

import csv

import numpy as np
import pytest

from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.numbers.series import GAIT_CYCLE_COLUMNS
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.every_stride import STRIDE_KEYS, each_stride, write_every_stride


def walked(name, **given):
    policy, settings = policy_and_settings(name, {"episode_seconds": 6.0} | given)
    return record(policy, settings, name=name, episodes=3, threads=1)


@pytest.fixture(scope="module")
def walk():
    return walked("schedule", push_newton=100.0)


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_its_means_are_the_mean_curves(walk, tmp_path):
    write_every_stride(tmp_path, walk)
    rows, gait = rows_of(tmp_path / "every_stride.csv"), measure(walk)
    assert tuple(rows[0]) == (*STRIDE_KEYS, *GAIT_CYCLE_COLUMNS)
    count = gait.metrics["strides"]["count"]
    assert count > 5 and len(rows) == 101 * count
    for side, curves in zip(("left", "right"), gait.feet, strict=True):
        knee = [float(row["knee_flexion_deg"]) for row in rows if row["side"] == side and row["percent"] == "40"]
        assert len(knee) == curves.count
        assert np.mean(knee) == pytest.approx(curves.mean("knee_flexion_deg")[40], rel=1e-5)
        assert np.std(knee, ddof=1) == pytest.approx(curves.sd("knee_flexion_deg")[40], rel=1e-4)
    times = {(row["episode"], row["side"], row["stride"]): float(row["stride_time_s"]) for row in rows}
    assert np.mean(list(times.values())) == pytest.approx(120 / gait.metrics["cadence_steps_min"], rel=0.01)


def test_strides_of_a_leg_follow_each_other(walk):
    for side in ("left", "right"):
        mine = [keys for keys, _ in each_stride(walk) if keys["side"] == side and keys["episode"] == 1]
        assert [keys["stride"] for keys in mine] == list(range(len(mine)))
        ends = [keys["begin_s"] + keys["stride_time_s"] for keys in mine]
        assert [keys["begin_s"] for keys in mine[1:]] == pytest.approx(ends[:-1], abs=1e-5)
        assert mine[0]["begin_s"] >= 3.0 and ends[-1] <= 6.0  # after the warm-up


def test_parquet_says_the_same(walk, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra parquet: pip install pyarrow")
    write_every_stride(tmp_path, walk)
    table = parquet.read_table(tmp_path / "every_stride.parquet")
    rows = rows_of(tmp_path / "every_stride.csv")
    assert table.column_names == list(rows[0])
    for name in table.column_names:
        values = table[name].to_pylist()
        if name == "side":
            assert values == [row[name] for row in rows]
        else:
            assert values == pytest.approx([float(row[name]) for row in rows], rel=1e-6, abs=1e-9), name


def test_a_walk_without_strides_has_a_table_without_rows(tmp_path):
    write_every_stride(tmp_path, walked("thesis_printed"))
    assert rows_of(tmp_path / "every_stride.csv") == []
    if (tmp_path / "every_stride.parquet").exists():
        import pyarrow.parquet  # pyright: ignore[reportMissingImports]  # optional

        assert pyarrow.parquet.read_table(tmp_path / "every_stride.parquet").num_rows == 0


def test_without_pyarrow_there_is_text_alone(walk, tmp_path, monkeypatch):
    monkeypatch.setattr("springfoot.evaluation.report.every_stride.find_spec", lambda name: None)
    write_every_stride(tmp_path, walk)
    assert [path.name for path in tmp_path.iterdir()] == ["every_stride.csv"]
