"""The plan against its own physics (cart-table, rockers, kinematics) and against people."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from springfoot.gait import GRAVITY, Body, SpringfootError, human_gait, plan_walk
from springfoot.gait.body.rockers import turned
from springfoot.gait.plan.foot import ROCKER_MARGIN, feet_under_zmp
from springfoot.gait.plan.foot_style import peoples_style
from springfoot.gait.plan.plan import Cadence
from springfoot.gait.plan.posture import leg_angles

PHASE = np.arange(10_000) / 10_000


@cache
def plan_of(cadence: Cadence = "people", speed=1.2, height=1.70, proportions=(), **settings):
    return plan_walk(Body(height, 63.0, *proportions), speed, cadence, **settings)


PLANS = pytest.mark.parametrize(
    "arguments",
    [("people",), ("thesis",), ("people", 0.6), ("people", 1.8), ("people", 1.0, 1.5), ("thesis", 1.4, 2.0)]
    + [("people", 1.2, 1.7, proportions) for proportions in ((0.94, 1.07), (1.06, 0.93), (1.0, 1.0, 0.3))],
    ids=str,
)


def rms_deg(plan, name):
    phase = np.arange(1000) / 1000
    return np.degrees(np.sqrt(np.mean((plan.joint_angles(phase)[name] - plan.human.mean(name, phase)) ** 2)))


def recomputed_zmp(plan, phase, step=1e-4):
    """Equation (1) with accelerations by finite differences of the positions alone."""
    (x0, z0), (x1, z1), (x2, z2) = (plan.com(phase + shift) for shift in (-step, 0.0, step))
    interval = step * plan.step_time
    return x1 - z1 * (x2 - 2 * x1 + x0) / ((z2 - 2 * z1 + z0) + GRAVITY * interval**2)


def test_step_is_that_of_people_or_of_the_thesis():
    people, thesis = plan_of(), plan_of("thesis")
    assert people.step_length == pytest.approx(0.66, abs=0.005) and people.step_time == pytest.approx(0.55, abs=0.005)
    assert thesis.step_length == pytest.approx(0.6) and thesis.step_time == pytest.approx(0.5)
    assert thesis.double_support == pytest.approx(0.06)


@PLANS
def test_zmp_recomputed_from_the_motion_stays_inside_the_support(arguments):
    plan = plan_of(*arguments)
    inside_step = PHASE[2:-2]
    for zmp, phase, tolerance in (
        (plan.zmp(PHASE), PHASE, 0.0),
        (recomputed_zmp(plan, inside_step), inside_step, 1e-4),
    ):
        rear, front = plan.support(phase)
        assert np.all(zmp >= rear - tolerance) and np.all(zmp <= front + tolerance)


def test_two_feet_support_from_the_trailing_toe_to_the_leading_foot():
    plan = plan_of()
    double_support = plan.double_support / plan.step_time
    phase = PHASE[double_support > PHASE]
    rear, front = plan.support(phase)
    np.testing.assert_allclose(rear, plan.feet.on_ground(phase / 2 + 0.5)[0] - plan.step_length)
    np.testing.assert_allclose(front, plan.feet.on_ground(phase / 2)[1])


def test_planned_zmp_runs_straight_across_and_then_along_the_stance_foot():
    plan = plan_of()
    times = np.array([0.0, plan.double_support, plan.step_time])
    straight = np.interp(PHASE * plan.step_time, times, [0.140 - plan.step_length, -0.020, 0.140])
    assert np.abs(plan.zmp(PHASE) - straight).max() < 1e-6


@PLANS
def test_speed_closes_and_net_fore_aft_impulse_is_zero(arguments):
    plan = plan_of(*arguments)
    assert plan.step_length / plan.step_time == pytest.approx(plan.speed)
    (start, _), (end, _) = plan.com(0.0), plan.com(1 - 1e-12)
    assert end - start == pytest.approx(plan.step_length, abs=1e-9)
    for ends in (plan.com_velocity, plan.com_acceleration):
        np.testing.assert_allclose(ends(0.0), ends(1 - 1e-12), atol=1e-6)
    forward, up = plan.com_acceleration(PHASE)
    assert abs(forward.mean()) < 1e-6 and abs(up.mean()) < 1e-9


@PLANS
def test_com_is_lowest_in_double_support(arguments):
    plan = plan_of(*arguments)
    _, height = plan.com(PHASE)
    assert PHASE[height.argmin()] * plan.step_time == pytest.approx(plan.double_support / 2, abs=1e-3)


def test_walking_com_height_and_rise_are_peoples():
    plan = plan_of()
    _, height = plan.com(PHASE)
    assert 0.965 < height.mean() < 0.985
    assert 0.034 < height.max() - height.min() < 0.041


@PLANS
def test_toe_joint_stands_still_until_the_toe_leaves_the_ground(arguments):
    plan = plan_of(*arguments)
    feet, body = plan.feet, plan.body
    assert 0 < feet.foot_flat < feet.heel_off < 0.5 < feet.toe_off < 1
    planted = np.linspace(feet.foot_flat, feet.toe_off, 2001)
    x, z = plan.toe_joint_position(planted)
    assert np.ptp(z) <= 1e-12 and np.ptp(x) <= 1e-12
    assert z[0] == pytest.approx(body.toe_joint_height, abs=1e-12)
    # It is where ankle and pitch put it, not merely declared so.
    ankle, pitch = feet.ankle(planted), feet.pitch(planted)
    arm = turned(pitch, body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height)
    np.testing.assert_allclose([ankle[0] + arm[0], ankle[1] + arm[1]], [x, z], atol=1e-12)
    flat = np.linspace(feet.foot_flat, feet.heel_off, 500)
    assert np.all(feet.pitch(flat) == 0) and np.all(plan.joint_angles(flat[5:-5])["toe"] == 0)
    heel_x, heel_z = feet.heel(np.linspace(0, feet.heel_off, 500))
    assert np.ptp(heel_x) < 1e-12 and np.abs(heel_z).max() < 1e-12


@PLANS
def test_swing_foot_clears_the_floor_and_lands_two_steps_on_smoothly(arguments):
    plan = plan_of(*arguments)
    feet = plan.feet
    swing = np.linspace(feet.toe_off, 1, 500)[1:-1]
    assert feet.ball_clearance(swing).min() > -1e-12 and feet.heel(swing)[1].min() > -0.003
    assert 0.014 < feet.clearance / plan.body.length_scale < 0.020
    tiny = 1e-7
    for event, step in ((feet.toe_off, 0.0), (1.0, 2 * plan.step_length)):
        for before, after in zip(feet.ankle(event - tiny), feet.ankle(event + tiny), strict=True):
            assert min(abs(after - before), abs(after + step - before)) < 1e-5


@PLANS
def test_joint_angles_rebuild_the_planned_body(arguments):
    """Forward kinematics from the angles: the ankle lies where the foot is, the whole body's CoM where planned."""
    plan = plan_of(*arguments)
    body = plan.body
    phase = np.arange(600) / 600
    angles, hip = plan.joint_angles(phase), np.array(plan.hip_position(phase))

    def along(angle, length):
        return length * np.stack([np.sin(angle), -np.cos(angle)])

    thigh, shank = angles["thigh"], angles["thigh"] - angles["knee"]
    knee = hip + along(thigh, body.thigh_length)
    ankle = knee + along(shank, body.shank_length)
    np.testing.assert_allclose(ankle, plan.feet.ankle(phase), atol=1e-9)
    pitch = shank + angles["ankle"]
    np.testing.assert_allclose(pitch, plan.feet.pitch(phase), atol=1e-9)

    forward, below = body.foot_com
    toe_joint = ankle + turned(pitch, body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height)
    leg = (
        body.thigh_mass * (hip + along(thigh, body.thigh_com))
        + body.shank_mass * (knee + along(shank, body.shank_com))
        + body.foot_mass * (ankle + turned(pitch, forward, -below))
        + body.toe_mass * (toe_joint + turned(pitch + angles["toe"], body.toe_com, 0.0))
    )
    c, s = np.cos(body.trunk_lean), np.sin(body.trunk_lean)
    load = c * body.carried_com[0] + s * body.carried_com[1], c * body.carried_com[1] - s * body.carried_com[0]
    trunk = body.trunk_mass * (hip + body.trunk_com_above_hip * np.array([[s], [c]]))
    trunk = trunk + body.carried_mass * (hip + np.array(load)[:, None])
    other = np.roll(leg, 300, axis=1)
    leg_mass = (body.mass - body.trunk_mass) / 2
    other[0] += leg_mass * plan.step_length * np.where(phase < 0.5, -1, 1)
    com = (trunk + leg + other) / body.total_mass
    planned = np.array(plan.com(2 * phase))
    planned[0] += plan.step_length * (phase >= 0.5)
    np.testing.assert_allclose(com, planned, atol=1e-9)


