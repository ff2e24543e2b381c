"""The search for what a slope adds: nothing on level ground, what it pays for, and what it writes."""

import json
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.constants import slope_constants
from springfoot.envs.control.stiffness_control import action_of
from springfoot.envs.settings.settings import BipedSettings
from springfoot.studies.searches import slope_tuning as slopes

COMMITTED = slope_constants()
LARGE = slopes.constants_of(np.arange(10.0))


@pytest.fixture
def constants(tmp_path):
    """A copy of the committed file of constants."""
    path = tmp_path / "legs.json"
    path.write_text(resources.files("springfoot.envs.control").joinpath("legs.json").read_text(encoding="utf-8"))
    return path


def run(*words):
    return study_main(["slope-tuning", "--threads", "1", *map(str, words)])


def test_the_numbers_add_nothing_where_the_ground_is_level_even_beside_a_slope():
    def walked(constants, slope_deg):
        biped = Biped(BipedSettings(), 2, slope=constants)
        biped.subjects.slope[:] = 0.0, np.radians(slope_deg)
        biped.reset(np.arange(2), [3, 3])
        for _ in range(20):
            action = action_of(biped.scheduled_stiffness(), biped.settings, biped.body)
            observation = biped.step(action.reshape(2, -1)).observation
        return observation

    level = walked(COMMITTED, 0.0)[0]
    for constants in (COMMITTED, LARGE):
        beside = walked(constants, 4.0)
        np.testing.assert_array_equal(beside[0], level)
        assert (beside[1] != level).any()
    assert (walked(LARGE, 4.0)[1] != walked(COMMITTED, 4.0)[1]).any()


def test_a_vector_gives_the_constants_it_was_made_of():
    assert slopes.constants_of(slopes.vector_of(COMMITTED)) == COMMITTED


def test_the_committed_numbers_pay_less_than_none():
    none = slopes.constants_of(np.zeros(10))
    level = slopes.walk(None, (0.0,), 1, 5.0, seed=0, threads=1)["reward"].mean()
    walked = [slopes.walk(each, (5.0,), 2, 5.0, seed=0, threads=1) for each in (COMMITTED, none)]
    assert not walked[0]["missing"].any() and walked[1]["missing"].all()
    assert slopes.cost(walked[0], level) < slopes.cost(walked[1], level)
    harder = walked[0] | {"heel": walked[0]["heel"] + 1.0}
    assert slopes.cost(walked[0], level) < slopes.cost(harder, level) < slopes.cost(walked[1], level)


@pytest.mark.slow
def test_better_numbers_are_written_with_their_command_and_worse_ones_are_not(monkeypatch, capsys, constants):
    monkeypatch.setattr(slopes, "JUDGED_WALKS", 1)
    monkeypatch.setattr(slopes, "JUDGED_SECONDS", 3.0)
    monkeypatch.chdir(constants.parent)  # where the results go
    before = constants.read_text()
    assert run("--generations", "0", "--constants", constants) == 0
    assert constants.read_text() == before and "wrote nothing" in capsys.readouterr().out
    poor = replace(COMMITTED, hip=(-0.5, 0.0, 0.0))  # leans the thigh the wrong way: falls at 5 deg
    table = json.loads(before)
    table["slope"]["constants"] = vars(poor)
    constants.write_text(json.dumps(table))
    words = ["--generations", "3", "--population", "6", "--walks", "1", "--seconds", "3", "--sigma", "0.4"]
    assert run(*words, "--constants", constants) == 0
    after, said = json.loads(constants.read_text()), capsys.readouterr().out
    assert "wrote the constants it ended with" in said
    assert after["constants"] == table["constants"] and after["slope"]["constants"] != table["slope"]["constants"]
    assert after["slope"]["found_by"].startswith("springfoot study slope-tuning --threads 1 --generations 3")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--generations", "-1"], "generations must be"),
        (["--population", "1"], "population must be"),
        (["--sigma", "0"], "sigma must be"),
        (["--seconds", "nan"], "seconds must be"),
        (["--seconds", "2"], "seconds must be"),
        (["--constants", "nowhere.json"], "nowhere.json"),
        (["--constants", "foreign.json"], "not a file of leg constants"),
        (["--constants", "level.json"], "no constants for slopes"),
        (["--constants", "short.json"], "no constants for slopes"),
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_written(monkeypatch, capsys, tmp_path, constants, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "foreign.json").write_text("[1]")
    (tmp_path / "level.json").write_text('{"constants": {}}')
    (tmp_path / "short.json").write_text('{"constants": {}, "slope": {"constants": {"hip": [1, 2]}}}')
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    file = [] if "--constants" in words else ["--constants", "legs.json"]
    assert run(*file, *words) == 2
    out, error = capsys.readouterr()
    assert said in error and error.count("\n") == 1 and not out
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
