"""The table of physics settings: a window stays a window under any timestep, and the reference is the finest."""

import sys

import numpy as np
import pytest

from benchmarks import physics
from benchmarks.walking import record_walk
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.timing import CONTROL_WINDOW
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record


@pytest.mark.parametrize("name", physics.ROWS)
def test_a_row_differs_from_the_default_in_one_thing_and_its_steps_fill_a_window(name):
    default, model = physics.edited(lambda model: None), physics.edited(physics.ROWS[name])
    options = [key for key in dir(default.opt) if not key.startswith("_")]
    changed = [key for key in options if not np.array_equal(getattr(default.opt, key), getattr(model.opt, key))]
    assert len(changed) == (name != physics.DEFAULT)
    steps = CONTROL_WINDOW / model.opt.timestep
    assert steps == pytest.approx(round(steps), abs=1e-9)


def test_a_finer_timestep_walks_the_same_windows_a_little_otherwise():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 0.2, "start": 0.2})
    fine = physics.edited(physics.ROWS["0.5 ms"])
    coarse, walked = (record(policy, settings, name="", episodes=1, model=model) for model in (None, fine))
    assert walked.ticks == coarse.ticks == round(0.2 / CONTROL_WINDOW)
    apart = np.abs(walked.series["angle"] - coarse.series["angle"]).max()
    assert 0 < apart < np.deg2rad(3.0)
    biped = Biped(settings, 1, model=fine)
    biped.reset(np.array([0]), [0])
    biped.step(np.zeros((1, 4)))
    assert biped.data(0).time == pytest.approx(2 * CONTROL_WINDOW)


def test_costs_are_of_the_same_states_and_grow_with_the_number_of_steps():
    models = [physics.edited(physics.ROWS[name]) for name in ("0.25 ms (reference)", physics.DEFAULT)]
    spent = physics.costs(models, record_walk(2, 9), rounds=1)
    assert spent.shape == (2, 9) and np.median(spent[0]) > np.median(spent[1])  # eight times the steps


def test_the_reference_is_the_finest_and_apart_from_itself_by_nothing(monkeypatch, capsys):
    steps = [physics.edited(edit).opt.timestep for edit in physics.ROWS.values()]
    assert steps[0] == min(steps)
    monkeypatch.setattr(
        physics, "ROWS", {name: physics.ROWS[name] for name in (next(iter(physics.ROWS)), physics.DEFAULT)}
    )
    monkeypatch.setattr(
        sys, "argv", ["physics", "--policies", "schedule", "--episodes", "1", "--seconds", "6", "--rounds", "1"]
    )
    assert physics.main() == 0
    head, _, reference, default = capsys.readouterr().out.splitlines()[-4:]
    cells = [line.count("|") for line in (head, reference, default)]
    assert len(set(cells)) == 1
    assert "| 0 of 1 |" in reference and "| 0.00 / 0.00 / 0.00 | 0.000 |" in reference
    assert "| 0.00 / 0.00 / 0.00 |" not in default and "| 1.00 |" in default


@pytest.mark.parametrize(
    ("words", "said"), [(["--policies", "nobody"], "no policy 'nobody'"), (["--rounds", "0"], "rounds must be")]
)
def test_bad_input_is_one_line_and_exit_code_2(words, said, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["physics", *words])
    assert physics.main() == 2
    told = capsys.readouterr()
    assert said in told.err and told.err.count("\n") == 1


def test_the_default_needs_neither_islands_nor_stops_while_walking():
    walk = record_walk(1, 10)
    models = [physics.edited(physics.ROWS[name]) for name in (physics.DEFAULT, "search for islands", "no joint stops")]
    ends = []
    for model in models:
        bodies = physics.Physics(model, 1)
        bodies.place(walk, 0)
        for step in range(len(walk.actions)):
            bodies.step(walk, step)
        ends.append(bodies.bodies[0].qpos.copy())
    assert np.abs(ends[1] - ends[0]).max() < 1e-9 and np.abs(ends[2] - ends[0]).max() < 1e-9
