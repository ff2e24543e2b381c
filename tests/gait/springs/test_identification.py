"""Springs found again: from a simulated stride, under noise, and where they cannot be found."""

from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.stats import t as student

from springfoot.agents.policies.baselines import baseline
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.constants import leg_constants
from springfoot.envs.physics.model import ANKLE, LEFT, TOE, damping_times
from springfoot.envs.settings.settings import BipedSettings
from springfoot.gait import SpringfootError
from springfoot.gait.springs.identification import PARAMETERS, Estimate, PhaseSpring, identify
from springfoot.gait.springs.spring_fit import fit_spring, intervals
from springfoot.gait.springs.stiffness import Segment, StiffnessSchedule

K, BETA, REST = 200.0, 0.02, 0.1
BOUNDS = (0.0, 0.1, 0.3, 0.5, 0.65, 1.0)
SWITCHING = 0.02
"""K is decided every 20 ms (0.018 of a stride): data this near a bound may belong to the spring before."""


def spring_data(count=60):
    """Torque, angle, velocity of one spring moved at two frequencies, sampled at 100 Hz, and phases for them."""
    time = 0.01 * np.arange(count)
    angle = 0.06 * np.sin(7 * time) + 0.03 * np.sin(19 * time + 1)
    velocity = 0.42 * np.cos(7 * time) + 0.57 * np.cos(19 * time + 1)
    return K * (REST - angle - BETA * velocity), angle, velocity, np.linspace(0.2, 0.4, count)


@cache
def simulated_stride():
    """One stride of the left leg, walking on springs that differ in K and theta_eq from phase to phase.

    (torque, angle, velocity) each (n, joint), phases (n,), the schedule, and beta of the joints.
    """
    legs = leg_constants("neutral", "people")
    ankle, toe = np.deg2rad(legs.neutral_deg)
    rows = list(zip(BOUNDS[:-1], (0.85, 1.0, 1.15, 1.0, 0.85), (0.02, 0.0, -0.02, -0.02, 0.0), strict=True))
    schedule = StiffnessSchedule(
        ankle=tuple(
            Segment(start, factor * k, ankle + shift)
            for (start, factor, shift), k in zip(rows, legs.ankle_schedule, strict=True)
        ),
        toe=tuple(Segment(start, factor * legs.toe_schedule, toe - shift) for start, factor, shift in rows),
    )
    settings = BipedSettings(equilibrium="phase", schedule=schedule, start=0.2)
    biped, policy = Biped(settings, num_envs=1, legs=[legs]), baseline("schedule", settings)
    ticks = []
    biped.on_tick = ticks.append
    biped.reset(np.arange(1), [0])
    for _ in range(250):
        biped.step(policy(biped.observe()))
    # Springs are set at a window's start, by the phase there; torque, angle and velocity are those of its end.
    phase = np.array([tick.phase[0, LEFT] for tick in ticks])
    strikes = np.flatnonzero(np.diff(phase) < -0.5) + 1
    assert len(strikes) >= 4
    stride = slice(strikes[2], strikes[3])
    curves = [
        np.array([getattr(tick.measurement, name)[0, LEFT] for tick in ticks[stride]])
        for name in ("torque", "angle", "velocity")
    ]
    return curves, phase[stride], schedule, damping_times(biped.body)


def of_joint(joint) -> tuple[dict[str, Any], tuple[Segment, ...], float]:
    """Arguments of `identify`, the true segments and the true beta of one joint."""
    curves, phase, schedule, beta = simulated_stride()
    data = {name: curve[:, joint] for name, curve in zip(("torque", "angle", "velocity"), curves, strict=True)}
    segments = schedule.ankle if joint == ANKLE else schedule.toe
    return data | {"phase": phase, "bounds": BOUNDS, "margin": SWITCHING}, segments, float(beta[joint])


def estimates(found: PhaseSpring) -> tuple[Estimate, Estimate, Estimate]:
    """K, beta and theta_eq, which all are there."""
    assert found.stiffness and found.damping_time and found.equilibrium
    return found.stiffness, found.damping_time, found.equilibrium


def only(torque, angle, velocity, phase):
    """The spring of one phase, 20 to 40 % of the stride, where `spring_data` lies."""
    (found,) = identify(torque, angle, velocity, phase, (0.2, 0.401))
    return found


@pytest.mark.parametrize("joint", [ANKLE, TOE], ids=["ankle", "toe"])
def test_springs_of_a_simulated_stride_are_found_within_two_percent(joint):
    data, segments, beta = of_joint(joint)
    for found, true in zip(identify(**data), segments, strict=True):
        stiffness, damping_time, equilibrium = estimates(found)
        assert found.samples > 3
        assert stiffness.value == pytest.approx(true.stiffness, rel=0.02)
        assert damping_time.value == pytest.approx(beta, rel=0.02)
        # An ankle rests near 0 when loading: 2 % of an angle that small means nothing, 0.1 degrees does.
        assert equilibrium.value == pytest.approx(true.equilibrium, rel=0.02, abs=np.deg2rad(0.1))
        assert found.r2 == pytest.approx(1.0, abs=1e-9)


