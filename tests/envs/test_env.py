"""The contract of Gymnasium's Env, and its docstring as the specification."""

import re
import subprocess
import sys
import warnings
from dataclasses import replace
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from springfoot.agents.training.config import TrainingConfig
from springfoot.envs.batch.step_result import INFO, TERMINATIONS
from springfoot.envs.env import SegmentedFootBiped
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.settings import (
    DEFAULT_WEIGHTS,
    THEME_OF,
    THEMES,
    BipedSettings,
    settings_from,
    settings_to_json,
)
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError

ID = "springfoot.envs:SegmentedFootBiped-v0"
SHORT: dict[str, Any] = {"episode_seconds": 0.8, "push_newton": 900.0, "push_interval": 0.4, "start_noise": 0.05}
"""Episodes that end both by falls and out of time within a few steps."""


def make(**settings) -> Any:
    return gym.make(ID, **settings)


def make_vec(**settings) -> Any:
    return gym.make_vec(ID, **settings)


def rows_of(heading: str) -> list[list[str]]:
    """Cells of the first table after `heading` in the Env's docstring, without its head."""
    section = (SegmentedFootBiped.__doc__ or "").split(f"## {heading}\n")[1].split("\n    ## ")[0]
    lines = [line.strip().strip("|") for line in section.splitlines() if line.strip().startswith("|")]
    return [[cell.strip() for cell in line.split("|")] for line in lines[2:]]


# The docstring is the specification -------------------------------------------------------------------------


def test_docstring_lists_every_entry_of_the_observation():
    env: Any = SegmentedFootBiped()
    rows = rows_of("Observation space")
    assert [row[0] for row in rows] == [str(index) for index in range(len(rows))]
    assert [row[1:] for row in rows] == [[e.name, e.unit, f"{e.low:g}", f"{e.high:g}", e.meaning] for e in OBSERVATION]
    assert tuple(row[1] for row in rows) == env.biped.observation_names
    np.testing.assert_array_equal(env.observation_space.low, [np.float32(row[3]) for row in rows])
    np.testing.assert_array_equal(env.observation_space.high, [np.float32(row[4]) for row in rows])


def test_docstring_lists_actions_rewards_and_arguments_with_their_values():
    settings = BipedSettings()
    ranges = {"ankle": settings.ankle_stiffness_range, "toe": settings.toe_stiffness_range}
    actions = [[name, *(f"{k:g}" for k in ranges[name.split("_")[0]])] for name in ACTIONS]
    assert [row[1:4] for row in rows_of("Action space")] == actions
    assert [(row[0], float(row[1])) for row in rows_of("Rewards")] == list(DEFAULT_WEIGHTS.items())
    arguments = [(row[0].strip("`"), row[1].strip("`").strip('"')) for row in rows_of("Arguments")]
    themes = {theme: [name for name, its in THEME_OF.items() if its == theme] for theme in THEMES}
    wanted = [
        row
        for theme, names in themes.items()
        for row in ((f"**{theme}**", ""), *((name, str(getattr(settings, name))) for name in names))
    ]
    assert arguments == wanted  # lists, so that a row given twice fails


def test_docstring_lists_every_key_of_info():
    env = SegmentedFootBiped()
    env.reset(seed=0)
    info = env.step(np.zeros(4, np.float32))[-1]
    text = (SegmentedFootBiped.__doc__ or "").split("## Info")[1].split("##")[0]
    for key in info:
        stem = re.sub(rf"/({'|'.join(ACTIONS)}|{'|'.join(DEFAULT_WEIGHTS)})$", "/", key)
        assert f"`{stem}`" in text, key
    assert [(row[0], row[1]) for row in rows_of("Info")] == [
        (str(code), name) for code, name in enumerate(TERMINATIONS)
    ]
    warnings = {name.removeprefix("mjWARN_") for name in mujoco.mjtWarning.__members__} - {"mjNWARNING"}
    assert warnings == {name.removeprefix("diverged: ") for name in TERMINATIONS if name.startswith("diverged: ")}


