"""Published effects: each is walked or has a reason, planted truths are judged as they are, and a slope costs."""

import csv

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.settings import body_of, settings_from
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.studies.walks.condition_effects import slope
from springfoot.studies.walks.effect_experiments import BRACES, EXPERIMENTS, STRENGTHS, Experiment
from springfoot.studies.walks.effect_numbers import ALL_EFFORT, EFFECT_NUMBERS, FIBRE, com_power, numbers_by_episode
from springfoot.studies.walks.effects import (
    AROUND,
    effect_row,
    effects_table,
    published_effects,
    sign_is,
    size_within,
    verdict,
    walks_of,
)

PUBLISHED = {row["name"]: row for row in published_effects()}
WALKED = {name: one for name, one in EXPERIMENTS.items() if isinstance(one, Experiment)}


def planted(name, number_of, falls=(), episodes=3):
    """Rows of an experiment's walks, each walking as commanded, whose numbers are 1 but for those of `number_of`, a
    function of condition, commanded speed and episode; the episodes (condition, episode) of `falls` fall."""
    rows = []
    for condition, given in walks_of(WALKED[name]):
        for episode in range(episodes):
            numbers = dict.fromkeys(EFFECT_NUMBERS, 1.0) | {"walked_m_s": given["speed"]}
            numbers |= number_of(condition, given["speed"], episode)
            fell = (condition, episode) in falls
            numbers = {key: None if fell else value for key, value in numbers.items()} | {"falls": float(fell)}
            rows.append({"condition": condition, "episode": episode, "speed_m_s": given["speed"], **numbers})
    return rows


def row_of(name, walks):
    return effect_row(PUBLISHED[name], EXPERIMENTS[name], walks)


def test_every_published_effect_is_walked_or_has_a_reason():
    assert list(PUBLISHED) == list(EXPERIMENTS)
    reasons = [one for one in EXPERIMENTS.values() if isinstance(one, str)]
    assert all(reason.startswith("not run: ") and len(reason) > 20 for reason in reasons)
    assert len(WALKED) + len(reasons) == 36
    row = row_of("afo_stop_knee", {})
    assert (row["run"], row["measured"]) == (0, None) and row["note"] in reasons


@pytest.mark.parametrize("name", WALKED)
def test_every_experiment_has_valid_settings_and_an_understood_tolerance(name):
    for _, given in walks_of(WALKED[name]):
        settings_from(**given)
    within = size_within(PUBLISHED[name], 1.0, dict.fromkeys(WALKED[name].also, True))
    assert (within is None) == (PUBLISHED[name]["tolerance"] == "sign only")


def test_signs_are_right_wrong_or_unclear():
    assert [sign_is(sign, 1) for sign in ("+", "-", "")] == ["right", "wrong", None]
    assert [sign_is(sign, -1) for sign in ("+", "-", "")] == ["wrong", "right", None]
    assert [sign_is(sign, 0) for sign in ("+", "-", "")] == ["unclear", "unclear", None]


@pytest.mark.parametrize(
    ("size", "tolerance", "inside", "outside"),
    [
        ("-16", "within a factor of 2", (-8.0, -16.0, -32.0), (-7.9, -32.1, 16.0, 0.0)),
        ("0.6", "within a factor of 2", (0.3, 1.2), (0.29, 1.21, -0.6)),
        ("10.7", "5 to 20", (5.0, 20.0), (4.9, 20.1, -10.0)),
        ("-0.4", "-10 to 10", (-10.0, 0.0, 10.0), (-10.1, 10.1)),
        ("", "sign only", (), ()),
    ],
)
def test_sizes_are_within_the_tolerance_of_the_row(size, tolerance, inside, outside):
    row = {"name": "planted", "size": size, "tolerance": tolerance}
    assert {size_within(row, value, {}) for value in inside} <= {1}
    assert {size_within(row, value, {}) for value in outside} <= {0}
    if tolerance == "sign only":
        assert size_within(row, 1.0, {}) is None


def test_a_further_clause_of_a_tolerance_has_to_hold_and_an_unknown_one_is_refused():
    row = {"name": "planted", "size": "-4.2", "tolerance": "-2 to -9; less at 250 than at 50"}
    assert size_within(row, -4.2, {"less at 250 than at 50": True}) == 1
    assert size_within(row, -4.2, {"less at 250 than at 50": False}) == 0
    for tolerance, also in (("-2 to -9; and more", {}), ("about as much", {}), ("-2 to -9", {"and more": True})):
        with pytest.raises(SpringfootError, match="not understood"):
            size_within({**row, "tolerance": tolerance}, -4.2, also)


