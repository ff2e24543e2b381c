"""The thesis as printed: the appendix's numbers, and its faults where and as large as they are."""

from math import cos, pi, sin

import numpy as np
import pytest

from springfoot.gait import Body, SpringfootError
from springfoot.gait.plan.thesis import GRAVITY, ThesisWalk, table_1

WEIGHT = 63 * GRAVITY
TIMES = np.linspace(0.5, 1.25, 15_001)
INTERPOLATIONS = ("line and sine", "not-a-knot", "least-squares cubic")


def test_table_1_is_printed():
    printed_cm = {"l_foot": 25.84, "l_toe": 6.8, "l_bf": 8.67, "l_ff": 17.17, "l_ft": 19.04, "l_ankle": 6.8}
    rounded_up = {"l_shank": 41.7, "l_thigh": 41.7}
    lengths = table_1()
    assert lengths.keys() == printed_cm.keys() | rounded_up.keys()
    assert {symbol: 100 * lengths[symbol] for symbol in printed_cm} == pytest.approx(printed_cm)
    assert {symbol: 100 * lengths[symbol] for symbol in rounded_up} == pytest.approx(rounded_up, abs=0.0501)
    assert table_1(Body(2.0, 80.0))["l_foot"] == pytest.approx(0.304)


@pytest.mark.parametrize("k", [0, 1, 4])
def test_knots_are_the_appendix_formulas(k):
    D_s, x_ed, x_sd, T_c, T_d, T_m = 0.6, 0.25, 0.25, 0.5, 0.06, 0.25
    q_b, q_f, L_a0, H_a0, l_an, l_bf, l_ft = 0.4, 0.13, 0.4654, 0.14, 0.068, 0.0867, 0.1037
    t = [k * T_c, k * T_c + T_d, k * T_c + T_m, (k + 1) * T_c, (k + 1) * T_c + T_d, (k + 1) * T_c + T_m]
    x_com = [k * D_s + x_ed, (k + 1) * D_s - x_sd, (k + 1) * D_s - 0.5 * x_sd]
    x_com += [(k + 1) * D_s + x_ed, (k + 2) * D_s - x_sd, (k + 2) * D_s - 0.5 * x_sd]
    z_com = [-0.012 * sin(4 * pi * (time - 2.62)) + 0.89 for time in t]
    x_a = [k * D_s, k * D_s + l_an * sin(q_b) + l_ft * (1 - cos(q_b)), k * D_s + L_a0]
    x_a += [(k + 2) * D_s - l_an * sin(q_f) - l_bf * (1 - cos(q_f)), (k + 2) * D_s, (k + 2) * D_s]
    z_a = [l_an, l_ft * sin(q_b) + l_an * cos(q_b), H_a0, l_bf * sin(q_f) + l_an * cos(q_f), l_an, l_an]
    x_t = [k * D_s + l_ft, k * D_s + l_ft, k * D_s + L_a0 + l_ft]
    x_t += [(k + 2) * D_s - l_an * sin(q_f) - l_bf * (1 - cos(q_f)) + l_ft * cos(q_f)]
    x_t += [(k + 2) * D_s + l_ft, (k + 2) * D_s + l_ft]
    z_t = [0, 0, H_a0 - l_an, (l_bf + l_ft) * sin(q_f), 0, 0]

    walk = ThesisWalk(k=k)
    np.testing.assert_allclose(walk.knot_times, t, rtol=0, atol=1e-12)
    for got, wanted in (
        (walk.com_knots, (x_com, z_com)),
        (walk.ankle_knots, (x_a, z_a)),
        (walk.toe_joint_knots, (x_t, z_t)),
    ):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_curves_pass_their_knots(interpolation):
    walk = ThesisWalk(interpolation=interpolation)
    t = walk.knot_times
    np.testing.assert_allclose(walk.ankle(t), walk.ankle_knots, atol=1e-12)
    np.testing.assert_allclose(walk.toe_joint(t), walk.toe_joint_knots, atol=1e-12)
    missed = np.abs(walk.com(t)[0] - walk.com_knots[0]).max()
    assert missed == pytest.approx(0.0459, abs=1e-4) if interpolation == "least-squares cubic" else missed < 1e-12


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_acceleration_is_that_of_the_com(interpolation):
    walk, t, step = ThesisWalk(interpolation=interpolation), TIMES[10:-10], 2e-4
    (x0, z0), (x1, z1), (x2, z2) = (walk.com(t + shift) for shift in (-step, 0, step))
    forward, up = walk.com_acceleration(t)
    np.testing.assert_allclose((x2 - 2 * x1 + x0) / step**2, forward, atol=0.05)  # the spline's has corners
    np.testing.assert_allclose((z2 - 2 * z1 + z0) / step**2, up, atol=1e-4)