class NoiseOutcome(NamedTuple):
    """Effect of white noise on the estimates of one phase."""

    start: float
    """Stride phase at which it begins."""
    coverage: dict[str, float]
    """Percent of the repeats whose 95 % interval holds the true value, by parameter."""
    stiffness_bias_percent: float
    """Median estimate of K minus the true one, in percent of it."""
    expected_percent: float
    """The same as theory has it for many samples: errors in variables."""


def noise_study(
    torque, angle, velocity, phase, bounds, margin=0.0, *, torque_sd=0.0, angle_sd=0.0, velocity_sd=0.0, repeats=1000
):
    """Identify each phase `repeats` times under white noise; the truth is the spring identified from the data as given.

    The torque of that spring gets the noise `torque_sd` [N m]; `angle_sd` [rad] and `velocity_sd` [rad/s] are noise on
    the measured angle and velocity alone. A velocity taken by central differences of that angle, every h [s], has
    velocity_sd = angle_sd / (sqrt(2) h), independent of the angle's noise at the same sample.
    """
    random = np.random.default_rng(1)
    noises = (torque_sd, angle_sd, velocity_sd)
    outcomes = []
    for start, end in pairwise(bounds):
        inside = (phase >= start + margin) & (phase < end - margin)
        angles, rates = angle[inside], velocity[inside]
        fit = fit_spring(torque[inside], angles, rates)
        assert fit.solvable
        offset, K, c = fit.coefficients
        clean = (offset - K * angles - c * rates, angles, rates)
        noisy = [
            curve + sd * random.standard_normal((repeats, len(angles))) for curve, sd in zip(clean, noises, strict=True)
        ]
        truth = np.array([ratio[0] for ratio in intervals(fit)])
        value, low, high = np.moveaxis(np.array(intervals(fit_spring(*noisy))), 1, 0)
        held = np.mean((truth >= low.T) & (truth <= high.T), axis=0) * 100
        spread = np.cov(np.stack(clean[1:]), bias=True)
        expected = np.linalg.solve(spread + np.diag(np.square(noises[1:])), spread @ fit.coefficients[1:])
        outcomes.append(
            NoiseOutcome(
                start=start,
                coverage=dict(zip(PARAMETERS, held.tolist(), strict=True)),
                stiffness_bias_percent=float(100 * (np.median(value[0]) / truth[0] - 1)),
                expected_percent=float(100 * (expected[0] / truth[0] - 1)),
            )
        )
    return outcomes


@pytest.mark.parametrize(("joint", "torque_sd"), [(ANKLE, 0.5), (TOE, 0.05)], ids=["ankle", "toe"])
def test_intervals_hold_the_truth_in_95_percent_of_1000_repeats_with_torque_noise(joint, torque_sd):
    data, segments, _ = of_joint(joint)
    outcomes = noise_study(**data, torque_sd=torque_sd)
    assert len(outcomes) == len(segments)
    for result in outcomes:
        for name in PARAMETERS:
            assert 92 <= result.coverage[name] <= 98, (result.start, name)


def test_noise_on_the_angle_makes_the_spring_too_soft_as_errors_in_variables_do():
    data, _, _ = of_joint(ANKLE)
    springs = identify(**data)
    found = [noise_study(**data, angle_sd=sd) for sd in np.deg2rad([0.25, 0.5, 1.0])]
    table, expected = (  # noise level, phase
        np.array([[getattr(result, name) for result in outcomes] for outcomes in found])
        for name in ("stiffness_bias_percent", "expected_percent")
    )
    assert np.all(np.diff(table, axis=0) < 0)
    # Three parameters take their part of a few samples' noise: 6 in the shortest phase, a third of many samples'.
    assert np.all(table < 0.35 * expected) and np.all(table > expected)
    assert np.argmin(table[1]) == np.argmin([spring.angle_spread for spring in springs])

    torque, angle, velocity, where = spring_data(count=2000)
    (result,) = noise_study(torque, angle, velocity, where, (0.2, 0.401), angle_sd=0.01, repeats=100)
    spread = only(torque, angle, velocity, where).angle_spread
    factor = spread**2 / (spread**2 + 0.01**2)
    assert factor < 0.98
    assert result.expected_percent == pytest.approx(100 * (factor - 1))
    assert result.stiffness_bias_percent == pytest.approx(result.expected_percent, abs=0.5)
    assert result.coverage["stiffness"] < 50  # the intervals know nothing of it


def test_noise_on_a_differentiated_angle_reaches_the_spring_through_both():
    torque, angle, velocity, phase = spring_data(count=2000)
    sd = 0.01
    (result,) = noise_study(
        torque, angle, velocity, phase, (0.2, 0.401), angle_sd=sd, velocity_sd=sd / (np.sqrt(2) * 0.01), repeats=50
    )
    noisy = angle + sd * np.random.default_rng(4).standard_normal((50, len(angle)))
    rate = velocity[1:-1] + (noisy - angle)[:, 2:] / 0.02 - (noisy - angle)[:, :-2] / 0.02
    found = [estimates(only(torque[1:-1], x[1:-1], v, phase[1:-1]))[0].value for x, v in zip(noisy, rate, strict=True)]
    assert 100 * (np.median(found) / K - 1) == pytest.approx(result.expected_percent, abs=0.5)
    assert result.expected_percent < -2


