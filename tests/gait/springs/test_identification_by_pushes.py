"""Springs found by pushing: planted springs, ramps and reflexes; noise that lasts; what is no spring is called so."""

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from springfoot.gait import SpringfootError
from springfoot.gait.springs.identification import identify
from springfoot.gait.springs.identification_by_pushes import (
    BIN,
    REACTION_SHARE,
    REACTS,
    SPRING,
    UNKNOWN,
    PushedSpring,
    identify_pushed,
)
from springfoot.gait.springs.jackknife import fit_by_trial
from springfoot.gait.springs.spring_fit import Estimate

BETA, TICK, STRIDE = 0.02, 0.01, 1.1
BOUNDS = (0.1, 0.3, 0.45)
PLANTED = (120.0, 420.0)
"""K of the two phases between `BOUNDS`."""


def plateaus(phase):
    return np.where(phase < BOUNDS[1], *PLANTED)


def walks(
    stiffness=plateaus, *, trials=32, seconds=8.0, noise=0.0, reflex=0.0, angle_noise=0.0, push=1.0, scatter=0.0, seed=0
) -> Any:
    """Strides thrown off their mean course: arguments of `identify_pushed` except bounds; one state, the body's speed.

    The joint is a spring of `stiffness` (phase -> K) whose rest angle moves with the angle, as a gait's does, plus
    `reflex` [N m s/m] times the body's deviation of speed. Each trial has a K of its own, with a relative standard
    deviation of `scatter`, and angles by that much nearer to the rest angle. Noise [N m] on the torque lasts for 50 ms,
    and one offset of the same size for each trial.
    """
    random = np.random.default_rng(seed)
    time = TICK * np.arange(round(seconds / TICK))
    shape = trials, len(time)
    phase = (random.random((trials, 1)) + time / STRIDE * (1 + 0.02 * random.standard_normal((trials, 1)))) % 1.0
    moved, rate, speed = np.zeros((3, *shape))
    for frequency in (0.4, 0.9, 1.6, 2.7, 4.1):
        turn = 2 * np.pi * frequency
        size, other = push * 0.6 * random.standard_normal((2, trials, 1)) / (1 + frequency)
        start = 2 * np.pi * random.random((trials, 1))
        moved += 0.03 * size * np.sin(turn * time + start)
        rate += 0.03 * size * turn * np.cos(turn * time + start)
        speed += 0.1 * (size * np.cos(turn * time + start) + other * np.sin(turn * time))
    course = 0.2 * np.sin(2 * np.pi * phase) + 0.05 * np.sin(6 * np.pi * phase)
    climb = (0.4 * np.pi * np.cos(2 * np.pi * phase) + 0.3 * np.pi * np.cos(6 * np.pi * phase)) / STRIDE
    rest = 1.7 * course - 0.05 * np.cos(4 * np.pi * phase)  # K of the loop angle-torque is not the spring's
    own = scatter * random.standard_normal((trials, 1)) if scatter else 0.0
    angle, velocity = course + moved + own * (rest - course), climb + rate
    torque = stiffness(phase) * (1 + own) * (rest - angle - BETA * velocity) + reflex * speed
    if noise:
        kept = np.exp(-TICK / 0.05)
        errors = lfilter([np.sqrt(1 - kept**2)], [1, -kept], random.standard_normal(shape))
        torque += noise * (errors + random.standard_normal((trials, 1)))
    angle = angle + angle_noise * random.standard_normal(shape)
    trial = np.broadcast_to(np.arange(trials)[:, None], shape)
    columns = {"torque": torque, "angle": angle, "velocity": velocity, "phase": phase, "trial": trial}
    return {name: values.ravel() for name, values in columns.items()} | {"states": speed.reshape(-1, 1)}


def known(found: PushedSpring) -> tuple[Estimate, Estimate]:
    assert found.stiffness and found.damping_time
    return found.stiffness, found.damping_time


def test_planted_springs_are_found_without_noise_where_the_undisturbed_estimator_is_far_off():
    data = walks()
    for found, true in zip(identify_pushed(**data, bounds=BOUNDS, spacing=None), PLANTED, strict=True):
        stiffness, damping_time = known(found)
        assert stiffness.value == pytest.approx(true, rel=0.002)
        assert damping_time.value == pytest.approx(BETA, rel=0.01)
        assert found.explained > 0.999 and (found.verdict, found.reason) == (SPRING, "")
    quiet = walks(push=0.02)
    curves = [quiet[name] for name in ("torque", "angle", "velocity", "phase")]
    loop = identify(*curves, bounds=BOUNDS)[1].stiffness
    assert loop and loop.high < 0.7 * PLANTED[1]


