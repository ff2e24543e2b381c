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
        settings = settings_from(left_foot=foot, right_foot=foot, **WORDS)
        biped = Biped(settings, 1)
        biped.reset(np.arange(1), [0])
        seen.append(told_sound(lambda observation: observation, settings)(biped.observe()))
    names = list(biped.observation_names)
    feet = slice(names.index("muscles_ankle_left"), names.index("leg_ratio"))
    assert (seen[0][:, feet] == seen[1][:, feet]).all()
    others = np.r_[: feet.start, names.index("leg_ratio") : len(names)]
    assert (seen[1][:, others] == biped.observe()[:, others]).all()
    assert (biped.observe()[:, feet] != seen[1][:, feet]).any()  # the environment's own stays


def walked(told, falls, speed, fibre, effort):
    numbers = {"speed_m_s": speed, "fibre_J_kg_m": fibre, "effort": effort}
    return {"foot": "rigid", "told": told, "episodes": 4, "falls": falls} | numbers


def test_prices_are_of_all_feet_walked_on_and_what_knowing_is_worth_of_those_walked_on_either_way():
    rows = [
        walked(TOLD[0], 0.0, 1.2, 3.0, 0.8),
        walked(TOLD[0], 0.0, 1.0, 4.0, 1.0),
        walked(TOLD[0], 0.25, 1.0, 9.0, 9.0),
        walked(SOUND_FOOT, 0.0, 1.1, 3.3, 0.9),
        walked(SOUND_FOOT, 0.5, 1.0, 9.0, 9.0),
        walked(SOUND_FOOT, 0.0, 1.0, 9.0, 9.0),
    ]
    assert "| rigid | 1 of 12 / 2 of 12 | 1.10 | 3.50 | 0.90 | +10% (feet: 1) |" in map_table(rows)
    fallen = [walked(told, 1.0, None, None, None) for told in TOLD]
    assert "| rigid | 4 of 4 / 4 of 4 | – | – | – | – |" in map_table(fallen)


def test_flat_stiffness_has_a_row_for_each():
    rows = [{"ankle_N_m_rad": 50.0, "episodes": 2, "falls": 0.5, "speed_m_s": None, "fibre_J_kg_m": None}]
    rows.append({"ankle_N_m_rad": 600.0, "episodes": 2, "falls": 0.0, "speed_m_s": 1.2, "fibre_J_kg_m": 3.0})
    text = flat_table([row | {"effort": row["speed_m_s"] and 0.7} for row in rows])
    assert "| 50 | 1 of 2 | – | – | – |" in text and "| 600 | 0 of 2 | 1.20 | 3.00 | 0.70 |" in text


@pytest.mark.slow
def test_quick_runs(tmp_path):
    assert study_main(["foot-map", "learned", "--quick", "--threads", "1", "--out", str(tmp_path / "out")]) == 0
    assert "36 passive feet" in (tmp_path / "out" / "feet.csv").read_text()


def test_a_policy_that_moves_no_person_is_refused(capsys):
    assert study_main(["foot-map", "pretrained", "--quick"]) == 2
    assert "pretrained moves no person" in capsys.readouterr().err
