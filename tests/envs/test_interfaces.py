"""What other libraries ask of the environments: a spec, wrappers, MuJoCo's model and data."""

from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector as vector_wrappers

from springfoot.envs import SegmentedFootBiped, SegmentedFootBipedVector

ID = "springfoot.envs:SegmentedFootBiped-v0"


def make(**settings) -> Any:
    return gym.make(ID, **settings)


def make_vec(**settings) -> Any:
    return gym.make_vec(ID, **settings)


def steps_until_truncated(env: Any) -> int:
    env.reset(seed=0)
    count, truncated = 0, np.array(False)
    while not np.any(truncated):
        *_, terminated, truncated, _ = env.step(np.zeros(env.action_space.shape, np.float32))
        assert not np.any(terminated)
        count += 1
    return count


# Spec ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("maker", [make, make_vec])
@pytest.mark.parametrize(
    ("arguments", "steps"),
    [
        ({}, 1000),
        ({"episode_seconds": 5}, 250),
        ({"episode_seconds": 0.5, "decisions": "100hz"}, 50),
        ({"episode_seconds": 0.5, "decisions": "25hz"}, 12),  # the nearest step, half a step not counted
        ({"episode_seconds": 0.5, "decisions": "event"}, 25),
        ({"episode_seconds": 0.31}, 15),
        ({"episode_seconds": 0.311}, 16),
        ({"max_episode_steps": 7}, 7),
        ({"episode_seconds": 0.5, "max_episode_steps": 7}, 7),
    ],
    ids=str,
)
def test_the_spec_says_after_how_many_steps_an_episode_ends(maker, arguments, steps):
    env = maker(**arguments)
    assert env.spec.max_episode_steps == steps
    if steps < 100:
        assert steps_until_truncated(env) == steps
    for spec in (env.spec, EnvSpec.from_json(env.spec.to_json())):
        again = gym.make_vec(spec) if maker is make_vec else gym.make(spec)
        assert again.spec is not None and again.spec.max_episode_steps == steps


def test_an_environment_made_without_gymnasium_has_no_spec():
    assert SegmentedFootBiped().spec is None and SegmentedFootBipedVector(2).spec is None


def test_a_spec_that_is_set_stays_its_owner_s():
    env, spec = SegmentedFootBiped(episode_seconds=5), gym.spec("SegmentedFootBiped-v0")
    env.spec = spec
    assert spec.max_episode_steps is None and env.spec is not spec
    env.spec = None
    assert env.spec is None


# Wrappers -----------------------------------------------------------------------------------------------------

WRAPPERS = {
    "time": (wrappers.TimeAwareObservation, (44,)),
    "time in [0, 1]": (lambda env: wrappers.TimeAwareObservation(env, normalize_time=True), (44,)),
    "statistics": (wrappers.RecordEpisodeStatistics, (43,)),
    "normalised observation": (wrappers.NormalizeObservation, (43,)),
    "normalised reward": (wrappers.NormalizeReward, (43,)),
    "stack": (lambda env: wrappers.FrameStackObservation(env, 3), (3, 43)),
    "delay": (lambda env: wrappers.DelayObservation(env, 2), (43,)),
    "skip": (lambda env: wrappers.MaxAndSkipObservation(env, 2), (43,)),
    "autoreset": (wrappers.Autoreset, (43,)),
    "limit": (lambda env: wrappers.TimeLimit(env, 5), (43,)),
}


@pytest.mark.parametrize(("wrap", "shape"), WRAPPERS.values(), ids=WRAPPERS)
def test_gymnasium_s_wrappers_go_around_it(wrap, shape):
    env = wrap(make(episode_seconds=0.2))
    observation, _ = env.reset(seed=0)
    truncated = False
    while not truncated:
        observation, *_, truncated, _ = env.step(env.action_space.sample())
        assert observation.shape == shape and observation in env.observation_space
    env.reset()


def test_time_is_counted_to_the_end_of_the_episode():
    env = wrappers.TimeAwareObservation(make(episode_seconds=0.2, decisions="100hz"), normalize_time=True)
    env.reset(seed=0)
    times = [env.step(env.action_space.sample())[0][-1] for _ in range(20)]
    np.testing.assert_allclose(times, np.arange(1, 21) / 20, rtol=1e-6)


BATCHED = {
    "statistics": (vector_wrappers.RecordEpisodeStatistics, list(AutoresetMode)),
    "normalised observation": (vector_wrappers.NormalizeObservation, [AutoresetMode.NEXT_STEP]),  # all it takes
    "normalised reward": (vector_wrappers.NormalizeReward, list(AutoresetMode)),
    "clipped action": (vector_wrappers.ClipAction, list(AutoresetMode)),
    "list of infos": (vector_wrappers.DictInfoToList, list(AutoresetMode)),
}


@pytest.mark.parametrize(
    ("wrap", "mode"),
    [pytest.param(wrap, mode, id=f"{name}, {mode.value}") for name, (wrap, modes) in BATCHED.items() for mode in modes],
)
def test_gymnasium_s_vector_wrappers_go_around_the_batch(wrap, mode):
    env = wrap(make_vec(num_envs=3, episode_seconds=0.2, autoreset_mode=mode))
    env.reset(seed=0)
    for _ in range(25):
        observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
        assert observation.shape == (3, 43)
        ended = terminated | truncated
        if mode is AutoresetMode.DISABLED and ended.any():
            env.reset(options={"reset_mask": ended})


def test_statistics_of_the_batch_are_those_of_its_episodes():
    env = vector_wrappers.RecordEpisodeStatistics(make_vec(num_envs=3, episode_seconds=0.2))
    env.reset(seed=0)
    total = np.zeros(3)
    for _ in range(10):
        _, reward, *_, info = env.step(np.zeros((3, 4), np.float32))
        total += reward
    np.testing.assert_array_equal(info["episode"]["l"], [10, 10, 10])
    np.testing.assert_allclose(info["episode"]["r"], total)


# MuJoCo -------------------------------------------------------------------------------------------------------


def test_model_and_data_are_those_of_the_present_body_and_moment():
    env = make(height_range=(1.5, 1.9), mass_range=(50.0, 90.0)).unwrapped
    env.reset(seed=0, options={"height": 1.6, "mass": 60})
    small = env.model
    env.reset(options={"height": 1.9, "mass": 80})
    model, data = env.model, env.data
    assert isinstance(model, mujoco.MjModel) and isinstance(data, mujoco.MjData)
    assert small.body_mass.sum() == pytest.approx(60) and model.body_mass.sum() == pytest.approx(80)
    for _ in range(3):
        *_, info = env.step(np.zeros(4))
        assert env.data.time == pytest.approx(info["time"])
    assert data.time == 0.0  # a copy
    toe = [env.data.qfrc_actuator[env.model.joint(f"toe_{side}").dofadr[0]] for side in ("left", "right")]
    np.testing.assert_allclose(toe, [info["torque/toe_left"], info["torque/toe_right"]], rtol=1e-9)


def test_writing_to_data_changes_nothing():
    env, twin = SegmentedFootBiped(), SegmentedFootBiped()
    for each in (env, twin):
        each.reset(seed=0)
    data = env.data
    data.qpos[:] = 0.0
    data.qvel[:] = 9.0
    np.testing.assert_array_equal(env.step(np.zeros(4))[0], twin.step(np.zeros(4))[0])
