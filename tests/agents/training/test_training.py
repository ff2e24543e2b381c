"""Training: the learner starts in mid-range, learns, keeps its best, and can be stopped and gone on with."""

import dataclasses
import json
import shutil

import numpy as np
import pytest
import torch
from safetensors.numpy import load, save

from springfoot.agents.policies.baselines import baseline
from springfoot.agents.policies.policy import LAST, load_policy
from springfoot.agents.training import training
from springfoot.agents.training.config import PRESETS, TrainingConfig, config_from_json, config_to_json
from springfoot.agents.training.ppo import Learner
from springfoot.agents.training.returns import EVALUATION_SEED, evaluate_returns
from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.settings.settings import DEFAULT_WEIGHTS, BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.files.json_file import read_object

SHORT = TrainingConfig(
    timesteps=3_000,
    num_envs=8,
    threads=1,
    update_steps=1024,
    eval_interval=1024,
    eval_episodes=2,
    environment=BipedSettings(episode_seconds=1.0, push_newton=50.0, reward_weights={"grf": 0.2}),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short training: its folder and its record."""
    folder = tmp_path_factory.mktemp("runs") / "short"
    return folder, training.train(SHORT, folder)


@pytest.fixture
def learner():
    environments = SegmentedFootBipedVecEnv(SHORT.num_envs, episode_seconds=1.0)
    yield Learner(SHORT, environments, seed=0)
    environments.close()


def test_a_policy_does_not_read_what_never_varied_in_its_training(run):
    policy = load_policy(run[0] / LAST)  # the best may be the one before any training
    biped = Biped(policy.settings, 1)
    biped.reset(np.arange(1), [0])
    seen = biped.observe()
    other = seen.copy()
    for name in ("command_speed", "height_ratio"):
        other[:, biped.observation_names.index(name)] += 0.3
    np.testing.assert_allclose(policy(other), policy(seen), atol=1e-5)
    other[:, biped.observation_names.index("hip_height")] += 0.3
    assert np.abs(policy(other) - policy(seen)).max() > 1e-3


@pytest.mark.slow
def test_a_policy_of_any_body_reads_speed_and_height_and_is_evaluated_on_one_body(tmp_path):
    preset = PRESETS["any-body"]
    environment = dataclasses.replace(preset.environment, episode_seconds=1.0)
    config = dataclasses.replace(SHORT, timesteps=1_024, environment=environment)
    record = training.train(config, tmp_path / "run")
    assert [entry["episodes"] for entry in record["evaluations"]] == [2, 2]
    policy, settings = policy_and_settings(str(tmp_path / "run"), {"height": 1.85, "mass": 95.0, "speed": 1.4})
    assert (settings.height, settings.mass, settings.speed) == (1.85, 95.0, 1.4)
    assert settings.height_range is settings.mass_range is settings.speed_range is settings.speed_interval is None
    assert load_policy(tmp_path / "run").settings == environment
    biped = Biped(settings, 1)
    biped.reset(np.arange(1), [0])
    seen = biped.observe()
    assert np.isfinite(biped.step(policy(seen)).reward).all()
    for name in ("command_speed", "height_ratio"):
        other = seen.copy()
        other[:, biped.observation_names.index(name)] += 0.1
        assert np.abs(policy(other) - policy(seen)).max() > 1e-4, name


@pytest.mark.parametrize("config", [SHORT, dataclasses.replace(SHORT, mirrored=True), *PRESETS.values()])
def test_configuration_survives_json(config):
    assert config_from_json(json.loads(json.dumps(config_to_json(config)))) == config


def test_the_reward_of_predict_reads_no_likeness():
    task = PRESETS["predict"].environment
    weights = DEFAULT_WEIGHTS | task.reward_weights
    assert task.follows_plan and weights["pose"] == weights["grf"] == 0.0
    costs = "fibre_work", "activation", "activation_rate", "acceleration", "impact", "speed_held", "step_length"
    assert all(weights[name] < 0.0 for name in costs)


def test_a_configuration_without_a_form_is_not_mirrored():
    values = {name: value for name, value in config_to_json(SHORT).items() if name != "mirrored"}
    assert config_from_json(values) == SHORT


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"timesteps": 0}, "timesteps must be a whole number >= 1, got 0"),
        ({"num_envs": 2.5}, "num_envs must be a whole number"),
        ({"learning_rate": float("nan")}, "learning_rate must be a finite number > 0 and <= 1000, got nan"),
        ({"gamma": 1.5}, "gamma must be a finite number > 0 and <= 1"),
        ({"num_envs": 2048}, "update_steps must be a whole number >= 2048, got 1024"),
        ({"hidden": ()}, "hidden must be"),
        ({"hidden": (64, -1)}, "hidden must be"),
    ],
)
def test_bad_configurations_are_refused_with_one_line(change, words):
    with pytest.raises(SpringfootError, match=words) as caught:
        dataclasses.replace(SHORT, **change)
    assert "\n" not in str(caught.value)


def test_an_untrained_policy_sets_mid_range_stiffness(learner):
    observation = learner.normalized.reset()
    with torch.no_grad():
        mean = learner.ppo.policy.get_distribution(torch.as_tensor(observation)).distribution.mean
        deviation = learner.ppo.policy.log_std.exp()
    assert mean.abs().max() < 0.15
    assert deviation.numpy() == pytest.approx(np.exp(SHORT.log_std))


def test_exported_policy_acts_as_the_network_does(learner):
    learner.ppo.learn(1024)
    policy = learner.policy({})
    learner.normalized.training = False
    learner.normalized.reset()
    random = np.random.default_rng(0)
    for _ in range(20):
        normalized, *_ = learner.normalized.step(random.uniform(-1, 1, (SHORT.num_envs, 4)).astype(np.float32))
        expected, _ = learner.ppo.predict(normalized, deterministic=True)
        assert policy(learner.normalized.get_original_obs()) == pytest.approx(expected, abs=1e-5)


def test_the_learning_rate_falls_to_its_end_and_stays_there(learner):
    rate = learner.ppo.lr_schedule
    assert rate(1.0) == SHORT.learning_rate
    assert rate(0.0) == pytest.approx(SHORT.learning_rate * SHORT.learning_rate_end)
    assert rate(-3.0) == rate(0.0)  # of one update that is longer than the training


def test_state_is_all_there_is_to_a_learner(learner):
    learner.ppo.learn(1024)
    other = Learner(SHORT, learner.normalized.venv, seed=1)
    other.restore(learner.state())
    state, restored = learner.state(), other.state()
    assert set(state) == set(restored)
    assert all(np.array_equal(state[name], restored[name]) for name in state)
    for one in (learner, other):  # the same gradient step from the same samples
        samples = torch.as_tensor(np.random.default_rng(0).normal(size=(32, state["observation.mean"].size)))
        value, probability, _ = one.ppo.policy.evaluate_actions(samples.float(), torch.zeros(32, 4))
        one.ppo.policy.optimizer.param_groups[0]["lr"] = 1e-3  # PPO sets it anew before each update
        one.ppo.policy.optimizer.zero_grad()
        (value.mean() + probability.mean()).backward()
        one.ppo.policy.optimizer.step()
    state, restored = learner.state(), other.state()
    assert all(np.array_equal(state[name], restored[name]) for name in state)


def test_the_learning_rate_falls_on_a_line_to_a_share_of_its_beginning(learner):
    rates = [learner.ppo.lr_schedule(left) for left in (1.0, 0.5, 0.0)]
    begin, end = SHORT.learning_rate, SHORT.learning_rate * SHORT.learning_rate_end
    assert rates == [pytest.approx(rate, rel=1e-12) for rate in (begin, (begin + end) / 2, end)]


def test_state_of_another_shape_is_refused(learner):
    state = learner.state()
    for name, words in (("observation.mean", "observation.mean"), ("network.log_std", "log_std")):
        with pytest.raises(SpringfootError, match=words) as caught:
            learner.restore(state | {name: np.zeros(3, np.float32)})
        assert "\n" not in str(caught.value)


def test_a_run_folder_holds_what_it_says(run):
    folder, record = run
    assert read_object(folder / "run.json", "record of a run") == record
    assert config_from_json(record["config"]) == SHORT
    assert record["status"] == "finished"
    assert record["timesteps"] == 3072  # whole updates
    assert [entry["timesteps"] for entry in record["evaluations"]] == [0, 1024, 2048, 3072]
    assert record["best"] == max(record["evaluations"], key=lambda entry: entry["return_mean"])
    assert {"python", "mujoco", "scipy", "torch"} <= set(record["sessions"][0]["versions"])
    names = {path.name for path in folder.iterdir() if not path.name.startswith("events.out.tfevents")}
    assert names == {"best.safetensors", "last.safetensors", "state-3072.safetensors", "run.json"}
    assert any(path.name.startswith("events.out.tfevents") for path in folder.iterdir())


def test_the_best_policy_returns_what_its_evaluation_said(run):
    folder, record = run
    policy = load_policy(folder)
    assert policy.settings == SHORT.environment
    biped = Biped(policy.settings, SHORT.eval_episodes)
    returns, seconds, fell = evaluate_returns(biped, policy, EVALUATION_SEED)
    assert returns.mean() == pytest.approx(record["best"]["return_mean"], rel=1e-9)
    assert fell.sum() == record["best"]["falls"]
    assert seconds.mean() == pytest.approx(record["best"]["seconds_mean"])


def test_same_seed_same_policy_with_any_number_of_threads(run, tmp_path):
    folder, _ = run
    training.train(dataclasses.replace(SHORT, threads=2), tmp_path / "again")
    assert (tmp_path / "again" / "last.safetensors").read_bytes() == (folder / "last.safetensors").read_bytes()
    training.train(dataclasses.replace(SHORT, seed=1), tmp_path / "other")
    assert (tmp_path / "other" / "last.safetensors").read_bytes() != (folder / "last.safetensors").read_bytes()


def test_an_existing_run_is_refused_and_untouched(run):
    folder, _ = run
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}
    with pytest.raises(SpringfootError, match=r"already exists; out must be a new or an empty folder"):
        training.train(SHORT, folder)
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before


def test_a_finished_run_goes_on_where_it_was(tmp_path):
    folder = tmp_path / "run"
    first = training.train(dataclasses.replace(SHORT, timesteps=1024), folder)
    with pytest.raises(SpringfootError, match=r"has done its 1,024 timesteps"):
        training.resume(folder)
    count = load((folder / "state-1024.safetensors").read_bytes())["observation.count"]
    record = training.resume(folder, 1000)
    assert record["timesteps"] == 2048
    assert record["evaluations"][: len(first["evaluations"])] == first["evaluations"]
    assert [session["from_timesteps"] for session in record["sessions"]] == [0, 1024]
    assert record["config"] == first["config"] | {"timesteps": 2024}
    state = load((folder / "state-2048.safetensors").read_bytes())
    assert state["observation.count"] - count == pytest.approx(1024)
    assert state["adam.0.step"] == 2 * SHORT.minibatches * SHORT.epochs


def test_what_cannot_be_gone_on_with_is_refused(run, tmp_path):
    with pytest.raises(SpringfootError, match=r"no run.json"):
        training.resume(tmp_path)
    folder, _ = run
    shutil.copyfile(folder / "run.json", tmp_path / "run.json")
    with pytest.raises(SpringfootError, match=r"no state-3072.safetensors in it"):
        training.resume(tmp_path, 1000)
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(SpringfootError, match=r"not the record of a run"):
        training.resume(tmp_path, 1000)
    shutil.copyfile(folder / "run.json", tmp_path / "run.json")
    arrays = load((folder / "state-3072.safetensors").read_bytes())
    (tmp_path / "state-3072.safetensors").write_bytes(save(arrays, {"springfoot-training": "{}"}))
    with pytest.raises(SpringfootError, match=r"is damaged or was changed: it has no sha256"):
        training.resume(tmp_path, 1000)
    shutil.copyfile(folder / "last.safetensors", tmp_path / "state-3072.safetensors")
    with pytest.raises(SpringfootError, match=r"no springfoot training state"):
        training.resume(tmp_path, 1000)


@pytest.mark.slow
def test_it_learns(tmp_path):
    """To walk better, by the default reward, than the untrained mean action does on the same fixed seeds."""
    config = TrainingConfig(
        timesteps=131_072,
        threads=1,
        update_steps=2048,
        learning_rate=1e-3,
        eval_interval=131_072,
        environment=BipedSettings(episode_seconds=4.0),
    )
    training.train(config, tmp_path / "run")
    biped = Biped(config.environment, 32)
    learned, _, _ = evaluate_returns(biped, load_policy(tmp_path / "run" / "last.safetensors"), 0)
    untrained, _, _ = evaluate_returns(biped, baseline("untrained", config.environment), 0)
    gain = learned - untrained
    assert gain.mean() > 10 * gain.std() / np.sqrt(len(gain))
    assert gain.mean() > 0.25 * untrained.mean()
