"""Common samples of several trials, and the method that finds strides."""

from dataclasses import replace

import numpy as np
import pytest

from springfoot.gait.people.gait_events import Contacts
from springfoot.gait.people.motion_files import Trial
from springfoot.gait.people.strides import MeasuredWalk, _ends_abruptly, cut_strides, merge_trials

TICK = 0.01


def test_trials_have_in_common_the_time_from_the_last_beginning_to_the_first_end():
    slow = Trial(name="a", time=0.5 + 0.02 * np.arange(101), legs={"left": {"knee": 0.02 * np.arange(101)}})
    quick = Trial(name="b", time=0.8 + 0.01 * np.arange(101), legs={"left": {"hip": 0.01 * np.arange(101)}})
    walk = merge_trials([slow, quick])
    assert (walk.name, walk.first, walk.tick) == ("a,b", 0.8, pytest.approx(0.01))
    assert walk.last == pytest.approx(1.8)
    np.testing.assert_allclose(walk.legs["left"]["hip"], 0.01 * np.arange(101), atol=1e-12)
    np.testing.assert_allclose(walk.legs["left"]["knee"], 0.3 + 0.01 * np.arange(101), atol=1e-12)


def loaded_walk(landings: int) -> MeasuredWalk:
    """Return a walk of 8 s with heel strikes each second, of which a plate saw some: at 1.25 s, 2.25 s, ..."""
    time = TICK * np.arange(800)
    since = (time - 1.25) % 1.0
    stance = (time >= 1.25) & (time < 1.25 + landings) & (since < 0.6)
    force = np.where(stance, np.sin(np.pi * since / 0.6), 0.0)
    events = Contacts(heel_strikes=0.25 + np.arange(7.0), toe_offs=0.85 + np.arange(7.0))
    legs = {"left": {"grf_vertical": force, "knee": 0.3 + 0.3 * np.sin(2 * np.pi * time)}}
    return MeasuredWalk(
        name="a", first=0.0, tick=TICK, legs=legs, unscaled=set(), contacts={"left": events}, speed=None
    )


@pytest.mark.parametrize(("landings", "strides", "by_force"), [(4, 3, True), (3, 2, True), (2, 6, False)])
def test_strides_are_those_of_the_first_method_that_finds_enough(landings, strides, by_force):
    found, _ = cut_strides(loaded_walk(landings))
    assert len(found) == strides
    delay = found[0, 0] % 1.0 - 0.25  # the force crosses its threshold after the event's time
    assert (delay > 1e-3) == by_force


def test_a_stride_may_end_with_the_last_sample_and_not_after_it():
    walk = loaded_walk(2)  # strides by the events of the file, the sixth until 6.25 s
    for samples, strides in ((626, 6), (625, 5)):
        shorter = replace(walk, legs={"left": {name: curve[:samples] for name, curve in walk.legs["left"].items()}})
        assert len(cut_strides(shorter)[0]) == strides


def test_the_edge_of_a_plate_takes_all_force_at_once_and_an_impact_a_part():
    percent = np.arange(101)
    whole = np.sqrt(np.sin(np.pi * np.minimum(percent, 62) / 62).clip(0.0))
    edge = np.where(percent < 48, whole, 0.0)
    impact = whole + np.where(percent == 20, 1.2, 0.0)
    np.testing.assert_array_equal(_ends_abruptly(np.stack([whole, edge, impact]), 1.0), [False, True, False])
