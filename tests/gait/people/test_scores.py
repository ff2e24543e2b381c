"""Each statistic against its closed form, and against people's own curves."""

import numpy as np
import pytest

from springfoot.gait import human_gait
from springfoot.gait.people import scores as score
from springfoot.gait.people.gait_events import PERCENT

PHASE = PERCENT / 100
WAVE = np.sin(2 * np.pi * PHASE)


def test_rmse_keeps_an_offset_and_correlation_does_not():
    assert score.rmse(WAVE + 3, WAVE) == pytest.approx(3.0)
    assert score.correlation(2 * WAVE + 3, WAVE) == pytest.approx(1.0)
    assert score.correlation(-WAVE, WAVE) == pytest.approx(-1.0)
    assert score.correlation(np.cos(2 * np.pi * PHASE[:100]), WAVE[:100]) == pytest.approx(0.0, abs=1e-12)


def test_what_cannot_be_computed_is_none():
    missing = np.full(101, np.nan)
    assert score.rmse(missing, WAVE) is None
    assert score.correlation(missing, WAVE) is None
    assert score.correlation(np.full(101, 0.97), WAVE) is None
    assert score.share_within_sd(missing, WAVE, np.ones(101)) is None
    assert score.largest(missing) == (None, None)
    assert set(score.phase_means(missing, 60.0).values()) == {None}
    assert score.mean_sd([]) == {"mean": None, "sd": None}
    assert score.mean_sd([2.0]) == {"mean": 2.0, "sd": None}


def test_share_within_sd_counts_the_samples_inside():
    curve = np.where(PERCENT < 50, 0.5, 2.0)
    assert score.share_within_sd(curve, np.zeros(101), np.ones(101)) == pytest.approx(100 * 50 / 101)


def test_force_features_find_the_landmarks_of_people():
    human = human_gait(1.2)
    features = score.force_features(human.mean("grf_vertical", PHASE), human.mean("grf_forward", PHASE))
    # reference/README.md, checks at 1.22 m/s: 1.05 at 14 %, 0.80 at 29 %, 1.14 at 48 %; -0.16 and +0.21
    assert features.vertical_peak1 == pytest.approx(1.05, abs=0.02)
    assert features.vertical_valley == pytest.approx(0.82, abs=0.03)
    assert features.vertical_peak2 == pytest.approx(1.13, abs=0.02)
    assert features.braking_peak == pytest.approx(-0.155, abs=0.02)
    assert features.forward_peak == pytest.approx(0.205, abs=0.02)


def test_force_windows_are_those_of_the_definitions():
    vertical = np.zeros(101)
    vertical[[2, 3, 25, 26]] = 9, 1, 2, 8
    vertical[35:61], vertical[61] = 0.5, 7
    features = score.force_features(vertical, np.zeros(101))
    assert (features.vertical_peak1, features.vertical_valley, features.vertical_peak2) == (2, 0, 0.5)


def test_stride_work_splits_into_positive_and_negative():
    positive, negative = score.stride_work(np.stack([WAVE, 3 * WAVE]), np.array([1.0, 2.0]))
    assert positive == pytest.approx(np.array([1, 6]) / np.pi, rel=1e-3)
    assert negative == pytest.approx(positive)


def test_ankle_work_of_people_is_that_of_their_curves():
    human = human_gait(1.2)
    power = human.mean("ankle_power", PHASE)
    positive, negative = score.stride_work(power[None], np.array([human.stride_time]))
    assert positive[0] - negative[0] == pytest.approx(np.trapezoid(power) / 100 * human.stride_time)
    assert 0.25 < positive[0] < 0.40 and 0.05 < negative[0] < 0.20  # design.md's figures: .35, .12


def test_phase_means_split_at_10_45_percent_and_toe_off():
    curve = np.select([PERCENT < 10, PERCENT < 45, PERCENT < 62], [1.0, 2.0, 3.0], 4.0)
    assert score.phase_means(curve, 62.0) == {"loading": 1.0, "mid_stance": 2.0, "push_off": 3.0, "swing": 4.0}


def test_travel_counts_only_loaded_points_by_their_share():
    position = np.array([[0.0, 0.0], [0.1, 0.0], [0.05, 4.0], [0.05, 9.0]])
    force = np.array([[10.0, 0.0], [20.0, 0.0], [15.0, 5.0], [0.5, 0.5]])
    assert score.travel(position, force, 2.0) == pytest.approx(0.1 + 0.05 * 35 / 40 + 4.0 * 5 / 40)


@pytest.mark.parametrize("points", [1, 2, 5])
def test_a_rigid_foot_that_slides_travels_as_far_with_any_number_of_contact_points(points):
    slide = np.linspace(0.0, 0.03, 7)
    load = np.random.default_rng(0).uniform(1.0, 9.0, (7, points))
    assert score.travel(np.tile(slide[:, None], points), load, 0.5) == pytest.approx(0.03)
