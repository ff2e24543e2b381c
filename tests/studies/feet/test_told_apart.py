"""Feet told apart: planted prices, persons that disagree, differences below the gap, prices at one speed."""

import numpy as np
import pytest

from springfoot.studies.feet.told_apart import GAP, LEAST_CHANGE, difference, price_at, verdict

NOISE = 0.01 * np.random.default_rng(0).standard_normal((3, 8))
"""Of three persons in eight episodes."""


def test_a_planted_difference_is_found_with_its_sign():
    found = difference(3.0 * (1 + NOISE) * 0.9, 3.0 * (1 + NOISE))
    assert found.mean == pytest.approx(-0.1) and found.told_apart
    assert found.low == pytest.approx(-0.1) and found.high == pytest.approx(-0.1)  # in pairs the noise drops out
    assert found.text == "−10 % (−10 to −10)"
    apart = difference(3.3 * (1 + NOISE), 3.0 * (1 + NOISE[::-1]))
    assert apart.low < 0.1 < apart.high and apart.told_apart


@pytest.mark.parametrize(
    "factors", [(1.0 + 0.9 * GAP,) * 3, (1.3, 1.3, 0.99)], ids=["below the gap", "one person disagrees"]
)
def test_what_is_not_told_apart(factors):
    prices = 3.0 * (1 + NOISE)
    assert not difference(prices * np.array(factors)[:, None], prices).told_apart


def test_a_foot_is_not_told_apart_from_itself_in_other_episodes():
    prices = 3.0 * (1 + 10 * NOISE)
    assert not difference(prices, prices[:, ::-1]).told_apart


def test_the_verdict_names_the_least_its_like_and_the_dearer():
    first = np.full((3, 5), 4.0)
    prices = [first, 0.75 * first, 0.76 * first, 0.9 * first, None]
    words = verdict("fibre work", ["none", "4", "6", "9", "12"], prices)
    assert (
        words == "Fibre work is least with 4, not told apart from 6: −25 % (−25 to −25) against none. Dearer: 9 +20 %."
    )
    assert (
        verdict("effort", ["none", "4"], [first, 0.99 * first]) == "Effort is least with 4, not told apart from none."
    )
    assert verdict("effort", ["none", "4"], [None, first]) == (
        "Effort is least with 4; unknown with none, on which somebody falls or is too slow."
    )
    assert verdict("effort", ["none", "4"], [None, None]) == (
        "Effort is unknown: on every foot somebody falls or is too slow."
    )


def test_a_price_at_one_speed_is_on_the_line_of_each_pair_of_walks():
    walked = np.array([[[1.0, 1.1]], [[1.2, 1.2]]])
    prices = 1.0 + 2.0 * walked  # a price that is linear in the speed
    assert price_at(1.15, walked, prices) == pytest.approx(np.full((1, 2), 3.3))
    assert price_at(1.05, walked, prices) == pytest.approx(np.full((1, 2), 3.1))
    assert price_at(1.15, np.array([[[1.0]], [[1.0 + 0.9 * LEAST_CHANGE]]]), prices[..., :1]) is None
    assert price_at(1.41, walked, prices) is None and price_at(1.29, walked, prices) is not None  # too slow for it
