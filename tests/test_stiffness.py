"""Equation (4), and schedules over the stride."""

import json

import numpy as np
import pytest

from springfoot.gait import Body, SpringfootError, human_gait
from springfoot.gait.stiffness import LOWEST_STIFFNESS, Segment, StiffnessSchedule, line_spring, thesis_schedule

TWO = StiffnessSchedule(ankle=(Segment(0.1, 100.0, 0.2), Segment(0.6, 20.0, 0.0)), toe=(Segment(0.0, 28.0, 0.0),))


def test_spring_of_a_line_gives_back_its_torque_at_both_ends():
    start, end = (-0.09, 2.5), (0.23, -81.0)
    stiffness, rest = line_spring(start, end)
    for angle, torque in (start, end):
        assert stiffness * (rest - angle) == pytest.approx(torque, rel=1e-12)
    assert stiffness == pytest.approx(83.5 / 0.32)


@pytest.mark.parametrize("end", [(0.3, 9.0), (0.1, 9.0), (0.3, 4.9)], ids=["rising", "standing angle", "too flat"])
def test_line_that_no_spring_follows_gets_the_lowest_through_its_middle(end):
    stiffness, rest = line_spring((0.1, 5.0), end, lowest=20.0)
    assert stiffness == 20.0
    assert stiffness * (rest - (0.1 + end[0]) / 2) == pytest.approx((5.0 + end[1]) / 2)


def test_segments_hold_until_the_next_and_wrap_around_the_stride():
    stiffness, rest = TWO.at([[0.05, 0.1, 0.59], [0.6, 0.99, 1.05]])
    assert stiffness.shape == rest.shape == (2, 3, 2)
    np.testing.assert_array_equal(stiffness[..., 0], [[20, 100, 100], [20, 20, 20]])
    np.testing.assert_array_equal(rest[..., 0], [[0, 0.2, 0.2], [0, 0, 0]])
    np.testing.assert_array_equal(stiffness[..., 1], 28)


def test_json_round_trip_is_exact():
    schedule = thesis_schedule(Body(1.83, 71.0))
    assert StiffnessSchedule.from_json(json.loads(json.dumps(schedule.to_json()))) == schedule


def test_thesis_schedule_follows_peoples_torque_at_its_events_and_is_soft_in_swing():
    body = Body()
    schedule, human = thesis_schedule(body), human_gait(1.2)
    foot_flat, dorsiflexed, toe_off = (segment.start for segment in schedule.ankle[1:])
    assert 0.04 < foot_flat < 0.10 and 0.40 < dorsiflexed < 0.48 and toe_off == human.toe_off
    for event in (foot_flat, dorsiflexed):
        for phase in (event - 1e-9, event):  # the lines meet at the events
            stiffness, rest = schedule.at(phase)
            torque = stiffness[0] * (rest[0] - human.mean("ankle", phase))
            assert torque == pytest.approx(-human.mean("ankle_moment", phase) * body.mass, abs=0.01)
    stance = [segment.stiffness for segment in schedule.ankle[:3]]
    assert stance[1] > stance[2] > stance[0]
    np.testing.assert_array_equal(schedule.at(0.8)[0], LOWEST_STIFFNESS)
    assert schedule.at(0.3)[0][1] == 28.0 and np.all(schedule.at(0.8)[1] == 0)


def test_thesis_schedule_scales_with_mass_times_height_at_equal_froude_speed():
    small, large = Body(1.5, 50.0), Body(1.8, 75.0)
    small_k, small_rest = thesis_schedule(small, 1.1).at(np.linspace(0, 0.99, 50))
    large_k, large_rest = thesis_schedule(large, 1.1 * np.sqrt(1.2)).at(np.linspace(0, 0.99, 50))
    np.testing.assert_allclose(large_k, small_k * 1.5 * 1.2)
    np.testing.assert_allclose(large_rest, small_rest, atol=1e-12)


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (None, "keys"),
        ({"ankle": [[0, 1, 0]]}, "keys"),
        ({"ankle": 3, "toe": [[0, 1, 0]]}, "list"),
        ({"ankle": [[0, 1]], "toe": [[0, 1, 0]]}, "segment"),
        ({"ankle": [], "toe": [[0, 1, 0]]}, "at least one"),
        ({"ankle": [[0.5, 1, 0], [0.2, 1, 0]], "toe": [[0, 1, 0]]}, "ascend"),
        ({"ankle": [[0, -1, 0]], "toe": [[0, 1, 0]]}, "stiffness"),
        ({"ankle": [[0, float("nan"), 0]], "toe": [[0, 1, 0]]}, "stiffness"),
        ({"ankle": [[0, 1, "a"]], "toe": [[0, 1, 0]]}, "equilibrium"),
        ({"ankle": [[1, 1, 0]], "toe": [[0, 1, 0]]}, "below 1"),
    ],
)
def test_bad_schedules_are_refused_with_one_line(data, word):
    with pytest.raises(SpringfootError, match=word) as caught:
        StiffnessSchedule.from_json(data)
    assert "\n" not in str(caught.value)
