"""Learning curves: when a run stopped falling, and the command."""

import dataclasses
import json

import pytest
from drawn import has_line, kept_figures

from springfoot.agents.training.config import TrainingConfig
from springfoot.agents.training.training import train
from springfoot.cli.main import study_main
from springfoot.envs.settings.settings import BipedSettings
from springfoot.studies.walks.learning_curves import first_without_falls


def test_the_last_fall_counts():
    entries = [{"falls": falls, "timesteps": step} for step, falls in enumerate((16, 0, 1, 0, 0))]
    steady = first_without_falls(entries)
    assert steady is not None and steady["timesteps"] == 3
    assert first_without_falls(entries[:3]) is None


@pytest.mark.slow
def test_the_command_draws_and_judges_a_run(tmp_path, capsys):
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
    words = ["learning-curves", str(tmp_path / "run"), "--threads", "1"]
    with kept_figures() as figures:
        assert study_main([*words, "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "learning.png").exists()
    entries = json.loads((tmp_path / "run" / "run.json").read_text())["evaluations"]
    returns = [entry["return_mean"] for entry in entries]
    by_steps, by_time = figures["learning.png"].axes
    assert has_line(by_steps, [entry["timesteps"] / 1e6 for entry in entries], returns)
    assert has_line(by_time, [entry["seconds"] for entry in entries], returns)
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("| run |") and "64" in line)
    assert "speed off by" in row and row in (tmp_path / "out" / "report.md").read_text()
    evaluations = (tmp_path / "out" / "evaluations.csv").read_text().splitlines()
    assert evaluations[0] == "run,timesteps,seconds,return_mean,falls" and len(evaluations) == 4

    assert study_main(["learning-curves", str(tmp_path / "none")]) == 2
    assert "none holds no run.json" in capsys.readouterr().err
