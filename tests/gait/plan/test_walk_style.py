"""A plan of another style knows the angular momentum of its legs, so that its own moments hold the trunk upright."""

import json
from dataclasses import replace

import numpy as np
import pytest

from springfoot.gait import GRAVITY, Body, SpringfootError, foot_force, human_gait, plan_walk
from springfoot.gait.body.leg_dynamics import JOINTS, inverse_dynamics
from springfoot.gait.plan.foot_style import FootStyle
from springfoot.gait.plan.kinetics import planned_leg
from springfoot.gait.plan.walk_style import WalkStyle, least_work, styles_of

PHASE = np.arange(200) / 200
FOOT = FootStyle(
    heel_strike_pitch=0.3,
    toe_off_pitch=1.0,
    roll_pitch=0.5,
    toe_rocker_power=2.5,
    roll_power=2.5,
    via_forward=(0.32, 0.70),
    via_up=(0.18, 0.11),
    via_pitch=(-0.6, -0.05),
    toe_swing=0.1,
)
STYLE = WalkStyle(double_support=0.24, zmp_travel=(-0.02, 0.15), rise=0.5, knee=0.1, foot=FOOT)


def dynamics(plan):
    motion, load = planned_leg(plan, PHASE)
    return motion, inverse_dynamics(plan.body, motion, load, plan.slope)