def test_step_k_is_the_first_moved_on():
    first, fourth = ThesisWalk(), ThesisWalk(k=4)
    later, further = TIMES + 3 * 0.5, 3 * 0.6
    np.testing.assert_allclose(fourth.zmp(later), first.zmp(TIMES) + further, atol=1e-9)
    np.testing.assert_allclose(fourth.joint_torque("toe", later), first.joint_torque("toe", TIMES), atol=1e-6)


@pytest.mark.parametrize(
    ("interpolation", "least", "most"),
    [("line and sine", -1.08, 1.08), ("not-a-knot", -2.05, 0.92), ("least-squares cubic", -0.67, 0.68)],
)
def test_fore_aft_force_in_body_weights(interpolation, least, most):
    forward, _ = ThesisWalk(interpolation=interpolation).ground_reaction(TIMES)
    assert forward.min() / WEIGHT == pytest.approx(least, abs=0.005)
    assert forward.max() / WEIGHT == pytest.approx(most, abs=0.005)


def test_vertical_force_is_one_sine_in_the_wrong_phase():
    walk = ThesisWalk()
    _, up = walk.ground_reaction(TIMES)
    swing = 0.012 * (4 * pi) ** 2 / GRAVITY
    assert up.min() / WEIGHT == pytest.approx(1 - swing, abs=1e-6) and 1 - swing == pytest.approx(0.807, abs=5e-4)
    assert up.max() / WEIGHT == pytest.approx(1 + swing, abs=1e-6) and 1 + swing == pytest.approx(1.193, abs=5e-4)
    # Least as double support begins, most at mid-stance: people's do the reverse.
    single = (TIMES >= 0.56) & (TIMES <= 1.0)
    assert TIMES[single][up[single].argmax()] == pytest.approx((0.56 + 1.0) / 2, abs=0.05)
    np.testing.assert_allclose(walk.com_height(np.array([0.5, 0.75])), [0.902, 0.878], atol=5e-5)


def test_zmp_leaves_the_feet():
    walk = ThesisWalk()
    outside = walk.zmp_outside(TIMES)
    rear, front = walk.support(TIMES)
    np.testing.assert_array_equal(outside != 0, (walk.zmp(TIMES) < rear) | (walk.zmp(TIMES) > front))
    assert np.mean(outside != 0) == pytest.approx(0.91, abs=0.005)
    assert outside.max() == pytest.approx(0.754, abs=2e-3)  # ahead of the toe tip, as single support ends
    assert outside.min() == pytest.approx(-0.848, abs=1e-3)  # behind the heel, before mid-stance
    assert walk.zmp(TIMES[outside.argmax()]) == pytest.approx(1.2 + 0.1717 + 0.754, abs=2e-3)


def test_support_is_both_feet_for_the_double_support_then_one():
    walk = ThesisWalk()
    rear, front = walk.support(np.array([0.5, 0.55, 0.57, 0.99, 1.0, 1.05, 1.07]))
    np.testing.assert_allclose(rear + 0.0867, [0.6, 0.6, 1.2, 1.2, 1.2, 1.2, 1.8], atol=1e-12)
    np.testing.assert_allclose(front - 0.1717, [1.2, 1.2, 1.2, 1.2, 1.8, 1.8, 1.8], atol=1e-12)


