"""The search for leg constants: its units, what it pays for, and what it writes."""

import csv
import json
from dataclasses import asdict, replace
from importlib import resources
from math import exp

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.control.constants import leg_constants
from springfoot.envs.control.legs import KNOTS
from springfoot.envs.settings.settings import BipedSettings
from springfoot.evaluation import measure, policy_and_settings, record
from springfoot.evaluation.numbers import series as numbers_series
from springfoot.gait.people.human import human_gait
from springfoot.studies.searches import leg_cost
from springfoot.studies.searches import leg_tuning as tuning
from springfoot.studies.searches.leg_vector import LEAD_STEP, LED, Search
from springfoot.studies.searches.leg_walks import SECONDS
from springfoot.studies.springs.stiffness_steps import paired_walks

COMMITTED = leg_constants("planned", "people")


@pytest.fixture
def constants(tmp_path):
    """A copy of the committed file of constants."""
    path = tmp_path / "legs.json"
    path.write_text(resources.files("springfoot.envs.control").joinpath("legs.json").read_text(encoding="utf-8"))
    return path


def test_the_search_begins_at_its_start_and_steps_in_the_constants_own_units():
    search = Search(COMMITTED)
    assert search.constants(np.zeros(search.size)) == COMMITTED
    stepped = search.constants(np.append(np.ones(search.size - len(LED)), np.zeros(len(LED))))
    assert stepped.knee_knots_deg == pytest.approx(np.array(COMMITTED.knee_knots_deg) + 2.0, abs=1e-5)
    assert stepped.hip_stiffness == pytest.approx(np.array(COMMITTED.hip_stiffness) * exp(0.15), rel=1e-6)
    assert stepped.trunk_pitch_deg == pytest.approx(COMMITTED.trunk_pitch_deg + 1.0, abs=1e-5)


@pytest.mark.parametrize(
    ("place", "joint", "curve"), [(-3, "hip", "thigh"), (-2, "knee", "knee"), (-1, "ankle", "ankle")]
)
def test_one_step_brings_the_whole_target_of_a_joint_earlier(place, joint, curve):
    search = Search(COMMITTED)
    vector = np.zeros(search.size)
    vector[place] = 1.0
    led, human, name = search.constants(vector), human_gait(tuning.TUNED_SPEED), f"{joint}_knots_deg"
    added = np.array(getattr(led, name)) - getattr(COMMITTED, name)
    earlier = human.mean(curve, KNOTS + LEAD_STEP) - human.mean(curve, KNOTS)
    assert added == pytest.approx(np.rad2deg(earlier), abs=0.2)  # to first order; the knee moves 1.5 deg
    assert replace(led, **{name: getattr(COMMITTED, name)}) == COMMITTED


def test_legs_like_peoples_pay_less_than_legs_farther_off_and_those_less_than_legs_that_fall():
    farther = replace(COMMITTED, hip_knots_deg=tuple(1.5 + knot for knot in COMMITTED.hip_knots_deg))
    limp = replace(COMMITTED, hip_stiffness=(20.0, 20.0), knee_stiffness=(20.0, 20.0))
    settings = BipedSettings(episode_seconds=SECONDS + 1)
    paid = leg_cost.cost(settings, [limp, COMMITTED, farther], seed=0, threads=1, push=0.0, foreign=0.0)
    assert paid[1] < paid[2] < paid[0]