def test_a_planted_slope_comes_back_at_equal_walked_speed_with_effort_beside():
    # Fibre work rises by 2 J/kg/m for each m/s: compared at the commanded speeds alone a slow walk would look cheap.
    def numbers(condition, speed, episode):
        up = condition == "up"
        walked = speed - 0.1 * up
        return {"walked_m_s": walked, FIBRE: 2.0 * walked + 2.8 * up + 0.01 * episode, ALL_EFFORT: 10.0 + 5.0 * up}

    row = row_of("slope_up", {"one": planted("slope_up", numbers)})
    assert row["measured"] == pytest.approx(2.8) and row["effort"] == pytest.approx(5.0)
    assert (row["sign_is"], row["size_within"], row["pairs"], row["walked_m_s"]) == ("right", 1, 3, "1.30")
    assert verdict([row]).startswith("Of 1 effects seen before, 1 walked, signs are right in 1 of 1")


def test_slopes_are_of_least_squares_for_each_episode():
    x = np.array([0.0, 1.0, 3.0])
    assert slope(x, [2.0 * x[0] + np.arange(2), 2.0 * x[1] + np.arange(2), 2.0 * x[2] + np.arange(2)]) == pytest.approx(
        [2.0, 2.0]
    )
    assert slope([[0.0, 0.0], [1.0, 2.0]], [[0.0, 0.0], [3.0, 3.0]]) == pytest.approx([3.0, 1.5])


@pytest.mark.parametrize(("name", "masses"), [("foot_mass", (0.0, 4.0, 8.0)), ("waist_mass", (0.0, 4.0, 8.0, 16.0))])
def test_masses_that_are_carried_cost_a_share_of_the_walk_without_them_for_each_kg(name, masses):
    assert tuple(WALKED[name].conditions) == masses
    carried = [settings_from(**given) for given in WALKED[name].conditions.values()]
    bodies = [body_of(settings) for settings in carried]
    added = [
        body.carried_mass + sum((foot.foot_mass_ratio - 1.0) * (body.foot_mass + body.toe_mass) for foot in of.feet)
        for body, of in zip(bodies, carried, strict=True)
    ]
    assert added == pytest.approx(masses)
    walks = planted(name, lambda kg, *_: {"walked_m_s": 1.25, FIBRE: 3.0 * (1.0 + 0.05 * kg)})
    assert row_of(name, {"one": walks})["measured"] == pytest.approx(5.0)


def test_an_effect_of_ankle_work_lost_is_per_joule_lost():
    lost = {"free": 0.0, "stop at 0°": 0.1, "stop at -5°": 0.2, "stop at -10°": 0.3}
    walks = planted(
        "pushoff_collision",
        lambda condition, *_: {
            "ankle_positive_J_kg": 0.5 - lost[condition],
            "collision_J_kg": 0.2 + 0.6 * lost[condition],
        },
    )
    row = row_of("pushoff_collision", {"one": walks})
    assert row["measured"] == pytest.approx(0.6) and row["sign_is"] == "right" and row["effort"] is None


def test_a_range_is_of_each_calf_and_a_saving_obeys_its_clause():
    prices = dict(zip(BRACES, (3.3, 3.0, 3.1, 3.2), strict=True))
    row = row_of("afo_range", {"one": planted("afo_range", lambda condition, *_: {FIBRE: prices[condition[1]]})})
    assert row["measured"] == pytest.approx(10.0) and (row["sign_is"], row["size_within"]) == (None, 1)
    assert all(f"calf {strength:g} 10" in row["beside"] for strength in STRENGTHS)

    def saving(at_250):
        walks = planted("exo_saving", lambda k, *_: {FIBRE: {50.0: 0.95, 250.0: at_250}.get(k, 1.0)})
        return row_of("exo_saving", {"one": walks})

    assert (saving(0.97)["size_within"], saving(0.90)["size_within"]) == (1, 0)
    assert "less at 250 than at 50: no" in saving(0.90)["note"]


def test_the_saving_of_a_spring_is_told_joint_by_joint():
    numbers = {0.0: (2.0, 1.0), 50.0: (1.7, 1.2)}  # ankle and knee [J/kg/m]

    def prices(k, *_):
        ankle, knee = numbers.get(k, (2.0, 1.0))
        joints = {"ankle": ankle, "knee": knee, "hip": 1.0, "toe": 0.0}
        return {f"fibre_{joint}_J_kg_m": price for joint, price in joints.items()} | {FIBRE: sum(joints.values())}

    row = row_of("exo_saving", {"one": planted("exo_saving", prices)})
    assert row["measured"] == pytest.approx(-2.5)
    assert row["beside"].endswith("of it hip 0; of it knee 5; of it ankle −7.5; of it toe 0")


def test_falls_are_told_left_out_in_pairs_and_a_condition_in_which_all_fall_is_a_miss():
    def numbers(condition, speed, episode):
        return {"right_forward_bw": {"sound": 0.2, "stay": 0.1 if episode else 0.9}[condition]}

    row = row_of("stay_propulsion", {"one": planted("stay_propulsion", numbers, falls={("stay", 0)})})
    assert (row["measured"], row["pairs"], row["falls"]) == (pytest.approx(-0.1), 2, "1 of 6")
    assert row["note"] == "falls 1 of 3 in stay at 0.8 m/s; of 2 of 3 episodes, in which all walk, and as fast"
    everyone = {("stay", episode) for episode in range(3)}
    row = row_of("stay_propulsion", {"one": planted("stay_propulsion", numbers, falls=everyone)})
    assert (row["measured"], row["sign_is"], row["falls"]) == (None, None, "3 of 6")
    assert row["note"].endswith("no episode has all numbers: stay always falls")
    assert "signs are right in 0 of 1" in verdict([row]) and "| – |" in effects_table([row])


