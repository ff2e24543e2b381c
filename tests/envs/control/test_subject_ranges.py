"""Ranges of bodies and speeds: draws fill them, and what is not allowed is refused."""

import json
from typing import Any

import numpy as np
import pytest

from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.reference_walk import reference_walk_at, reference_walks, tabulated_speeds
from springfoot.envs.control.subjects import Subjects
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError

ANYBODY: dict[str, Any] = {"height_range": (1.45, 2.0), "mass_range": (40.0, 120.0), "speed_range": (0.8, 1.6)}


def test_draws_fill_their_ranges_and_follow_the_seed():
    settings = BipedSettings(**ANYBODY)
    speeds = tabulated_speeds(settings)

    def draw(seed):
        subjects = Subjects(settings, speeds, 200)
        subjects.reset(np.arange(200), [np.random.default_rng(seed + index) for index in range(200)])
        return np.array([(body.height, body.mass) for body in subjects.bodies]), subjects.speed

    bodies, speed = draw(0)
    for values, (low, high) in zip((*bodies.T, speed), ANYBODY.values(), strict=True):
        assert values.min() >= low and values.max() <= high
        assert np.ptp(values) > 0.95 * (high - low)
    assert abs(np.corrcoef(bodies.T)[0, 1]) < 0.25  # height and mass independently
    again, other = draw(0), draw(1000)
    np.testing.assert_array_equal(again[0], bodies)
    np.testing.assert_array_equal(again[1], speed)
    assert not np.intersect1d(other[1], speed).size


def test_a_height_and_a_mass_that_make_no_body_are_drawn_again():
    settings = BipedSettings(height_range=(1.0, 2.3), mass_range=(20.0, 250.0))
    subjects = Subjects(settings, tabulated_speeds(settings), 100)
    subjects.reset(np.arange(100), [np.random.default_rng(index) for index in range(100)])
    index = np.array([body.mass / body.height**2 for body in subjects.bodies])
    assert 10.0 <= index.min() < 20.0 and 60.0 < index.max() <= 80.0


@pytest.mark.slow
@pytest.mark.parametrize("part", range(2))  # of the same 100 ranges, so that both workers plan
def test_whatever_range_its_slowest_and_fastest_body_may_walk_at_starts(part):
    """A short body at a high speed walks as the settings' tall body would beyond the speeds that it may have."""
    random = np.random.default_rng(0)
    beyond = 0
    for number in range(60):
        heights = np.sort(random.uniform(1.2, 2.3, 2))
        fastest = min(2.0, 2.1 * np.sqrt(heights[0] / 1.7))  # beyond, its legs are too short for a step
        speeds = np.sort(random.uniform(0.4, fastest, 2))
        ranges: dict[str, Any] = {"height_range": tuple(heights), "speed_range": tuple(speeds)}
        for name in random.choice(list(ranges), number % 2, replace=False):
            del ranges[name]
        settings = BipedSettings(height=random.choice(heights), speed=random.choice(speeds), **ranges)
        grid = tabulated_speeds(settings)
        beyond += grid[0] < 0.4 or grid[-1] > 2.0
        if number // 2 % 2 == part:
            for speed in {grid[0], grid[-1]}:  # speeds between them are easier to plan
                assert reference_walk_at(settings, float(speed)).speed == pytest.approx(speed)
            if number % 10 == part:
                assert len(reference_walks(settings)) == len(grid)
    assert beyond > 6  # a tenth


def test_a_grid_ends_at_the_range_where_it_would_leave_what_can_be_planned():
    settings = BipedSettings(height=2.0, height_range=(1.25, 2.0), speed_range=(0.6, 2.0))
    unit, fastest = np.sqrt(2.0 / 1.7), 2.0 * np.sqrt(2.0 / 1.25)
    grid = tabulated_speeds(settings)
    assert grid[-1] == pytest.approx(fastest) and grid[-2] == pytest.approx(2.3 * unit)
    biped = Biped(settings, 3)
    biped.reset(np.arange(3), [0, 1, 2])
    assert np.isfinite(biped.step(np.zeros((3, 4))).observation).all()


