"""Controls of the price: what does nothing costs nothing, and a spring that returns a tendon's work saves nothing."""

import pytest

from springfoot.cli.main import study_main
from springfoot.studies.base.walked_speeds import at_walked_speeds
from springfoot.studies.feet.controls import (
    CONTROLS,
    STIFFEST,
    TRIED_SPRINGS,
    UNCHANGED,
    Controls,
    best_springs,
    best_table,
    controls_table,
)


def priced(policy, condition, fibre, effort, falls=0.0):
    walk = {"speed_m_s": 1.0, "walked_m_s": 1.0, "falls": falls}
    return {"policy": policy, "condition": condition, **walk, "fibre_J_kg_m": fibre, "effort": effort}


def test_differences_are_from_the_sound_walk_at_the_same_speed():
    rows = [
        priced("mine", UNCHANGED, 4.0, 1.0),
        priced("mine", "worse", 5.0, 0.9),
        priced("mine", "fallen", None, None, 1.0),
    ]
    text = controls_table(rows)
    assert "| worse | 5.00 / 0.90 (+25% / -10%) |" in text and "| fallen | – |" in text


def test_several_policies_have_the_mean_price_and_the_range_of_differences():
    rows = [
        priced("mine", UNCHANGED, 4.0, 1.0),
        priced("mine", "other", 5.0, 0.9),
        priced("yours", UNCHANGED, 2.0, 1.0),
        priced("yours", "other", 2.0, 1.1),
    ]
    assert "| other | 3.50 / 1.00 (+0% to +25% / -10% to +10%) |" in controls_table(rows)


def test_the_best_spring_is_the_lowest_point_of_a_parabola_planted_in_the_prices():
    def price(k):  # least at 180 N m/rad, a tenth below the price without a spring
        return 4.0 - 0.4 * (1.0 - ((k - 180.0) / 180.0) ** 2)

    springs = TRIED_SPRINGS[0]
    rows = [priced("mine", name, 4.0, 1.0) for name in CONTROLS if name not in springs.conditions.values()]
    rows += [priced("mine", name, price(k), 1.0 + 0.001 * k) for k, name in springs.conditions.items()]
    best = {(row["springs"], row["price"]): row for row in best_springs(rows)}
    fibre = best[springs.name, "fibre_J_kg_m"]
    assert fibre["best_N_m_rad"] == pytest.approx(180.0) and fibre["saving"] == pytest.approx(0.1)
    dearer = best[springs.name, "effort"]  # every spring costs more than a slack device
    assert dearer["saving"] == 0.0 and dearer["best_N_m_rad"] == 0.0
    assert f"| {springs.name} | {UNCHANGED} | 180, 10% |" in best_table(best_springs(rows))


def test_no_spring_is_best_where_nobody_walks():
    rows = [priced("mine", name, None, None, 1.0) for name in CONTROLS]
    assert {(row["best_N_m_rad"], row["saving"]) for row in best_springs(rows)} == {(None, None)}


SLACK = TRIED_SPRINGS[0].conditions[0.0]


@pytest.mark.slow
def test_a_slack_device_costs_nothing_to_the_bit():
    study = Controls(episodes=2, seconds=8.0, threads=1)
    slack, sound = study.walk("schedule", [CONTROLS[SLACK], CONTROLS[UNCHANGED]])
    assert slack == sound and sound["fibre_J_kg_m"] is not None


@pytest.mark.slow
def test_the_stiffest_spring_beside_a_sound_calf_saves_nothing():
    study = Controls(episodes=1, seconds=12.0, threads=1)
    asked = [(name, speed) for name in (UNCHANGED, STIFFEST) for speed in (0.8, 1.0, 1.2, 1.4, 1.6)]
    numbers = study.walk("schedule", [{**CONTROLS[name], "speed": speed} for name, speed in asked])
    walks = [{"condition": name, "speed_m_s": speed, **own} for (name, speed), own in zip(asked, numbers, strict=True)]
    for speed in (0.8, 1.0, 1.2):
        sound, braced = at_walked_speeds(walks, ("condition",), (speed,))
        assert braced["fibre_J_kg_m"] >= 0.99 * sound["fibre_J_kg_m"]


@pytest.mark.slow
def test_quick_runs(tmp_path):
    assert study_main(["controls", "--quick", "--threads", "1", "--out", str(tmp_path / "out")]) == 0
    assert "sound" in (tmp_path / "out" / "equal_speeds.csv").read_text()
