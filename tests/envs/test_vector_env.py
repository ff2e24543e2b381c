"""The contract of Gymnasium's VectorEnv in its three autoreset modes: the same bits as a loop over environments."""

import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from springfoot.envs.env import SegmentedFootBiped
from springfoot.envs.gym_face import METADATA
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError

SHORT: dict[str, Any] = {"episode_seconds": 0.8, "push_newton": 900.0, "push_interval": 0.4, "start_noise": 0.05}
"""Episodes that end both by falls and out of time within a few steps."""

SEED, STEPS, NUM = 11, 150, 3


def same_info(ours: dict, theirs: dict) -> None:
    assert set(ours) == set(theirs)
    for key, value in theirs.items():
        if isinstance(value, dict):
            same_info(ours[key], value)
        elif value.dtype == object:
            for mine, other in zip(ours[key], value, strict=True):
                np.testing.assert_array_equal(mine, other, err_msg=key)
        else:
            assert ours[key].dtype == value.dtype, key
            if (ours[key].shape, ours[key].tobytes()) == (value.shape, value.tobytes()):
                continue  # NumPy's own test, which says what differs, takes fifty times as long
            np.testing.assert_array_equal(ours[key], value, err_msg=key)


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_a_vector_gives_the_same_bits_as_gymnasium_s_loop_over_environments(mode, num_threads):
    ours = SegmentedFootBipedVector(NUM, autoreset_mode=mode, num_threads=num_threads, **SHORT)
    theirs = SyncVectorEnv([lambda: SegmentedFootBiped(**SHORT)] * NUM, autoreset_mode=mode)
    rng = np.random.default_rng(0)
    falls = timeouts = 0
    (seen, info), (expected, expected_info) = ours.reset(seed=SEED), theirs.reset(seed=SEED)
    for _ in range(STEPS):
        np.testing.assert_array_equal(seen, expected)
        assert seen.dtype == expected.dtype
        same_info(info, expected_info)
        actions = rng.uniform(-1, 1, (NUM, 4)).astype(np.float32)
        seen, *rest, info = ours.step(actions)
        expected, *expected_rest, expected_info = theirs.step(actions)
        for mine, other in zip(rest, expected_rest, strict=True):
            assert mine.dtype == other.dtype
            np.testing.assert_array_equal(mine, other)
        _, terminated, truncated = rest
        falls, timeouts = falls + terminated.sum(), timeouts + truncated.sum()
        ended = terminated | truncated
        if mode is AutoresetMode.DISABLED and ended.any():
            np.testing.assert_array_equal(seen, expected)
            same_info(info, expected_info)
            seen, info = ours.reset(options={"reset_mask": ended})
            expected, expected_info = theirs.reset(options={"reset_mask": ended})
    assert falls > 0 and timeouts > 0


def test_next_step_ignores_the_action_and_returns_the_new_start():
    env = SegmentedFootBipedVector(2, episode_seconds=0.1)
    env.reset(seed=0)
    for _ in range(5):
        _, _, _, truncated, _ = env.step(np.zeros((2, 4)))
    assert truncated.all()
    observation, reward, terminated, truncated, info = env.step(np.full((2, 4), np.nan))
    assert not reward.any() and not terminated.any() and not truncated.any()
    assert not info["time"].any() and info["_time"].all()
    loads = [index for index, name in enumerate(env.biped.observation_names) if name.startswith("load")]
    assert not observation[:, loads].any()


def test_same_step_gives_the_true_last_observation():
    env = SegmentedFootBipedVector(3, autoreset_mode="SameStep", episode_seconds=0.2)
    twin = SegmentedFootBiped(episode_seconds=0.2)
    env.reset(seed=4)
    twin.reset(seed=5)
    for _ in range(10):
        observation, _, _, truncated, info = env.step(np.zeros((3, 4)))
        last, _, _, _, last_info = twin.step(np.zeros(4))
    assert truncated.all() and info["_final_obs"].all()
    np.testing.assert_array_equal(info["final_obs"][1], last)
    assert info["final_info"]["time"][1] == last_info["time"] == pytest.approx(0.2)
    assert not np.array_equal(observation[1], last)


