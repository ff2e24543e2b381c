"""The human curves against the data they were fitted to, and the scaling between bodies and speeds."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from springfoot.gait import SpringfootError, human_gait
from springfoot.gait.people import fit_human

REFERENCE = Path(__file__).resolve().parents[4] / "shared" / "reference"
CONDITIONS = {"very_slow": 0.85, "slow": 1.20, "natural": 1.22, "medium": 1.50, "fast": 1.96}
needs_data = pytest.mark.skipif(
    not (REFERENCE / "human_gait.csv").is_file(),
    reason="the measured data are not ours to give away: ../shared/reference",
)


def measured(condition, column):
    with (REFERENCE / "human_gait.csv").open(newline="") as file:
        return np.array([float(row[column]) for row in csv.DictReader(file) if row["condition"] == condition])


@needs_data
@pytest.mark.parametrize("condition", CONDITIONS)
def test_curves_match_the_measured_ones(condition):
    gait = human_gait(CONDITIONS[condition], height=1.71)
    phase = np.linspace(0, 1, 101)

    def rms(name, column, unit=1.0):
        return np.sqrt(np.mean((unit * gait.mean(name, phase) - measured(condition, column)) ** 2))

    for name, column in fit_human.ANGLES.items():
        assert rms(name, column, 180 / np.pi) < 0.3
        spread = np.degrees(gait.sd(name, phase)) - measured(condition, column + "_sd")
        assert np.sqrt(np.mean(spread**2)) < 0.15
    for column in fit_human.FORCES.values():
        assert rms(column.removesuffix("_bw"), column) < 0.01
    for joint in ("knee", "ankle"):
        assert rms(f"{joint}_moment", f"{joint}_moment_Nm_per_kg") < 0.02


@needs_data
def test_committed_series_are_what_the_command_makes():
    from springfoot.gait.people.human import harmonics

    fitted = fit_human.fit(REFERENCE)
    for kind in ("mean", "sd"):
        for name, rows in fitted[kind].items():
            array = np.array(rows)
            committed = harmonics()[kind][name]
            expected = array[..., 0] + 1j * array[..., 1] if array.ndim == 3 else array
            np.testing.assert_allclose(committed, expected, atol=2e-7)


def test_known_events_of_people_walking_at_1_2():
    gait = human_gait(1.2, height=1.71)
    phase = np.linspace(0, 1, 1001)
    assert gait.condition == "slow" and not gait.clamped
    assert 12 < np.degrees(gait.mean("ankle", phase).max()) < 15
    assert 60 < np.degrees(gait.mean("knee", phase).max()) < 66
    assert phase[gait.mean("toe", phase).argmax()] == pytest.approx(0.60, abs=0.02)
    assert gait.mean("ankle_moment", phase).max() == pytest.approx(1.31, abs=0.03)
    assert human_gait(1.2).condition == "slow"


def test_forces_are_exactly_zero_in_swing_and_bear_the_body():
    gait = human_gait(1.35)
    phase = np.linspace(0, 1, 2001)[:-1]
    swing = phase >= gait.toe_off
    for name in ("grf_vertical", "grf_forward"):
        assert np.all(gait.mean(name, phase)[swing] == 0) and np.all(gait.sd(name, phase)[swing] == 0)
    assert 2 * gait.mean("grf_vertical", phase).mean() == pytest.approx(1.0, abs=0.05)
    assert 2 * gait.mean("grf_forward", phase).mean() == pytest.approx(0.0, abs=0.01)


def test_rate_is_the_derivative_to_phase_and_curves_are_periodic():
    gait = human_gait(1.2)
    phase = np.random.default_rng(0).uniform(0.01, 0.6, (3, 5))
    step = 1e-6
    for name in ("knee", "ankle_moment", "grf_vertical", "toe"):
        slope = (gait.mean(name, phase + step) - gait.mean(name, phase - step)) / (2 * step)
        np.testing.assert_allclose(gait.rate(name, phase), slope, atol=1e-6)
        np.testing.assert_allclose(gait.mean(name, phase + 1), gait.mean(name, phase), atol=1e-9)
        assert np.all(gait.sd(name, phase) >= 0)


def test_equal_froude_speed_gives_equal_angles_and_scaled_length_and_time():
    ratio = 1.9 / 1.5
    small, large = human_gait(1.1, 1.5), human_gait(1.1 * math.sqrt(ratio), 1.9)
    np.testing.assert_allclose(small.mean("knee", [0.1, 0.7]), large.mean("knee", [0.1, 0.7]), atol=1e-12)
    assert large.step_length / small.step_length == pytest.approx(ratio)
    assert large.stride_time / small.stride_time == pytest.approx(math.sqrt(ratio))
    assert 2 * human_gait(1.2).step_length / human_gait(1.2).stride_time == pytest.approx(1.2, rel=0.01)


@pytest.mark.parametrize(("speed", "condition", "end"), [(0.3, "very_slow", 0.85), (3.0, "fast", 1.96)])
def test_outside_the_measured_speeds_the_ends_are_given_and_marked(speed, condition, end):
    gait = human_gait(speed, height=1.71)
    assert gait.clamped and gait.condition == condition and gait.speed == pytest.approx(end)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), "fast"])
def test_bad_speed_is_refused(speed):
    with pytest.raises(SpringfootError, match="speed"):
        human_gait(speed)


def test_unknown_curve_names_the_known_ones():
    with pytest.raises(SpringfootError, match="ankle_moment"):
        human_gait(1.2).mean("elbow", 0.0)


def test_fit_command_refuses_a_folder_without_data(tmp_path):
    with pytest.raises(SpringfootError, match=r"human_gait\.csv"):
        fit_human.fit(tmp_path)


def test_another_step_time_at_the_same_speed_has_another_step_length_and_the_same_curves():
    usual, quick = human_gait(1.2, 1.7), human_gait(1.2, 1.7).paced(0.8)
    assert quick.stride_time == 0.8 * usual.stride_time
    assert quick.step_length / quick.stride_time == pytest.approx(usual.step_length / usual.stride_time, rel=1e-12)
    assert quick.mean("knee", 0.3) == usual.mean("knee", 0.3)
    with pytest.raises(SpringfootError, match=r"step_time_ratio must be .*got 1.3"):
        usual.paced(1.3)
