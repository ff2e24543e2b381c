"""Changes between speeds: people against themselves are without error, and each number is that of its curve."""

import numpy as np
import pytest

from springfoot.errors import SpringfootError
from springfoot.gait.people import human_gait
from springfoot.studies.walks.changes import (
    Changes,
    curves_table,
    extent,
    highest,
    lowest,
    negative_work,
    numbers_table,
    positive_work,
    spans_table,
    stride_of_gait,
)

PEOPLE = [stride_of_gait(human_gait(speed)) for speed in (0.9, 1.5)]


def line(table, begin):
    """Cells of the line that begins so."""
    (found,) = [cells for row in table.splitlines() if (cells := row.strip("| ").split(" | "))[0].startswith(begin)]
    return found


def test_numbers_of_a_curve_in_closed_form():
    turn = 2 * np.pi * np.arange(100) / 100
    curve, spread = 3.0 * np.sin(turn), np.linspace(0.0, 1.0, 100)
    assert highest(curve, spread, 0.01) == pytest.approx((3.0, spread[25]))
    assert lowest(curve, spread, 0.01) == pytest.approx((-3.0, spread[75]))
    assert extent(curve, spread, 0.01) == pytest.approx((6.0, np.hypot(spread[25], spread[75])))
    half_wave = 3.0 / np.pi  # the integral of 3 sin(2 pi t) over half a second
    assert positive_work(curve, spread, 0.01)[0] == pytest.approx(half_wave, rel=1e-3)
    assert negative_work(curve, spread, 0.01)[0] == pytest.approx(half_wave, rel=1e-3)
    assert positive_work(curve, np.ones(100), 0.01)[1] == pytest.approx(0.5, abs=0.011)


def test_people_change_as_people_and_what_stays_changes_nothing():
    alike = {"people": PEOPLE, "still": [PEOPLE[0], PEOPLE[0]]}
    curves, numbers = curves_table(PEOPLE, alike), numbers_table(PEOPLE, alike)
    assert line(curves, "people")[1:] == ["0.0 (1.00)"] * 3
    assert [cell.split(" ")[0] for cell in line(curves, "still")[1:]] == line(curves, "nothing changes")[1:]
    for begin in ("sign right", "size within"):
        head, _, people, still = line(numbers, begin)
        judged = int(head.rpartition(" ")[2])
        assert judged == int(people) > 5 and int(still) == 0


def test_the_spread_of_several_walks_is_from_the_least_to_the_largest_change():
    still = (PEOPLE[0], PEOPLE[0])
    table = spans_table(PEOPLE, [still, tuple(PEOPLE)])
    (own,) = curves_table(PEOPLE, {"still": still}).splitlines()[3:]
    error = own.split(" | ")[1].split(" ")[0]  # of the thigh
    assert line(table, "error of the thigh's")[1:] == [f"{error}, if nothing changes", error, f"0.0 to {error}"]
    _, people, first, both = line(table, "range of the thigh")
    assert first == "+0.00" and both == f"+0.00 to {people.split(' ')[0]}"


def test_speeds_ascend():
    with pytest.raises(SpringfootError, match=r"speeds must be a slower and a faster one, got 1\.5 0\.9"):
        Changes(speeds=(1.5, 0.9)).check()


def test_a_walk_stands_beside_the_plan():
    answer = Changes(policies=("schedule",), episodes=1, seconds=5.0).ask(lambda _: None)
    assert "error of the change ° (r)" in answer.text and "schedule, 0.9 m/s: 0." in answer.text
    assert answer.files["changes.csv"].startswith("change,people,people_sd,the plan,schedule")
