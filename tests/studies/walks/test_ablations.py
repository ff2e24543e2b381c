"""Ablations: rows that differ from the preset in their flags alone, a study that may be stopped, and its pages."""

import json
from dataclasses import replace

import pytest
from stable_baselines3.common.callbacks import BaseCallback

from springfoot.agents.policies.baselines import schedule
from springfoot.agents.policies.policy import RUN
from springfoot.agents.training.config import PRESETS, TrainingConfig
from springfoot.agents.training.training import train
from springfoot.cli.main import study_main
from springfoot.envs.physics.timing import ACTION_STEP
from springfoot.envs.settings.settings import BipedSettings, settings_to_json
from springfoot.evaluation.recording.recording import record
from springfoot.studies.walks import ablations

SHORT = ("--episodes", "1", "--seconds", "0.5", "--threads", "1")


def main(*words):
    return study_main(["ablations", *map(str, words)])


def test_every_row_differs_from_the_preset_in_its_flags_and_walks_as_long():
    preset = PRESETS["walk"]
    assert list(ablations.MEANING) == list(ablations.ABLATIONS)
    assert ablations.config_of("walk") == preset
    known = settings_to_json(preset.environment)
    for name, flags in ablations.ABLATIONS.items():
        config = ablations.config_of(name, seed=2)
        own = settings_to_json(config.environment)
        assert {key for key in own if own[key] != known[key]} == set(flags) | (
            {"schedule"} if name == "phase" else set()
        )
        step = config.environment.step_seconds
        for field in ("timesteps", "update_steps", "eval_interval"):
            assert getattr(config, field) * step == pytest.approx(getattr(preset, field) * ACTION_STEP)
        assert config.seed == 2 and (config.gamma, config.minibatches) == (preset.gamma, preset.minibatches)


def test_the_phase_equilibrium_of_the_ablation_is_one_that_can_be_walked():
    own = ablations.phase_schedule(BipedSettings())
    assert len(own.ankle) == len(own.toe) == 10
    settings = BipedSettings(equilibrium="phase", schedule=own, episode_seconds=4.0)
    assert not record(schedule(settings), settings, name="", episodes=3, threads=1).fall_reason.any()


class Stop(BaseCallback):
    """Ends a training within its first update."""

    def _on_step(self) -> bool:
        return self.n_calls < 3


@pytest.mark.slow
def test_resume_keeps_finished_trainings(monkeypatch, capsys, tmp_path):
    quick = TrainingConfig(
        num_envs=8, update_steps=512, eval_interval=512, eval_episodes=2, environment=BipedSettings(episode_seconds=0.5)
    )
    monkeypatch.setitem(ablations.PRESETS, "walk", quick)
    runs = tmp_path / "runs"
    [(config, folder, _)] = ablations.jobs(runs, ["25hz"], 1, 512)
    assert train(config, folder, callbacks=[Stop()])["status"] == "interrupted"
    words = ["--runs", runs, "--seeds", 1, "--only", "25hz", "--timesteps", 512, *SHORT]
    assert main(*words, "--out", tmp_path / "one") == 0
    done = json.loads((folder / RUN).read_text())
    assert done["status"] == "finished" and done["timesteps"] == 256  # as long a walk, in steps twice as long
    written = (tmp_path / "one" / "report.md").read_text(), (tmp_path / "one" / "ablations.csv").read_bytes()
    assert "K decided at 25 Hz" in written[0] and "thesis lines" in written[0]
    assert written[1].startswith(b"table,row,seed,undisturbed_falls,pushed_falls,")

    assert main(*words, "--out", tmp_path / "two") == 0
    again = (tmp_path / "two" / "report.md").read_text(), (tmp_path / "two" / "ablations.csv").read_bytes()
    assert again == written
    assert json.loads((folder / RUN).read_text()) == done
    capsys.readouterr()
    words[words.index("--timesteps") + 1] = 1024
    assert main(*words) == 2
    assert "was trained with other settings" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--only", "walks"], "no row 'walks'; there are walk, "),
        (["--seeds", 0], "seeds must be"),
        (["--seconds", -1], "seconds"),
    ],
)
def test_bad_input_is_one_line_and_nothing_on_disk(capsys, tmp_path, words, message):
    assert main("--runs", tmp_path / "runs", "--out", tmp_path / "out", *words) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_table_has_mean_and_spread_over_seeds_and_people_beside_them():
    how = replace(ablations.PushedWalks(), episodes=2, seconds=0.5, threads=1)
    one = how.metrics("schedule")
    other = json.loads(json.dumps(one))
    for metrics, value in ((one, 1.0), (other, 2.0)):
        metrics["undisturbed"]["speed_m_s"]["mean"] = value
        metrics["pushed"]["falls"] = int(value)
    head, _, row, people = ablations.rows_table({"x": [one, other]}, "what", people=True).splitlines()
    assert head.startswith("| what | seeds | falls | pushed | return | m/s |")
    assert row.startswith("| x | 2 | 0.0 ± 0.0 | 1.5 ± 0.7 |") and "| 1.50 ± 0.71 |" in row
    assert people.startswith("| people | – | – | – | – | 1.20 |") and "| 1.31 |" in people