@pytest.mark.parametrize("cadence", ["people", "thesis"])
@pytest.mark.parametrize("double_support", [None, 0.06])
def test_angles_are_like_peoples_at_1_2(cadence, double_support):
    plan = plan_of(cadence, double_support=double_support)
    assert rms_deg(plan, "thigh") < 4.0
    assert rms_deg(plan, "knee") < 5.0
    assert rms_deg(plan, "ankle") < 7.0


def test_step_time_replaces_the_cadence_and_the_step_follows_from_the_speed():
    plan = plan_of(step_time=0.6)
    assert plan.step_time == 0.6 and plan.step_length == pytest.approx(0.72) and plan.stride_time == 1.2


def test_step_and_swing_toe_follow_a_gait_given_in_peoples_place():
    people = human_gait(1.0)
    toe = {**people.mean_series, "toe": np.array([0.2 + 0j])}
    own = replace(people, speed=1.0, stride_time=1.25, step_length=0.625, mean_series=toe)
    plan = plan_walk(Body(), 1.2, human=own)
    # Step length and rate each take the square root of 1.2 m/s for 1.0.
    assert plan.step_length == pytest.approx(0.625 * np.sqrt(1.2))
    assert plan.step_time == pytest.approx(1.25 / 2 / np.sqrt(1.2))
    late_swing = plan.joint_angles(np.linspace((2 + plan.feet.toe_off) / 3, 0.99, 50))
    np.testing.assert_allclose(late_swing["toe"], 0.2, atol=1e-12)
    assert plan_walk(Body(), 1.2, "thesis", human=own).step_time == 0.5


