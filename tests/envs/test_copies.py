"""Copies of environments, by pickle or deepcopy, and environments in other processes: bits go on equal."""

import copy
import pickle  # noqa: TID251  # environments are copied by it
from functools import partial
from typing import Any

import cloudpickle  # noqa: TID251  # environments are copied by it
import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

from springfoot.agents import SegmentedFootBipedVecEnv
from springfoot.envs import SegmentedFootBiped, SegmentedFootBipedVector

ID = "springfoot.envs:SegmentedFootBiped-v0"
SHORT: dict[str, Any] = {"episode_seconds": 0.8, "push_newton": 900.0, "push_interval": 0.4, "start_noise": 0.05}
"""Episodes that end both by falls and out of time within a few steps."""
SETTINGS: dict[str, dict[str, Any]] = {
    "defaults": {},
    "bodies and speeds": SHORT
    | {"height_range": (1.5, 1.9), "mass_range": (50.0, 90.0), "speed_range": (0.9, 1.5), "speed_interval": 0.3},
    "ground, noise and delay": SHORT
    | {
        "slope_range_deg": (-3.0, 3.0),
        "unevenness_m": 0.01,
        "sensor_noise": 0.01,
        "stiffness_delay_range_s": (0, 0.03),
    },
    "feet and proportions": SHORT
    | {
        "drawn_feet": [{"foot": {"kind": "passive", "ankle_stiffness": [300, 900]}}, {"foot": "rigid", "on": "both"}],
        "drawn_bodies": [{"leg_ratio": 1.03}, {"carried_ratio": 0.2}],
    },
    "standing": {"start": "standing", "stop_at": 3.5, "episode_seconds": 4.0},
    "decided at events": {"decisions": "event", "action_mode": "residual", "episode_seconds": 0.8},
}
FACES = {
    "Env": SegmentedFootBiped,
    "gym.make": partial(gym.make, ID),
    **{f"vector, {mode.value}": partial(SegmentedFootBipedVector, 3, autoreset_mode=mode) for mode in AutoresetMode},
}
COPIES = {
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),
    "cloudpickle": lambda env: cloudpickle.loads(cloudpickle.dumps(env)),
    "deepcopy": copy.deepcopy,
}


def walk(env: Any, rng: np.random.Generator, steps: int) -> list[Any]:
    """What `steps` steps return, and the resets between them that no autoreset makes."""
    seen = []
    resets = not isinstance(env, SegmentedFootBipedVector) or env.autoreset_mode is AutoresetMode.DISABLED
    for _ in range(steps):
        seen.append(env.step(rng.uniform(-1, 1, env.action_space.shape)))
        ended = np.logical_or(*seen[-1][2:4])
        if resets and ended.any():
            seen.append(env.reset(options={"reset_mask": ended} if ended.ndim else None))
    return seen


def same(ours: Any, theirs: Any) -> None:
    """Require equal bits, in whatever containers."""
    assert type(ours) is type(theirs)
    if isinstance(ours, dict):
        assert list(ours) == list(theirs)
        for name, value in ours.items():
            same(value, theirs[name])
    elif isinstance(ours, (list, tuple)) or (isinstance(ours, np.ndarray) and ours.dtype == object):
        assert len(ours) == len(theirs)
        for mine, other in zip(ours, theirs, strict=True):
            same(mine, other)
    elif not _plainly_same(ours, theirs):
        np.testing.assert_array_equal(ours, theirs)


def _plainly_same(ours: Any, theirs: Any) -> bool:
    """Return True for arrays of the same bytes, and for equal numbers and words.

    NumPy's own test says what differs, and takes fifty times as long.
    """
    if not isinstance(ours, np.ndarray):
        return bool(ours == theirs)
    return (ours.dtype, ours.shape, ours.tobytes()) == (theirs.dtype, theirs.shape, theirs.tobytes())


