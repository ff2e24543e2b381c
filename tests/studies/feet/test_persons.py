"""The study of persons: falls by foot, held speed, likeness on sound feet."""

import csv

import pytest

from springfoot.cli.main import study_main


@pytest.mark.slow
def test_quick_walks_the_packages_person_on_drawn_feet_and_sound_ones(tmp_path):
    out = tmp_path / "out"
    assert study_main(["persons", "--quick", "--threads", "1", "--out", str(out)]) == 0
    drawn = list(csv.DictReader((out / "drawn.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["push_N"] for row in drawn] == ["0", "0", "100", "100"]
    assert {row["person"] for row in drawn} == {"learned"}
    by_foot = list(csv.DictReader((out / "by_foot.csv").read_text(encoding="utf-8").splitlines()))
    for row in by_foot:
        here = [one for one in drawn if (one["push_N"], one["foot"]) == (row["push_N"], row["foot"])]
        assert int(row["walks"]) == len(here) and int(row["falls"]) == sum(int(one["fell"]) for one in here)
    assert sum(int(row["walks"]) for row in by_foot) == len(drawn)
    sound = list(csv.DictReader((out / "sound.csv").read_text(encoding="utf-8").splitlines()))
    assert [float(row["speed_m_s"]) for row in sound[:5]] == [0.9, 1.0, 1.2, 1.4, 1.5]
    assert all(row["falls"] == "0" and abs(float(row["walked_m_s"]) - float(row["speed_m_s"])) < 0.05 for row in sound)
