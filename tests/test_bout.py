"""Walking bouts: at rest at both ends, on the cart-table's equation in between, the planned walk in the middle."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from springfoot.gait import GRAVITY, Body, SpringfootError
from springfoot.gait.body.rockers import turned
from springfoot.gait.bout import plan_bout
from springfoot.gait.bout_com import STANDING_COM, zmp_knots
from springfoot.gait.plan.plan import Cadence
from springfoot.gait.plan.posture import STRAIGHTEST_KNEE

SIDES = ("left", "right")


@cache
def bout_of(speed=1.2, steps=6, cadence: Cadence = "people", height=1.70, **settings):
    return plan_bout(Body(height, 22 * height**2), speed, steps, cadence, **settings)


def times(bout, n=10_000):
    return np.linspace(0, bout.duration, n)


BOUTS = pytest.mark.parametrize(
    "arguments",
    [
        (1.2, 6),
        (1.2, 1),
        (0.8, 2),
        (1.6, 3),
        (0.4, 4),
        (2.0, 8),
        (1.2, 4, "thesis"),
        (1.0, 3, "people", 1.4),
        (1.4, 5, "people", 2.0),
        (0.4, 3, "thesis"),
    ],
    ids=str,
)


@BOUTS
def test_it_stands_still_at_both_ends_feet_side_by_side(arguments):
    bout = bout_of(*arguments)
    body, travelled = bout.plan.body, bout.step_lengths.sum()
    for time, x in ((0.0, 0.0), (bout.duration, travelled), (-1.0, 0.0), (bout.duration + 1.0, travelled)):
        assert np.abs([bout.com_velocity(time), bout.com_acceleration(time)]).max() < 1e-9
        com, height = bout.com(time)
        assert com == pytest.approx(x + STANDING_COM * body.length_scale, abs=1e-9)
        assert bout.zmp(time) == pytest.approx(com, abs=1e-9)
        assert height == pytest.approx(bout.com(0.0)[1], abs=1e-9)
        for side in SIDES:
            np.testing.assert_allclose(bout.ankle_position(side, time), (x, body.ankle_height), atol=1e-12)
            assert bout.foot_pitch(side, time) == 0 and bout.joint_angles(side, time)["toe"] == 0
            assert bout.joint_angles(side, time)["knee"] == pytest.approx(STRAIGHTEST_KNEE, abs=1e-6)
            assert bout.on_ground(side, time) == pytest.approx(
                (x - body.heel_to_ankle, x - body.heel_to_ankle + body.foot_length)
            )


@BOUTS
def test_zmp_recomputed_from_the_motion_stays_inside_the_support(arguments):
    bout = bout_of(*arguments)
    time, step = times(bout)[1:-1], 1e-4
    (x0, z0), (x1, z1), (x2, z2) = (bout.com(time + shift) for shift in (-step, 0.0, step))
    by_differences = x1 - z1 * (x2 - 2 * x1 + x0) / (z2 - 2 * z1 + z0 + GRAVITY * step**2)
    rear, front = bout.support(time)
    for zmp, tolerance in ((bout.zmp(time), 0.0), (by_differences, 1e-4)):
        assert np.all(zmp >= rear - tolerance) and np.all(zmp <= front + tolerance)


@BOUTS
def test_velocity_and_acceleration_are_continuous_derivatives(arguments):
    bout = bout_of(*arguments)
    time, step = times(bout, 3001)[1:-1], 1e-5
    for value, rate in ((bout.com, bout.com_velocity), (bout.com_velocity, bout.com_acceleration)):
        difference = (np.array(value(time + step)) - value(time - step)) / (2 * step)
        np.testing.assert_allclose(rate(time), difference, atol=1e-3)
    fine = bout.duration / 2 + np.linspace(-1, 1, 200_001) * bout.plan.step_time
    assert np.abs(np.diff(bout.com_acceleration(fine))).max() < 2e-3
    assert GRAVITY + bout.com_acceleration(time)[1].min() > 0.2 * GRAVITY


def test_com_solves_the_cart_table_at_moving_height_with_the_shifts_as_unknowns():
    bout = bout_of(1.2, 1)
    knots, columns = zmp_knots(bout.plan, bout.step_lengths)

    def driven(t, shifts):
        return sum(w * np.interp(t, knots, column) for w, column in zip((1, *shifts), columns.T, strict=True))

    def motion(t, state, shifts):
        pull = (GRAVITY + bout.com_acceleration(t)[1]) / bout.com(t)[1]
        return np.stack([state[1], pull * (state[0] - driven(t, shifts))])

    first, last = columns[[0, -1], 0]

    def at_rest(start, end, shifts):
        return np.array([start[0] - first, start[1], end[0] - last, end[1]])

    grid = np.unique(np.round(np.union1d(np.linspace(0, bout.duration, 601), knots), 9))
    guess = np.stack([np.linspace(first, last, len(grid)), np.zeros(len(grid))])
    solution = solve_bvp(motion, at_rest, grid, guess, p=[0.0, 0.0], tol=1e-8, max_nodes=50_000)
    assert solution.success
    assert np.abs(bout.com(grid)[0] - solution.sol(grid)[0]).max() < 1e-6
    np.testing.assert_allclose(bout.zmp_shifts, solution.p, atol=1e-6)


@BOUTS
def test_before_the_first_step_the_zmp_goes_back_and_after_the_last_it_is_ahead(arguments):
    back, ahead = bout_of(*arguments).zmp_shifts
    assert back < 0 < ahead


@pytest.mark.parametrize(("speed", "steps"), [(1.2, 20), (0.6, 14), (2.0, 20)])
def test_the_middle_of_a_long_bout_is_the_planned_walk(speed, steps):
    bout = bout_of(speed, steps)
    plan = bout.plan
    phase = np.linspace(0, 1, 100, endpoint=False)
    for k in (steps // 2 - 1, steps // 2):
        stance = "right" if k % 2 == 0 else "left"
        time = bout.heel_strikes[k] + phase * plan.step_time
        x, z = bout.com(time)
        placed = bout.step_lengths[: k + 1].sum()
        tolerance = 1e-4 if speed == 2.0 else 3e-6
        np.testing.assert_allclose([x - placed, z], plan.com(phase), atol=tolerance)
        for name, angle in bout.joint_angles(stance, time).items():
            np.testing.assert_allclose(angle, plan.joint_angles(phase / 2)[name], atol=20 * tolerance)
        x, z = bout.ankle_position(stance, time)
        np.testing.assert_allclose([x - placed, z], plan.ankle_position(phase / 2), atol=1e-9)
        beside = phase + 1e-6  # heel strike and toe-off themselves are a matter of rounding
        ends = np.array(bout.support(bout.heel_strikes[k] + beside * plan.step_time)) - placed
        np.testing.assert_allclose(ends, plan.support(beside), atol=1e-9)


def test_speed_rises_over_three_steps():
    bout = bout_of(1.2, 20)
    speeds = [np.ptp(bout.com(strike + np.array([0, bout.plan.step_time]))[0]) for strike in bout.heel_strikes[:6]]
    speeds = np.array(speeds) / bout.plan.step_time
    assert np.all(np.diff(speeds[:3]) > 0)
    assert speeds[0] < 1.0 and speeds[2] == pytest.approx(1.2, rel=0.05) and speeds[4] == pytest.approx(1.2, rel=3e-3)
    assert np.all(bout.step_lengths[3:-3] == bout.plan.step_length)


def test_the_other_foot_first_is_the_mirror_image():
    right, left = bout_of(), bout_of(first="left")
    time = times(right, 500)
    np.testing.assert_array_equal(right.com(time), left.com(time))
    for side, other in (SIDES, SIDES[::-1]):
        np.testing.assert_array_equal(right.ankle_position(side, time), left.ankle_position(other, time))
        for name, angle in right.joint_angles(side, time).items():
            np.testing.assert_array_equal(angle, left.joint_angles(other, time)[name])


@BOUTS
def test_feet_never_enter_the_ground_and_stand_still_on_it(arguments):
    bout = bout_of(*arguments)
    body, time = bout.plan.body, times(bout)
    for k, side in zip(range(len(bout.heel_strikes)), ("right", "left") * 10, strict=False):
        x, _ = bout.ankle_position(side, bout.heel_strikes[k] + bout.plan.double_support)
        assert x == pytest.approx(bout.step_lengths[: k + 1].sum(), abs=1e-9)
    for side in SIDES:
        heel, toe_joint = bout.heel_position(side, time), bout.toe_joint_position(side, time)
        assert heel[1].min() > -0.0031 and toe_joint[1].min() > body.toe_joint_height - 0.0031
        rear, front = bout.on_ground(side, time)
        down = np.isfinite(rear)
        assert np.array_equal(down, np.isfinite(front)) and np.all(rear[down] <= front[down])
        on_heel = down & (rear < toe_joint[0] - 1e-6)
        assert np.abs(heel[1][on_heel]).max() < 1e-9
        on_toe = down & (front > toe_joint[0] + 1e-6)
        assert np.abs(toe_joint[1][on_toe] - body.toe_joint_height).max() < 1e-9
        x, z = bout.ankle_position(side, time)
        quickest = 8 * bout.plan.speed + 2  # of a swing foot: nothing jumps
        assert np.abs(np.diff([x, z])).max() < quickest * time[1]


@BOUTS
def test_joint_angles_rebuild_the_planned_body(arguments):
    """Forward kinematics from the angles: ankles where the feet are, the whole body's CoM where planned."""
    bout = bout_of(*arguments)
    body = bout.plan.body
    time = bout.plan.step_time / 300 * np.arange(0, 300 * (4 + len(bout.step_lengths)), 7)
    hip = np.array(bout.hip_position(time))
    com = body.trunk_mass * (hip + np.array([[0.0], [body.trunk_com_above_hip]]))
    for side in SIDES:
        angles = bout.joint_angles(side, time)
        assert angles["knee"].min() > 0.02

        def along(angle, length):
            return length * np.stack([np.sin(angle), -np.cos(angle)])

        thigh, shank = angles["thigh"], angles["thigh"] - angles["knee"]
        knee = hip + along(thigh, body.thigh_length)
        ankle = knee + along(shank, body.shank_length)
        np.testing.assert_allclose(ankle, bout.ankle_position(side, time), atol=1e-9)
        pitch = shank + angles["ankle"]
        np.testing.assert_allclose(pitch, bout.foot_pitch(side, time), atol=1e-9)
        forward, below = body.foot_com
        toe_joint = ankle + turned(pitch, body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height)
        np.testing.assert_allclose(toe_joint, bout.toe_joint_position(side, time), atol=1e-9)
        com += (
            body.thigh_mass * (hip + along(thigh, body.thigh_com))
            + body.shank_mass * (knee + along(shank, body.shank_com))
            + body.foot_mass * (ankle + turned(pitch, forward, -below))
            + body.toe_mass * (toe_joint + turned(pitch + angles["toe"], body.toe_com, 0.0))
        )
    np.testing.assert_allclose(com / body.mass, bout.com(time), atol=1e-9)


