"""Gait events on force records whose events are known in closed form."""

import numpy as np
import pytest

from springfoot.gait.people.gait_events import PERCENT, find_contacts, find_steps, next_after, on_percent, sample

TICK = 0.01


def force_record(seconds=4.0, period=1.0, stance=0.6, height=700.0, start=0.25, tick=TICK):
    """Half sines of `stance` seconds, heel strikes at start + k * period."""
    time = np.arange(round(seconds / tick)) * tick
    since = (time - start) % period
    return np.where((time >= start) & (since < stance), height * np.sin(np.pi * since / stance), 0.0)


def test_heel_strikes_and_toe_offs_of_half_sines_are_found_between_samples():
    contacts = find_contacts(force_record(), TICK, threshold=30.0)
    delay = 0.6 / np.pi * np.arcsin(30 / 700)
    assert contacts.heel_strikes == pytest.approx([0.25 + delay + k for k in range(4)], abs=1e-3)
    assert contacts.toe_offs == pytest.approx([0.85 - delay + k for k in range(4)][: len(contacts.toe_offs)], abs=1e-3)


def test_first_sample_time_moves_every_event():
    record = force_record()
    early, late = (find_contacts(record, TICK, 30.0, first=first) for first in (0.0, 0.005))
    assert late.heel_strikes - early.heel_strikes == pytest.approx(0.005)
    assert late.toe_offs - early.toe_offs == pytest.approx(0.005)


def test_bounce_in_stance_and_scuff_in_swing_are_no_events():
    record = force_record(start=0.0)
    clean = find_contacts(record, TICK, 30.0)
    record[105:109] = 0.0  # 40 ms without load, 50 ms after a heel strike
    record[175:180] = 100.0  # 50 ms of load in swing
    disturbed = find_contacts(record, TICK, 30.0)
    assert disturbed.heel_strikes == pytest.approx(clean.heel_strikes)
    assert disturbed.toe_offs == pytest.approx(clean.toe_offs)


def test_foot_down_at_both_ends_of_the_record_has_no_event_there():
    contacts = find_contacts(np.full(100, 500.0), TICK, 30.0)
    assert len(contacts.heel_strikes) == len(contacts.toe_offs) == 0
    assert contacts.strides().shape == (0, 3)


def test_strides_are_complete_and_begin_after_the_time_given():
    contacts = find_contacts(force_record(seconds=5.0), TICK, 30.0)
    strides = contacts.strides(after=1.0)
    assert len(strides) == 3
    assert np.all(strides[:, 0] >= 1.0)
    assert strides[:, 2] - strides[:, 0] == pytest.approx(1.0, abs=1e-9)
    assert np.all((strides[:, 0] < strides[:, 1]) & (strides[:, 1] < strides[:, 2]))


def test_steps_alternate_and_a_double_strike_of_one_foot_is_no_step():
    left = find_contacts(force_record(), TICK, 30.0)
    right = find_contacts(force_record(start=0.75), TICK, 30.0)
    steps, sides = find_steps(left, right)
    assert list(sides) == [0, 1] * 3 + [0]
    assert steps[:, 1] - steps[:, 0] == pytest.approx(0.5, abs=1e-9)
    assert len(find_steps(left, find_contacts(np.zeros(400), TICK, 30.0))[0]) == 0


def test_next_after_is_strictly_later_and_infinite_at_the_end():
    assert list(next_after(np.array([1.0, 2.0]), np.array([0.5, 1.0, 2.0]))) == [1.0, 2.0, np.inf]


def test_lines_are_resampled_exactly_whatever_the_shape():
    time = 0.005 + np.arange(300) * TICK
    series = np.stack([2 * time + 1, -time], -1)
    begin, end = np.array([0.1, 1.23]), np.array([1.13, 2.2])
    curves = on_percent(series, begin, end, TICK, first=0.005)
    expected = begin[:, None] + (end - begin)[:, None] * PERCENT / 100
    assert curves.shape == (2, 101, 2)
    assert curves[..., 0] == pytest.approx(2 * expected + 1, abs=1e-12)
    assert curves[..., 1] == pytest.approx(-expected, abs=1e-12)


def test_beyond_its_ends_a_series_keeps_its_last_value():
    assert list(sample(np.array([1.0, 3.0]), np.array([-1.0, 0.5, 9.0]), tick=1.0)) == [1.0, 2.0, 3.0]
