"""The stable-baselines3 face: its own contract, and the same bits as the Gymnasium VectorEnv."""

from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError

N = 6


@pytest.fixture(scope="module")
def environments():
    made = SegmentedFootBipedVecEnv(N, episode_seconds=1.0)
    yield made
    made.close()


def test_same_bits_as_the_vector_env_through_falls_and_time_limits():
    rough: dict[str, Any] = {"episode_seconds": 1.0, "push_newton": 600.0, "push_interval": 1.0, "push_seconds": 0.3}
    vector = SegmentedFootBipedVector(num_envs=N, autoreset_mode=AutoresetMode.SAME_STEP, **rough)
    environments = SegmentedFootBipedVecEnv(N, num_threads=2, **rough)
    environments.seed(7)
    assert np.array_equal(np.asarray(environments.reset()), vector.reset(seed=7)[0])
    random, fell, timed_out = np.random.default_rng(0), 0, 0
    for _ in range(160):
        actions = random.uniform(-1, 1, (N, 4)).astype(np.float32)
        observation, reward, done, infos = environments.step(actions)
        expected, expected_reward, terminated, truncated, info = vector.step(actions)
        assert np.array_equal(np.asarray(observation), expected)
        assert np.array_equal(reward, expected_reward)
        assert np.array_equal(done, terminated | truncated)
        fell, timed_out = fell + terminated.sum(), timed_out + truncated.sum()
        for i in range(N):
            assert ("terminal_observation" in infos[i]) == done[i]
            if done[i]:
                assert np.array_equal(infos[i]["terminal_observation"], info["final_obs"][i])
                assert infos[i]["TimeLimit.truncated"] == (truncated[i] and not terminated[i])
                assert infos[i]["termination"] == info["final_info"]["termination"][i]
    assert fell > 0 and timed_out > 0
    vector.close()
    environments.close()


def test_episode_statistics_add_up_from_reset_to_end(environments):
    environments.seed(3)
    environments.reset()
    returns, lengths, episodes = np.zeros(N), np.zeros(N, int), 0
    for _ in range(120):
        _, reward, done, infos = environments.step(np.zeros((N, 4), np.float32))
        returns, lengths = returns + reward, lengths + 1
        for i in np.flatnonzero(done):
            assert infos[i]["episode"] == {"r": pytest.approx(returns[i]), "l": lengths[i]}
            episodes += 1
        returns[done], lengths[done] = 0, 0
    assert episodes >= 2 * N
    assert environments.step_info["reward/speed"].shape == (N,)


def test_seeds_count_from_the_given_one_and_hold_for_one_reset(environments):
    assert environments.seed(11) == [11 + i for i in range(N)]
    first = environments.reset()
    assert not np.array_equal(environments.reset(), first)
    environments.seed(12)
    assert np.array_equal(environments.reset()[:-1], first[1:])


def test_rewards_are_the_callers_own(environments):
    environments.seed(0)
    environments.reset()
    _, reward, _, _ = environments.step(np.zeros((N, 4), np.float32))
    kept = reward.copy()
    environments.step(np.ones((N, 4), np.float32))
    assert np.array_equal(reward, kept)


def test_attributes_and_methods_are_those_of_the_batch(environments):
    assert environments.get_attr("render_mode") == [None] * N
    assert environments.get_attr("num_envs", indices=[0, 2]) == [N, N]
    assert environments.env_is_wrapped(VecMonitor) == [False] * N
    assert not environments.has_attr("nothing")
    observations = [result[0] for result in environments.env_method("reset", seed=1)]
    assert len(observations) == N and observations[0].shape == (N, *environments.observation_space.shape)
    with pytest.raises(SpringfootError, match=r"some environments only"):
        environments.env_method("reset", indices=[0])
    with pytest.raises(SpringfootError, match=r"some environments only"):
        environments.set_attr("num_envs", 3, indices=1)
    with pytest.raises(AttributeError):
        environments.get_attr("nothing")


def test_reset_options_reach_the_batch_once(environments):
    environments.set_options({"start": 0.2})
    first = environments.reset()
    assert np.ptp(first, axis=0).max() < 1e-6  # one phase, no noise: all the same
    assert np.ptp(environments.reset(), axis=0).max() > 0.1
    environments.set_options([{"start": 0.2}, *[{}] * (N - 1)])
    with pytest.raises(SpringfootError, match="same for all"):
        environments.reset()
    environments.set_options()


def test_unknown_settings_are_refused():
    with pytest.raises(SpringfootError, match="hight"):
        SegmentedFootBipedVecEnv(2, hight=1.8)


def test_ppo_learns_on_it_without_further_wrappers(environments):
    model = PPO("MlpPolicy", environments, n_steps=64, batch_size=64, n_epochs=1, seed=0, device="cpu")
    model.learn(64 * N)
    assert model.num_timesteps == 64 * N
    assert {"r", "l"} <= set((model.ep_info_buffer or [{}])[0])
    action, _ = model.predict(environments.reset())
    assert environments.action_space.contains(action[0])