@pytest.mark.parametrize("clearance", [0.0, 0.017, 0.05, 0.15])
def test_swing_foot_clears_the_floor_by_what_was_asked(clearance):
    feet = plan_of(clearance=clearance).feet
    swing = feet.toe_off + np.linspace(0.3, 0.7, 2000) * (1 - feet.toe_off)
    lowest = min(feet.ball_clearance(swing).min(), feet.heel(swing)[1].min())
    assert lowest == pytest.approx(clearance, abs=1e-5) and feet.clearance == pytest.approx(clearance, abs=1e-12)


def test_on_a_slope_the_com_stays_above_the_foot_and_the_legs_bend():
    """Uphill the CoM is ahead along the ground by z tan a, hip and ankle flex more; downhill the knee."""
    slope = np.radians(5)
    level, up, down = plan_of(), plan_of(slope=slope), plan_of(slope=-slope)
    assert up.step_length == level.step_length and up.step_time == level.step_time
    for plan, sign in ((up, 1), (down, -1)):
        ahead = plan.com(PHASE)[0].mean() - level.com(PHASE)[0].mean()
        assert ahead == pytest.approx(sign * plan.motion.height * np.tan(slope), rel=0.02)
        forward, _ = plan.com_acceleration(PHASE)
        assert abs(forward.mean()) < 1e-6  # what gravity takes on the way the ground gives back
    stance = np.linspace(0.1, 0.4, 100)
    ten = np.radians(10)
    assert up.joint_angles(0.0)["thigh"] > level.joint_angles(0.0)["thigh"] + ten
    assert up.joint_angles(stance)["ankle"].mean() > level.joint_angles(stance)["ankle"].mean() + ten / 2
    assert down.joint_angles(stance)["knee"].mean() > level.joint_angles(stance)["knee"].mean() + ten


def test_phases_wrap_and_have_any_shape():
    plan = plan_of()
    np.testing.assert_allclose(plan.joint_angles([1.25, -0.75])["knee"], plan.joint_angles(0.25)["knee"], atol=1e-12)
    assert plan.joint_angles(np.zeros((2, 3)))["toe"].shape == (2, 3)