@pytest.mark.slow
def test_searches_and_studies_measure_as_an_evaluation_does(monkeypatch):
    """A measurer that finds heel strikes late and toe-offs early moves an evaluation, a search and a study alike; one
    that finds the speed too high, an evaluation and a search."""
    settings = BipedSettings(episode_seconds=SECONDS + 1)
    policy, walked = policy_and_settings("schedule", {"episode_seconds": SECONDS})

    recording = record(policy, walked, name="", episodes=1)

    def paid_by_search():
        return leg_cost.cost(settings, [COMMITTED], seed=0, threads=1, push=0.0, foreign=0.0)[0]

    def three():
        toe_off = measure(recording).metrics["toe_off_percent"]
        step_length = paired_walks(policy, walked, 0.0, range(2), strides=2, threads=1).unchanged[..., 1]
        return paid_by_search(), toe_off, step_length

    paid, toe_off, step_length = three()
    speed = measure(recording).metrics["speed_m_s"]["mean"]
    distance = numbers_series.distance_walked
    with monkeypatch.context() as faster:
        faster.setattr(numbers_series, "distance_walked", lambda *walk: 1.1 * distance(*walk))
        assert measure(recording).metrics["speed_m_s"]["mean"] == pytest.approx(1.1 * speed)
        assert paid_by_search() > paid + 0.1
    found = numbers_series.find_contacts

    def late(force, tick, threshold, first=0.0):
        return found(force, tick, 8 * threshold, first)

    monkeypatch.setattr(numbers_series, "find_contacts", late)
    paid_late, toe_off_late, step_length_late = three()
    assert toe_off_late < toe_off - 1.0 and abs(paid_late - paid) > 0.1
    assert (step_length_late != step_length).all()


def run(*words):
    return study_main(["leg-tuning", *map(str, words)])


@pytest.mark.slow
def test_a_search_writes_its_constants_and_its_command_and_leaves_the_others_alone(constants):
    before = json.loads(constants.read_text())
    words = ["--generations", "1", "--population", "4", "--threads", "1", "--constants", constants]
    words += ["--out", constants.parent / "out"]
    assert run(*words) == 0
    after = json.loads(constants.read_text())
    found = after["constants"].pop("planned")
    assert found != before["constants"].pop("planned") and set(found) == set(asdict(COMMITTED))
    assert after["constants"] == before["constants"]
    assert after["found_by"]["planned"] == " ".join(["springfoot study leg-tuning", *map(str, words)])
    (row,) = csv.DictReader((constants.parent / "out" / "generations.csv").read_text().splitlines())
    assert row["generation"] == "1" and float(row["best"]) <= float(row["median"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--start", "nobody"], "no constants 'nobody' to start from"),
        (["--equilibrium", "neutral", "--cadence", "thesis"], "'neutral, thesis cadence'"),
        (["--generations", "0"], "generations must be"),
        (["--sigma", "nan"], "sigma must be"),
        (["--push-newton", "-1"], "push_newton must be"),
        (["--constants", "nowhere.json"], "nowhere.json"),
        (["--constants", "foreign.json"], "not a file of leg constants"),
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_written(monkeypatch, capsys, tmp_path, constants, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "foreign.json").write_text("[1]")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    file = [] if "--constants" in words else ["--constants", "legs.json"]
    assert run(*file, "--population", "2", *words) == 2
    out, error = capsys.readouterr()
    assert said in error and error.count("\n") == 1 and not out
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
def test_a_search_pushes_from_a_generation_on(constants):
    own = constants.read_bytes()

    def paid(name, *words):
        constants.write_bytes(own)  # a search begins at what is there, and replaces it
        words = ["--population", "2", "--threads", "1", "--generations", "2", *words]
        out = constants.parent / name
        assert run(*words, "--constants", constants, "--out", out) == 0
        return [float(row["best"]) for row in csv.DictReader((out / "generations.csv").read_text().splitlines())]

    never, later = paid("never", "--push-newton", 0), paid("later", "--push-newton", 400, "--pushed-from", 1)
    assert later[0] == never[0] and later[1] > never[1] + leg_cost.FALL_COST / 3


def test_a_quick_search_writes_no_constants(constants, capsys):
    before = constants.read_text()
    assert run("--quick", "--generations", "150", "--constants", constants, "--out", constants.parent / "out") == 0
    assert constants.read_text() == before and "these figures mean nothing" in capsys.readouterr().out
