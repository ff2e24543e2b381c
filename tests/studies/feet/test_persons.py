"""The study of persons: falls by foot, held speed, likeness on sound feet."""

import csv

import pytest

from springfoot.cli.main import study_main
from springfoot.envs.settings.feet import FootSetting
from springfoot.studies.feet.persons import feet_in_words

BRACE = {"orthosis": {"ankle_stiffness": 150.0}}
HEAVIER = {"kind": "intact", "foot_mass_ratio": 3.0}


@pytest.mark.parametrize(
    ("left", "right", "words"),
    [
        ("intact", "intact", "intact"),
        ("intact", "rigid", "rigid"),
        ("drop", "intact", "drop"),
        (HEAVIER, HEAVIER, "intact, heavier (both)"),
        (HEAVIER | BRACE, HEAVIER | BRACE, "intact, braced, heavier (both)"),
        ("intact", {"kind": "weak", "strength": 0.5} | BRACE, "weak, braced"),
    ],
)
def test_feet_are_told_by_kind_brace_and_mass_that_is_added(left, right, words):
    assert feet_in_words((FootSetting(left).foot, FootSetting(right).foot)) == words


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
