"""The pitch of a foot that rolls over its forefoot: its ends, its shape and its derivatives."""

import numpy as np
import pytest

from springfoot.gait.body.rockers import pitch_rise

TOP, START, END = -1.1, 0.4, 0.62


@pytest.mark.parametrize("shape", [2.0, 2.6, 3.5, (0.2, 2.4)])
def test_a_pitch_rises_to_its_top_and_its_derivatives_are_those_of_differences(shape):
    phase, step = np.linspace(START + 0.02, END, 9), 1e-5
    before, now, after = (pitch_rise(TOP, phase + shift, START, END, shape) for shift in (-step, 0.0, step))
    for order in range(2):
        np.testing.assert_allclose(now[order + 1], (after[order] - before[order]) / (2 * step), rtol=1e-6)
    assert now[0, -1] == pytest.approx(TOP)
    assert np.all(pitch_rise(TOP, [0.0, START], START, END, shape)[:2] == 0.0)


def test_a_pair_is_the_fraction_half_way_and_the_rate_at_the_end_over_the_mean():
    half_way, end_rate = 0.2, 2.4
    pitch, rate, _ = pitch_rise(TOP, [(START + END) / 2, END], START, END, (half_way, end_rate))
    assert pitch[0] == pytest.approx(half_way * TOP)
    assert rate[1] == pytest.approx(end_rate * TOP / (END - START))
