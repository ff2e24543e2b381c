"""Feet and bodies drawn at a reset: every part of a walker follows them, to the bit of one made with them."""

import json
import pickle  # noqa: TID251  # environments are copied by it
from typing import Any

import numpy as np
import pytest
from walked_ticks import walked_ticks

from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs import SegmentedFootBiped
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.physics.model import build_model
from springfoot.envs.settings.settings import body_of, settings_from
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import Body
from springfoot.gait.springs.stiffness import thesis_schedule

LINE = {"kind": "passive", "ankle_table": [[-10.0, 60.0], [20.0, -100.0]]}
OTHER_LINE = {"kind": "passive", "ankle_table": [[-5.0, 20.0], [5.0, -20.0], [20.0, -90.0]]}
SCHEDULED = {"kind": "adaptive", "schedule": thesis_schedule(Body()).to_json()}
ONE_WAY = {
    "kind": "weak",
    "strength": [0.2, 0.35],
    "orthosis": {"ankle_stiffness": [50, 500], "engages": "dorsiflexion"},
}
FEET: list[dict[str, Any]] = [
    {"foot": {"kind": "passive", "ankle_stiffness": [300, 900], "shank_mass_ratio": [0.5, 0.8]}, "weight": 2},
    {"foot": "rigid", "on": "both"},
    {"foot": LINE, "on": "left"},
    {"foot": SCHEDULED, "on": "right"},
    {"foot": ONE_WAY, "on": "both", "weight": 2},
    {"foot": "no_toe"},
    {"foot": "intact", "on": "both"},
]
BODIES = [{"leg_ratio": 1.03}, {"foot_ratio": 0.95, "carried_ratio": 0.2}, {}]
DRAWN: dict[str, Any] = {"drawn_feet": FEET, "drawn_bodies": BODIES}
NUM = 9


def actions(num: int, steps: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.5, 1.0, (steps, num, 4))


def walk(biped: Biped, ids: list[int], steps: int = 40) -> list[np.ndarray]:
    """What environments `ids`, of a batch of them or of all `NUM`, do; those that end begin anew."""
    own = ids if biped.num_envs == NUM else list(range(len(ids)))
    seen = [biped.observe()[own]]
    for action in actions(NUM, steps):
        result = biped.step(action if biped.num_envs == NUM else action[ids])
        seen += [values[own] for values in (result.observation, result.reward, result.values, result.terminated)]
        ended = np.flatnonzero(result.terminated | result.truncated)
        biped.reset(ended, [None] * len(ended))
    return [*seen, biped.controlled[own]]


def assert_same(first: list[np.ndarray], second: list[np.ndarray]) -> None:
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one, other)


def numbers_of(tick: Tick) -> dict[str, np.ndarray]:
    own = {name: getattr(tick, name) for name in ("stiffness", "equilibrium", "fibre_moment", "muscle_work")}
    return (
        own | vars(tick.work) | {name: getattr(tick.measurement, name) for name in ("angle", "com", "torque", "force")}
    )


def test_drawn_feet_walk_as_feet_of_the_settings():
    """Observation, reward, work, muscles and the parts of the energy follow a drawn foot to the last bit."""
    drawn = Biped(settings_from(drawn_feet=FEET), NUM)
    drawn.reset(np.arange(NUM), range(NUM), start=0.2)
    pairs = [[foot or "intact" for foot in pair] for pair in drawn.state()["feet"]]
    assert {foot if isinstance(foot, str) else foot["kind"] for pair in pairs for foot in pair} > {"passive", "weak"}
    feet = [settings_from(left_foot=left, right_foot=right).feet for left, right in pairs]
    made = Biped(settings_from(), NUM, feet=feet)
    made.reset(np.arange(NUM), range(NUM), start=0.2)
    np.testing.assert_array_equal(drawn.controlled, made.controlled)
    assert not drawn.controlled.all() and drawn.controlled.any()
    np.testing.assert_array_equal(drawn.observe(), made.observe())
    for ours, theirs in zip(walked_ticks(drawn), walked_ticks(made), strict=True):
        for name, values in numbers_of(ours).items():
            np.testing.assert_array_equal(values, numbers_of(theirs)[name], name)


@pytest.mark.parametrize(
    "further", [{}, {"action_mode": "residual", "ankle_tendon": 400.0}, {"guide": "plan"}], ids=str
)
def test_drawn_bodies_walk_as_bodies_of_the_settings(further):
    together = Biped(settings_from(drawn_bodies=BODIES, **further), len(BODIES))
    ids = np.arange(len(BODIES))
    together.reset(ids, [5] * len(ids), start=0.2, given={"body": ids, "mass": np.full(len(ids), 70.0)})
    twin = pickle.loads(pickle.dumps(together))
    steps = [twin.step(action) for action in actions(len(BODIES), 40)]
    for index, ratios in enumerate(BODIES):
        alone = Biped(settings_from(**ratios, **further), 1)
        alone.reset(np.array([0]), [5], start=0.2, given={"mass": np.array([70.0])})
        assert together.model_of(index).body_mass.sum() == alone.model_of(0).body_mass.sum()
        np.testing.assert_array_equal(together.observe()[index], alone.observe()[0])
        for action, seen in zip(actions(len(BODIES), 40), steps, strict=True):
            own = alone.step(action[index : index + 1])
            np.testing.assert_array_equal(seen.observation[index], own.observation[0])
            np.testing.assert_array_equal(seen.values[index], own.values[0])