@pytest.mark.parametrize("lean", [0.0, -0.05])
@pytest.mark.parametrize("body", [Body(), Body(1.9, 90.0), Body(1.6, 55.0, carried_ratio=0.2)], ids=str)
def test_the_hips_moments_hold_the_trunk_upright_or_leaning(body, lean):
    plan = plan_walk(body, 1.2, style=replace(STYLE, lean=lean))
    motion, loads = dynamics(plan)
    both = loads.moment["hip"] + np.roll(loads.moment["hip"], len(PHASE) // 2)
    forward, up = motion.hip_acceleration.T
    # Without a lean the CoM of trunk and load is upright over the hip.
    needed = np.hypot(*body.upper_moment) * (np.sin(lean) * (up + GRAVITY) - np.cos(lean) * forward)
    assert np.sqrt(np.mean((both - needed) ** 2)) < 0.02 * np.abs(both).max()
    assert plan_walk(body, 1.2).motion.ahead is None


def test_a_toe_that_rolls_later_stands_longer_and_its_moment_is_smaller():
    largest = []
    for roll_from in (0.0, 0.3, 0.6):
        plan = plan_walk(Body(), 1.2, style=replace(STYLE, foot=replace(FOOT, roll_from=roll_from)))
        feet = plan.feet
        assert feet.tip_off >= 0.5 + roll_from * (feet.toe_off - 0.5) - 1e-12
        _, cop = foot_force(plan, np.linspace(0.5, feet.tip_off, 50)[:-1])
        assert np.all(cop <= plan.body.ankle_to_toe_joint + plan.body.toe_length)
        _, loads = dynamics(plan)
        largest.append(loads.moment["toe"].max())
    assert largest[0] > 1.05 * largest[1] and largest[1] > 1.05 * largest[2]


def test_over_a_stride_the_joints_do_no_net_work():
    motion, loads = dynamics(plan_walk(Body(), 1.2, style=STYLE))
    turn = motion.rate
    rates = dict(
        zip(
            JOINTS, (turn[:, 0], turn[:, 0] - turn[:, 1], turn[:, 2] - turn[:, 1], turn[:, 3] - turn[:, 2]), strict=True
        )
    )
    power = np.array([-np.mean(loads.moment[joint] * rates[joint]) for joint in JOINTS])
    assert np.abs(power).max() > 5.0  # W: joints give to each other
    assert abs(power.sum()) < 0.02 * np.abs(power).sum()


def test_the_forces_of_both_feet_act_at_the_zmp_through_the_pivot():
    plan = plan_walk(Body(), 1.2, style=STYLE)
    force, cop = foot_force(plan, PHASE)
    half = len(PHASE) // 2
    other, other_cop = np.roll(force, half, 0), np.roll(cop, half) - plan.step_length
    first = slice(0, half)
    total = (force + other)[first]
    x_acceleration, z_acceleration = plan.com_acceleration(2 * PHASE[first])
    mass = plan.body.total_mass
    np.testing.assert_allclose(total[:, 0], mass * x_acceleration, atol=1e-6 * mass)
    np.testing.assert_allclose(total[:, 1], mass * (z_acceleration + GRAVITY), atol=1e-6 * mass)
    at = (force[:, 1] * cop + other[:, 1] * other_cop)[first] / total[:, 1]
    np.testing.assert_allclose(at, plan.zmp(2 * PHASE[first]), atol=1e-6)
    x, z = plan.com(2 * PHASE[first])
    ahead = plan.pivot(2 * PHASE[first])[0] - x
    np.testing.assert_allclose(at + z * total[:, 0] / total[:, 1], x + ahead, atol=1e-6)
    assert np.abs(ahead).max() > 0.01


def test_a_style_takes_the_place_of_all_that_people_chose():
    plan = plan_walk(Body(), 1.2, style=STYLE)
    assert plan.double_support == pytest.approx(0.24 * plan.step_time)
    assert plan.zmp([0.24, 1 - 1e-12]) == pytest.approx([-0.02, 0.15], abs=1e-6)
    assert np.degrees(plan.joint_angles(np.arange(600) / 600)["knee"].min()) == pytest.approx(np.degrees(0.1), abs=0.01)
    human = human_gait(1.2)
    noise = replace(human, mean_series={"toe": 1.0 + human.mean_series["toe"]}, toe_off=0.7)
    other = plan_walk(Body(), 1.2, style=STYLE, human=noise)
    for name, curve in plan.joint_angles(PHASE).items():
        assert np.array_equal(curve, other.joint_angles(PHASE)[name]), name


def test_a_swing_passes_its_via_points_however_many():
    foot = replace(FOOT, via_forward=(0.22, 0.52, 0.82), via_up=(0.18, 0.12, 0.1), via_pitch=(-0.8, -0.3, 0.1))
    feet = plan_walk(Body(), 1.2, style=replace(STYLE, foot=foot)).feet
    at = feet.toe_off + np.arange(1, 4) / 4 * (1 - feet.toe_off)
    np.testing.assert_allclose(feet.ankle(at)[1], foot.via_up, atol=1e-9)
    np.testing.assert_allclose(feet.pitch(at), foot.via_pitch, atol=1e-9)


def test_a_style_that_cannot_walk_is_refused():
    with pytest.raises(SpringfootError, match="legs too short"):
        plan_walk(Body(), 1.9, style=replace(STYLE, knee=1.2))


def test_the_zmp_of_a_style_goes_as_far_along_a_longer_foot():
    own, longer = (plan_walk(Body(foot_ratio=ratio), 1.2, style=least_work(1.2)) for ratio in (1.0, 1.05))
    # In the frame of the step single support ends as the other foot lands.
    assert longer.zmp(1.0 - 1e-9) == pytest.approx(1.05 * own.zmp(1.0 - 1e-9), abs=1e-6)


@pytest.mark.parametrize(
    ("place", "name", "value", "said"),
    [
        ("walk", "lean", "x", "lean must be a number within ±10, got 'x'"),
        ("walk", "rise", float("nan"), "rise must be a number within ±10, got nan"),
        ("walk", "knee", None, "knee must be a number within ±10, got None"),
        ("walk", "rise_again", [1.0], r"rise_again must be 2 numbers within ±10, got \(1.0,\)"),
        ("foot", "via_pitch", 0.5, "via_pitch must be numbers within ±10, got 0.5"),
        ("walk", "knee", 1e308, r"knee must be a number within ±10, got 1e\+308"),
        ("foot", "roll_power", 0.0, "roll_power must be > 0, got 0"),
        ("foot", "roll_from", 1.5, r"roll_from must be in \[0, 1\], got 1.5"),
        ("foot", "heel_radius", -0.1, "heel_radius must be >= 0 m, got -0.1"),
        ("walk", "step_time_ratio", 0.0, "step_time_ratio must be > 0, got 0"),
        ("foot", "via_up", [0.1], "via_forward, via_up and via_pitch must be equally many"),
    ],
)
def test_a_style_that_cannot_be_is_told_in_one_line(tmp_path, place, name, value, said):
    style = least_work(1.2).to_json()
    (style if place == "walk" else style["foot"])[name] = value
    path = tmp_path / "styles.json"
    path.write_text(json.dumps({"styles": {"1.2": style}}), encoding="utf-8")
    with pytest.raises(SpringfootError, match=f"styles.json is not a file of styles of walks: {said}"):
        styles_of(path)
