"""Springs beside a weak calf and a drop foot: whose energy counts, which spring is best, and what ends the falls."""

import csv

import pytest

from springfoot.cli.main import study_main
from springfoot.studies.feet.orthosis import (
    SPRING_OF_A_BODY,
    at_the_ends,
    best_springs,
    directions,
    weak_text,
    weakest_cure,
)
from springfoot.studies.feet.walked_speeds import at_walked_speeds


def rows(energies: dict[float, float], falls=(), strength=0.3, mass=63.0, speed=1.2) -> list[dict]:
    cell = {"mass_kg": mass, "speed_m_s": speed, "strength": strength, "walked_m_s": speed}
    return [
        {
            **cell,
            "spring_Nm_deg": spring,
            "fibre_J_kg_m": energy,
            "effort": -energy,
            "falls": 0.25 if spring in falls else 0.0,
        }
        for spring, energy in energies.items()
    ]


def test_the_best_spring_takes_least_energy_of_those_that_nobody_falls_with():
    (best,) = best_springs(rows({0.0: 1.0, 2.0: 2.0, 4.0: 3.0}, falls=(0.0,)))
    assert best["best_Nm_deg"] == 2.0
    assert best["worst_Nm_deg"] == 4.0
    assert best["worst_more_percent"] == pytest.approx(50.0)
    assert best_springs(rows({2.0: 2.0, 4.0: 3.0}), "effort")[0]["best_Nm_deg"] == 4.0
    assert best["springs_without_falls"] == 2
    fast = [row | {"walked_m_s": 1.0 - 0.1 * abs(row["spring_Nm_deg"] - 4.0)} for row in rows({2.0: 2.0, 4.0: 3.0})]
    assert best_springs(fast)[0]["fastest_Nm_deg"] == 4.0
    (none,) = best_springs(rows({0.0: 1.0, 2.0: 2.0}, falls=(0.0, 2.0)))
    assert none["best_Nm_deg"] is None


def test_the_report_says_none_where_every_spring_falls():
    walks = [
        *rows({0.0: 1.0, 2.0: 2.0}, falls=(0.0, 2.0), strength=0.2),
        *rows({0.0: 1.0, 2.0: 2.0}, strength=0.3),
    ]
    best = best_springs(walks)
    lines = weak_text(walks, best, best, best, "One walk").splitlines()
    assert [line for line in lines if line.startswith("| 20 %")] == ["| 20 % | 63 | none |"]
    assert [line for line in lines if line.startswith("| 30 %")] == ["| 30 % | 63 | 0 (+100 %, 2) |"]


def test_springs_are_compared_where_they_walk_equally_fast():
    walks = []
    for asked, slow, fast in ((1.2, (1.0, 4.0), (1.1, 4.1)), (1.4, (1.2, 5.0), (1.3, 5.3))):  # walked, energy
        for spring, (walked, energy) in ((8.7, slow), (0.9, fast)):
            walks += [row | {"walked_m_s": walked} for row in rows({spring: energy}, speed=asked)]
    even = {row["spring_Nm_deg"]: row for row in at_walked_speeds(walks, SPRING_OF_A_BODY, (1.15,))}
    assert even[8.7]["fibre_J_kg_m"] == pytest.approx(4.75)
    assert even[0.9]["fibre_J_kg_m"] == pytest.approx(4.4)
    assert best_springs(walks)[0]["best_Nm_deg"] == 8.7  # it is the slower walk that takes less
    assert best_springs(list(even.values()))[0]["best_Nm_deg"] == 0.9
    fallen = [row | {"falls": 0.2} if row["spring_Nm_deg"] == 0.9 else row for row in walks]
    prices = [row["fibre_J_kg_m"] for row in at_walked_speeds(fallen, SPRING_OF_A_BODY, (1.15,))]
    assert prices == [pytest.approx(4.75), None]
    assert all(row["fibre_J_kg_m"] is None for row in at_walked_speeds(walks, SPRING_OF_A_BODY, (1.5,)))


def test_directions_have_their_sign():
    found = []
    for strength, least in ((0.2, 6.0), (0.3, 3.0), (0.4, 0.0)):
        for mass in (50.0, 80.0):
            energies = {spring: abs(spring - least) + 1 for spring in (0.0, 3.0, 6.0)}
            found += rows(energies, strength=strength, mass=mass)
    text = directions(best_springs(found), "best_Nm_deg")
    assert "weakness ρ +1.00 (0.4: 0.0, 0.3: 3.0, 0.2: 6.0; 6 pairs: stiffer 6, softer 0, same 0)" in text
    assert "mass ρ +0.00 (50: 3.0, 80: 3.0; 3 pairs: stiffer 0, softer 0, same 3)" in text


def test_cells_at_the_ends_of_the_map_are_counted():
    best = [{"speed_m_s": 1.2, "best_Nm_deg": spring} for spring in (0.0, 3.0, 6.0, 6.0)]
    assert at_the_ends(best, (0.0, 3.0, 6.0)) == "2 and 1 of 4 at 1.2 m/s"


def test_a_cure_has_no_falls_with_any_stiffer_spring_of_its_rest_angle():
    falls = {(0.0, 0.0): 1, (5.0, 0.0): 0, (10.0, 0.0): 1, (20.0, 0.0): 0, (0.0, 5.0): 1, (5.0, 5.0): 1}
    falls |= {(10.0, 5.0): 0, (20.0, 5.0): 0}
    map_of = [{"spring_Nm_rad": k, "rest_deg": rest, "falls": fell} for (k, rest), fell in falls.items()]
    cure = weakest_cure(map_of, "falls")
    assert cure is not None
    assert (cure["spring_Nm_rad"], cure["rest_deg"]) == (10.0, 5.0)
    assert weakest_cure([row | {"falls": 1} for row in map_of], "falls") is None


@pytest.mark.slow
def test_quick_walks_and_the_same_command_writes_the_same_numbers(tmp_path):
    for name in ("one", "two"):
        words = ["orthosis", "--quick", "--out", str(tmp_path / f"{name}-out")]
        assert study_main(words) == 0
    for file in ("weak.csv", "best.csv", "drop.csv"):
        one, two = ((tmp_path / f"{name}-out" / file).read_bytes() for name in ("one", "two"))
        assert one == two
    lines = list(csv.DictReader((tmp_path / "one-out" / "drop.csv").read_text().splitlines()))
    slack = [line for line in lines if float(line["spring_Nm_rad"]) == 0.0]
    assert all(float(line["falls"]) == 1.0 for line in slack)  # a drop foot alone catches its toe
    assert "Weakest with which 0 of 1 fell" in (tmp_path / "one-out" / "report.md").read_text()