def test_a_body_without_load_walks_as_one_with_a_box_of_no_mass():
    """The box that all models of a batch have is without effect where it has no mass."""
    plain, boxed = (Biped(settings_from(), 1, model=build_model(Body(), loaded=loaded)) for loaded in (False, True))
    assert boxed.model.nbody == plain.model.nbody + 1
    for biped in (plain, boxed):
        biped.reset(np.array([0]), [1])
    for action in actions(1, 60):
        np.testing.assert_array_equal(plain.step(action).observation, boxed.step(action).observation)


def test_heights_and_masses_are_drawn_beside_proportions():
    settings = settings_from(**DRAWN, height_range=(1.5, 1.9), mass_range=(50.0, 90.0))
    biped = Biped(settings, 30)
    biped.reset(np.arange(30), range(30))
    bodies = biped.subjects.bodies
    assert len({body.height for body in bodies}) == len({body.mass for body in bodies}) == 30
    of_settings = {(1.03, 1.0, 0.0), (1.0, 0.95, 0.2), (1.0, 1.0, 0.0)}
    assert {(body.leg_ratio, body.foot_ratio, body.carried_ratio) for body in bodies} == of_settings
    assert len({json.dumps(pair) for pair in biped.state()["feet"]}) > 10
    again = biped.state()["feet"]
    biped.reset(np.arange(30), [None] * 30)
    assert sum(old != new for old, new in zip(again, biped.state()["feet"], strict=True)) > 15


@pytest.mark.parametrize("threads", [1, 3])
def test_a_batch_gives_the_bits_of_batches_of_one(threads):
    settings = settings_from(**DRAWN, height_range=(1.6, 1.8), episode_seconds=0.4)
    together = Biped(settings, NUM, threads)
    together.reset(np.arange(NUM), range(NUM))
    expected = walk(together, list(range(NUM)))
    for index in range(0, NUM, 2):
        alone = Biped(settings, 1)
        alone.reset(np.array([0]), [index])
        assert_same(walk(alone, [index]), [values[index : index + 1] for values in expected])


def test_feet_are_drawn_after_phase_noise_and_pushes():
    """So these are the same with drawn feet and without."""
    plain, drawn = (SegmentedFootBiped(start_noise=0.05, drawn_feet=feet) for feet in (None, [{"foot": "intact"}]))
    seen, info = plain.reset(seed=4)
    same, same_info = drawn.reset(seed=4)
    np.testing.assert_array_equal(seen, same)
    assert info == same_info


def test_settings_without_drawn_walkers_have_the_state_they_had():
    plain, drawn = Biped(settings_from(), 1), Biped(settings_from(**DRAWN), 1)
    assert set(drawn.state()) - set(plain.state()) == {"feet", "proportions"}
    assert not any("proportions" in name or name == "feet" for name in plain.state())


# State --------------------------------------------------------------------------------------------------------


def begun(**settings: Any) -> Biped:
    biped = Biped(settings_from(**settings), NUM)
    biped.reset(np.arange(NUM), range(NUM))
    walk(biped, list(range(NUM)), 12)
    return biped


def test_a_state_has_feet_as_json_and_moves_between_batches():
    biped = begun(**DRAWN, episode_seconds=0.5)
    ids = np.array([1, 4, 5])
    state = biped.state(ids)
    state["feet"] = json.loads(json.dumps(state["feet"], allow_nan=False))
    other, alone = begun(**DRAWN, episode_seconds=0.5), Biped(biped.settings, len(ids))
    other.reset(np.arange(NUM), range(50, 50 + NUM))
    other.restore(state, ids)
    alone.restore(state)
    expected = walk(biped, ids.tolist())
    assert_same(walk(other, ids.tolist()), expected)
    assert_same(walk(alone, ids.tolist()), expected)


@pytest.mark.parametrize(
    "feet", [None, "rigid", [["rigid", None]], [["rigid"]] * NUM, [["rigd", None]] * NUM, [[1, None]] * NUM], ids=str
)
def test_feet_that_do_not_fit_leave_the_state_as_it_is(feet):
    biped = begun(**DRAWN)
    before, state = biped.observe(), begun(**DRAWN).state()
    with pytest.raises(SpringfootError, match=r"feet|left_foot"):
        biped.restore(
            {name: values for name, values in state.items() if name != "feet"} | ({"feet": feet} if feet else {})
        )
    np.testing.assert_array_equal(biped.observe(), before)


def test_proportions_beyond_the_drawn_bodies_are_refused():
    biped = begun(**DRAWN)
    with pytest.raises(SpringfootError, match="'proportions' must be from 0 to 2"):
        biped.restore(biped.state() | {"proportions": np.full(NUM, 3)})


# Options of a reset -------------------------------------------------------------------------------------------