def test_joint_rates_are_the_derivatives_and_times_have_any_shape():
    bout, step = bout_of(), 1e-6
    time = np.linspace(0.1, bout.duration - 0.1, 50)
    for name, rate in bout.joint_rates("left", time).items():
        ahead, behind = (bout.joint_angles("left", time + shift)[name] for shift in (step, -step))
        np.testing.assert_allclose(rate, (ahead - behind) / (2 * step), atol=5e-3)
    square = time[:48].reshape(6, 8)
    assert bout.zmp(square).shape == bout.support(square)[0].shape == bout.foot_pitch("left", square).shape == (6, 8)
    assert bout.joint_angles("left", 1.0)["knee"].shape == ()
    assert np.abs(list(bout.joint_rates("left", [-1.0, bout.duration + 1]).values())).max() < 1e-6


def test_settings_of_the_walk_hold_in_a_bout_too():
    bout = bout_of(1.2, 4, double_support=0.12, clearance=0.03, step_time=0.5, com_amplitude=0.0)
    assert bout.plan.double_support == 0.12 and bout.plan.step_time == 0.5
    time = times(bout)
    rear, front = bout.support(time)
    assert np.all(bout.zmp(time) >= rear) and np.all(bout.zmp(time) <= front)


@pytest.mark.parametrize(
    ("arguments", "settings", "reason"),
    [
        ((1.2, 0), {}, "steps"),
        ((1.2, 2.5), {}, "steps"),
        ((1.2, 1000), {}, "steps"),
        ((2.5, 4), {}, "speed"),
        ((1.2, 4, "robot"), {}, "cadence"),
        ((1.2, 4), {"first": "front"}, "first must be 'left' or 'right'"),
        ((1.2, 4), {"slope": 0.05}, "level ground"),
        ((2.0, 4, "thesis"), {}, r"legs too short.* \d\.\d+ m"),
        ((0.7, 2, "thesis"), {"zmp_travel": (0.006, 0.155)}, r"ZMP outside the feet by 0\.\d+ m at \d"),
    ],
)
def test_impossible_bouts_are_refused_with_their_reason(arguments, settings, reason):
    with pytest.raises(SpringfootError, match=reason) as caught:
        plan_bout(Body(), *arguments, **settings)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("steps", [1, 4])
def test_where_steps_are_very_short_the_first_and_last_swing_are_raised(steps):
    """Of 0.2 m; their plain swings would be 3.4 mm in the ground."""
    bout = bout_of(0.4, steps, "thesis")
    swings = [stride for foot in bout.feet.values() for stride in foot.strides]
    assert max(stride.lift for stride in swings) > bout.plan.feet.lift
    assert min(bout.heel_position(side, times(bout))[1].min() for side in SIDES) > -0.0031
