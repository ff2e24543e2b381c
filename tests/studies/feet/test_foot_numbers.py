"""The numbers of a walk on feet that differ, and feet side by side."""

import pytest

from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.numbers.per_leg import leg_numbers
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record, record_feet
from springfoot.studies.feet.foot_numbers import FOOT_NUMBERS, numbers_of_feet

SHORT = {"episode_seconds": 6.0}


def test_numbers_are_those_of_the_evaluation():
    acting, settings = policy_and_settings("pretrained", {**SHORT, "right_foot": "passive"})
    gait = measure(record(acting, settings, name="pretrained", episodes=2, threads=1))
    own, legs = numbers_of_feet(gait), gait.metrics["per_leg"]
    assert set(own) == set(FOOT_NUMBERS)
    assert own["sound_peak_bw"] == legs["left"]["vertical_max_mean_bw"]
    work = legs["right"]["joint_work_J_kg"]
    assert own["push_off_J_kg"] == work["ankle"]["positive"] + work["toe"]["positive"]
    assert own["step_asymmetry"] == abs(gait.metrics["asymmetry"]["step_length"])
    assert own["falls"] == gait.metrics["falls"] / 2
    stride = 2 * gait.metrics["step_length_m"]
    hips = sum(leg["joint_work_J_kg"]["hip"]["positive"] for leg in leg_numbers(gait.tally).values())
    assert own["hip_work_J_kg_m"] == pytest.approx(hips / stride)


def test_feet_side_by_side_walk_as_alone_and_the_same_episodes():
    weak = {"kind": "weak", "strength": 0.3}
    feet = [{"right_foot": "intact"}, {"left_foot": weak, "right_foot": weak}]
    acting, settings = policy_and_settings("pretrained", {**SHORT, "unevenness_m": 0.01})
    together = record_feet(acting, settings, feet, name="x", episodes=2, seed=5, threads=1)
    for worn, recording in zip(feet, together, strict=True):
        acting, settings = policy_and_settings("pretrained", {**SHORT, "unevenness_m": 0.01, **worn})
        alone = record(acting, settings, name="x", episodes=2, seed=5, threads=1)
        assert recording.settings == alone.settings
        assert recording.returns.tobytes() == alone.returns.tobytes()
        assert recording.series["angle"].tobytes() == alone.series["angle"].tobytes()


def test_a_walk_that_falls_has_its_falls_and_no_other_numbers():
    acting, settings = policy_and_settings("thesis_printed", SHORT)
    own = numbers_of_feet(measure(record(acting, settings, name="thesis_printed", episodes=1)))
    assert own["falls"] == 1.0
    assert own["fibre_J_kg_m"] is None or own["push_off_J_kg"] is None
