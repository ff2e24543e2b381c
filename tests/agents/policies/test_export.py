"""Exported policies: the same actions and stiffness in onnxruntime, and the walk they make."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import onnx
import onnxruntime
import pytest

from springfoot.agents import Policy, export_policy, load_policy, policy_from_mlp, read_policy
from springfoot.agents.policies.export import contract_of
from springfoot.agents.policies.policy import ACTIVATIONS, Output
from springfoot.agents.training.returns import evaluate_returns
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.model import ACTIONS, SIDES, actions_of
from springfoot.envs.settings.settings import settings_from, settings_to_json
from springfoot.envs.task.observation_entries import OBSERVATION, PERSON_OBSERVATION
from springfoot.errors import SpringfootError

D = len(OBSERVATION)
LOW, HIGH = np.array([(entry.low, entry.high) for entry in OBSERVATION]).T


ELEVEN = np.radians(11)


def play_onnx(path):
    session = onnxruntime.InferenceSession(path)
    return lambda rows: [np.asarray(part) for part in session.run(None, {"observation": rows})]


def exported(policy, folder):
    """Run the file as its users run it."""
    export_policy(policy, folder / "walk.onnx")
    return play_onnx(folder / "walk.onnx")


def observations(policy):
    """10 000: at the ends of their bounds, beyond the clip of the normalised ones, zeros, anywhere, and as walked."""
    random = np.random.default_rng(0)
    rows = random.uniform(LOW, HIGH, (10_000, D))
    rows[:2000] = np.where(random.random((2000, D)) < 0.5, LOW, HIGH)
    reach = np.minimum(policy.observation_deviation, 1.0)
    for first, size in ((2000, 1.0), (4000, 0.1), (6000, 12.0)):
        rows[first : first + 2000] = policy.observation_mean + size * reach * random.normal(size=(2000, D))
    rows[0], rows[1], rows[2], rows[3] = LOW, HIGH, 0.0, policy.observation_mean
    return rows.astype(np.float32)


def drawn(
    activation="tanh",
    output: Output = "clip",
    sizes=(D, 48, 24, 4),
    clip: float | None = 10.0,
    mirrored=False,
    **settings,
):
    """A policy of random weights that reaches both ends of its actions."""
    sizes = (*sizes[:-1], 2) if mirrored and sizes[0] == D else sizes
    least = 1e-6 if clip else 1.0
    random = np.random.default_rng(2)
    layers = [(random.normal(0, 1 / np.sqrt(i), (o, i)), random.normal(0, 0.2, o)) for i, o in pairwise(sizes)]
    layers[-1] = (0.5 * layers[-1][0], layers[-1][1])
    return policy_from_mlp(
        layers,
        settings,
        activation=activation,
        output=output,
        observation_mean=random.normal(size=sizes[0]),
        observation_variance=np.where(np.arange(sizes[0]) % 7, random.uniform(0.5, 2.0, sizes[0]), least),
        observation_clip=clip,
        mirrored=mirrored,
    )


POLICIES = {
    "pretrained": lambda: read_policy("pretrained"),
    **{name: lambda name=name: drawn(name) for name in ACTIVATIONS},
    "as SAC": lambda: drawn("relu", "tanh", height=1.9, mass=90.0),
    "without clip": lambda: drawn("elu", sizes=(D, 16, 4), clip=None),
    "linear": lambda: drawn(sizes=(D, 4)),
    "ankle": lambda: drawn(stiffness_joints="ankle", ankle_stiffness_range=(30.0, 700.0)),
    "residual": lambda: drawn(action_mode="residual"),
    "mirrored": lambda: drawn(mirrored=True),
    "mirrored, as SAC": lambda: drawn("silu", "tanh", mirrored=True, stiffness_joints="ankle"),
}


@pytest.mark.parametrize("name", POLICIES)
def test_an_export_acts_as_the_policy_does(name, tmp_path):
    policy = POLICIES[name]()
    rows, play = observations(policy), exported(policy, tmp_path)
    action, sets = play(rows)
    expected = policy(rows)
    assert action.shape == (10_000, 4) and np.abs(action - expected).max() <= 1e-5
    assert expected.std() > 0.2 and np.abs(expected).max() > 0.99
    contract = json.loads((tmp_path / "walk.onnx.json").read_text())
    (entry,) = (contract[key] for key in ("stiffness", "stiffness_factor") if key in contract)
    columns = [ACTIONS.index(each["name"]) for each in entry["entries"]]
    low, high = np.array([(each["low"], each["high"]) for each in entry["entries"]]).T
    scaled = low * (high / low) ** (0.5 * (expected[:, columns] + 1.0))
    assert sets.shape == scaled.shape and np.abs(sets / scaled - 1.0).max() <= 3e-5
    alone, _ = play(rows[:1])
    assert alone.shape == (1, 4) and alone == pytest.approx(expected[:1], abs=1e-5)


@pytest.mark.parametrize(
    "settings", [{}, {"height": 1.9, "mass": 90.0, "carried_ratio": 0.2}, {"stiffness_joints": "toe"}]
)
def test_the_stiffness_is_what_the_environment_sets_in_the_body_of_the_contract(settings, tmp_path):
    policy = drawn(**settings)
    biped = Biped(policy.settings, 3)
    biped.reset(np.arange(3), [0, 1, 2])
    rows = biped.observe()
    _, stiffness = exported(policy, tmp_path)(rows)
    contract = contract_of(policy)
    body, load = contract["body"], policy.settings.carried_ratio * policy.settings.mass
    own = (policy.settings.mass + load) / body["mass_kg"] * policy.settings.height / body["height_m"]
    result = biped.step(policy(rows))
    for column, entry in enumerate(contract["stiffness"]["entries"]):
        set_to = result.info[f"stiffness/{entry['name']}"]
        assert set_to == pytest.approx(stiffness[:, column] * own, rel=3e-5)  # float32


def test_a_residual_export_says_which_schedule_its_factor_multiplies(tmp_path):
    policy = drawn(action_mode="residual", height=1.9, mass=90.0)
    biped = Biped(policy.settings, 8)
    biped.reset(np.arange(8), list(range(8)))
    rows, phase = biped.observe(), biped.leg_phase.copy()
    _, factor = exported(policy, tmp_path)(rows)
    schedule = contract_of(policy)["schedule"]
    assert schedule["speed_m_s"] == [1.2]
    info, own = biped.step(policy(rows)).info, 90.0 / 63.0 * 1.9 / 1.7
    for side, name in enumerate(SIDES):
        ankle = np.interp(phase[:, side], np.arange(100) / 100, schedule["ankle"][0], period=1.0)
        assert info[f"stiffness/ankle_{name}"] == pytest.approx(factor[:, 2 * side] * ankle * own, rel=3e-5)  # float32


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_an_export_of_a_mirrored_policy_mirrors_to_the_bit(activation, tmp_path):
    policy = drawn(activation, mirrored=True)
    assert policy.mirror is not None
    rows, play = observations(policy), exported(policy, tmp_path)
    for count in (1, 7, 64, len(rows)):
        action, image = (play(each[:count])[0] for each in (rows, policy.mirror.of(rows)))
        assert image.tobytes() == np.take(action, policy.mirror.action_index, -1).tobytes()
    assert contract_of(policy)["network"]["mirrored"] is True
    assert np.array_equal(load_policy(tmp_path / "walk.onnx")(rows), play(rows)[0])


@pytest.mark.parametrize(
    ("acts", "sets"), [("person", ["rest_angle_offset"]), ("both", ["stiffness_factor", "rest_angle_offset"])]
)
def test_an_export_of_a_person_acts_as_the_policy_does_and_tells_the_offsets(acts, sets, tmp_path):
    width, count = len(PERSON_OBSERVATION), len(actions_of(acts))
    policy = drawn(sizes=(width, 24, count // 2), mirrored=True, acts=acts, action_mode="residual", person_range_deg=11)
    assert policy.mirror is not None
    rows = np.random.default_rng(0).normal(size=(500, width)).astype(np.float32)
    session = exported(policy, tmp_path)
    action, *others = session(rows)
    expected = policy(rows)
    assert action.shape == (500, count) and np.abs(action - expected).max() <= 1e-5
    assert others[-1] == pytest.approx(np.radians(11) * expected[:, -6:], abs=1e-6)
    contract = json.loads((tmp_path / "walk.onnx.json").read_text())
    assert list(contract)[3 : 3 + len(others)] == sets
    assert [entry["name"] for entry in contract["observation"]["entries"]] == [one.name for one in PERSON_OBSERVATION]
    assert [entry["name"] for entry in contract["action"]["entries"]] == list(actions_of(acts))
    assert contract["rest_angle_offset"]["entries"][0] == {"name": "rest_hip_left", "low": -ELEVEN, "high": ELEVEN}
    assert session(policy.mirror.of(rows))[0].tobytes() == action[:, policy.mirror.action_index].tobytes()
    again = load_policy(tmp_path / "walk.onnx")
    assert again.settings == policy.settings and np.array_equal(again(rows), action)


def test_the_contract_names_everything_in_its_order_and_nothing_of_where_or_when():
    policy = read_policy("pretrained")
    contract = contract_of(policy)
    assert [entry["name"] for entry in contract["observation"]["entries"]] == [entry.name for entry in OBSERVATION]
    assert [entry["name"] for entry in contract["action"]["entries"]] == list(ACTIONS)
    ends = {entry["name"]: (entry["low"], entry["high"]) for entry in contract["stiffness"]["entries"]}
    assert ends["ankle_left"] == policy.settings.ankle_stiffness_range
    assert ends["toe_right"] == policy.settings.toe_stiffness_range
    assert settings_from(**contract["settings"]) == policy.settings and contract["step_seconds"] == 0.02
    assert contract["fingerprint"] == policy.fingerprint
    assert set(contract) == {
        *("contract_version", "observation", "action", "stiffness", "body", "step_seconds", "network", "settings"),
        *("fingerprint", "versions"),
    }


def test_exporting_twice_gives_the_same_bytes(tmp_path):
    policy = drawn()
    for folder in ("one", "two"):
        export_policy(policy, tmp_path / folder / "walk.onnx")
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == ["walk.onnx", "walk.onnx.json"]
    assert all((tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes() for name in names)


@pytest.mark.slow
def test_the_walk_that_an_export_makes_earns_what_the_policys_does(tmp_path):
    policy = read_policy("pretrained")
    alone = dict.fromkeys(("height_range", "mass_range", "speed_range", "speed_interval", "slope_range_deg"))
    settings = settings_from(**(settings_to_json(policy.settings) | alone | {"episode_seconds": 10.0}))
    biped, play = Biped(settings, 8), exported(policy, tmp_path)
    ours, _, fell = evaluate_returns(biped, policy, 0)
    theirs, _, they_fell = evaluate_returns(biped, lambda rows: np.asarray(play(rows)[0]), 0)
    assert theirs.mean() == pytest.approx(ours.mean(), rel=0.005)
    assert np.array_equal(fell, they_fell)


def test_the_onnx_file_is_a_policy_again_with_the_settings_it_was_trained_in(tmp_path):
    policy = drawn(speed=1.3, action_mode="residual")
    out = tmp_path / "walk.onnx"
    export_policy(policy, out)
    again, rows = load_policy(out), observations(policy)
    assert again.settings == policy.settings and np.abs(again(rows) - policy(rows)).max() <= 1e-5
    assert again(rows[0]).shape == (4,)
    out.with_name("walk.onnx.json").unlink()  # it carries its contract
    assert load_policy(out).settings == policy.settings


def test_every_number_in_the_onnx_file_is_of_float32_or_an_index(tmp_path):
    export_policy(drawn(), tmp_path / "walk.onnx")
    model = onnx.load(tmp_path / "walk.onnx")
    assert {tensor.data_type for tensor in model.graph.initializer} == {onnx.TensorProto.FLOAT, onnx.TensorProto.INT64}
    assert [value.name for value in (*model.graph.input, *model.graph.output)] == ["observation", "action", "stiffness"]


def test_a_write_that_fails_leaves_nothing(tmp_path):
    policy = replace(drawn(), fingerprint={})
    (tmp_path / "walk.onnx.json").mkdir()
    with pytest.raises(SpringfootError, match=r"walk.onnx.json already exists"):
        export_policy(policy, tmp_path / "walk.onnx")
    assert isinstance(policy, Policy) and [path.name for path in tmp_path.iterdir()] == ["walk.onnx.json"]
