"""Equation (4), and schedules over the stride."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from springfoot.gait import Body, SpringfootError, human_gait, plan_walk
from springfoot.gait.springs.quasi_stiffness import FUKUCHI_OVERGROUND
from springfoot.gait.springs.stiffness import (
    LOWEST_STIFFNESS,
    PRINTED_SWING,
    Segment,
    StiffnessSchedule,
    ankle_events,
    line_spring,
    schedule_from_curves,
    thesis_schedule,
    toe_events,
)

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


PHASE = np.linspace(0, 1, 201)
TOE_OFF = 0.62


def test_ankle_events_are_those_of_a_curve_made_of_lines():
    angle = np.interp(PHASE, [0, 0.06, 0.44, 0.62, 0.8, 1], [0.0, -0.1, 0.2, -0.3, 0.3, 0.0])
    events = ankle_events(PHASE, angle, TOE_OFF)
    assert list(events) == ["heel_strike", "foot_flat", "maximum_dorsiflexion", "toe_off"]
    np.testing.assert_allclose(list(events.values()), [0, 0.06, 0.44, 0.62])


def test_toe_events_are_those_of_a_curve_made_of_lines():
    angle = np.interp(PHASE, [0, 0.1, 0.4, 0.58, 0.62, 0.7, 1], [0.7, 0.0, 0.0, 0.6, 0.4, 0.9, 0.7])
    events = toe_events(PHASE, angle, TOE_OFF)
    assert list(events) == ["heel_strike", "heel_off", "maximum_dorsiflexion", "toe_off"]
    # 5 % of the rise is 0.009 of the stride after it began; data stand every 0.005
    np.testing.assert_allclose(list(events.values()), [0, 0.405, 0.58, 0.62], atol=1e-9)


def test_events_of_people_and_of_the_plan_lie_where_gait_has_them():
    human, plan = human_gait(1.2), plan_walk(Body(), 1.2)
    heel_off = toe_events(PHASE, human.mean("toe", PHASE), human.toe_off)
    assert 0.35 < heel_off["heel_off"] < 0.45 and 0.58 < heel_off["maximum_dorsiflexion"] < 0.62
    angles, toe_off = plan.joint_angles(PHASE), (1 + plan.double_support) / 2
    planned = toe_events(PHASE, angles["toe"], toe_off)
    heel_off = planned["heel_off"]
    before, after = np.searchsorted(PHASE, [heel_off - 0.02, heel_off + 0.001])
    assert np.all(np.abs(angles["toe"][40:before]) < 1e-4)  # flat, from 20 % on
    assert angles["toe"][after] > 0.01 and heel_off < planned["maximum_dorsiflexion"] <= toe_off
    ankle = list(ankle_events(PHASE, angles["ankle"], toe_off).values())
    assert ankle == sorted(ankle)


def test_springs_of_curves_are_those_that_made_them():
    made = StiffnessSchedule(
        ankle=(Segment(0, 60, 0.05), Segment(0.06, 200, -0.055), Segment(0.44, 120, -0.225), Segment(0.62, 0, 0)),
        toe=(Segment(0, 0, 0), Segment(0.4, 30, 0.0), Segment(0.58, 90, 0.4), Segment(0.62, 0, 0)),
    )
    ankle = np.interp(PHASE, [0, 0.06, 0.44, 0.62, 1], [0.0, -0.1, 0.2, -0.225, 0.0])
    toe = np.interp(PHASE, [0, 0.1, 0.4, 0.58, 0.62, 1], [0.3, 0.0, 0.0, 0.6, 0.4, 0.3])
    stiffness, rest = made.at(PHASE)
    torque = stiffness * (rest - np.stack([ankle, toe], -1))
    found = schedule_from_curves(PHASE, TOE_OFF, (ankle, torque[:, 0]), (toe, torque[:, 1]))
    # the ankle's lines meet at its events, so that every line is recovered
    np.testing.assert_allclose(np.array(found.ankle[1:]), np.array(made.ankle[1:]), atol=1e-9)
    assert found.toe[1].stiffness == pytest.approx(30, rel=1e-6)
    assert found.toe[1].equilibrium == pytest.approx(0, abs=1e-6)
    assert found.ankle[-1] == found.toe[-1] == Segment(TOE_OFF, 0.0, 0.0)
    assert found.toe[0].stiffness == 0  # locked flat: no spring follows an angle that stands


def test_events_that_coincide_leave_no_line_between_them():
    rising = np.interp(PHASE, [0, TOE_OFF, 1], [0.0, 0.3, 0.0])
    assert ankle_events(PHASE, rising, TOE_OFF)["foot_flat"] == 0
    schedule = schedule_from_curves(PHASE, TOE_OFF, (rising, -100 * rising), lowest=(20.0, 5.0))
    np.testing.assert_allclose(schedule.ankle, [(0, 100, 0), (TOE_OFF, 20, 0)], atol=1e-9)
    assert schedule.toe == (Segment(0, 28, 0), Segment(TOE_OFF, 5, 0))
    falling = schedule_from_curves(PHASE, TOE_OFF, (-rising, 100 * rising))
    np.testing.assert_allclose(falling.ankle, [(0, 100, 0), (TOE_OFF, 0, 0)], atol=1e-9)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"phase": PHASE[::-1]}, "ascend"),
        ({"phase": PHASE + 0.1}, "ascend"),
        ({"phase": PHASE[:100] / 2}, "shapes"),
        ({"toe_off": 1.2}, "toe_off"),
        ({"toe_off": 0.0}, "toe_off"),
        ({"ankle": (np.full(201, np.nan), PHASE)}, "finite"),
        ({"ankle": (PHASE, PHASE[:7])}, "shapes"),
        ({"toe": (PHASE, np.full(201, np.inf))}, "finite"),
        ({"lowest": (-1.0, 0.0)}, "lowest"),
    ],
)
def test_bad_curves_are_refused_with_one_line(change, word):
    given = {"phase": PHASE, "toe_off": TOE_OFF, "ankle": (PHASE, -PHASE)} | change
    with pytest.raises(SpringfootError, match=word) as caught:
        schedule_from_curves(**given)
    assert "\n" not in str(caught.value)


def test_ankle_of_people_is_as_stiff_as_another_laboratory_found_within_two_sd():
    human, phase = human_gait(1.2), np.arange(100) / 100  # the middle of the published class of speeds
    angle, moment = human.mean("ankle", phase), human.mean("ankle_moment", phase)
    slope, deviation = [], []
    for _, start, end, median, sd in FUKUCHI_OVERGROUND:
        inside = (phase >= start) & (phase < end)
        slope.append(np.polyfit(angle[inside], moment[inside], 1)[0])
        deviation.append((slope[-1] - median) / sd)
    loading, early, late, push_off = slope
    assert late > 2 * early > 0 and early > push_off > loading > 0
    # One laboratory's mean curve against another's single trials: dorsiflexion agrees within one SD, the short
    # loading and push-off are softer here by more than one.
    assert np.all(np.abs(deviation) < 2)
    assert np.all(np.abs(deviation[1:3]) < 1)
    assert deviation[0] < -1 and deviation[3] < -1


REFERENCE = Path(__file__).resolve().parents[4] / "shared" / "reference" / "ankle_quasi_stiffness_fukuchi.csv"


@pytest.mark.skipif(not REFERENCE.is_file(), reason="the measured data are not ours to give away: ../shared/reference")
def test_published_stiffness_is_that_of_the_reference_file():
    with REFERENCE.open(newline="") as file:
        (row,) = [row for row in csv.DictReader(file) if (row["mode"], row["v_lo"]) == ("Overground", "1.1")]
    ends = [float(row[name]) for name in ("ERP_start_pct", "LRP_start_pct", "DP_start_pct", "DP_end_pct")]
    for (_, start, end, median, sd), name, low, high in zip(
        FUKUCHI_OVERGROUND, ("CP", "ERP", "LRP", "DP"), [0.0, *ends[:-1]], ends, strict=True
    ):
        assert (start, end) == pytest.approx((low / 100, high / 100))
        assert (median, sd) == (float(row[f"{name}_median"]), float(row[f"{name}_sd"]))


def test_json_round_trip_is_exact():
    schedule = thesis_schedule(Body(1.83, 71.0))
    assert StiffnessSchedule.from_json(json.loads(json.dumps(schedule.to_json()))) == schedule


def test_thesis_schedule_follows_peoples_torque_at_its_events_and_swings_as_told():
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
    assert schedule.at(0.8)[0].tolist() == [45.0, 25.0] and schedule.at(0.3)[0][1] == 28.0
    assert np.degrees(schedule.at(0.8)[1]) == pytest.approx([0.0, 10.0])
    printed = thesis_schedule(body, swing=PRINTED_SWING)
    np.testing.assert_array_equal(printed.at(0.8)[0], LOWEST_STIFFNESS)
    assert np.all(printed.at(0.8)[1] == 0) and printed.ankle[:-1] == schedule.ankle[:-1]


def test_thesis_schedule_is_the_one_that_baselines_were_measured_with():
    schedule = thesis_schedule(Body(), swing=PRINTED_SWING)
    np.testing.assert_allclose(
        np.array(schedule.ankle),
        [
            (0.0, 24.61824010611919, 0.02405500649874389),
            (0.05568849335868274, 262.9899338536559, -0.08062771145544838),
            (0.4341171186824586, 140.12773015153957, -0.34985725235600895),
            (0.6328237881668493, 20.0, 0.0),
        ],
        rtol=1e-12,
    )
    assert schedule.toe == (Segment(0.0, 28.0, 0.0), Segment(0.6328237881668493, 5.0, 0.0))


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
