"""The search for leg constants: its units, what it pays for, and what it writes."""

import json
import sys
from dataclasses import asdict, replace
from importlib import resources
from math import exp

import numpy as np
import pytest

from springfoot.envs.control.leg_constants import leg_constants
from springfoot.envs.settings import BipedSettings
from springfoot.studies import leg_tuning as tuning

COMMITTED = leg_constants("planned", "people")


@pytest.fixture
def constants(tmp_path):
    """A copy of the committed file of constants."""
    path = tmp_path / "legs.json"
    path.write_text(resources.files("springfoot.envs.control").joinpath("legs.json").read_text(encoding="utf-8"))
    return path


def test_the_search_begins_at_its_start_and_steps_in_the_constants_own_units():
    search = tuning.Search(COMMITTED)
    assert search.constants(np.zeros(search.size)) == COMMITTED
    stepped = search.constants(np.ones(search.size))
    assert stepped.knee_knots_deg == pytest.approx(np.array(COMMITTED.knee_knots_deg) + 2.0, abs=1e-5)
    assert stepped.hip_stiffness == pytest.approx(np.array(COMMITTED.hip_stiffness) * exp(0.15), rel=1e-6)
    assert stepped.trunk_pitch_deg == pytest.approx(COMMITTED.trunk_pitch_deg + 1.0, abs=1e-5)


def test_legs_like_peoples_pay_less_than_legs_farther_off_and_those_less_than_legs_that_fall():
    farther = replace(COMMITTED, hip_knots_deg=tuple(1.5 + knot for knot in COMMITTED.hip_knots_deg))
    limp = replace(COMMITTED, hip_stiffness=(20.0, 20.0), knee_stiffness=(20.0, 20.0))
    settings = BipedSettings(episode_seconds=tuning.SECONDS + 1)
    paid = tuning.cost(settings, [limp, COMMITTED, farther], seed=0, threads=1, push=150.0, ease=0.0)
    assert paid[1] < paid[2] < paid[0]


def run(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["tuning", *map(str, words)])
    return tuning.main()


def test_a_search_writes_its_constants_and_its_command_and_leaves_the_others_alone(monkeypatch, constants):
    before = json.loads(constants.read_text())
    words = ["--generations", "1", "--population", "4", "--threads", "1", "--out", constants]
    assert run(monkeypatch, *words) == 0
    after = json.loads(constants.read_text())
    found = after["constants"].pop("planned")
    assert found != before["constants"].pop("planned") and set(found) == set(asdict(COMMITTED))
    assert after["constants"] == before["constants"]
    assert after["found_by"]["planned"] == " ".join(["python -m springfoot.studies.leg_tuning", *map(str, words)])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--start", "nobody"], "no constants 'nobody' to start from"),
        (["--equilibrium", "neutral", "--cadence", "thesis"], "'neutral, thesis cadence'"),
        (["--generations", "0"], "generations must be"),
        (["--sigma", "nan"], "sigma must be"),
        (["--push-newton", "-1"], "push_newton must be"),
        (["--out", "nowhere.json"], "nowhere.json"),
        (["--out", "foreign.json"], "not a file of leg constants"),
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_written(monkeypatch, capsys, tmp_path, constants, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "foreign.json").write_text("[1]")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert run(monkeypatch, "--out", "legs.json", "--population", "2", *words) == 2
    out, error = capsys.readouterr()
    assert said in error and error.count("\n") == 1 and not out
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
