"""The study of many bodies at many speeds: what is drawn, that a pair is measured as if alone, and what is told."""

import csv
from typing import Any

import numpy as np
import pytest

from springfoot.agents.training.config import PRESETS
from springfoot.cli.main import study_main
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.studies.base.columns import COMPARED_JOINTS
from springfoot.studies.walks import bodies as bodies

SOME: dict[str, Any] = {"height_range": (1.6, 1.75), "mass_range": (40.0, 120.0), "speed_range": (1.15, 1.25)}


def test_pairs_fill_the_ranges_of_the_preset_independently():
    assert all(getattr(PRESETS["any-body"].environment, name) == span for name, span in bodies.RANGES.items())
    settings = settings_from(**bodies.RANGES)
    who = bodies.draw_pairs(settings, 300)
    for values, (low, high) in zip(who.values(), bodies.RANGES.values(), strict=True):
        assert values.min() >= low and values.max() <= high and np.ptp(values) > 0.97 * (high - low)
    assert np.abs(np.corrcoef(list(who.values())) - np.eye(3)).max() < 0.15
    again, other = bodies.draw_pairs(settings, 300), bodies.draw_pairs(settings, 300, seed=1)
    assert all(np.array_equal(who[name], again[name]) for name in who)
    assert not np.intersect1d(who["speed"], other["speed"]).size


def test_a_pair_is_measured_as_if_alone_in_blocks_of_any_size():
    policy, settings = policy_and_settings("schedule", SOME | {"episode_seconds": 5.0})
    who = {"height": np.array([1.7, 1.62]), "mass": np.array([63.0, 110.0]), "speed": np.array([1.2, 1.16])}
    rows = bodies.walk_pairs(policy, settings, who, name="schedule", seed=3, threads=1)
    assert rows == bodies.walk_pairs(policy, settings, who, name="schedule", seed=3, block=1, threads=1)
    alone = measure(
        record(*policy_and_settings("schedule", {"episode_seconds": 5.0}), name="", episodes=1, seed=3)
    ).metrics
    first, second = rows
    assert first["measured_speed_m_s"] == pytest.approx(alone["speed_m_s"]["mean"], rel=1e-4)
    assert first["knee_rmse_deg"] == pytest.approx(alone["joints"]["knee"]["rmse_deg"], rel=1e-2)
    assert second["speed_error_percent"] == pytest.approx(100 * (second["measured_speed_m_s"] / 1.16 - 1))


def row(speed_error: float | None = 1.0, fall: str = "", **values: Any) -> dict[str, Any]:
    plain = {"height_m": 1.7, "mass_kg": 63.0, "speed_m_s": 1.2, "froude_speed": 0.4, "people_clamped": 0}
    measured = {f"{joint}_rmse_deg": 2.0 for joint in COMPARED_JOINTS} | {"grf_vertical_r": 0.99}
    fell = {"seconds": 20.0, "fall": fall, "measured_speed_m_s": 1.2, "speed_error_percent": speed_error}
    return plain | fell | measured | values


def test_the_table_has_falls_apart_and_the_worst_of_those_that_walked():
    rows = [row(error) for error in (0.1, -0.2, 0.3, -4.0)] + [row(-50.0, "fell: hip too low", seconds=3.2)]
    rows[1] |= {"grf_vertical_r": 0.91, "height_m": 1.45, "mass_kg": 40.0, "speed_m_s": 1.6}
    lines = {line.split("|")[1].strip(): line for line in bodies.pairs_table(rows).splitlines() if line[:1] == "|"}
    assert "| 1 of 5 |" in lines["falls"]
    assert lines["speed error %"].split("|")[2:5] == [" 0.2 ", " 4.0 ", " 4.0 "]
    assert "0.910 | 1.45 m, 40 kg, 1.60 m/s" in lines["vertical force r"]
    assert "1.70 m, 63 kg, 1.20 m/s: after 3.2 s, fell: hip too low" in bodies.pairs_table(rows)
    fallen = bodies.pairs_table([row(None, "fell: hip too low", thigh_rmse_deg=None)])
    assert "1 of 1" in fallen and "RMSE" not in fallen


def test_the_command_prints_a_table_and_writes_a_row_for_each_pair(capsys, tmp_path):
    ranges = [f"--{name.replace('_', '-')} {low:g} {high:g}" for name, (low, high) in SOME.items()]
    words = ["bodies", "schedule", "--pairs", "2", "--seconds", "6", "--threads", "1", *ranges]
    words = " ".join([*words, "--out", str(tmp_path / "new")]).split()
    assert study_main(words) == 0
    out = capsys.readouterr().out
    assert "| falls | 0 of 2 |" in out and "2 pairs × 6 s, seed 0: 1.6–1.75 m, 40–120 kg, 1.15–1.25 m/s" in out
    with (tmp_path / "new" / bodies.PAIRS).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 and list(rows[0]) == list(row())
    assert all(1.6 <= float(each["height_m"]) <= 1.75 and float(each["knee_rmse_deg"]) < 6 for each in rows)
    assert study_main(words) == 2
    assert "exists already" in capsys.readouterr().err


def test_a_speed_that_changes_within_an_episode_is_refused():
    policy, settings = policy_and_settings("schedule", SOME | {"speed_interval": 2.0})
    with pytest.raises(SpringfootError, match="speed_interval must be None"):
        bodies.walk_pairs(policy, settings, bodies.draw_pairs(settings, 1), name="schedule")


def test_fixed_quantities_need_no_range():
    who = bodies.draw_pairs(BipedSettings(height_range=(1.6, 1.75)), 5)
    assert set(who["mass"]) == {63.0} and set(who["speed"]) == {1.2} and len(set(who["height"])) == 5
