"""A mirrored learner: left and right alike in network, statistics and policy, from the first update on."""

import dataclasses

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from springfoot.agents import policy_from_sb3
from springfoot.agents.policies.conversion import IGNORED
from springfoot.agents.training.config import TrainingConfig
from springfoot.agents.training.mirrored_network import MirroredMeanStd, MirroredNetwork
from springfoot.agents.training.ppo import Learner
from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.task.mirror import mirror_of
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.errors import SpringfootError

CONFIG = TrainingConfig(num_envs=8, threads=1, update_steps=512, mirrored=True, learning_rate=3e-3)
NAMES = [entry.name for entry in OBSERVATION]
MIRROR = mirror_of(NAMES, ACTIONS)


@pytest.fixture(scope="module")
def learner():
    """A learner after three updates."""
    environments = SegmentedFootBipedVecEnv(CONFIG.num_envs, episode_seconds=1.0, push_newton=50.0)
    made = Learner(CONFIG, environments, seed=0)
    made.ppo.learn(3 * CONFIG.update_steps)
    yield made
    environments.close()


@pytest.fixture
def rows():
    return np.random.default_rng(0).normal(0, 2, (64, len(OBSERVATION))).astype(np.float32)


def image_of(actions):
    return actions[..., MIRROR.action_index]


def test_the_policy_of_a_few_updates_mirrors_to_the_bit_and_is_not_the_first_one(learner, rows):
    policy = learner.policy({})
    action = policy(rows)
    assert policy(MIRROR.of(rows)).tobytes() == np.ascontiguousarray(image_of(action)).tobytes()
    assert policy.layer_sizes == [43, 64, 64, 2]
    environments = SegmentedFootBipedVecEnv(CONFIG.num_envs, episode_seconds=1.0)
    first = Learner(CONFIG, environments, seed=0).policy({})
    assert all(np.abs(one - other).max() > 1e-3 for one, other in zip(policy.weights, first.weights, strict=True))
    environments.close()


def test_actor_exploration_and_critic_are_alike_on_both_sides(learner, rows):
    network = learner.ppo.policy
    seen, image = (torch.from_numpy(each) for each in (rows, MIRROR.of(rows)))
    with torch.no_grad():
        ours, its = network.get_distribution(seen).distribution, network.get_distribution(image).distribution
        assert ours.mean.numpy() == pytest.approx(image_of(its.mean.numpy()), abs=1e-6)
        assert torch.equal(ours.stddev, image_of(its.stddev)) and ours.stddev.shape == (64, 4)
        worth, images_worth = (network.predict_values(each).numpy() for each in (seen, image))
        assert worth == pytest.approx(images_worth, abs=1e-5) and worth.std() > 0.1
    assert network.log_std.shape == (2,) and (network.log_std != CONFIG.log_std).all()


def test_the_policy_acts_as_the_network_does(learner):
    policy, ours = policy_from_sb3(learner.ppo), learner.policy({})  # ours ignores what never varied
    learner.normalized.training = False
    random = np.random.default_rng(0)
    for _ in range(20):
        normalized, *_ = learner.normalized.step(random.uniform(-1, 1, (CONFIG.num_envs, 4)).astype(np.float32))
        expected, _ = learner.ppo.predict(normalized, deterministic=True)
        assert policy(learner.normalized.get_original_obs()) == pytest.approx(expected, abs=1e-6)
        assert ours(learner.normalized.get_original_obs()) == pytest.approx(expected, abs=1e-4)
    learner.normalized.training = True


def test_the_running_statistics_are_those_of_observations_and_their_images(rows):
    ours, whole = MirroredMeanStd(MIRROR), RunningMeanStd(shape=(len(OBSERVATION),))
    rows = rows.astype(float) + np.arange(len(OBSERVATION))  # means differ from side to side
    for part in (rows[:10], rows[10:11], rows[11:]):
        ours.update(part)
        whole.update(np.concatenate([part, MIRROR.of(part)]))
    np.testing.assert_allclose(ours.mean, whole.mean, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ours.var, whole.var, rtol=1e-12)
    assert ours.count == whole.count


def test_the_learners_statistics_are_alike_to_the_bit_and_what_never_varied_is_ignored(learner):
    seen = learner.normalized.obs_rms
    assert np.array_equal(MIRROR.of(seen.mean), seen.mean)
    assert np.array_equal(seen.var[MIRROR.index], seen.var)
    assert seen.count == pytest.approx(2 * (3 * CONFIG.update_steps + CONFIG.num_envs))  # with the reset's
    ignored = {
        name for name, value in zip(NAMES, learner.policy({}).observation_variance, strict=True) if value == IGNORED
    }
    assert ignored == {"command_speed", "height_ratio"}


def test_what_differs_from_side_to_side_but_never_varies_is_seen():
    constant = np.zeros((5, len(OBSERVATION)), np.float32)
    constant[:, NAMES.index("planned_ankle_left")] = 0.5  # as the strength of one weak calf
    seen = MirroredMeanStd(MIRROR)
    for _ in range(1000):
        seen.update(constant)
    assert seen.var[NAMES.index("planned_ankle_right")] == pytest.approx(0.25**2, rel=1e-3)


def test_state_is_all_there_is_to_a_mirrored_learner(learner):
    other = Learner(CONFIG, learner.normalized.venv, seed=1)
    other.restore(learner.state())
    state, restored = learner.state(), other.state()
    assert set(state) == set(restored)
    assert all(np.array_equal(state[name], restored[name]) for name in state)
    plain = Learner(dataclasses.replace(CONFIG, mirrored=False), learner.normalized.venv, seed=1)
    with pytest.raises(SpringfootError, match="does not fit its configuration"):
        plain.restore(state)


@pytest.mark.parametrize("critic_steps", [0, 600])
def test_actor_and_critic_side_by_side_learn_the_same_bits(critic_steps):
    config = dataclasses.replace(CONFIG, critic_steps=critic_steps)
    states = []
    for threads in (1, 2):
        environments = SegmentedFootBipedVecEnv(CONFIG.num_envs, episode_seconds=1.0)
        made = Learner(config, environments, seed=0, threads=threads)
        made.ppo.learn(2 * CONFIG.update_steps)
        states.append({name: array.tobytes() for name, array in made.state().items()})
        environments.close()
    assert states[0] == states[1]


def test_its_model_of_stable_baselines3_is_a_mirrored_policy(learner, rows):
    policy = policy_from_sb3(learner.ppo, ignore_unvaried=True)
    assert np.array_equal(policy(rows), learner.policy({})(rows)) and policy.header["network"]["mirrored"] is True


def test_a_mirrored_model_with_other_statistics_is_refused():
    environments = VecNormalize(SegmentedFootBipedVecEnv(4, episode_seconds=1.0))
    model = PPO(
        MirroredNetwork, environments, n_steps=32, batch_size=32, policy_kwargs={"mirror": MIRROR}, device="cpu"
    )
    assert policy_from_sb3(model).mirror is not None  # before the first observation
    environments.reset()
    with pytest.raises(SpringfootError) as refused:
        policy_from_sb3(model)
    assert str(refused.value) == "its network is mirrored, but its VecNormalize treats left and right differently"
