"""Feet told apart: planted prices, persons that disagree, differences below the gap, prices at one speed."""

import numpy as np
import pytest

from springfoot.studies.feet.told_apart import GAP, LEAST_CHANGE, common_speed, difference, price_at, verdict

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
        words
        == "Fibre work is least with 4, not told apart from 6: −25 % (−25 to −25) against none. Against 4: 9 +20 %."
        " Unknown, as somebody falls or is too slow: 12."
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


def test_the_interval_is_over_persons_whatever_the_number_of_their_episodes():
    of_persons = np.array([-0.63, -0.43, -0.53])
    found = difference(np.repeat(1.0 + of_persons[:, None], 50, axis=1), np.ones((3, 50)))
    reach = 4.302653 * 0.1 / np.sqrt(3)  # Student's t of two degrees of freedom at 97.5 %
    assert (found.low, found.high) == pytest.approx((-0.53 - reach, -0.53 + reach), rel=1e-6)


def test_one_person_has_no_interval():
    assert difference(np.full((1, 5), 2.7), np.full((1, 5), 3.0)).text == "−10 %"


WALKED = np.array([[[1.0, 1.1]], [[1.2, 1.2]]])
"""Speeds of two walks of one person in two episodes [m/s]."""


def test_a_price_at_one_speed_is_on_the_line_of_each_pair_of_walks_and_never_beyond():
    prices = 1.0 + 2.0 * WALKED  # a price that is linear in the speed
    for speed in (1.05, 1.15, 1.2):
        assert price_at(speed, WALKED, prices) == pytest.approx(np.full((1, 2), 1.0 + 2.0 * speed))
    for speed in (1.0, 1.21, 1.4):
        assert price_at(speed, WALKED, prices) is None
    assert price_at(1.15, np.array([[[1.0]], [[1.0 + 0.9 * LEAST_CHANGE]]]), prices[..., :1]) is None


def test_feet_are_compared_at_a_speed_that_all_walk():
    slower = WALKED - 0.06
    assert common_speed(1.1, [WALKED, slower, None]) == 1.1
    assert common_speed(1.3, [WALKED, slower]) == pytest.approx(1.14)  # the fastest of the slower one
    assert common_speed(0.8, [WALKED, slower]) == pytest.approx(1.05)  # the slowest of the other
    assert common_speed(1.1, [WALKED, WALKED - 0.5]) == 1.1  # there is none
    assert common_speed(1.1, [None]) == 1.1
