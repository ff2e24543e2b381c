"""Minari's sets hold what a learner sees of a walk: the environment that they name gives the same bits again."""

import os
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import minari
import numpy as np
import pytest

from springfoot.agents import load_policy
from springfoot.agents.training.returns import evaluate_returns
from springfoot.cli.main import main
from springfoot.envs import Biped
from springfoot.errors import SpringfootError
from springfoot.evaluation.benchmark.minari_sets import set_id, walked_episodes, write_sets

EXAMPLE = Path(__file__).parents[3] / "examples" / "clone_from_minari.py"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "sets"))
    return tmp_path


def test_an_episode_is_what_its_environment_gives_for_its_seed_and_actions(folder):
    told = write_sets(["random"], "Slopes-v0", 3, seed=5)["springfoot/slopes/random-v0"]
    dataset = minari.load_dataset("springfoot/slopes/random-v0")
    environment = dataset.recover_environment()
    episodes = list(dataset.iterate_episodes())
    seeds = [dataset.storage.get_episode_metadata([episode.id]) for episode in episodes]
    assert [next(iter(each))["seed"] for each in seeds] == [5, 6, 7]
    for seed, episode in zip((5, 6, 7), episodes, strict=True):
        observation, _ = environment.reset(seed=seed)
        assert np.array_equal(observation, episode.observations[0])
        for step, action in enumerate(episode.actions):
            observation, reward, terminated, truncated, _ = environment.step(action)
            assert np.array_equal(observation, episode.observations[step + 1])
            assert (reward, terminated, truncated) == (
                episode.rewards[step],
                episode.terminations[step],
                episode.truncations[step],
            )
        assert terminated or truncated
    assert told["steps"] == dataset.total_steps
    assert told["falls"] == sum(bool(episode.terminations[-1]) for episode in episodes)


def test_episodes_of_several_batches_are_those_of_one():
    policy = load_policy("medium")
    settings = replace(policy.settings, episode_seconds=2.0)
    several = walked_episodes(settings, policy, 52, 0)
    alone = walked_episodes(settings, policy, 1, 51)
    assert len(several) == 52 and several[51].seed == 51
    assert np.array_equal(several[51].observations, alone[0].observations)


def test_a_set_that_exists_is_kept(folder, capsys):
    assert main(["datasets", "random", "--episodes", "1"]) == 0
    assert "springfoot/walk/random-v0" in capsys.readouterr().out
    assert main(["datasets", "expert", "random", "--episodes", "1"]) == 2
    assert "springfoot/walk/random-v0 exists already" in capsys.readouterr().err
    assert list(minari.list_local_datasets()) == ["springfoot/walk/random-v0"]
    with pytest.raises(SpringfootError, match="exists already"):
        write_sets(["random"], "Walk-v0", 1)


def test_a_policy_that_the_task_does_not_take_and_two_of_one_name_leave_nothing(folder):
    with pytest.raises(SpringfootError, match=r"^learned was trained with acts 'both', Walk-v0 takes 'stiffness'$"):
        write_sets(["random", "learned"], "Walk-v0", 1)
    with pytest.raises(SpringfootError, match=r"^two policies would make the Minari set springfoot/walk/random-v0;"):
        write_sets(["random", "random"], "Walk-v0", 1)
    assert list(minari.list_local_datasets()) == []
    assert set_id("runs/My run.2", "Walk-v0") == "springfoot/walk/my-run-2-v0"
    assert set_id("a/b/mine.safetensors", "AnyBodyBoth-v0") == "springfoot/anybodyboth/mine-v0"
    assert set_id("constant:300,40", "Walk-v0") == "springfoot/walk/constant-300-40-v0"


def test_the_command_to_type_next_prints_the_number_of_episodes(folder, capsys):
    assert main(["datasets", "random", "--episodes", "2"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("Next:    python -c ")
    words = [sys.executable, *shlex.split(last.removeprefix("Next:"))[1:]]
    assert subprocess.run(words, capture_output=True, text=True).stdout == "2\n"


def test_a_set_that_cannot_be_finished_leaves_nothing(folder, monkeypatch):
    def fails(*given, **named):
        raise KeyboardInterrupt

    monkeypatch.setattr(minari.MinariDataset, "__init__", fails)  # Minari's last step
    with pytest.raises(KeyboardInterrupt):
        write_sets(["random"], "Walk-v0", 1)
    monkeypatch.undo()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder / "sets"))
    assert not list((folder / "sets").rglob("*.hdf5"))
    assert write_sets(["random"], "Walk-v0", 1)["springfoot/walk/random-v0"]["episodes"] == 1


@pytest.mark.slow
def test_a_clone_of_the_expert_returns_as_much_in_a_fresh_process(folder):
    assert main(["datasets", "expert", "--episodes", "60"]) == 0  # less to learn from than by default
    words = [sys.executable, str(EXAMPLE), "--out", str(folder / "clone.safetensors")]
    subprocess.run(words, check=True, env=dict(os.environ), cwd=folder)
    expert = load_policy("expert")
    biped = Biped(expert.settings, 20)
    own, _, _ = evaluate_returns(biped, expert, 10**6)
    cloned, _, _ = evaluate_returns(biped, load_policy(folder / "clone.safetensors"), 10**6)
    assert cloned.mean() >= 0.95 * own.mean()
