"""The shipped policy and the committed legs: short walks held to the limits that the README's long ones keep."""

import numpy as np
import pytest

from springfoot.agents.policies.policy import find_policy
from springfoot.evaluation.numbers.criteria import WALKS, unmet
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record


def walked(name, **settings):
    """The gait of a few episodes."""
    policy, environment = policy_and_settings(name, {"episode_seconds": 10.0} | settings)
    return measure(record(policy, environment, name=name, episodes=4, threads=1))


@pytest.fixture(scope="module")
def gait():
    return walked("pretrained")


@pytest.fixture(scope="module")
def pretrained(gait):
    return gait.metrics


def test_it_is_small():
    assert find_policy("pretrained").stat().st_size <= 1_000_000


def test_it_walks_like_people_and_at_the_commanded_speed(pretrained):
    assert unmet(pretrained, WALKS) == []
    grf = pretrained["grf"]
    assert min(grf["vertical_peak1_bw"], grf["vertical_peak2_bw"]) > 0.8


def test_over_its_strides_braking_and_propulsion_cancel(gait):
    forward = gait.both.mean("grf_forward_bw")
    propulsion, braking = np.maximum(forward, 0).mean(), np.minimum(forward, 0).mean()
    assert propulsion + braking == pytest.approx(0.0, abs=0.05 * propulsion)


def test_the_neutral_legs_walk_with_a_constant_stiffness():
    assert walked("constant", equilibrium="neutral").metrics["falls"] == 0


@pytest.mark.parametrize("cadence", ["people", "thesis"])
def test_the_planned_legs_walk_with_the_schedule_they_were_tuned_with(cadence):
    metrics = walked("schedule", cadence=cadence).metrics
    assert metrics["falls"] == 0
    assert metrics["speed_m_s"]["mean"] == pytest.approx(1.2, abs=0.06)
