"""Any walk asked for is either valid in every sense the plan promises, or refused with a number; never NaN."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from springfoot.gait import Body, SpringfootError, plan_walk
from springfoot.gait.body.body import REFERENCE_HEIGHT
from springfoot.gait.plan.foot import FLOOR_TOLERANCE
from springfoot.gait.plan.plan import PLAN_SPEED_RANGE, SLOPE_RANGE, STEP_TIME_RANGE, WalkPlan

SAMPLES = 10_000
PHASE = np.arange(SAMPLES) / SAMPLES
EXAMPLES = settings(derandomize=True, deadline=None, max_examples=50)


@st.composite
def walks(draw) -> tuple[Body, float, dict]:
    """A body, a speed [m/s] and arguments of `plan_walk`, one in three of them given; lengths go with the body."""
    height = draw(st.floats(1.4, 2.0))
    body = Body(height, draw(st.floats(16.0, 40.0)) * height**2)

    def sometimes(values):
        return draw(st.none() | st.none() | values)

    step_time = sometimes(st.floats(*STEP_TIME_RANGE))
    part, com, rise, lowest = (
        sometimes(st.floats(*limits)) for limits in ((0.03, 0.4), (0.50, 0.60), (0.0, 0.03), (0.0, 0.2))
    )
    zmp = sometimes(st.tuples(st.floats(-0.05, 0.06), st.floats(0.06, 0.10)))
    asked = {
        "cadence": draw(st.sampled_from(["people", "thesis"])),
        "step_time": step_time,
        "double_support": None if part is None else part * (step_time or 0.5),
        "com_height": None if com is None else com * height,
        "com_amplitude": None if rise is None else draw(st.sampled_from([0.0, rise * height])),
        "zmp_travel": None if zmp is None else (zmp[0] * height, zmp[1] * height),
        "slope": draw(st.just(0.0) | st.floats(*SLOPE_RANGE)),
        "clearance": None if lowest is None else lowest * height,
    }
    return body, draw(st.floats(*PLAN_SPEED_RANGE)), asked


def assert_valid(plan: WalkPlan) -> None:
    body, feet = plan.body, plan.feet
    everything = [*plan.com(PHASE), *plan.com_velocity(PHASE), *plan.com_acceleration(PHASE), plan.zmp(PHASE)]
    everything += [*plan.joint_angles(PHASE).values(), *plan.hip_position(PHASE)]
    everything += [*plan.feet.ankle(PHASE), *plan.toe_joint_position(PHASE), feet.pitch(PHASE)]
    assert all(np.isfinite(values).all() for values in everything)

    rear, front = plan.support(PHASE)
    zmp = plan.zmp(PHASE)
    assert np.all(zmp >= rear - 1e-6) and np.all(zmp <= front + 1e-6)
    _, lift = plan.com_acceleration(PHASE)
    assert lift.min() > -9.81

    # Continuous and periodic: no jump between samples beyond what a bounded rate makes of them, nor from step to step.
    forward, up = plan.com_acceleration(PHASE)
    for acceleration in (forward, up):
        jumps = np.abs(np.diff(acceleration, append=acceleration[0]))
        assert jumps.max() < 20 * np.ptp(acceleration) / SAMPLES / min(plan.double_support / plan.step_time, 0.2) + 1e-9
    assert plan.com(1 - 1e-12)[0] - plan.com(0.0)[0] == pytest.approx(plan.step_length, abs=1e-8)
    np.testing.assert_allclose(plan.com_velocity(0.0), plan.com_velocity(1 - 1e-12), atol=1e-7)
    if plan.motion.bob.amplitude > 1e-6:
        assert PHASE[plan.com(PHASE)[1].argmin()] * plan.step_time < plan.double_support

    angles = plan.joint_angles(PHASE)
    assert angles["knee"].min() >= 0 and angles["knee"].max() < np.radians(135.1)
    for name, angle in angles.items():
        assert np.abs(np.diff(angle, append=angle[0])).max() < 0.05, name

    planted = np.linspace(feet.foot_flat, feet.tip_off, 500)
    _, toe_joint = plan.toe_joint_position(planted)
    assert np.ptp(toe_joint) == 0.0 and toe_joint[0] == body.toe_joint_height
    flat = np.linspace(feet.foot_flat, feet.heel_off, 102)[1:-1]
    assert np.all(feet.pitch(flat) == 0.0)
    assert min(feet.ball_clearance(PHASE).min(), feet.heel(PHASE)[1].min()) > -1.1 * FLOOR_TOLERANCE
    assert_rebuilt(plan)


def assert_rebuilt(plan: WalkPlan) -> None:
    """The ankle lies where the foot is and the whole body's CoM where planned, by forward kinematics in the world."""
    body, phase = plan.body, np.arange(600) / 600
    angles, pitch = plan.joint_angles(phase), plan.feet.pitch(phase)
    up = np.array([[np.sin(plan.slope)], [np.cos(plan.slope)]])
    ahead = np.array([[np.cos(plan.slope)], [-np.sin(plan.slope)]])

    def along(angle):  # to the true vertical, seen in the frame of the ground
        return np.sin(angle) * ahead - np.cos(angle) * up

    def foot(angle, forward, upward):
        return np.stack(
            [forward * np.cos(angle) - upward * np.sin(angle), forward * np.sin(angle) + upward * np.cos(angle)]
        )

    hip = np.array(plan.hip_position(phase))
    thigh, shank = along(angles["thigh"]), along(angles["thigh"] - angles["knee"])
    knee = hip + body.thigh_length * thigh
    ankle = knee + body.shank_length * shank
    np.testing.assert_allclose(ankle, plan.feet.ankle(phase), atol=1e-9)
    np.testing.assert_allclose(angles["thigh"] - angles["knee"] + angles["ankle"] - plan.slope, pitch, atol=1e-9)
    joint = ankle + foot(pitch, body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height)
    tip = (joint + foot(pitch + angles["toe"], body.toe_length, -body.toe_joint_height))[1]
    assert tip.min() > -0.01 * body.length_scale, "toe tip in the floor"
    leg = (
        body.thigh_mass * (hip + body.thigh_com * thigh)
        + body.shank_mass * (knee + body.shank_com * shank)
        + body.foot_mass * (ankle + foot(pitch, body.foot_com[0], -body.foot_com[1]))
        + body.toe_mass * (joint + foot(pitch + angles["toe"], body.toe_com, 0.0))
    )
    other = np.roll(leg, 300, axis=1)
    other[0] += (body.mass - body.trunk_mass) / 2 * plan.step_length * np.where(phase < 0.5, -1, 1)
    com = (body.trunk_mass * (hip + body.trunk_com_above_hip * up) + leg + other) / body.mass
    planned = np.array(plan.com(2 * phase))
    planned[0] += plan.step_length * (phase >= 0.5)
    np.testing.assert_allclose(com, planned, atol=1e-9)


