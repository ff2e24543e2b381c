"""Controls of the price: what does nothing costs nothing, and a spring that returns a tendon's work saves nothing."""

import pytest

from springfoot.cli.main import study_main
from springfoot.studies.feet.controls import CONTROLS, SLACK, STIFFEST, UNCHANGED, Controls, controls_table
from springfoot.studies.feet.walked_speeds import at_walked_speeds


def test_differences_are_from_the_sound_walk_at_the_same_speed():
    walk = {"speed_m_s": 1.0, "walked_m_s": 1.0, "falls": 0.0}
    rows = [
        {"condition": UNCHANGED, **walk, "fibre_J_kg_m": 4.0, "effort": 1.0},
        {"condition": "worse", **walk, "fibre_J_kg_m": 5.0, "effort": 0.9},
        {"condition": "fallen", **walk, "falls": 1.0, "fibre_J_kg_m": None, "effort": None},
    ]
    text = controls_table(rows)
    assert "| worse | 5.00 / 0.90 (+25% / -10%) |" in text and "| fallen | – |" in text


@pytest.mark.slow
def test_a_slack_device_costs_nothing_to_the_bit():
    study = Controls(episodes=2, seconds=8.0)
    assert study.walk(CONTROLS[SLACK]) == study.walk(CONTROLS[UNCHANGED])


@pytest.mark.slow
def test_the_stiffest_spring_beside_a_sound_calf_saves_nothing():
    study = Controls(episodes=1, seconds=12.0)
    walks = [
        {"condition": name, "speed_m_s": speed, **study.walk({**CONTROLS[name], "speed": speed})}
        for name in (UNCHANGED, STIFFEST)
        for speed in (0.8, 1.0, 1.2, 1.4, 1.6)
    ]
    for speed in (0.8, 0.9):
        sound, braced = at_walked_speeds(walks, ("condition",), (speed,))
        assert braced["fibre_J_kg_m"] >= 0.99 * sound["fibre_J_kg_m"]


@pytest.mark.slow
def test_quick_runs(tmp_path):
    assert study_main(["controls", "--quick", "--out", str(tmp_path / "out")]) == 0
    assert "sound" in (tmp_path / "out" / "equal_speeds.csv").read_text()
