"""Feet told apart, alike or uncertain: planted prices, persons that disagree, prices at one speed that all walk."""

import csv
from pathlib import Path

import numpy as np
import pytest

from springfoot.envs.settings import settings_from
from springfoot.studies.base.walked_speeds import TWO_PRICES
from springfoot.studies.feet.specialists import CELLS
from springfoot.studies.feet.told_apart import (
    GAIN,
    GAIN_OF_KIND,
    LEAST_CHANGE,
    MOST_ALIKE,
    common_speed,
    comparison,
    difference,
    gain_of,
    gain_words,
    least_told_apart,
    price_at,
    verdict,
    without_price,
)

CSV = Path(__file__).parents[3] / "docs" / "results" / "csv" / "specialists.csv"
NOISE = 0.01 * np.random.default_rng(0).standard_normal((3, 8))
"""Of three persons in eight episodes."""


def test_a_planted_difference_is_found_with_its_sign():
    found = difference(3.0 * (1 + NOISE) * 0.8, 3.0 * (1 + NOISE))
    assert found.mean == pytest.approx(-0.2) and found.told_apart
    assert found.low == pytest.approx(-0.2) and found.high == pytest.approx(-0.2)  # in pairs the noise drops out
    assert found.text == "−20 % (−20 to −20)"
    apart = difference(3.6 * (1 + NOISE), 3.0 * (1 + NOISE[::-1]))
    assert apart.low < 0.2 < apart.high and apart.told_apart


@pytest.mark.parametrize(
    "factors", [(1.0 + 0.9 * GAIN,) * 3, (1.3, 1.3, 0.99)], ids=["within the gain", "one person disagrees"]
)
def test_what_is_not_told_apart(factors):
    prices = 3.0 * (1 + NOISE)
    assert not difference(prices * np.array(factors)[:, None], prices).told_apart


def test_a_foot_is_not_told_apart_from_itself_in_other_episodes():
    prices = 3.0 * (1 + 10 * NOISE)
    assert not difference(prices, prices[:, ::-1]).told_apart


def test_gains_are_no_smaller_than_those_of_specialists():
    with CSV.open(encoding="utf-8", newline="") as lines:
        rows: dict[str, list[float]] = {}
        for row in csv.DictReader(lines):
            rows.setdefault(row["cell"], []).extend(-float(row[f"{price}_gap"]) for price in TWO_PRICES)
    assert rows.keys() == CELLS.keys()
    weak, passive = (max(rows.pop(cell)) for cell in ("both calves of 25 %", "passive right foot, 300 N·m/rad"))
    for found, gain in (
        (weak, GAIN_OF_KIND["weak"]),
        (passive, GAIN_OF_KIND["passive"]),
        (max(map(max, rows.values())), GAIN),
    ):
        assert 0.6 * gain < found <= gain
    feet = "intact", "rigid", {"kind": "weak", "strength": 0.3}
    assert [gain_of(settings_from(left_foot=foot).left_foot) for foot in feet] == [GAIN, GAIN, GAIN_OF_KIND["weak"]]
    assert gain_words("weak", "intact") == (
        "A person trained on with one foot alone may take less: a foot is told from a cheaper one where it takes more "
        "by 28 % (weak) and 11 % (intact)."
    )


def test_the_dearer_foot_must_stay_dearer_after_its_gain():
    cheap = 3.0 * (1 + NOISE)
    least = least_told_apart(0.2)
    assert least == pytest.approx(0.25)
    for factor, apart in ((1.0 + 0.99 * least, False), (1.0 + 1.01 * least, True)):
        assert difference(factor * cheap, cheap, 0.2, 0.0).told_apart is apart
        assert difference(cheap, factor * cheap, 0.0, 0.2).told_apart is apart
        assert difference(factor * cheap, cheap, 0.0, 0.2).told_apart  # the cheaper one's gain widens the difference


def test_a_foot_that_may_gain_is_uncertain_and_not_alike():
    prices = {"none": FIRST, "4": 0.9 * FIRST}
    assert verdict("effort", prices, {"none": 0.2, "4": 0.0}) == (
        "Effort is least with 4. Uncertain against 4: none, +11.1 % (+11.1 to +11.1)."
    )
    assert verdict("effort", prices) == "Effort is least with 4: −10 % (−10 to −10) against none."
    assert difference((1.0 + 0.9 * MOST_ALIKE) * FIRST, FIRST, 0.2).alike


