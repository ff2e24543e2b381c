"""The landscape of stiffness: a planted least price, its neighbourhood, directions with their sign, and kept cells."""

import json

import pytest

from springfoot.cli.main import study_main
from springfoot.studies.base.walked_speeds import TWO_PRICES
from springfoot.studies.springs.landscape import (
    ANGLES_RMSE,
    ANKLES,
    NOT_DEARER,
    TOES,
    cells_of_least,
    direction,
    least_table,
)

FIBRE, EFFORT = TWO_PRICES


def bowl(best_ankle, best_toe, *, speed=1.1, person="one", missing=()):
    """Return rows at equal walked speed whose fibre work is least, 3 J/kg/m, at one cell; effort falls with both."""
    return [
        {
            "person": person,
            "ankle_N_m_rad": ankle,
            "toe_N_m_rad": toe,
            "speed_m_s": speed,
            FIBRE: None if (ankle, toe) in missing else 3.0 + abs(ankle - best_ankle) / 500 + abs(toe - best_toe) / 50,
            EFFORT: None if (ankle, toe) in missing else 5.0 - ankle / 1000 - toe / 1000,
            ANGLES_RMSE: None if (ankle, toe) in missing else 2.0,
        }
        for ankle in ANKLES
        for toe in TOES
    ]


def test_the_cheapest_cell_is_the_one_planted_with_the_cells_near_it():
    fibre, effort, _ = cells_of_least(bowl(150.0, 28.0))
    assert (fibre["ankle_N_m_rad"], fibre["toe_N_m_rad"], fibre["least"]) == (150.0, 28.0, 3.0)
    # 3 J/kg/m and NOT_DEARER of it reach as far as 75 N m/rad of the ankle alone; no other toe lies within 7.5 N m/rad.
    assert pytest.approx(75) == 500 * 3.0 * NOT_DEARER
    assert (fibre["ankle_N_m_rad_from"], fibre["ankle_N_m_rad_to"]) == (100.0, 200.0)
    assert (fibre["toe_N_m_rad_from"], fibre["toe_N_m_rad_to"]) == (28.0, 28.0)
    assert (effort["ankle_N_m_rad"], effort["toe_N_m_rad"]) == (ANKLES[-1], TOES[-1])


def test_a_cell_that_falls_is_not_the_cheapest_and_a_map_of_falls_has_none():
    fibre, *_ = cells_of_least(bowl(150.0, 28.0, missing={(150.0, 28.0)}))
    assert fibre["ankle_N_m_rad"] in (100.0, 200.0) and fibre["cells"] == len(ANKLES) * len(TOES) - 1
    everywhere = {(ankle, toe) for ankle in ANKLES for toe in TOES}
    rows = cells_of_least(bowl(150.0, 28.0, missing=everywhere))
    assert {row["least"] for row in rows} == {None}
    assert "| one, 1.1 m/s | – | – | – |" in least_table(rows)


@pytest.mark.parametrize(
    ("fastest", "ankle"),
    [
        ((200.0, 150.0, 200.0), "stiffer"),
        ((50.0, 50.0, 50.0), "softer"),
        ((200.0, 150.0, 100.0), "not known (2 stiffer, 0 softer)"),
        ((200.0, 150.0), "not known (2 stiffer, 0 softer)"),
    ],
)
def test_a_direction_is_known_if_persons_agree(fastest, ankle):
    even = [
        row
        for number, best in enumerate(fastest)
        for speed, k in ((0.9, 100.0), (1.1, 400.0), (1.3, best))
        for row in bowl(k, 28.0, speed=speed, person=f"{number}")
    ]
    least = cells_of_least(even)
    assert direction(least, "ankle_N_m_rad", FIBRE) == ankle
    assert direction(least, "toe_N_m_rad", FIBRE) == "not known (0 stiffer, 0 softer)"


@pytest.mark.slow
def test_kept_cells_are_not_walked_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("springfoot.studies.springs.landscape.ANKLES", (200.0,))
    monkeypatch.setattr("springfoot.studies.springs.landscape.TOES", (28.0,))
    monkeypatch.setattr("springfoot.studies.springs.landscape.ASKED_SPEEDS", (1.0, 1.2))
    words = ["landscape", "--episodes", "1", "--seconds", "6", "--threads", "1", "--keep", str(tmp_path / "kept.json")]
    assert study_main([*words, "--out", str(tmp_path / "first")]) == 0
    kept = json.loads((tmp_path / "kept.json").read_text())
    assert len(kept) == 2
    monkeypatch.setattr("springfoot.studies.springs.landscape.record_policies", None)  # walking again would fail
    assert study_main([*words, "--out", str(tmp_path / "second")]) == 0
    assert (tmp_path / "first/walks.csv").read_bytes() == (tmp_path / "second/walks.csv").read_bytes()
    assert "somebody falls in 0 undisturbed" in capsys.readouterr().out


def test_a_bad_push_is_one_line(capsys):
    assert study_main(["landscape", "--push-newton", "0"]) == 2
    assert capsys.readouterr().err == (
        "springfoot study landscape: error: push_newton must be a finite number > 0 and <= 1000 N, got 0.0\n"
    )
