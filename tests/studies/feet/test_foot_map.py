"""A map of feet: a person who is told that every foot is sound, tables, and the command."""

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs import Biped, settings_from
from springfoot.studies.feet.foot_map import SOUND_FOOT, TOLD, flat_table, map_table, told_sound

WORDS = {"acts": "both", "ankle_tendon": 400.0}


def test_a_person_who_is_told_a_sound_foot_sees_what_it_sees_on_one():
    seen = []
    for foot in ("intact", "rigid"):
        settings = settings_from(right_foot=foot, **WORDS)
        biped = Biped(settings, 1)
        biped.reset(np.arange(1), [0])
        seen.append(told_sound(lambda observation: observation, settings)(biped.observe()))
    names = list(biped.observation_names)
    feet = slice(names.index("muscles_ankle_left"), names.index("leg_ratio"))
    assert (seen[0][:, feet] == seen[1][:, feet]).all()
    assert (biped.observe()[:, feet] != seen[1][:, feet]).any()  # the environment's own stays


def walked(told, falls, speed, fibre):
    return {"foot": "rigid", "told": told, "episodes": 4, "falls": falls, "speed_m_s": speed, "fibre_J_kg_m": fibre}


def test_numbers_are_of_feet_without_a_fall_either_way():
    rows = [
        walked(TOLD[0], 0.0, 1.2, 3.0),
        walked(TOLD[0], 0.25, 1.0, 9.0),
        walked(SOUND_FOOT, 0.0, 1.1, 3.5),
        walked(SOUND_FOOT, 0.5, 1.0, 9.0),
    ]
    assert "| rigid | 1 of 8 / 2 of 8 | 1.20 / 1.10 | 3.00 / 3.50 |" in map_table(rows)
    fallen = [walked(told, 1.0, None, None) for told in TOLD]
    assert "| rigid | 4 of 4 / 4 of 4 | – | – |" in map_table(fallen)


def test_flat_stiffness_has_a_row_for_each():
    rows = [{"ankle_N_m_rad": 50.0, "episodes": 2, "falls": 0.5, "speed_m_s": None, "fibre_J_kg_m": None}]
    rows.append({"ankle_N_m_rad": 600.0, "episodes": 2, "falls": 0.0, "speed_m_s": 1.2, "fibre_J_kg_m": 3.0})
    text = flat_table(rows)
    assert "| 50 | 1 of 2 | – | – |" in text and "| 600 | 0 of 2 | 1.20 | 3.00 |" in text


@pytest.mark.slow
def test_quick_runs(tmp_path):
    assert study_main(["foot-map", "learned", "--quick", "--out", str(tmp_path / "out")]) == 0
    assert "36 passive feet" in (tmp_path / "out" / "feet.csv").read_text()


def test_a_policy_that_moves_no_person_is_refused(capsys):
    assert study_main(["foot-map", "predicted", "--quick"]) == 2
    assert "predicted moves no person" in capsys.readouterr().err
