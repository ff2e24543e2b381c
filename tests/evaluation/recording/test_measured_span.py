"""One rule says which part of a recording is measured: the steady walk after the warm-up."""

import numpy as np

from springfoot.agents.policies.baselines import baseline
from springfoot.envs.settings.settings import BipedSettings, body_of
from springfoot.evaluation.numbers.tally import tally_strides
from springfoot.evaluation.recording.recording import TICK, WARM_UP, Recording, record
from springfoot.evaluation.report.animation import clip_of
from springfoot.studies.springs.any_stiffness import mean_springs
from springfoot.studies.springs.push_experiment import samples


def walk(**settings) -> Recording:
    chosen = BipedSettings(episode_seconds=12.0, **settings)
    return record(baseline("schedule", chosen), chosen, name="schedule", episodes=1)


def test_a_walk_is_measured_after_its_warm_up():
    recording = walk()
    assert recording.measured_span == (WARM_UP, np.inf)
    assert recording.measured_ticks == slice(round(WARM_UP / TICK), None)


def test_numbers_pictures_and_springs_begin_where_a_walk_from_standing_is_steady():
    recording = walk(start="standing")
    begin, end = recording.measured_span
    assert WARM_UP < begin < 10.0 and end == np.inf
    _, first, _ = clip_of(recording, body_of(recording.settings))
    assert first * TICK >= begin
    assert len(samples(recording).phase) == 2 * (recording.ticks[0] - recording.measured_ticks.start)  # of two legs
    strides = tally_strides(recording).stride_time
    assert sum(strides) / 2 <= 12.0 - begin < sum(strides) / 2 + 2 * max(strides)


def test_mean_springs_take_nothing_from_before():
    recording = walk(start="standing")
    springs = mean_springs(recording)
    recording.series["stiffness"][:, : recording.measured_ticks.start] = 1e3
    np.testing.assert_array_equal(mean_springs(recording).stiffness, springs.stiffness)


def test_a_walk_that_stops_is_measured_until_then():
    recording = walk(stop_at=8.0)
    begin, end = recording.measured_span
    assert begin == WARM_UP and 7.0 < end <= 8.0
    assert recording.measured_ticks.stop == round(end / TICK)