@pytest.mark.parametrize(
    ("face", "settings"),
    [
        *(pytest.param(face, SHORT, id=name) for name, face in FACES.items()),
        *(
            pytest.param(FACES[face], SETTINGS[name], id=f"{face}, {name}")
            for face in ("gym.make", "vector, NextStep")
            for name in SETTINGS
        ),
    ],
)
def test_a_copy_in_mid_episode_goes_on_with_the_same_bits(face, settings):
    env, rng = face(**settings), np.random.default_rng(0)
    env.reset(seed=3)
    walk(env, rng, 33)
    copies = [take(env) for take in COPIES.values()]
    going_on = walk(env, copy.deepcopy(rng), 90)
    ends = sum(bool(np.any(seen[2]) or np.any(seen[3])) for seen in going_on if len(seen) == 5)
    assert ends > 1 or settings.get("episode_seconds", 20.0) > 0.8
    for each in copies:
        same(walk(each, copy.deepcopy(rng), 90), going_on)


@pytest.mark.parametrize("take", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("face", FACES.values(), ids=FACES)
def test_a_copy_before_the_first_reset_is_reset_as_the_original(face, take):
    env = face(**SHORT)
    again = take(env)
    same(again.reset(seed=5), env.reset(seed=5))
    same(walk(again, np.random.default_rng(1), 20), walk(env, np.random.default_rng(1), 20))


@pytest.mark.parametrize("take", COPIES.values(), ids=COPIES)
def test_neither_notices_what_the_other_does(take):
    env = SegmentedFootBipedVector(2, **SHORT)
    env.reset(seed=0)
    again, twin = take(env), take(env)
    walk(again, np.random.default_rng(2), 60)
    again.reset(seed=9)
    same(walk(env, np.random.default_rng(3), 60), walk(twin, np.random.default_rng(3), 60))


def test_a_copy_has_the_same_spec_settings_and_generators():
    env: Any = gym.make(ID, episode_seconds=0.4)
    env.reset(seed=7)
    for take in COPIES.values():
        again = take(env)
        ours, theirs = again.unwrapped, env.unwrapped
        assert again.spec == env.spec and ours.settings == theirs.settings
        assert again.np_random_seed == 7 and again.np_random.bit_generator.state == env.np_random.bit_generator.state
        assert again.np_random is not env.np_random


def test_a_copy_for_stable_baselines3_goes_on_with_the_same_bits():
    env = SegmentedFootBipedVecEnv(3, **SHORT)
    env.seed(0)
    env.reset()
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (80, 3, 4)).astype(np.float32)
    for action in actions[:30]:
        env.step(action)
    again = pickle.loads(pickle.dumps(env))
    for action in actions[30:]:
        same(list(again.step(action)), list(env.step(action)))


# Other processes ----------------------------------------------------------------------------------------------

METHODS = ["spawn", "fork", "forkserver"]


def begun(seed: int) -> gym.Env:
    """An environment in mid-episode, to be sent to another process."""
    env = gym.make(ID, **SHORT)
    env.reset(seed=seed)
    walk(env, np.random.default_rng(seed), 10)
    return env


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("method", METHODS)
def test_gymnasium_s_processes_give_the_same_bits(method):
    makers = [partial(gym.make, ID, **SHORT), partial(copy.copy, begun(2))]
    here = SyncVectorEnv([makers[0], partial(copy.copy, begun(2))])
    there = AsyncVectorEnv(makers, context=method, shared_memory=method != "forkserver")
    try:
        same(there.reset(seed=4), here.reset(seed=4))
        for action in np.random.default_rng(0).uniform(-1, 1, (60, 2, 4)).astype(np.float32):
            same(there.step(action), here.step(action))
    finally:
        there.close()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("method", METHODS)
def test_stable_baselines3_s_processes_give_the_same_bits(method):
    def makers() -> list[Any]:
        return [partial(gym.make, ID, **SHORT), partial(copy.copy, begun(2))]

    here, there = DummyVecEnv(makers()), SubprocVecEnv(makers(), start_method=method)
    try:
        for each in (here, there):
            each.seed(4)
        same(there.reset(), here.reset())
        for action in np.random.default_rng(0).uniform(-1, 1, (60, 2, 4)).astype(np.float32):
            (seen, reward, *rest), (seen_here, reward_here, *rest_here) = there.step(action), here.step(action)
            same([seen, reward.astype(np.float32), *map(list, rest)], [seen_here, reward_here, *map(list, rest_here)])
    finally:
        there.close()
