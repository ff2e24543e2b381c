"""Limits: held to their very value, missed alone, loosened, and measured where they say."""

import copy

import pytest

from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.settings.settings import BipedSettings, settings_to_json
from springfoot.evaluation.numbers.criteria import HUMAN_LIKE, WALKS, Criterion, fault, unmet, with_derived
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record

PLAN = reference_walk_at(BipedSettings(), 1.2).plan
METRICS = {
    "falls": 0,
    "speed_m_s": {"mean": 1.229},
    "step_length_m": PLAN.step_length,
    "cadence_steps_min": 60 / PLAN.step_time,
    "double_support_s": 0.1,
    "energy_J_kg": {"contact": 0.0},
    "environment": settings_to_json(BipedSettings()),
    "joints": {"thigh": {"rmse_deg": 3.5}, "knee": {"rmse_deg": 4.5}, "ankle": {"rmse_deg": 4.0}},
    "grf": {"vertical_peak1_bw": 1.3, "vertical_peak2_bw": 1.0, "vertical_r": 0.93},
}


def test_limits_hold_to_their_very_value():
    assert unmet(METRICS, WALKS) == []


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("falls",), 1, "falls 1, asked ≤ 0"),
        (("energy_J_kg", "contact"), 0.0004, "contact work 0.0004 J/kg, asked ≤ 0 J/kg"),
        (("speed_m_s", "mean"), 1.231, "speed off by 0.031 m/s, asked ≤ 0.030 m/s"),
        (("speed_m_s", "mean"), None, "speed off by ?, asked ≤ 0.030 m/s"),
        (("joints", "knee", "rmse_deg"), 4.51, "knee 4.51°, asked ≤ 4.50°"),
        (("joints", "ankle", "rmse_deg"), None, "ankle ?, asked ≤ 4.00°"),
        (("grf", "vertical_peak2_bw"), 1.31, "vertical_peak2_bw 1.31 BW, asked ≤ 1.30 BW"),
        (("grf", "vertical_r"), 0.92, "vertical_r 0.920, asked ≥ 0.930"),
    ],
)
def test_each_limit_alone_is_missed(path, value, said):
    metrics = copy.deepcopy(METRICS)
    place = metrics
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert unmet(metrics, WALKS) == [said]


@pytest.mark.parametrize(
    ("work", "said"), [(-0.05, ""), (0.0, ""), (None, ""), (1e-6, "1e-06 J/kg"), (0.168, "0.168 J/kg")]
)
def test_ground_that_gives_energy_is_a_fault(work, said):
    found = fault({"energy_J_kg": {"contact": work}})
    assert (
        found.startswith(f"Fault of the simulation: ground and joint stops put {said} a stride")
        if said
        else found == ""
    )


def test_a_loosened_limit_is_wider_at_each_of_its_ends():
    braking = Criterion(name="", path=("x",), low=-0.2, high=-0.12, loosen="share").loosened()
    assert (braking.low, braking.high) == pytest.approx((-0.24, -0.096))
    r = Criterion(name="", path=("x",), low=0.98, loosen="r").loosened()
    assert r.holds({"x": 0.96}) and not r.holds({"x": 0.959}) and r.holds({"x": 1.0})
    kept = Criterion(name="", path=("x",), low=59, high=65)
    assert kept.loosened() == kept


def test_every_limit_finds_its_number_in_an_evaluation():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 6.0})
    metrics = measure(record(policy, settings, name="schedule", episodes=2, threads=1)).metrics
    values = with_derived(metrics)
    assert all(limit.value(values) is not None for limit in (*WALKS, *HUMAN_LIKE))
    assert values["double_support_percent"] == pytest.approx(11, abs=4)
    assert values["off"]["cadence_percent"] < 5
    assert unmet(metrics, WALKS) == []
