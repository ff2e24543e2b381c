"""State, restore, pickle and deepcopy of the batched core: what goes on has the same bits."""

import copy
import json
import pickle  # noqa: TID251  # environments are copied by it
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.phase_table import SAMPLES
from springfoot.envs.physics.model import build_model
from springfoot.envs.settings.settings import settings_from
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import Body
from springfoot.gait.springs.stiffness import thesis_schedule

SETTINGS: dict[str, dict[str, Any]] = {
    "default": {},
    "events with a schedule": {
        "decisions": "event",
        "equilibrium": "phase",
        "schedule": thesis_schedule(Body()).to_json(),
    },
    "disturbed": {
        "push_newton": 120.0,
        "push_interval": 0.5,
        "sensor_noise": 0.01,
        "stiffness_delay_range_s": (0.0, 0.04),
        "start_noise": 0.02,
    },
    "any body on any ground": {
        "height_range": (1.5, 1.9),
        "mass_range": (50.0, 90.0),
        "speed_range": (0.9, 1.5),
        "speed_interval": 0.5,
        "slope_range_deg": (-3.0, 3.0),
        "unevenness_m": 0.01,
        "episode_seconds": 1.0,
    },
    "drawn feet and bodies": {
        "drawn_feet": [
            {"foot": {"kind": "passive", "ankle_stiffness": [300, 900], "toe_deg": [0, 5]}},
            {"foot": {"kind": "passive", "ankle_table": [[-10.0, 60.0], [20.0, -100.0]]}, "on": "both"},
            {"foot": {"kind": "drop", "orthosis": {"ankle_stiffness": [20, 90], "engages": "plantarflexion"}}},
        ],
        "drawn_bodies": [{"leg_ratio": 1.03}, {"carried_ratio": 0.2}],
        "episode_seconds": 0.8,
    },
    "setting off": {"start": "standing", "stop_at": 4.0},
    "stopping": {"stop_at": 0.3, "decisions": "100hz"},
}


def begun(num: int = 3, steps: int = 33, **settings: Any) -> Biped:
    biped = Biped(settings_from(**settings), num)
    biped.reset(np.arange(num), range(num))
    for action in actions(num, steps):
        biped.step(action)
    return biped


def actions(num: int, steps: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.5, 1.0, (steps, num, 4))


def go_on(biped: Biped, ids: np.ndarray | None = None, steps: int = 60) -> list[np.ndarray]:
    """What environments `ids` of a batch of three, or a batch of these alone, do next; those that end begin anew."""
    chosen = np.arange(3) if ids is None else ids
    own = chosen if biped.num_envs == 3 else np.arange(len(chosen))
    rows = [biped.observe()[own]]
    for action in actions(3, steps, 1):
        result = biped.step(action if biped.num_envs == 3 else action[chosen])
        rows += [values[own] for values in (result.observation, result.reward, result.truncated, result.values)]
        ended = np.flatnonzero(result.terminated | result.truncated)
        biped.reset(ended, [None] * len(ended))
    return [*rows, np.stack([biped.data(index).qpos for index in own.tolist()])]


def assert_same(first: list[np.ndarray], second: list[np.ndarray]) -> None:
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", SETTINGS)
def test_a_restored_batch_goes_on_with_the_same_bits(name):
    biped = begun(**SETTINGS[name])
    state = biped.state()
    state["generators"] = json.loads(json.dumps(state["generators"]))
    copies = [pickle.loads(pickle.dumps(biped)), copy.deepcopy(biped), Biped(biped.settings, 3, num_threads=2)]
    copies[-1].restore(state)
    expected = go_on(biped)
    for each in copies:
        assert_same(go_on(each), expected)
    biped.restore(state)  # back in the same batch, whose bodies have changed by now
    assert_same(go_on(biped), expected)


@pytest.mark.parametrize("name", SETTINGS)
def test_environments_move_between_batches(name):
    biped, ids = begun(**SETTINGS[name]), np.array([0, 2])
    state, one, alone = biped.state(ids), biped.state(np.array([1])), Biped(biped.settings, 2)
    alone.restore(state)
    expected = go_on(biped)
    columns = [values[ids] for values in expected]
    assert_same(go_on(alone, ids), columns)
    other = begun(steps=5, **SETTINGS[name])
    other.restore(state, ids)
    other.restore(one, np.array([1]))
    assert_same(go_on(other), expected)


def test_a_copy_is_made_from_the_same_arguments():
    home = Biped(settings_from(), 1)
    legs = [home.constants[0], replace(home.constants[0], trunk_pitch_deg=home.constants[0].trunk_pitch_deg + 1.0)]
    model = build_model(Body())
    model.opt.timestep = 0.001
    rest = 0.1 * np.random.default_rng(0).normal(size=(2, SAMPLES, 2))
    biped = Biped(home.settings, 3, legs=legs, variant=np.array([0, 1, 1]), rest=rest, model=model)
    biped.reset(np.arange(3), range(3))
    biped.step(np.zeros((3, 4)))
    copies = [pickle.loads(pickle.dumps(biped)), copy.deepcopy(biped)]
    expected = go_on(biped, steps=10)
    for each in copies:
        assert each.model.opt.timestep == 0.001
        assert_same(go_on(each, steps=10), expected)


def test_a_batch_that_has_not_begun_can_be_copied():
    biped = pickle.loads(pickle.dumps(Biped(settings_from(), 2)))
    assert biped.generators == [None, None]
    biped.reset(np.arange(2), [3, 4])
    assert biped.step(np.zeros((2, 4))).reward.all()


def test_generators_are_set_in_place():
    biped, own = Biped(settings_from(push_newton=50.0), 1), np.random.default_rng(5)
    biped.reset(np.arange(1), [own])
    state, drawn = biped.state(), own.random()
    biped.restore(state)
    assert biped.generators[0] is own and own.random() == drawn


def test_ticks_go_on_with_the_same_work():
    first = begun()
    second, works = pickle.loads(pickle.dumps(first)), []
    for biped in (first, second):
        ticks = []
        biped.on_tick = ticks.append
        go_on(biped, steps=4)
        works.append([tick.work.energy.tobytes() + tick.equilibrium.tobytes() for tick in ticks])
    assert works[0] == works[1] and len(works[0]) == 8


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda state: state.pop("mujoco"), "'mujoco' is in one of them only"),
        (lambda state: state.update(extra=1), "'extra' is in one of them only"),
        (lambda state: state.update(mujoco=state["mujoco"][:1]), "'mujoco' must be"),
        (lambda state: state.update(generators=[]), "2 generators, got 0"),
    ],
)
def test_a_state_that_does_not_fit_is_refused_and_nothing_changes(change, message):
    biped = begun(2)
    state, before = begun(2, steps=3).state(), biped.observe()
    change(state)
    with pytest.raises(SpringfootError, match=message):
        biped.restore(state)
    np.testing.assert_array_equal(biped.observe(), before)


@pytest.mark.parametrize("generators", [[], ["x"], [1], [{"bit_generator": "seed"}], [{}]], ids=repr)
def test_a_broken_generator_leaves_the_state_as_it_is(generators):
    biped = Biped(settings_from(), 1)
    biped.reset(np.arange(1), [0])
    before = biped.state()
    other = Biped(settings_from(), 1)
    other.reset(np.arange(1), [1])
    with pytest.raises(SpringfootError, match="the state does not fit"):
        biped.restore(other.state() | {"generators": generators})
    after = biped.state()
    assert after.pop("generators") == before.pop("generators")
    assert all(np.array_equal(after[name], before[name], equal_nan=True) for name in before)