def test_info_is_numbers_of_python_under_the_same_keys_from_reset_and_step():
    env = SegmentedFootBiped(start=0.25)
    _, first = env.reset(seed=0)
    *_, info = env.step(np.zeros(4, np.float32))
    types = [(name, type(value)) for name, value in info.items()]
    assert types == [*((name, float) for name in INFO), ("termination", int)]
    assert types == [(name, type(value)) for name, value in first.items()]
    env.reset(seed=0)
    speed = env.biped.measurement.com_velocity[0, 0]
    known = {"phase/left": 0.25, "phase/right": 0.75, "speed": speed} | {f"controlled/{name}": 1.0 for name in ACTIONS}
    assert first == dict.fromkeys(info, 0.0) | known
    assert speed == pytest.approx(1.2, abs=0.3)


# Env ----------------------------------------------------------------------------------------------------------


def test_gymnasium_and_stable_baselines3_have_nothing_to_say():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make().unwrapped, skip_render_check=True)
        check_env_sb3(SegmentedFootBiped(**SHORT))


def test_spaces_are_float32_boxes_with_finite_bounds():
    env = SegmentedFootBiped()
    assert env.action_space == gym.spaces.Box(-1, 1, (4,), np.float32)
    space = env.observation_space
    assert isinstance(space, gym.spaces.Box)
    assert space.dtype == np.float32
    assert np.isfinite([space.low, space.high]).all()


@pytest.mark.parametrize("settings", [{}, SHORT, {"height": 1.4, "mass": 38.0, "equilibrium": "neutral"}])
def test_observations_stay_inside_their_space(settings):
    env = SegmentedFootBiped(**settings)
    rng = np.random.default_rng(0)
    observation, _ = env.reset(seed=0)
    for _ in range(200):
        assert observation in env.observation_space
        observation, _, terminated, truncated, _ = env.step(rng.uniform(-1, 1, 4))
        if terminated or truncated:
            observation, _ = env.reset()


def test_the_same_seed_gives_the_same_episode_and_another_seed_another():
    def episode(seed):
        env = SegmentedFootBiped(push_newton=100.0, push_interval=0.3)
        observation, _ = env.reset(seed=seed)
        return np.concatenate([observation] + [env.step(np.zeros(4))[0] for _ in range(30)])

    np.testing.assert_array_equal(episode(3), episode(3))
    assert not np.array_equal(episode(3), episode(4))


def test_without_a_seed_the_generator_goes_on():
    env = SegmentedFootBiped()
    first, second = env.reset(seed=1)[0], env.reset()[0]
    again, after = env.reset(seed=1)[0], env.reset()[0]
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(second, after)
    assert not np.array_equal(first, second)


def test_start_option_sets_the_phase_of_one_episode():
    env = SegmentedFootBiped()
    quarter, drawn, zero = (env.reset(seed=0, options=options)[0] for options in ({"start": 0.25}, None, {"start": 0}))
    sine = env.biped.observation_names.index("phase_sin")
    assert quarter[sine] == pytest.approx(1.0)
    assert drawn[sine] != pytest.approx(1.0)
    assert zero[sine] == pytest.approx(0.0, abs=1e-6)


