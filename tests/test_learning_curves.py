"""Learning curves: when a run stopped falling, which limits an evaluation misses, and the command."""

import copy
import dataclasses
import sys

import pytest

from springfoot.agents import learning_curves
from springfoot.agents.config import TrainingConfig
from springfoot.agents.learning_curves import first_without_falls, unmet
from springfoot.agents.training import train
from springfoot.envs.settings import BipedSettings

WALKS = {
    "falls": 0,
    "speed_m_s": {"mean": 1.21},
    "environment": {"speed": 1.2},
    "joints": {"thigh": {"rmse_deg": 3.5}, "knee": {"rmse_deg": 4.5}, "ankle": {"rmse_deg": 4.0}},
    "grf": {"vertical_peak1_bw": 1.3, "vertical_peak2_bw": 1.0, "vertical_r": 0.93},
}


def test_limits_hold_to_their_very_value():
    assert unmet(WALKS) == []


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("falls",), 1, "1 falls"),
        (("speed_m_s", "mean"), 1.231, "0.031 m/s off"),
        (("speed_m_s", "mean"), None, "1.200 m/s off"),
        (("joints", "knee", "rmse_deg"), 4.51, "knee 4.51°"),
        (("joints", "ankle", "rmse_deg"), None, "ankle ?°"),
        (("grf", "vertical_peak2_bw"), 1.31, "vertical_peak2_bw 1.31"),
        (("grf", "vertical_r"), 0.92, "vertical_r 0.92"),
    ],
)
def test_each_limit_alone_is_missed(path, value, said):
    metrics = copy.deepcopy(WALKS)
    place = metrics
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert unmet(metrics) == [said]


def test_the_last_fall_counts():
    entries = [{"falls": falls, "timesteps": step} for step, falls in enumerate((16, 0, 1, 0, 0))]
    steady = first_without_falls(entries)
    assert steady is not None and steady["timesteps"] == 3
    assert first_without_falls(entries[:3]) is None


def test_the_command_draws_and_judges_a_run(tmp_path, monkeypatch, capsys):
    config = TrainingConfig(
        timesteps=64,
        num_envs=2,
        update_steps=32,
        minibatches=2,
        epochs=1,
        eval_interval=32,
        eval_episodes=2,
        environment=BipedSettings(episode_seconds=0.2),
    )
    train(dataclasses.replace(config, threads=1), tmp_path / "run")
    monkeypatch.setattr(sys, "argv", ["learning_curves", str(tmp_path / "run"), "--out", str(tmp_path / "l.png")])
    assert learning_curves.main() == 0
    assert (tmp_path / "l.png").read_bytes().startswith(b"\x89PNG")
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("| run |") and "64" in line)
    assert "m/s off" in row

    monkeypatch.setattr(sys, "argv", ["learning_curves", str(tmp_path / "none")])
    assert learning_curves.main() == 2
    assert "none holds no run.json" in capsys.readouterr().err