def test_disabled_refuses_to_step_what_was_not_reset_and_leaves_the_others_alone():
    env = SegmentedFootBipedVector(2, autoreset_mode="Disabled", episode_seconds=0.1)
    env.reset(seed=0)
    for _ in range(5):
        observation, *_ = env.step(np.zeros((2, 4)))
    with pytest.raises(SpringfootError, match="environments 0, 1"):
        env.step(np.zeros((2, 4)))
    after, _ = env.reset(options={"reset_mask": np.array([True, False])})
    np.testing.assert_array_equal(after[1], observation[1])
    assert not np.array_equal(after[0], observation[0])
    with pytest.raises(SpringfootError, match="environments 1:"):
        env.step(np.zeros((2, 4)))


def test_seeds_may_be_one_for_each_environment():
    env = SegmentedFootBipedVector(3)
    observation, _ = env.reset(seed=[7, 3, 7])
    np.testing.assert_array_equal(observation[0], observation[2])
    np.testing.assert_array_equal(observation[1], SegmentedFootBiped().reset(seed=3)[0])
    assert env.np_random_seed == (7, 3, 7)
    assert len(env.np_random) == 3


def test_what_a_vector_returns_is_the_caller_s_to_keep():
    env = SegmentedFootBipedVector(2)
    kept: list[Any] = [env.reset(seed=0)]
    copies = [kept[0][0].copy()]
    for _ in range(3):
        kept.append(env.step(np.zeros((2, 4))))
        copies.append(kept[-1][0].copy())
    infos = {key: value.copy() for key, value in kept[1][-1].items()}
    env.step(np.ones((2, 4)))
    for result, copy in zip(kept, copies, strict=True):
        np.testing.assert_array_equal(result[0], copy)
    same_info(kept[1][-1], infos)
    arrays = [array for result in kept[1:] for array in (*result[:4], *result[4].values()) if array.flags.writeable]
    shared = [(i, j) for i, a in enumerate(arrays) for j, b in enumerate(arrays[:i]) if np.shares_memory(a, b)]
    assert not shared


def test_each_vector_has_its_own_metadata():
    disabled, default = SegmentedFootBipedVector(1, autoreset_mode="Disabled"), SegmentedFootBipedVector(1)
    assert disabled.metadata["autoreset_mode"] is disabled.autoreset_mode is AutoresetMode.DISABLED
    assert default.metadata["autoreset_mode"] is default.autoreset_mode is AutoresetMode.NEXT_STEP
    assert "autoreset_mode" not in METADATA


BAD = [
    (lambda: SegmentedFootBipedVector(0), "num_envs"),
    (lambda: SegmentedFootBipedVector(2, num_threads=0), "num_threads"),
    (lambda: SegmentedFootBipedVector(2, autoreset_mode="never"), "'NextStep', 'SameStep', 'Disabled'"),
    (lambda: SegmentedFootBipedVector(2, max_episode_steps=0), "max_episode_steps"),
    (lambda: SegmentedFootBipedVector(2).step(np.zeros((2, 4))), "environments 0, 1"),
    (lambda: started(SegmentedFootBipedVector(2)).step(np.zeros((3, 4))), r"\(2, 4\)"),
    (lambda: started(SegmentedFootBipedVector(2)).step(np.full((2, 4), np.nan)), "finite"),
    (lambda: SegmentedFootBipedVector(2).reset(seed=[1, 2, 3]), "3 seeds"),
    (lambda: SegmentedFootBipedVector(2).reset(options={"reset_mask": [True, False]}), "reset_mask"),
    (lambda: SegmentedFootBipedVector(2).reset(options={"reset_mask": np.zeros(2, bool)}), "at least one"),
]


def started(env):
    env.reset(seed=0)
    return env


@pytest.mark.parametrize(("attempt", "words"), BAD)
def test_what_is_not_allowed_is_refused_in_one_clear_line(attempt, words):
    with pytest.raises(SpringfootError, match=words) as caught:
        attempt()
    assert "\n" not in str(caught.value)


def test_make_vec_uses_the_batch_and_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env: Any = gym.make_vec("springfoot.envs:SegmentedFootBiped-v0", num_envs=3, num_threads=2, speed=1.1)
    assert isinstance(env.unwrapped, SegmentedFootBipedVector)
    assert env.observation_space.shape == (3, len(OBSERVATION))
    env.close()