FIRST = np.full((3, 5), 4.0)
"""Prices of three persons in five episodes."""


def test_the_verdict_names_the_least_those_alike_and_the_dearer():
    prices = {"none": FIRST, "4": 0.75 * FIRST, "6": 0.76 * FIRST, "9": 0.9 * FIRST}
    assert verdict("fibre work", prices) == (
        "Fibre work is least with 4, alike (within 5 %) with 6: −25 % (−25 to −25) against none. Against 4: 9 +20 %."
    )
    assert verdict("effort", {"none": FIRST, "4": 0.99 * FIRST}) == (
        "Effort is least with 4, alike (within 5 %) with none."
    )
    assert verdict("effort", {"4": FIRST}) == "Effort is known with 4 alone."


def test_a_foot_of_which_persons_disagree_is_uncertain_and_not_alike():
    of_persons = np.array([1.1, 1.23, 1.36])[:, None]
    prices = {"4": FIRST, "2": 1.01 * FIRST, "9": 1.13 * FIRST, "12": of_persons * FIRST}
    reach = 4.302653 * 0.13 / np.sqrt(3)  # Student's t of two degrees of freedom at 97.5 %
    change = difference(prices["12"], FIRST)
    assert (change.low, change.high) == pytest.approx((0.23 - reach, 0.23 + reach))
    assert not change.told_apart and not change.alike
    assert verdict("fibre work", prices) == (
        "Fibre work is least with 4, alike (within 5 %) with 2. Against 4: 9 +13 %."
        " Uncertain against 4: 12, +23.0 % (−9.3 to +55.3)."
    )


def test_of_one_person_no_feet_are_told_apart_or_alike():
    one = FIRST[:1]
    for factor in (1.0, 1.5):
        change = difference(factor * one, one)
        assert not change.told_apart and not change.alike
    assert verdict("fibre work", {"none": one, "4": 0.8 * one, "6": 0.88 * one}) == (
        "Fibre work is least with 4, of one person: no interval. Against 4: none +25 % and 6 +10 %."
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
    assert common_speed(1.1, [None]) == 1.1


def test_a_foot_too_slow_for_the_others_is_left_out_and_told_from_one_on_which_somebody_falls():
    slow = WALKED - 0.3
    walked = [WALKED, WALKED - 0.02, slow, slow - 0.1, None]
    speed = common_speed(1.3, walked)
    assert speed == pytest.approx(1.18)  # the fastest of the second, not the asked one
    priced = [values is not None and price_at(speed, values, 3.0 + values) is not None for values in walked]
    assert priced == [True, True, False, False, False]
    assert [without_price(speed, values) for values in walked[2:]] == [
        "one person walks 0.90 m/s at most",
        "one person walks 0.80 m/s at most",
        "somebody falls",
    ]


def test_the_comparison_names_its_speed_and_feet_without_a_price():
    prices = [np.ones((1, 2)), None, None]
    walked = {"none": WALKED, "15": WALKED - 0.3, "drop": None}
    without = "Without a price: 15, as one person walks 0.90 m/s at most; drop, as somebody falls."
    assert comparison(1.1, 1.1, walked, prices) == f"Compared at 1.10 m/s walked. {without}"
    assert comparison(1.3, 1.2, walked, prices) == (
        f"Compared at 1.20 m/s walked, as on no foot all persons reach the asked 1.3 m/s. {without}"
    )
    assert comparison(1.1, 1.1, {"15": WALKED - 0.3, "drop": None}, [None, None]) == (
        "No foot has a price: 15, as one person walks 0.90 m/s at most; drop, as somebody falls."
    )


def test_a_foot_on_which_persons_have_no_common_speed_keeps_no_other_from_one():
    apart = np.concatenate([WALKED, WALKED + 0.3], axis=1)  # one person from 1.05 to 1.2 m/s, one from 1.35 to 1.5
    assert common_speed(1.1, [WALKED - 0.1, apart]) == pytest.approx(1.1)
    assert without_price(1.1, apart) == "somebody has no two walks around that speed"
    assert common_speed(1.1, [apart]) == 1.1