def test_matlabs_quotient_makes_the_zmp_follow_the_com():
    walk = ThesisWalk(interpolation="least-squares cubic", division="matrix")
    behind = walk.com(TIMES)[0] - walk.zmp(TIMES)
    t = walk.knot_times
    (forward, up), (_, z) = walk.com_acceleration(t), walk.com(t)
    quotient = np.linalg.lstsq((up + GRAVITY)[:, None], z * forward, rcond=None)[0]  # what / does with two rows
    np.testing.assert_allclose(behind, np.broadcast_to(quotient, TIMES.shape), atol=1e-12)
    assert np.ptp(behind) < 1e-12 and 0 < behind[0] < 0.01


def test_joint_torque_has_the_sine_twice():
    walk, t = ThesisWalk(), ThesisWalk().knot_times
    (ax, az), (forward, up), zmp = walk.ankle(t), walk.ground_reaction(t), walk.zmp(t)
    arm = np.stack([ax - zmp, 0 * t, az])
    angles = (pi / 2 - np.arctan2(az, ax - zmp)) + (pi / 2 - np.arctan2(up, forward))
    r_torque = np.sin(np.stack([angles, 1 + 0 * t, 1 + 0 * t])) * arm
    force = np.stack([forward, 0 * t, up])
    np.testing.assert_allclose(walk.joint_torque("ankle", t), np.cross(r_torque.T, force.T)[:, 1], atol=1e-9)
    np.testing.assert_allclose(walk.cross_product("ankle", t), np.cross(arm.T, force.T)[:, 1], atol=1e-9)
    assert np.abs(walk.joint_torque("ankle", t) - walk.cross_product("ankle", t)).max() > 500


def test_cross_product_is_plantarflexion_positive():
    """At the middle of single support of the standing foot, a force ahead of the ankle asks for plantarflexion."""
    walk = ThesisWalk()
    t = TIMES[(TIMES > 1.06) & (walk.zmp(TIMES) > walk.ankle(TIMES)[0] + 0.8)]
    assert len(t) and np.all(walk.cross_product("ankle", t) > 0)


def test_foot_is_short_at_heel_strike_and_not_flat_in_stance():
    walk = ThesisWalk()
    lengths = np.hypot(*np.subtract(walk.ankle_knots, walk.toe_joint_knots))
    np.testing.assert_allclose(1000 * lengths, [124.0, 124.0, 124.0, 116.1, 124.0, 124.0], atol=0.05)
    flat = TIMES >= 1.06
    assert walk.toe_joint(TIMES[flat])[1].min() == pytest.approx(-0.0233, abs=1e-4)
    assert walk.ankle(TIMES[flat])[1].min() == pytest.approx(0.0620, abs=1e-4)


def test_axis_of_the_figures_is_not_the_stride():
    np.testing.assert_allclose(ThesisWalk().normalised_time(np.array([0.5, 1.25])), [0.0, 1.0])
    np.testing.assert_allclose(ThesisWalk().normalised_time(1.0), 2 / 3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ThesisWalk(interpolation="spline"), "interpolation must be one of line and sine, not-a-knot"),  # type: ignore[arg-type]
        (lambda: ThesisWalk(division="/"), "division must be one of elementwise, matrix"),  # type: ignore[arg-type]
        (lambda: ThesisWalk(k=-1), "k must be a whole number >= 0"),
        (lambda: ThesisWalk().com([0.5, 1.3]), r"time must be in \[0.5, 1.25\] s, step 1"),
        (lambda: ThesisWalk().zmp(np.nan), r"time must be in \[0.5, 1.25\] s"),
        (lambda: ThesisWalk().joint_torque("knee", 1.0), "joint must be one of ankle, toe, got 'knee'"),  # type: ignore[arg-type]
    ],
)
def test_refuses(call, message):
    with pytest.raises(SpringfootError, match=message):
        call()


@pytest.mark.parametrize("derivative", [1, 2, 3])
def test_each_derivative_of_the_height_is_the_rate_of_the_one_before(derivative):
    walk, time, step = ThesisWalk(), np.linspace(0.55, 1.2, 40), 1e-6
    before, after = (walk.com_height(time + shift, derivative - 1) for shift in (-step, step))
    assert walk.com_height(time, derivative) == pytest.approx((after - before) / (2 * step), rel=1e-4, abs=1e-4)