def test_a_person_without_a_number_is_told_and_leaves_the_others_theirs():
    walks = planted(
        "stay_propulsion", lambda condition, *_: {"right_forward_bw": {"sound": 0.2, "stay": 0.1}[condition]}
    )
    fallen = planted(
        "stay_propulsion", lambda *_: {"right_forward_bw": 0.2}, falls={("stay", episode) for episode in range(3)}
    )
    row = row_of("stay_propulsion", {"one": walks, "other": fallen})
    assert (row["measured"], row["one"], row["other"]) == (pytest.approx(-0.1), pytest.approx(-0.1), None)
    assert "of 1 of 2 persons, those with an episode that has all numbers" in row["note"]
    assert row["sign_is"] == "right" and row["falls"] == "3 of 12"


def test_a_condition_that_does_not_reach_the_speed_is_a_miss_that_tells_its_speed():
    def slow(condition, speed, episode):
        return {"walked_m_s": 0.6 * speed if condition == "rigid" else speed}

    row = row_of("rigid_both_cost", {"one": planted("rigid_both_cost", slow)})
    assert (row["measured"], row["size_within"], row["falls"]) == (None, None, "0 of 18")
    assert row["note"] == "no episode has all numbers: rigid walks 0.66 to 0.84 m/s"
    assert "sizes within in 0 of 1" in verdict([row])


def test_several_persons_have_a_value_each():
    def steeper(by):
        return planted("slope_up", lambda condition, *_: {FIBRE: 1.0 + by * (condition == "up")})

    row = row_of("slope_up", {"one": steeper(2.0), "two": steeper(3.0)})
    assert (row["one"], row["two"], row["measured"]) == pytest.approx((2.0, 3.0, 2.5))
    assert row["low"] < 2.5 < row["high"] and row["pairs"] == 6


@pytest.mark.slow
def test_power_on_the_com_from_mean_curves_has_the_measured_push_off():
    act, settings = policy_and_settings("schedule", {"episode_seconds": 8.0})
    recording = record(act, settings, name="schedule", episodes=1)
    gait = measure(recording)
    power = np.maximum(com_power(gait), 0.0)
    percent_seconds = 2 * 60 / gait.metrics["cadence_steps_min"] / 100
    double_support = slice(50, round(gait.metrics["toe_off_percent"]) + 1)  # as the trailing leg
    push_off = power[double_support].sum() * percent_seconds
    assert push_off == pytest.approx(gait.metrics["com_work_J_kg"]["push_off"], rel=0.1)
    (measured,) = numbers_by_episode(recording)
    numbers = {name: value for name, value in measured.items() if value is not None}
    assert set(numbers) == {"falls", *EFFECT_NUMBERS}
    assert numbers[ALL_EFFORT] > numbers[FIBRE] == gait.metrics["effort"]["fibre_J_kg_m"]
    assert 0.0 < numbers["hip_share"] < 1.0 and numbers["com_positive_W_kg"] > push_off / 0.6


@pytest.mark.slow
def test_a_slope_costs_what_lifting_costs_and_kept_walks_are_not_walked_again(tmp_path, monkeypatch, capsys):
    words = ["effects", "--effects", "slope_up", "--episodes", "2", "--seconds", "6", "--threads", "1"]
    words += ["--keep", str(tmp_path / "kept")]
    assert study_main([*words, "--out", str(tmp_path / "first")]) == 0
    monkeypatch.setattr("springfoot.studies.base.condition_walks.record_feet", None)  # walking again would fail
    assert study_main([*words, "--out", str(tmp_path / "second")]) == 0
    first, second = ((tmp_path / out / "effects.csv").read_text(encoding="utf-8") for out in ("first", "second"))
    assert first == second
    (row,) = csv.DictReader(first.splitlines())
    lifting = 9.81 * np.tan(np.radians(4.57)) / 0.25  # by shortening muscles alone [J/kg/m]
    assert 0.5 * lifting < float(row["measured"]) < 1.5 * lifting
    assert (row["sign_is"], row["falls"]) == ("right", f"0 of {4 * len(AROUND)}")
    assert "**Of 1 effects seen before, 1 walked" in capsys.readouterr().out


def test_an_unknown_effect_is_one_line(capsys):
    assert study_main(["effects", "--effects", "slope_upp"]) == 2
    assert capsys.readouterr().err == (
        "springfoot study effects: error: no effect 'slope_upp'; docs/effects.csv lists them; perhaps slope_up?\n"
    )