def test_a_ramp_needs_knots_and_a_constant_that_is_fitted_to_it_leaks():
    def ramp(phase):
        return 100 + 2000 * np.clip(phase - 0.1, 0, 0.2)

    data = walks(ramp)
    bent, flat = (identify_pushed(**data, bounds=(0.1, 0.3), spacing=spacing)[0] for spacing in (0.05, None))
    assert known(bent)[0].value == pytest.approx(300, rel=0.005)
    assert known(bent)[1].value == pytest.approx(BETA, rel=0.02)
    assert bent.explained > 0.999 > 0.99 > flat.explained


def test_a_stiffness_that_differs_from_trial_to_trial_does_not_bias_its_mean():
    for seed in range(5):
        found = identify_pushed(**walks(scatter=0.03, noise=1.0, seed=seed), bounds=BOUNDS)
        for spring, true in zip(found, PLANTED, strict=True):
            assert known(spring)[0].value == pytest.approx(true, rel=0.05)
            assert spring.verdict == SPRING


def test_the_mean_course_moves_on_within_a_bin_and_so_does_its_straight_line():
    data = walks(noise=1.0)
    tilted = data | {"torque": data["torque"] + 300 * data["phase"]}
    for before, after in zip(
        identify_pushed(**data, bounds=BOUNDS), identify_pushed(**tilted, bounds=BOUNDS), strict=True
    ):
        assert known(after)[0] == pytest.approx(known(before)[0], rel=1e-6)


@pytest.mark.slow
def test_intervals_hold_the_truth_in_95_percent_of_200_repeats_and_true_springs_are_called_springs():
    held, verdicts = [], []
    for seed in range(200):
        (found,) = identify_pushed(**walks(trials=16, seconds=5.0, noise=2.0, seed=seed), bounds=(0.3, 0.45))
        stiffness, damping_time = known(found)
        held.append([e.low <= true <= e.high for e, true in ((stiffness, PLANTED[1]), (damping_time, BETA))])
        verdicts.append(found.verdict)
    assert np.all(np.mean(held, axis=0) >= 0.90) and np.all(np.mean(held, axis=0) <= 0.98)
    assert verdicts.count(REACTS) <= 4  # the test's level is 1 %
    assert verdicts.count(SPRING) >= 190


def test_a_planted_reflex_gets_the_verdict_from_a_small_gain_on():
    verdicts = []
    for gain in (0.0, 20.0, 80.0, 320.0):
        found = identify_pushed(**walks(noise=1.0, reflex=gain), bounds=BOUNDS)[1]
        verdicts.append(found.verdict)
        assert (found.reaction_p < 0.01) == (gain > 0)
        assert (found.verdict == REACTS) == (found.reaction >= REACTION_SHARE * (found.explained + found.reaction))
    assert verdicts == [SPRING, REACTS, REACTS, REACTS]
    blind = identify_pushed(**(walks(reflex=320.0) | {"states": None}), bounds=BOUNDS)[1]
    assert blind.verdict != REACTS and blind.explained < 0.9  # nobody can see what was not recorded


def test_a_reflex_shows_in_the_joints_own_past_too():
    data = walks(noise=1.0)
    earlier = np.roll(data["angle"], 5)
    (found,) = identify_pushed(
        **(data | {"torque": data["torque"] - 300 * earlier, "states": earlier[:, None]}), bounds=BOUNDS[1:]
    )
    assert found.verdict == REACTS and "further states explain" in found.reason


def test_a_stiffness_that_depends_on_the_push_is_a_reaction():
    data = walks(noise=0.5)
    bend = 4000 * (data["angle"] - 0.2 * np.sin(2 * np.pi * data["phase"])) ** 2
    found = identify_pushed(**(data | {"torque": data["torque"] + bend, "states": None}), bounds=BOUNDS[1:])[0]
    assert found.verdict == REACTS


def test_scrambled_torque_never_makes_a_spring():
    for seed in range(20):
        data = walks(trials=16, seconds=5.0, noise=1.0, seed=seed)
        random = np.random.default_rng(seed)
        anywhere = random.permutation(data["torque"])
        order = np.argsort(data["phase"] + 0.001 * random.random(len(anywhere)))
        at_equal_phase = data["torque"].copy()
        at_equal_phase[order] = data["torque"][np.roll(order, 7)]  # another stride's, hardly a bin away
        for torque in (anywhere, at_equal_phase):
            for found in identify_pushed(**(data | {"torque": torque}), bounds=BOUNDS):
                assert found.verdict != SPRING and found.reason


def test_a_joint_that_pushes_along_is_no_spring():
    for found in identify_pushed(**walks(lambda phase: -200 + 0 * phase, noise=1.0), bounds=BOUNDS):
        assert (found.verdict, found.reason) == (REACTS, "the torque grows with the angle")


def test_noise_of_the_angle_makes_the_spring_too_soft_as_told():
    sd = 0.003
    (found,) = identify_pushed(**walks(trials=200, angle_noise=sd), bounds=BOUNDS[1:], spacing=None)
    (clean,) = identify_pushed(**walks(trials=200), bounds=BOUNDS[1:], spacing=None)
    factor = clean.angle_spread**2 / (clean.angle_spread**2 + sd**2)
    assert 0.8 < factor < 0.97
    assert known(found)[0].value / PLANTED[1] == pytest.approx(factor, rel=0.02)


