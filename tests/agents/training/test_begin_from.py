"""A training that begins with another run's network: it acts like that one at first, and other tasks are allowed."""

import dataclasses

import numpy as np
import pytest
from safetensors.numpy import load_file

from springfoot.agents import TrainingConfig, read_policy, train
from springfoot.agents.training.checkpoint import checkpoints
from springfoot.agents.training.run_record import read_record
from springfoot.agents.training.training import resume
from springfoot.cli.train import train_main
from springfoot.envs import BipedSettings, settings_from
from springfoot.errors import SpringfootError

SHORT = TrainingConfig(
    timesteps=512,
    num_envs=8,
    threads=1,
    update_steps=256,
    minibatches=2,
    eval_interval=512,
    eval_episodes=2,
    environment=BipedSettings(episode_seconds=1.0),
)
ELSEWHERE = dataclasses.replace(SHORT, environment=settings_from(episode_seconds=1.0, right_foot="passive", speed=1.0))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("begin") / "run"
    train(dataclasses.replace(SHORT, learning_rate=0.01), folder)
    return folder


def weights_of(policy):
    return np.concatenate([weight.ravel() for weight in policy.weights])


def test_it_begins_with_that_network_and_its_return(run, tmp_path):
    train(SHORT, tmp_path / "next", begin_from=run)
    before, after = read_record(run), read_record(tmp_path / "next")
    untrained, *_, trained = [entry["return_mean"] for entry in before["evaluations"]]
    begun = after["evaluations"][0]["return_mean"]  # the first observations have joined its running statistics
    assert abs(begun - trained) < 0.1 * abs(untrained - trained)
    assert after["sessions"][0]["begun_from"]["timesteps"] == before["timesteps"] == 512
    first, last = (weights_of(read_policy(folder / "last.safetensors")) for folder in (run, tmp_path / "next"))
    assert 0.0 < np.abs(last - first).max() < 0.05  # it went on from there


def test_another_task_is_allowed_and_resumes_to_the_same_bits(run, tmp_path):
    train(ELSEWHERE, tmp_path / "whole", begin_from=run)
    train(ELSEWHERE, tmp_path / "cut", [lambda entry: False], begin_from=run)
    assert read_record(tmp_path / "cut")["status"] == "interrupted"
    resume(tmp_path / "cut")
    whole, cut = (read_policy(tmp_path / name / "last.safetensors") for name in ("whole", "cut"))
    assert whole.settings.right_foot.kind == "passive"
    assert (weights_of(whole) == weights_of(cut)).all()


def test_a_network_that_does_not_fit_is_refused(run, tmp_path):
    person = dataclasses.replace(SHORT, environment=BipedSettings(acts="both"))
    with pytest.raises(SpringfootError, match="the run to begin from was trained on another version of this env"):
        train(person, tmp_path / "person", begin_from=run)
    with pytest.raises(SpringfootError, match="the training state does not fit its configuration"):
        train(dataclasses.replace(SHORT, hidden=(32,)), tmp_path / "small", begin_from=run)
    with pytest.raises(SpringfootError, match="holds no checkpoint to begin from: give the folder of a run, or a"):
        train(SHORT, tmp_path / "none", begin_from=tmp_path / "nowhere")


def test_it_begins_with_a_policy_alone(run, tmp_path):
    path = run / "last.safetensors"
    train(SHORT, tmp_path / "next", begin_from=path)
    before, after = read_record(run), read_record(tmp_path / "next")
    untrained, *_, trained = [entry["return_mean"] for entry in before["evaluations"]]
    assert abs(after["evaluations"][0]["return_mean"] - trained) < 0.1 * abs(untrained - trained)
    assert set(after["sessions"][0]["begun_from"]) == {"sha256"}
    with pytest.raises(
        SpringfootError, match=r"the policy to begin from has a network of 43 - 64 - 64 - 4, tanh, .*, this"
    ):
        train(dataclasses.replace(SHORT, hidden=(32,)), tmp_path / "small", begin_from=path)
    with pytest.raises(SpringfootError, match="the policy to begin from was trained on another version of this env"):
        train(dataclasses.replace(SHORT, environment=BipedSettings(acts="both")), tmp_path / "b", begin_from="medium")


def test_a_run_without_its_first_checkpoint_is_not_begun_anew_from_nothing(run, tmp_path):
    train(SHORT, tmp_path / "next", begin_from=run)
    for path in checkpoints(tmp_path / "next"):
        path.unlink()
    with pytest.raises(SpringfootError, match="was stopped before its first checkpoint: train it anew"):
        resume(tmp_path / "next")


def test_the_flag_begins_one_run(run, tmp_path, capsys):
    assert train_main(["--begin-from", str(run), "--seeds", "2", "--out", str(tmp_path / "two")]) == 2
    assert "--begin-from begins one run" in capsys.readouterr().err


def test_the_actor_rests_while_the_critic_learns_alone(run, tmp_path):
    resting = dataclasses.replace(SHORT, critic_steps=256)
    train(dataclasses.replace(SHORT, timesteps=256, critic_steps=512), tmp_path / "rested", begin_from=run)
    train(resting, tmp_path / "whole", begin_from=run)
    train(resting, tmp_path / "cut", [lambda entry: False], begin_from=run)
    resume(tmp_path / "cut")
    begun = weights_of(read_policy(run / "last.safetensors"))
    rested, whole, cut = (
        weights_of(read_policy(tmp_path / name / "last.safetensors")) for name in ("rested", "whole", "cut")
    )
    assert (rested == begun).all() and (whole != begun).any()
    assert (whole == cut).all()
    before, after = (load_file(checkpoints(folder)[0]) for folder in (run, tmp_path / "rested"))
    critic = [name for name in before if name.startswith("network.") and "value" in name]
    actor = [name for name in before if name.startswith("network.") and "value" not in name]
    assert critic and all((before[name] != after[name]).any() for name in critic)
    assert actor and all((before[name] == after[name]).all() for name in actor)


@pytest.mark.parametrize("steps", [-1, 0.5, True])
def test_steps_of_the_critic_alone_are_a_whole_number(steps):
    with pytest.raises(SpringfootError, match=r"^critic_steps must be "):
        dataclasses.replace(SHORT, critic_steps=steps)