def test_settings_with_ranges_survive_json():
    settings = settings_from(**ANYBODY, speed_interval=4)
    assert settings_from(**json.loads(json.dumps(settings_to_json(settings)))) == settings


def reset(options: dict[str, Any], **settings: Any) -> None:
    SegmentedFootBipedVector(2, **settings).reset(options=options)


def sb3_reset(options: list[dict[str, Any]]) -> None:
    env = SegmentedFootBipedVecEnv(2)
    env.set_options(options)
    env.reset()


BAD = [
    (lambda: settings_from(height_range=(1.5, 2.5)), r"height_range must be in \[1, 2.3\] m"),
    (lambda: settings_from(mass_range=(90, 50)), r"mass_range must be \(low, high\)"),
    (lambda: settings_from(speed_range=1.2), r"speed_range must be \(low, high\)"),
    (lambda: settings_from(speed_range=(0.1, 1.2)), r"speed_range must be in \[0.4, 2\] m/s"),
    (lambda: settings_from(speed_interval=2.0), "speed_interval needs a speed_range"),
    (lambda: settings_from(speed_range=(1.0, 1.2), speed_interval=0), "speed_interval must be"),
    (lambda: settings_from(speed_rate=0), "speed_rate must be"),
    (lambda: reset({"height": "tall"}), "'height' must be a number"),
    (lambda: reset({"mass": [60.0, 70.0, 80.0]}), "'mass' must be a number, or one for each of 2"),
    (lambda: reset({"height": 3.0}), r"height must be in \[1, 2.3\] m"),
    (lambda: reset({"speed": 1.4}), r"must be in \[1.2, 1.2\] m/s, got 1.4; speed_range"),
    (lambda: reset({"height": 1.9}), "height_range"),
    (lambda: reset({"speed": np.nan}, **ANYBODY), "must be in"),
    (lambda: reset({"height": 2.0, "mass": 30.0}, **ANYBODY), "body-mass index"),
    (lambda: sb3_reset([{"speed": 1.2}, {}]), "to all environments, or to none"),
    (lambda: Biped(BipedSettings(), 1).command(np.array([0]), np.array([2.0])), r"must be in \[1.2, 1.2\]"),
    (lambda: Biped(BipedSettings(height_range=(1.0, 1.1), mass_range=(240.0, 250.0)), 1), "body-mass index"),
]


@pytest.mark.parametrize(("attempt", "words"), BAD)
def test_what_is_not_allowed_is_refused_in_one_clear_line(attempt, words):
    with pytest.raises(SpringfootError, match=words) as caught:
        attempt()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"height": 1.0, "speed": 2.0}, r"^no walk of 1 m at 2 m/s: legs too short for this step: "),
        (
            {"height_range": (1.0, 2.3), "speed_range": (0.4, 2.0)},
            r"^no walk of 1\.7 m at 2\.5 m/s, asked for by height_range \(1\.0, 2\.3\) and speed_range ",
        ),
        (
            {"speed": 1.7, "drawn_bodies": [{}, {"step_time_ratio": 1.2}]},
            r"^no walk of 1\.7 m at 1\.7 m/s, asked for by step_time_ratio 1\.2: legs too short for this step: ",
        ),
    ],
)
def test_a_body_too_short_for_a_speed_is_told_with_the_settings_that_ask_for_it(values, said):
    with pytest.raises(SpringfootError, match=said):
        Biped(BipedSettings(**values), 1)


def test_the_slowest_speed_of_the_tallest_body_can_be_planned():
    """At a height at which that speed of the settings' body, rounded to centimetres, would be a faster one."""
    settings = BipedSettings(height=1.8446, height_range=(1.7, 2.3), speed_range=(0.4, 1.2))
    assert reference_walk_at(settings, float(tabulated_speeds(settings)[0])).speed == pytest.approx(0.3582, abs=1e-4)
