"""Preview control against the closed form, and against what makes it a preview."""

import numpy as np
import pytest

from springfoot.gait import GRAVITY, Body, SpringfootError, plan_walk
from springfoot.gait.plan.cart_table import zmp
from springfoot.gait.preview import preview_com

TICK, HEIGHT = 0.005, 0.97


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize("speed", [0.6, 1.2, 1.8])
def test_preview_and_closed_form_agree_over_steady_steps_at_constant_height(speed):
    """Shows 3: CoM RMSE below 2 mm in the middle of a long run."""
    plan = plan_walk(Body(), speed, com_amplitude=0.0)
    time = np.arange(0.0, 20 * plan.step_time, TICK)
    step, phase = np.divmod(time / plan.step_time, 1.0)
    closed_form = step * plan.step_length + plan.com(phase)[0]
    motion = preview_com(step * plan.step_length + plan.zmp(phase), TICK, plan.motion.height)
    middle = (step >= 7) & (step < 13)
    assert rms((motion.x - closed_form)[middle]) < 0.002
    forward, _ = plan.com_velocity(phase)
    assert rms((motion.velocity - forward)[middle]) < 0.01


def test_com_moves_before_the_reference_does_and_comes_to_rest_over_it():
    reference = np.where(np.arange(2000) * TICK < 4.0, 0.1, 0.4)
    motion = preview_com(reference, TICK, HEIGHT)
    at = round(4.0 / TICK)
    assert motion.x[0] == 0.1 and motion.velocity[0] == 0
    assert 0.2 < motion.x[at] < 0.3  # half of the way when the reference jumps
    assert np.abs(motion.x[: at - round(2.0 / TICK)] - 0.1).max() < 0.002
    assert motion.x[-1] == pytest.approx(0.4, abs=1e-5) and motion.velocity[-1] == pytest.approx(0, abs=1e-5)
    assert rms(motion.zmp - reference) < 0.02


def test_zmp_is_that_of_the_motion_and_rates_are_derivatives():
    reference = 0.05 * np.sin(np.arange(1000) * TICK * 3)
    motion = preview_com(reference, TICK, HEIGHT)
    np.testing.assert_allclose(motion.zmp, zmp(motion.x, HEIGHT, motion.acceleration, 0.0), atol=1e-12)
    # Jerk is constant within a tick: Simpson's rule on the velocity, and the mean of accelerations, are exact.
    np.testing.assert_allclose(
        np.diff(motion.velocity), TICK / 2 * (motion.acceleration[1:] + motion.acceleration[:-1]), atol=1e-12
    )
    jerk = np.diff(motion.acceleration) / TICK
    step = motion.velocity[:-1] * TICK + motion.acceleration[:-1] * TICK**2 / 2 + jerk * TICK**3 / 6
    np.testing.assert_allclose(np.diff(motion.x), step, atol=1e-12)


def test_control_is_linear_and_does_not_depend_on_where_the_origin_is():
    rng = np.random.default_rng(0)
    a, b = rng.normal(0, 0.1, (2, 600)).cumsum(axis=1) * 0.05
    of_a, of_b, of_sum = (preview_com(row, TICK, HEIGHT).x for row in (a, b, 2 * a + b))
    np.testing.assert_allclose(of_sum, 2 * of_a + of_b, atol=1e-9)
    np.testing.assert_allclose(preview_com(a + 3.0, TICK, HEIGHT).x, of_a + 3.0, atol=1e-9)


def test_a_longer_horizon_comes_nearer_to_a_walk_that_goes_on():
    """What lies beyond the horizon counts as standing: the CoM lags in proportion to exp(-rate horizon)."""
    speed, rate = 1.2, np.sqrt(GRAVITY / HEIGHT)
    ramp = speed * TICK * np.arange(3000)
    lags = [ramp[1500] - preview_com(ramp, TICK, HEIGHT, horizon=horizon).x[1500] for horizon in (1.2, 1.6, 2.4)]
    assert lags[0] > lags[1] > lags[2] > 0
    assert lags[0] / lags[1] == pytest.approx(np.exp(rate * 0.4), rel=0.1)
    assert lags[2] < 0.001


@pytest.mark.parametrize(
    ("reference", "tick", "height", "settings", "reason"),
    [
        ([[0.0, 1.0]], TICK, HEIGHT, {}, r"shape \(T,\)"),
        ([0.0], TICK, HEIGHT, {}, "T >= 2"),
        ([0.0, np.nan, 1.0], TICK, HEIGHT, {}, "nan at sample 1"),
        (["a", "b"], TICK, HEIGHT, {}, "row of numbers"),
        ([0.0, 10**400], TICK, HEIGHT, {}, "row of numbers"),
        ([0.0, 1.0], 0.0, HEIGHT, {}, "tick"),
        ([0.0, 1.0], TICK, -1.0, {}, "height"),
        ([0.0, 1.0], TICK, HEIGHT, {"horizon": 0.0}, "horizon"),
        ([0.0, 1.0], TICK, HEIGHT, {"error_weight": 0.0}, "error_weight"),
        ([0.0, 1.0], TICK, HEIGHT, {"jerk_weight": float("inf")}, "jerk_weight"),
    ],
)
def test_bad_input_is_refused_in_one_line(reference, tick, height, settings, reason):
    with pytest.raises(SpringfootError, match=reason) as caught:
        preview_com(reference, tick, height, **settings)
    assert "\n" not in str(caught.value)