def test_order_of_samples_names_of_trials_and_units_of_states_do_not_matter():
    data = walks(noise=1.0, reflex=5.0)
    order = np.random.default_rng(1).permutation(len(data["phase"]))
    other = {name: values[order] for name, values in data.items()}
    other |= {"trial": 1000 - 3 * other["trial"], "states": 57.3 * other["states"] + 4}
    for one, two in zip(identify_pushed(**data, bounds=BOUNDS), identify_pushed(**other, bounds=BOUNDS), strict=True):
        assert known(two)[0] == pytest.approx(known(one)[0], rel=1e-9)
        assert (two.reaction, two.reaction_p) == pytest.approx((one.reaction, one.reaction_p), rel=1e-6)


def test_intervals_are_those_of_leaving_each_trial_out():
    random, trials = np.random.default_rng(3), np.repeat(np.arange(12), 5)
    columns, values = random.standard_normal((60, 2)), random.standard_normal(60)
    fit = fit_by_trial(columns, values, trials, 0)
    assert fit is not None
    assert fit.coefficients == pytest.approx(np.linalg.lstsq(columns, values, rcond=None)[0])
    without = [np.linalg.lstsq(columns[trials != k], values[trials != k], rcond=None)[0] for k in range(12)]
    assert fit.without == pytest.approx(np.array(without))
    estimate = fit.interval(fit.coefficients[0], fit.without[:, 0])
    spread = np.sqrt(60 / 58 * 11 / 12 * np.sum((np.array(without)[:, 0] - np.mean(without, axis=0)[0]) ** 2))
    assert (estimate.high - estimate.low) / 2 == pytest.approx(2.20098516 * spread)  # Student's t, 11 degrees


def test_what_the_data_do_not_say_is_called_so():
    few = identify_pushed(**walks(trials=9), bounds=BOUNDS)[0]
    assert (few.verdict, few.reason) == (UNKNOWN, "9 trials are too few, 10 are needed") and few.stiffness is None
    data = walks(trials=13)
    more_states = identify_pushed(**(data | {"states": np.repeat(data["states"], 5, axis=1)}), bounds=BOUNDS)[0]
    assert more_states.reason == "13 trials are too few, 14 are needed"  # twice five states and two curvatures
    data = walks(trials=20)
    alike = identify_pushed(**(data | {"velocity": -3 * data["angle"]}), bounds=BOUNDS)[0]
    assert alike.verdict == UNKNOWN and "as one" in alike.reason
    nowhere = identify_pushed(**(data | {"phase": 0.05 * data["phase"]}), bounds=BOUNDS)[0]
    assert nowhere.samples == nowhere.trials == 0 and "too few" in nowhere.reason
    loud = identify_pushed(**walks(noise=300.0), bounds=BOUNDS)[0]
    assert loud.verdict == UNKNOWN and loud.reason.startswith("K")
    assert loud.stiffness and loud.stiffness.low < 0.0 < loud.stiffness.high
    assert loud.damping_time is None  # K beta over a K that may be 0


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"angle": np.zeros(5)}, "one a sample"),
        ({"states": np.zeros((5, 1))}, "states must be"),
        ({"bounds": (0.2,)}, "ascending"),
        ({"bounds": (0.4, 0.2)}, "ascending"),
        ({"bounds": (0.2, 1.4)}, "a bound"),
        ({"margin": -0.1}, "margin"),
        ({"spacing": 0.0}, "spacing"),
    ],
)
def test_bad_data_are_refused_with_one_line(change, word):
    with pytest.raises(SpringfootError, match=word) as caught:
        identify_pushed(**(walks(trials=2) | {"bounds": BOUNDS} | change))
    assert "\n" not in str(caught.value)


def test_bins_begin_where_the_phase_does():
    """Eight samples of each of twelve trials fill one bin, wherever its phase begins; none is lost to a neighbour."""
    low, width = 0.1006, BIN
    random = np.random.default_rng(1)
    trial = np.repeat(np.arange(12), 8)
    inside = low + width * np.tile(np.linspace(0.02, 0.98, 8), 12)
    columns: dict[str, Any] = {name: random.standard_normal(len(trial)) for name in ("torque", "angle", "velocity")}
    (found,) = identify_pushed(**columns, phase=inside, trial=trial, bounds=(low, low + width))
    assert (found.samples, found.trials) == (96, 12)
    few = trial < 1  # eight samples in all: just enough for a bin
    columns = {name: values[few] for name, values in columns.items()}
    (found,) = identify_pushed(**columns, phase=inside[few], trial=trial[few], bounds=(low, low + width))
    assert (found.samples, found.trials) == (8, 1)