def test_options_set_feet_and_body_of_one_episode_in_place_of_drawn_ones():
    env = SegmentedFootBiped(drawn_feet=[{"foot": "rigid", "on": "both"}], drawn_bodies=BODIES)
    _, info = env.reset(seed=0, options={"right_foot": "intact", "body": 1})
    assert [info[f"controlled/{name}"] for name in env.biped.action_names] == [0, 0, 1, 1]
    assert env.biped.subjects.bodies[0] == body_of(settings_from(**BODIES[1]))
    _, info = env.reset(options={"body": 2, "left_foot": {"kind": "passive"}, "right_foot": "weak"})
    assert [info[f"controlled/{name}"] for name in env.biped.action_names] == [0, 0, 1, 1]
    _, info = env.reset()
    assert [info[f"controlled/{name}"] for name in env.biped.action_names] == [0, 0, 0, 0]


def test_options_give_feet_with_lines_of_their_own_where_none_are_drawn():
    """New lines change nothing of the other environments, and go with the state."""
    vector = SegmentedFootBipedVector(NUM, right_foot=["intact", LINE] + ["intact"] * (NUM - 2))
    vector.reset(seed=0)
    assert "feet" not in vector.biped.state()
    lefts = ["intact", "intact", OTHER_LINE, SCHEDULED] + ["intact"] * (NUM - 4)
    vector.reset(seed=0, options={"left_foot": lefts, "start": 0.2})
    made = SegmentedFootBipedVector(NUM, left_foot=lefts, right_foot=["intact", LINE] + ["intact"] * (NUM - 2))
    made.reset(seed=0, options={"start": 0.2})
    copied = pickle.loads(pickle.dumps(vector))
    elsewhere = SegmentedFootBipedVector(NUM, right_foot=["intact", LINE] + ["intact"] * (NUM - 2))
    elsewhere.reset(seed=1, options={"left_foot": [SCHEDULED, LINE, "rigid"] + ["intact"] * (NUM - 3)})
    elsewhere.biped.restore(vector.biped.state())
    for action in actions(NUM, 40):
        seen = made.biped.step(action)
        for env in (vector, copied, elsewhere):
            result = env.biped.step(action)
            np.testing.assert_array_equal(result.observation, seen.observation)
            np.testing.assert_array_equal(result.values, seen.values)
    vector.reset(seed=0)
    assert "feet" not in vector.biped.state()


def test_options_may_differ_between_environments_of_every_adapter():
    vector = SegmentedFootBipedVector(2, drawn_bodies=BODIES)
    vector.reset(seed=0, options={"left_foot": ["rigid", "intact"], "body": [2, 1]})
    assert vector.biped.controlled[:, 0].tolist() == [[False, False], [True, True]]
    assert [body.carried_ratio for body in vector.biped.subjects.bodies] == [0.0, 0.2]
    adapter = SegmentedFootBipedVecEnv(2, drawn_bodies=BODIES)
    adapter.set_options([{"left_foot": "rigid", "body": 2}, {"left_foot": {"kind": "weak"}, "body": 1}])
    adapter.reset()
    assert adapter.env.biped.controlled[:, 0].tolist() == [[False, False], [True, True]]
    assert [body.carried_ratio for body in adapter.env.biped.subjects.bodies] == [0.0, 0.2]


@pytest.mark.parametrize(
    ("settings", "options", "message"),
    [
        ({}, {"left_foot": "rigd"}, "reset option 'left_foot' must be one of 'intact'"),
        ({}, {"left_foot": ["rigid"] * 3}, "reset option 'left_foot' must be a foot, or a list of one for each of 2"),
        ({}, {"body": 0}, "an index in the setting drawn_bodies, which is None"),
        ({"drawn_bodies": BODIES}, {"body": 3}, "body must be a whole number from 0 to 2, got 3"),
        ({"drawn_bodies": BODIES}, {"body": 0.5}, "body must be a whole number from 0 to 2, got 0.5"),
        ({"drawn_bodies": BODIES}, {"body": "heavy"}, "reset option 'body' must be a number, or one for each of 2"),
        (
            {},
            {"left_foot": {"kind": "drop", "orthosis": {"engages": "dorsiflexion"}}},
            "only where the feet of the settings",
        ),
        (
            {},
            {"left_foot": {"kind": "passive", "adapted": "passive"}},
            "reset option 'left_foot': adapted people are gone",
        ),
    ],
)
def test_bad_options_are_refused_and_nothing_changes(settings, options, message):
    vector = SegmentedFootBipedVector(2, **settings)
    vector.reset(seed=0)
    before = vector.biped.state()
    with pytest.raises(SpringfootError, match=message):
        vector.reset(options=options)
    after = vector.biped.state()
    assert before.keys() == after.keys()
    for name, values in before.items():
        if name != "generators":
            np.testing.assert_array_equal(after[name], values, name)


def test_a_custom_model_wears_no_other_feet():
    biped = Biped(settings_from(), 1, model=build_model(Body()))
    with pytest.raises(SpringfootError, match="cannot change bodies or feet"):
        biped.reset(np.array([0]), [0], given={"left_foot": ["rigid"]})