def test_equal_froude_speed_gives_equal_angles_and_no_effect_of_mass():
    ratio = 1.9 / 1.6
    small, large = plan_walk(Body(1.6, 50.0), 1.1), plan_walk(Body(1.9, 90.0), 1.1 * np.sqrt(ratio))
    phase = np.linspace(0, 1, 101)
    for name, angle in small.joint_angles(phase).items():
        np.testing.assert_allclose(large.joint_angles(phase)[name], angle, atol=1e-4)
    assert large.step_time / small.step_time == pytest.approx(np.sqrt(ratio))


def test_leg_inverse_kinematics_reaches_its_target():
    thigh, knee = leg_angles(0.2, 0.7, 0.40, 0.43)
    assert 0.40 * np.sin(thigh) + 0.43 * np.sin(thigh - knee) == pytest.approx(0.2)
    assert 0.40 * np.cos(thigh) + 0.43 * np.cos(thigh - knee) == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("arguments", "settings", "reason"),
    [
        ((0.3,), {}, "speed"),
        ((3.0,), {}, "speed"),
        ((float("nan"),), {}, "speed"),
        ((1.2, "robot"), {}, "cadence"),
        ((2.0, "thesis"), {}, r"legs too short.* \d\.\d+ m"),
        ((1.2,), {"com_height": 1.0}, r"legs too short by 0\.\d+ m"),
        ((1.2,), {"zmp_travel": (-0.02, 0.20)}, r"outside by 0\.028 m"),
        ((1.2,), {"zmp_travel": (-0.10, 0.14)}, "outside by"),
        ((1.2,), {"double_support": 0.0}, "double_support"),
        ((1.2,), {"com_amplitude": 0.2}, "com_amplitude"),
        ((1.2,), {"slope": np.radians(5.1)}, r"slope must be in \[-0.087\d*, 0.087\d*\] rad"),
        ((1.2,), {"step_time": 2.0}, r"step_time must be in \[0.25, 1.2\] s"),
        ((0.4,), {"step_time": 0.25}, r"longer than the ZMP travel, 0.160 m, is 0.060 m too short"),
        ((1.2,), {"step_time": 1.1}, r"\d\.\d+ m lower than allowed"),
        ((1.2,), {"clearance": -0.01}, "clearance must be in"),
        ((1.2,), {"clearance": 0.5}, r"knee bent by .* \d+\.\d deg more than it can"),
        ((1.2,), {"zmp_travel": 0.1}, "zmp_travel must be 2 numbers"),
        ((1.2,), {"zmp_travel": (float("nan"), 0.14)}, "zmp_travel start"),
    ],
)
def test_impossible_plans_are_refused_with_their_reason(arguments, settings, reason):
    with pytest.raises(SpringfootError, match=reason) as caught:
        plan_walk(Body(), *arguments, **settings)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("radius", [0.0, 0.03])
@pytest.mark.parametrize("end", ["heel", "ball", "flat ball", "tip"])
def test_the_zmp_of_single_support_lies_between_heel_and_ball_and_between_ball_and_tip(end, radius):
    """A round heel touches the floor ahead of its back, by its radius."""
    body = Body(1.5, 50.0)
    heel = -body.heel_to_ankle + radius * body.length_scale
    ball = body.ankle_to_toe_joint
    flat_ball = ball + ROCKER_MARGIN * body.length_scale
    tip = ball + body.toe_length
    middle = {"start": (heel + ball) / 2, "end": (flat_ball + tip) / 2}
    name, limit, outward = {
        "heel": ("start", heel, -1.0),
        "ball": ("start", ball, 1.0),
        "flat ball": ("end", flat_ball, -1.0),
        "tip": ("end", tip, 1.0),
    }[end]
    style = replace(peoples_style(0.66 / body.leg_length, 0.0, 0.1, 0.1), heel_radius=radius)

    def feet(beyond):
        own = middle | {name: limit + outward * beyond}
        points = np.array([own["end"] - 1.0, own["start"], own["end"]])
        return feet_under_zmp(body, 1.0, np.array([0.0, 0.1, 0.55]), points, style=style)

    assert feet(-0.001).step_length == 1.0
    low, high = (heel, ball) if name == "start" else (flat_ball, tip)
    said = rf"ZMP at the {name} of single support must be in \({low:.3f}, {high:.3f}\) m .*: outside by 0\.002 m"
    with pytest.raises(SpringfootError, match=said):
        feet(0.002)