def plan_or_reason(plan: Callable, *args, **asked):
    try:
        return plan(*args, **asked)
    except SpringfootError as reason:
        text = str(reason)
        assert re.search(r"\d", text) and "nan" not in text and "\n" not in text, text
        event(re.sub(r"-?\d[\d.e-]*", "#", text))
        return None


@pytest.mark.slow
@EXAMPLES
@given(walks())
def test_any_walk_asked_for_is_valid_or_refused_with_a_number(walk):
    body, speed, asked = walk
    plan = plan_or_reason(plan_walk, body, speed, **asked)
    if plan is not None:
        event("valid")
        assert_valid(plan)
        if asked["clearance"] is not None:
            assert plan.feet.clearance == pytest.approx(asked["clearance"], abs=1e-9)


@settings(EXAMPLES, max_examples=8)
@given(st.floats(1.4, 2.0), st.floats(0.6, 1.6), st.floats(*SLOPE_RANGE))
def test_every_body_has_a_walk_at_peoples_cadence_on_every_slope(height, speed, slope):
    scale = height / REFERENCE_HEIGHT
    assert_valid(plan_walk(Body(height, 63.0 * scale**3), speed * np.sqrt(scale), slope=slope))


@settings(EXAMPLES, max_examples=40)
@given(
    st.floats() | st.integers() | st.none() | st.text(max_size=3),
    st.sampled_from(["speed", "step_time", "double_support", "com_height", "com_amplitude", "slope", "clearance"]),
)
def test_nonsense_is_refused_by_name(value, name):
    try:
        plan = plan_walk(Body(), **{name: value})
    except SpringfootError as reason:
        refusal = str(reason)
        plan = None
    if plan is None:
        assert "\n" not in refusal
    else:
        assert_valid(plan)
