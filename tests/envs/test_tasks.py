"""Frozen tasks: Gymnasium makes each without a warning, and none has moved."""

import gymnasium as gym
import pytest
from gymnasium.utils.env_checker import check_env

from springfoot.envs.batch.learned_person import digest_of_person
from springfoot.envs.settings.settings import settings_from, settings_to_json
from springfoot.evaluation.benchmark.task_walks import task_fingerprint
from springfoot.tasks import FINGERPRINTS, PERSONS_SHA256, STIFFNESS_TASKS, TASKS


@pytest.mark.parametrize("task", TASKS)
def test_gymnasium_makes_and_checks_every_task(task):
    environment = gym.make(f"springfoot/{task}")
    check_env(environment.unwrapped, skip_render_check=True)  # a warning is an error here
    acts = "both" if "Both" in task else "stiffness"
    assert environment.spec is not None and environment.spec.max_episode_steps == 500
    assert environment.action_space.shape == ({"stiffness": 4, "both": 10}[acts],)
    assert environment.get_wrapper_attr("settings").acts == acts
    vector = gym.make_vec(f"springfoot/{task}", num_envs=2)
    assert vector.single_observation_space == environment.observation_space
    vector.close()


def test_every_task_has_both_ids_and_a_fingerprint():
    assert list(TASKS) == [f"{name}{acts}-v0" for acts in ("", "Both") for name in STIFFNESS_TASKS]
    assert list(FINGERPRINTS) == list(TASKS)


@pytest.mark.parametrize("task", TASKS)
def test_no_task_has_moved(task):
    assert task_fingerprint(task) == pytest.approx(FINGERPRINTS[task], rel=1e-6)


def test_the_persons_of_the_tasks_are_pinned():
    assert {settings["person"] for settings in TASKS.values() if "person" in settings} == set(PERSONS_SHA256)
    assert {name: digest_of_person(name) for name in PERSONS_SHA256} == PERSONS_SHA256


def test_a_task_s_settings_are_plain_and_complete():
    for settings in TASKS.values():
        environment = settings_from(**settings)
        known = settings_to_json(environment) | {"person": environment.walker}  # None is the guide's own
        assert {name: known[name] for name in settings if "foot" not in name} == {
            name: value for name, value in settings.items() if "foot" not in name
        }