def test_an_episode_ends_once_and_asks_for_reset():
    env = SegmentedFootBiped(episode_seconds=0.1)
    env.reset(seed=0)
    ends = [env.step(np.zeros(4))[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]
    with pytest.raises(SpringfootError, match=r"reset\(\)"):
        env.step(np.zeros(4))


def test_a_fall_terminates_with_its_reason_and_no_reward():
    env = SegmentedFootBiped(push_newton=2000.0, push_interval=0.2)
    env.reset(seed=0)
    for _ in range(200):
        _, reward, terminated, truncated, info = env.step(np.zeros(4))
        if terminated:
            break
        assert info["termination"] == 0
    assert terminated and not truncated
    assert TERMINATIONS[info["termination"]].startswith("fell: ")
    assert reward == 0.0
    assert info["reward/alive"] == 0.0


def test_reward_is_the_weighted_sum_of_the_terms_in_info():
    env = make(reward_weights={"pose": 1.0, "grf": 0.5})
    weights = DEFAULT_WEIGHTS | {"pose": 1.0, "grf": 0.5}
    env.reset(seed=2)
    for _ in range(20):
        _, reward, terminated, _, info = env.step(env.action_space.sample())
        assert not terminated
        assert reward == pytest.approx(sum(weight * info[f"reward/{name}"] for name, weight in weights.items()))


def test_actions_beyond_the_box_are_clipped():
    observations = []
    for action in (np.ones(4), np.full(4, 7.0)):
        env = SegmentedFootBiped()
        env.reset(seed=0)
        observations.append(env.step(action)[0])
    np.testing.assert_array_equal(*observations)


BAD = [
    (lambda: SegmentedFootBiped(render_mode="ascii"), "render_mode"),
    (lambda: SegmentedFootBiped(heigth=1.8), "height"),
    (lambda: SegmentedFootBiped().step(np.zeros(4)), "reset"),
    (lambda: started(SegmentedFootBiped()).step(np.zeros(3)), r"\(4,\)"),
    (lambda: started(SegmentedFootBiped()).step(np.full(4, np.nan)), "finite"),
    (lambda: SegmentedFootBiped().reset(options={"stat": 0.2}), "start"),
    (lambda: SegmentedFootBiped().reset(options={"start": 1.2}), r"\[0, 1\)"),
    (lambda: SegmentedFootBiped().render(), "render_mode"),
]


@pytest.mark.parametrize("maker", [SegmentedFootBiped, SegmentedFootBipedVector, make, make_vec])
def test_an_unknown_setting_is_refused_as_python_refuses_an_unknown_argument(maker):
    with pytest.raises(TypeError, match=r"got an unexpected keyword argument 'heigth', .*: height") as caught:
        maker(heigth=1.8)
    assert isinstance(caught.value, SpringfootError)
    with pytest.raises(TypeError, match=r"unexpected keyword argument 'frameskip', .*: height, mass, ") as caught:
        maker(frameskip=2)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("maker", [BipedSettings, lambda **given: replace(BipedSettings(), **given), TrainingConfig])
def test_settings_made_in_python_refuse_an_unknown_name_likewise(maker):
    with pytest.raises(
        TypeError, match="got an unexpected keyword argument 'sed', which is no setting; likely: s"
    ) as told:
        maker(sed=1)
    assert isinstance(told.value, SpringfootError)


def started(env):
    env.reset(seed=0)
    return env


@pytest.mark.parametrize(("attempt", "words"), BAD)
def test_what_is_not_allowed_is_refused_in_one_clear_line(attempt, words):
    with pytest.raises(SpringfootError, match=words) as caught:
        attempt()
    assert "\n" not in str(caught.value)


def test_a_refused_action_steps_nothing():
    env, twin = started(SegmentedFootBiped()), started(SegmentedFootBiped())
    with pytest.raises(SpringfootError):
        env.step(np.full(4, np.nan))
    np.testing.assert_array_equal(env.step(np.zeros(4))[0], twin.step(np.zeros(4))[0])


# Registration -------------------------------------------------------------------------------------------------


def test_a_spec_holds_its_settings_as_json_and_makes_the_same_environment():
    env = make(height=1.5, mass=50.0, ankle_stiffness_range=(30.0, 600.0), reward_weights={"pose": 0.4})
    again: Any = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.settings == env.unwrapped.settings
    np.testing.assert_array_equal(env.reset(seed=5)[0], again.reset(seed=5)[0])
    vector = make_vec(num_envs=2, autoreset_mode="SameStep", height=1.5)
    again: Any = gym.make_vec(EnvSpec.from_json(vector.spec.to_json()))
    assert (again.num_envs, again.unwrapped.settings.height) == (2, 1.5)
    assert again.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


@pytest.mark.parametrize("name", ["springfoot/SegmentedFootBiped-v0", "SegmentedFootBiped-v0"])
def test_both_ids_are_known_after_the_import_of_the_package_alone(name):
    env: Any = gym.make(name, speed=1.1)
    assert isinstance(env.unwrapped, SegmentedFootBiped) and env.unwrapped.settings.speed == 1.1
    assert gym.make_vec(name, num_envs=2).unwrapped.num_envs == 2
    code = f"import gymnasium, springfoot, sys; gymnasium.spec({name!r}); print('mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False\n"


def test_every_setting_is_an_argument_of_make():
    values = settings_to_json(settings_from(height=1.6, mass=55.0, equilibrium="neutral", start=0.3))
    assert settings_to_json(make(**values).unwrapped.settings) == values


@pytest.mark.parametrize("maker", [make, make_vec])
def test_max_episode_steps_truncates(maker):
    env = maker(max_episode_steps=7)
    env.reset(seed=0)
    truncated = [bool(env.step(np.zeros(env.action_space.shape, np.float32))[3]) for _ in range(7)]
    assert truncated == [False] * 6 + [True]
