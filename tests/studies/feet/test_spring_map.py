"""The best spring of each case: planted prices, directions with their sign, and the same numbers twice."""

from collections.abc import Mapping

import pytest

from springfoot.cli.main import study_main
from springfoot.studies.base.walked_speeds import at_walked_speeds
from springfoot.studies.feet.orthosis import PER_DEG, Orthosis
from springfoot.studies.feet.prosthesis import Prosthesis
from springfoot.studies.feet.spring_map import best_springs, best_table, direction


def priced(prices: Mapping[float, float | None], case=0.3, speed=1.1, policy="one") -> list[dict]:
    """Return rows at equal walked speed: fibre work by spring, and an effort that falls where it rises."""
    cell = {"policy": policy, "case": case, "speed_m_s": speed, "walked_m_s": speed}
    return [
        {**cell, "spring": spring, "fibre_J_kg_m": price, "effort": None if price is None else 10.0 - price}
        for spring, price in prices.items()
    ]


def bowl(best: float) -> dict[float, float]:
    """Return prices that are least, 3 J/kg/m, at the spring `best`."""
    return {spring: 3.0 + 0.1 * (spring - best) ** 2 for spring in (0.0, 2.0, 4.0, 6.0)}


def test_the_best_spring_is_the_one_planted_under_each_price():
    by_price = {row["price"]: row for row in best_springs(priced(bowl(2.5)))}
    fibre = by_price["fibre_J_kg_m"]
    assert fibre["best"] == pytest.approx(2.5) and fibre["least"] == pytest.approx(3.0)
    assert fibre["worst_more"] == pytest.approx(0.1 * 3.5**2 / 3.0)
    assert fibre["saving"] == pytest.approx(1.0 - 3.0 / (3.0 + 0.1 * 2.5**2))
    assert by_price["effort"]["best"] == 6.0  # the price falls towards the end of the map


def test_a_case_where_fewer_than_two_springs_walk_has_no_best_one():
    rows = best_springs(priced({0.0: None, 2.0: 3.0, 4.0: None}))
    assert {row["best"] for row in rows} == {None} and {row["springs"] for row in rows} == {1}
    assert "| 0.3 | – |" in best_table(rows, {"": ("one",)}, "calf")
    (row, _) = best_springs(priced({0.0: None, 2.0: 3.0, 4.0: 4.0}))
    assert row["best"] == 2.0 and row["saving"] is None  # nobody walks without a spring


def test_the_table_has_the_range_over_persons_and_a_line_for_the_policy_that_does_not_adapt():
    rows = best_springs(
        [*priced(bowl(2.5)), *priced(bowl(3.5), policy="two"), *priced({0.0: None, 2.0: None}, policy="fixed")]
    )
    lines = best_table(rows, {"": ("one", "two"), ", fixed": ("fixed",)}, "calf").splitlines()
    assert lines[2:] == ["| 0.3 | 2.5 to 3.5 (+41%) |", "| 0.3, fixed | – |"]


def test_directions_have_their_sign():
    rows = []
    for policy, softer in (("one", 0.0), ("two", 1.0)):
        for case, best in ((0.2, 4.0), (0.3, 3.0 - softer), (0.4, 2.0)):
            rows += [row for speed in (0.9, 1.3) for row in priced(bowl(best + speed), case, speed, policy)]
    found = best_springs(rows)
    assert direction(found, "speed_m_s") == "6 of 6 pairs, most pairs of 2 of 2 policies"
    assert direction(found, "case") == "0 of 12 pairs, most pairs of 0 of 2 policies"


def test_springs_are_compared_where_they_walk_equally_fast():
    walks = []
    for asked, slow, fast in ((1.2, (1.0, 4.0), (1.1, 4.1)), (1.4, (1.2, 5.0), (1.3, 5.3))):  # walked, energy
        for spring, (walked, energy) in ((8.7, slow), (0.9, fast)):
            (row,) = priced({spring: energy}, speed=asked)
            walks.append(row | {"walked_m_s": walked, "falls": 0.0})
    keys = ("policy", "case", "spring")
    even = {row["spring"]: row for row in at_walked_speeds(walks, keys, (1.15,))}
    assert even[8.7]["fibre_J_kg_m"] == pytest.approx(4.75)
    assert even[0.9]["fibre_J_kg_m"] == pytest.approx(4.4)
    fallen = [row | {"falls": 0.2} if row["spring"] == 0.9 else row for row in walks]
    prices = [row["fibre_J_kg_m"] for row in at_walked_speeds(fallen, keys, (1.15,))]
    assert prices == [pytest.approx(4.75), None]
    assert all(row["fibre_J_kg_m"] is None for row in at_walked_speeds(walks, keys, (1.5,)))


def test_cases_and_springs_are_settings_of_feet_and_bodies():
    weak = Orthosis().feet_of(0.25, 3.6)
    assert weak["left_foot"] == weak["right_foot"]
    assert weak["right_foot"]["strength"] == 0.25
    assert weak["right_foot"]["orthosis"]["ankle_stiffness"] == pytest.approx(3.6 * PER_DEG, abs=1e-3)
    assert Orthosis().feet_of(1.0, 0.0)["right_foot"]["kind"] == "intact"
    assert Prosthesis().settings_of(80.0) == {"mass": 80.0}
    assert Prosthesis().feet_of(80.0, 250.0) == {"right_foot": {"kind": "passive", "ankle_stiffness": 250.0}}


@pytest.mark.slow
def test_the_same_command_writes_the_same_numbers_and_goes_on_with_what_it_kept(tmp_path):
    for name in ("one", "two"):
        words = ["prosthesis", "--quick", "--threads", "1", "--out", str(tmp_path / name)]
        assert study_main(words) == 0
    for file in ("walks.csv", "equal_speeds.csv", "best_springs.csv"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    assert "pretrained (not adapted)" in (tmp_path / "one" / "report.md").read_text()