def test_estimates_and_intervals_are_those_of_the_textbook():
    torque, angle, velocity, phase = spring_data()
    torque = torque + np.random.default_rng(2).standard_normal(len(torque))
    found = only(torque, angle, velocity, phase)
    stiffness, damping_time, equilibrium = estimates(found)
    design = np.stack([np.ones_like(angle), -angle, -velocity], -1)
    a, k, c = coefficients = np.linalg.lstsq(design, torque, rcond=None)[0]
    residual = torque - design @ coefficients
    freedom = len(torque) - 3
    covariance = np.linalg.inv(design.T @ design) * (residual @ residual) / freedom
    quantile = student.ppf(0.975, freedom)
    half = quantile * np.sqrt(covariance[1, 1])
    assert stiffness == pytest.approx((k, k - half, k + half))
    assert (damping_time.value, equilibrium.value) == pytest.approx((c / k, a / k))
    assert found.r2 == pytest.approx(1 - residual.var() / torque.var())
    # The ends of Fieller's interval: the ratios r at which a - r K is just significant.
    for ratio in equilibrium[1:]:
        weight = np.array([1.0, -ratio, 0.0])
        assert (weight @ coefficients) ** 2 == pytest.approx(quantile**2 * weight @ covariance @ weight)
    assert equilibrium.low < equilibrium.value < equilibrium.high
    assert found.warning == ""


def test_many_strides_and_any_origin_of_the_angle_give_the_same_spring():
    torque, angle, velocity, phase = spring_data()
    torque = torque + np.random.default_rng(2).standard_normal(len(torque))
    found = only(torque, angle, velocity, phase)
    folded = only(*(values.reshape(4, 15) for values in (torque, angle, velocity, phase)))
    assert folded == found
    assert only(torque, 0.01 * angle, velocity, phase).condition == pytest.approx(found.condition)  # of any unit
    stiffness, damping_time, equilibrium = estimates(only(torque, angle + 1.5, velocity, phase))
    assert (stiffness, damping_time) == tuple(pytest.approx(each) for each in estimates(found)[:2])
    assert np.subtract(equilibrium, 1.5) == pytest.approx(estimates(found)[2])


def test_data_that_do_not_tell_the_parameters_apart_are_called_so():
    torque, angle, velocity, phase = spring_data()
    still = only(np.ones(60), np.full(60, 0.1), np.zeros(60), phase)
    assert still.stiffness is None and still.equilibrium is None and still.r2 is None
    assert "too little motion" in still.warning and "told apart" in still.warning
    decay = np.exp(-5 * np.arange(60) * 0.01)  # velocity = -5 angle: only K (1 - 5 beta) can be known
    one_line = only(K * (REST - 0.9 * decay), decay, -5 * decay, phase)
    assert one_line.stiffness is None and "collinear" in one_line.warning
    few = identify(torque, angle, velocity, phase, (0.2, 0.21))[0]
    assert few.samples == 3 and few.stiffness is None and "too few" in few.warning
    small = only(torque, 0.05 * angle, velocity, phase)
    assert "too little motion" in small.warning
    for each in (still, one_line, few, small):
        assert "\n" not in each.warning and np.isfinite(each.angle_spread)


def test_springs_that_are_none_or_may_be_none_are_called_so():
    torque, angle, velocity, phase = spring_data()
    assert "grows with the angle" in only(-torque, angle, velocity, phase).warning
    loud = torque * 0.01 + 5 * np.random.default_rng(0).standard_normal(60)
    unsure = only(loud, angle, velocity, phase)
    stiffness, damping_time, equilibrium = estimates(unsure)
    assert stiffness.low <= 0 <= stiffness.high and "not significantly" in unsure.warning
    assert equilibrium[1:] == damping_time[1:] == (-np.inf, np.inf)


def test_errors_that_last_are_called_so():
    torque, angle, velocity, phase = spring_data()
    slow = only(torque + np.cos(25 * phase), angle, velocity, phase)
    assert slow.residual_correlation == pytest.approx(0.9, abs=0.1) and "too narrow" in slow.warning
    white = only(torque + np.random.default_rng(0).standard_normal(60), angle, velocity, phase)
    assert white.residual_correlation == pytest.approx(0.0, abs=0.4) and white.warning == ""


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"angle": np.zeros(5)}, "one shape"),
        ({"torque": np.full(60, np.nan)}, "finite"),
        ({"bounds": (0.2,)}, "ascending"),
        ({"bounds": (0.4, 0.2)}, "ascending"),
        ({"bounds": (0.2, 1.4)}, "bound"),
        ({"margin": -0.1}, "margin"),
    ],
)
def test_bad_data_are_refused_with_one_line(change, word):
    given = dict(zip(("torque", "angle", "velocity", "phase"), spring_data(), strict=True)) | {"bounds": (0.2, 0.4)}
    with pytest.raises(SpringfootError, match=word) as caught:
        identify(**(given | change))
    assert "\n" not in str(caught.value)
