"""A run that was killed and resumed ends as one that nothing interrupted: every bit but the clocks."""

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest

import train as train_script
from benchmarks.kills import EVENTS, differences, scalars
from springfoot.agents.training import returns, session
from springfoot.agents.training.checkpoint import KEPT_CHECKPOINTS, checkpoints, newest_checkpoint
from springfoot.agents.training.config import PRESETS, config_from_json
from springfoot.agents.training.run_record import read_record
from springfoot.agents.training.training import resume, train
from springfoot.cli.train import train_main
from springfoot.errors import SpringfootError
from springfoot.files.locks import OWNER

DRAWN_FEET = [{"foot": {"kind": "passive", "ankle_stiffness": [300.0, 900.0]}, "weight": 2.0}, {"foot": "intact"}]
FLAGS = (
    *("--preset", "any-body", "--timesteps", "2500", "--num-envs", "8", "--threads", "1", "--update-steps", "256"),
    *("--minibatches", "2", "--eval-interval", "1024", "--eval-episodes", "2", "--episode-seconds", "1.5"),
    *("--drawn-feet", json.dumps(DRAWN_FEET)),
)
CONFIG = dataclasses.replace(
    PRESETS["any-body"],
    **{"timesteps": 2500, "num_envs": 8, "threads": 1, "update_steps": 256, "minibatches": 2},
    **{"eval_interval": 1024, "eval_episodes": 2},
    environment=dataclasses.replace(PRESETS["any-body"].environment, episode_seconds=1.5, drawn_feet=DRAWN_FEET),  # type: ignore[arg-type]
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run that nothing interrupted."""
    folder = tmp_path_factory.mktemp("resume") / "whole"
    train(CONFIG, folder)
    return folder


@contextmanager
def ctrl_c_after(timesteps):
    """SIGINT once a training has done so many timesteps."""
    on_step = session.Session._on_step

    def step(self):
        if self.learner.ppo.num_timesteps >= timesteps and not self._stopping.asked:
            os.kill(os.getpid(), signal.SIGINT)
        return on_step(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session.Session, "_on_step", step)
        yield


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """The same run, ended within its sixth update as by Ctrl-C."""
    folder = tmp_path_factory.mktemp("resume") / "half"
    with ctrl_c_after(1400):
        train(CONFIG, folder)
    return folder


@pytest.fixture
def half(interrupted, tmp_path):
    """A copy of it."""
    return shutil.copytree(interrupted, tmp_path / "half")


@pytest.mark.slow
def test_three_kills_at_random_moments_change_nothing(whole, tmp_path):
    folder, random = tmp_path / "killed", np.random.default_rng(17)
    size = sum(path.stat().st_size for path in whole.glob(EVENTS))
    for share in np.sort(random.uniform(0.05, 0.9, 3)):
        words = ["--resume", folder, "--threads", "2"] if (folder / "run.json").exists() else ["--out", folder, *FLAGS]
        with subprocess.Popen([sys.executable, train_script.__file__, *words], stderr=subprocess.PIPE) as process:
            assert process.stderr is not None
            while sum(path.stat().st_size for path in folder.glob(EVENTS)) < share * size:
                assert process.poll() is None, process.stderr.read().decode()
                time.sleep(0.005)
            time.sleep(random.uniform(0.0, 0.1))
            process.kill()
    record = read_record(folder)
    assert record["status"] == "running" and (folder / OWNER).exists()
    assert config_from_json(record["config"]) == CONFIG
    resume(folder, threads=3)
    assert differences(whole, folder) == []
    assert len(scalars(whole)) > 100
    names = [{path.name for path in each.rglob("*") if not path.match(EVENTS)} for each in (whole, folder)]
    assert names[0] == names[1] and "state-2560.safetensors" in names[0]


@pytest.mark.slow
def test_ctrl_c_within_an_update_and_in_the_last_evaluation(whole, half, monkeypatch):
    record = read_record(half)
    assert (record["status"], record["signal"], record["timesteps"]) == ("interrupted", "SIGINT", 1280)
    assert checkpoints(half)[0].name == "state-1280.safetensors"
    assert len(checkpoints(half)) <= KEPT_CHECKPOINTS

    with ctrl_c_after(2504):  # beyond the 2,500 that are asked for, but within the last update
        assert resume(half)["timesteps"] == 2304

    def in_the_middle(*_):
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        evaluate = returns.evaluate_returns
        calls = iter([evaluate, in_the_middle])  # of the best, and at the end
        patch.setattr(returns, "evaluate_returns", lambda *given: next(calls)(*given))
        record = resume(half)
    assert (record["status"], record["timesteps"]) == ("interrupted", 2560)
    assert resume(half)["status"] == "finished"
    assert differences(whole, half) == []


@pytest.mark.slow
def test_a_mirrored_run_goes_on_bit_for_bit(tmp_path):
    config = dataclasses.replace(CONFIG, mirrored=True)
    train(config, tmp_path / "whole")
    with ctrl_c_after(1400):
        train(config, tmp_path / "half")
    assert resume(tmp_path / "half")["status"] == "finished"
    assert differences(tmp_path / "whole", tmp_path / "half") == []


def test_a_run_cannot_change_its_form(half):
    record = {name: value for name, value in read_record(half).items() if name != "sha256"}
    (half / "run.json").write_text(json.dumps(record | {"config": record["config"] | {"mirrored": True}}))
    with pytest.raises(SpringfootError, match=r"was trained with mirrored False; its run\.json says True"):
        resume(half)


@pytest.mark.slow
def test_a_damaged_newest_checkpoint_is_passed_over(whole, half, capsys):
    newest, second = checkpoints(half)[:2]
    newest.write_bytes(newest.read_bytes()[:-100])
    resume(half)
    error = capsys.readouterr().err
    assert f"Warning: {newest} is not a .safetensors file" in error and f"going on from {second.name}" in error
    assert newest.with_name(f"{newest.name}.damaged").exists()
    assert differences(whole, half) == []


def test_no_checkpoint_that_is_whole_is_no_run_to_continue(half):
    before = [path for path in checkpoints(half) if path.write_bytes(b"") == 0]
    with pytest.raises(SpringfootError, match=r"not a \.safetensors file.*and so are all other checkpoints"):
        resume(half)
    assert checkpoints(half) == before


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["best.safetensors", "last.safetensors", "run.json"])
def test_what_disagrees_with_the_last_checkpoint_is_made_again(whole, tmp_path, lost):
    folder = shutil.copytree(whole, tmp_path / "run")
    with pytest.raises(SpringfootError, match=r"has done its 2,560 timesteps"):
        resume(folder)
    if lost == "run.json":  # killed in the last save
        record = read_record(folder) | {"status": "running"}
        (folder / lost).write_text(json.dumps(record | {"evaluations": record["evaluations"][:-1]}))
    else:
        (folder / lost).unlink()
    for left in (".run.json.abcd1234", ".last.safetensors.abcd1234"):
        (folder / left).touch()
    assert resume(folder)["status"] == "finished"
    assert differences(whole, folder) == []
    assert (folder / lost).is_file() and not list(folder.rglob(".*"))


@pytest.mark.slow
@pytest.mark.parametrize("evaluation", [{}, {"timesteps": "x"}])
def test_an_evaluation_that_is_none_is_no_record(whole, tmp_path, evaluation):
    folder = shutil.copytree(whole, tmp_path / "run")
    record = {name: value for name, value in read_record(folder).items() if name != "sha256"}
    (folder / "run.json").write_text(json.dumps(record | {"evaluations": [evaluation]}))
    with pytest.raises(SpringfootError, match="is not the record of a run"):
        resume(folder)


@pytest.mark.slow
def test_killed_before_the_first_checkpoint_it_begins_again(whole, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    record = read_record(whole)
    (folder / "run.json").write_text(
        json.dumps(record | {"status": "running", "sessions": [], "evaluations": [], "timesteps": 0, "seconds": 0})
    )
    for path in whole.glob(EVENTS):  # it had told of its first evaluation, which will be told again
        shutil.copy(path, folder / f"{path.name}.killed")
    resume(folder)
    assert differences(whole, folder) == []
    assert scalars(folder) == scalars(whole)


@pytest.mark.slow
def test_killed_before_its_record_a_folder_is_still_new(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    for name in (OWNER, ".run.json.abcd1234"):
        (folder / name).touch()
    train(dataclasses.replace(CONFIG, timesteps=256), folder)
    assert not list(folder.glob(".*"))


@pytest.mark.slow
def test_the_best_is_measured_anew_where_the_reward_has_changed(half, capsys):
    record = read_record(half)
    words = ["--resume", str(half), "--reward-weights", '{"grf": 0.0, "pose": 0.0}']
    assert train_main(words) == 0
    after = read_record(half)
    assert after["config"]["environment"]["reward_weights"] == {"grf": 0.0, "pose": 0.0}
    assert after["sessions"][-1]["changed_from"] == {"reward_weights": {}}
    assert "The best policy returns" in capsys.readouterr().err
    told = after["sessions"][-1]
    assert (told["from_timesteps"], told["best"]["timesteps"]) == (1280, record["best"]["timesteps"])
    assert told["best"]["return_mean"] < record["best"]["return_mean"]
    later = [entry for entry in after["evaluations"] if entry["timesteps"] > 1280]
    assert after["best"] == max([told["best"], *later], key=lambda entry: entry["return_mean"])


@pytest.mark.slow
def test_another_number_of_timesteps_goes_on_from_the_same_state(half):
    found = newest_checkpoint(half)
    assert found is not None
    record = resume(half, 512)
    assert (record["timesteps"], record["config"]["timesteps"]) == (1792, 1792)
    assert [session["from_timesteps"] for session in record["sessions"]] == [0, 1280]
