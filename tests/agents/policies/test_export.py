"""Exported policies: the same actions and stiffness in onnxruntime, torch and NumPy, and the walk they make."""

import importlib.util
import json
import subprocess
import sys
import zipfile
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from springfoot.agents import Policy, export_policy, load_policy, policy_from_mlp, read_policy
from springfoot.agents.policies import numpy_player
from springfoot.agents.policies.contract import contract_of
from springfoot.agents.policies.export import FORMATS
from springfoot.agents.policies.numpy_player import ACTIVATIONS
from springfoot.agents.policies.policy import Output
from springfoot.agents.training.returns import evaluate_returns
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.settings import settings_from, settings_to_json
from springfoot.envs.task.observation import OBSERVATION
from springfoot.errors import SpringfootError

D = len(OBSERVATION)
LOW, HIGH = np.array([(entry.low, entry.high) for entry in OBSERVATION]).T


def play_onnx(path):
    session = onnxruntime.InferenceSession(path)
    return lambda rows: session.run(None, {"observation": rows})


def play_torch(path):
    program = torch.export.load(path).module()
    return lambda rows: [part.numpy() for part in program(torch.from_numpy(rows))]


def play_numpy(path):
    """By the player that was written beside the file."""
    spec = importlib.util.spec_from_file_location("player", path.with_name(f"play_{path.stem}.py"))
    assert spec is not None and spec.loader is not None
    player = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(player)
    return player.load(path)


PLAY = {"onnx": play_onnx, "torch": play_torch, "numpy": play_numpy}


def exported(policy, folder, to):
    """The file, run as its users run it."""
    out = folder / f"walk{FORMATS[to]}"
    export_policy(policy, out, to)
    return PLAY[to](out)


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


def drawn(activation="tanh", output: Output = "clip", sizes=(D, 48, 24, 4), clip: float | None = 10.0, **settings):
    """A policy of random weights that reaches both ends of its actions."""
    random = np.random.default_rng(2)
    layers = [(random.normal(0, 1 / np.sqrt(i), (o, i)), random.normal(0, 0.2, o)) for i, o in pairwise(sizes)]
    layers[-1] = (0.5 * layers[-1][0], layers[-1][1])
    return policy_from_mlp(
        layers,
        settings,
        activation=activation,
        output=output,
        observation_mean=random.normal(size=D),
        observation_variance=np.where(np.arange(D) % 7, random.uniform(0.5, 2.0, D), 1e-6 if clip else 1.0),
        observation_clip=clip,
    )


POLICIES = {
    "pretrained": lambda: read_policy("pretrained"),
    **{name: lambda name=name: drawn(name) for name in ACTIVATIONS},
    "as SAC": lambda: drawn("relu", "tanh", height=1.9, mass=90.0),
    "without clip": lambda: drawn("elu", sizes=(D, 16, 4), clip=None),
    "linear": lambda: drawn(sizes=(D, 4)),
    "ankle": lambda: drawn(stiffness_joints="ankle", ankle_stiffness_range=(30.0, 700.0)),
    "residual": lambda: drawn(action_mode="residual"),
}


@pytest.mark.parametrize("to", FORMATS)
@pytest.mark.parametrize("name", POLICIES)
def test_an_export_acts_as_the_policy_does(name, to, tmp_path):
    policy = POLICIES[name]()
    rows, play = observations(policy), exported(policy, tmp_path, to)
    action, sets = play(rows)
    expected = policy(rows)
    assert action.shape == (10_000, 4) and np.abs(action - expected).max() <= 1e-5
    assert expected.std() > 0.2 and np.abs(expected).max() > 0.99
    contract = json.loads((tmp_path / f"walk{FORMATS[to]}.json").read_text())
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
    _, stiffness = exported(policy, tmp_path, "numpy")(rows)
    contract = contract_of(policy)
    body, load = contract["body"], policy.settings.carried_ratio * policy.settings.mass
    own = (policy.settings.mass + load) / body["mass_kg"] * policy.settings.height / body["height_m"]
    result = biped.step(policy(rows))
    for column, entry in enumerate(contract["stiffness"]["entries"]):
        set_to = result.info[f"stiffness/{entry['name']}"]
        assert set_to == pytest.approx(stiffness[:, column] * own, rel=1e-6)


@pytest.mark.parametrize("right_foot", ["intact", {"kind": "adaptive", "adapted": "adaptive"}])
def test_a_residual_export_says_which_schedule_its_factor_multiplies(right_foot, tmp_path):
    policy = drawn(action_mode="residual", height=1.9, mass=90.0, right_foot=right_foot)
    biped = Biped(policy.settings, 8)
    biped.reset(np.arange(8), list(range(8)))
    rows, phase = biped.observe(), biped.leg_phase.copy()
    _, factor = exported(policy, tmp_path, "numpy")(rows)
    schedule = contract_of(policy)["schedule"]
    assert schedule["speed_m_s"] == [1.2]
    assert ("right" in schedule) == (right_foot != "intact")
    info, own = biped.step(policy(rows)).info, 90.0 / 63.0 * 1.9 / 1.7
    for side, (name, curves) in enumerate((("left", schedule), ("right", schedule.get("right", schedule)))):
        ankle = np.interp(phase[:, side], np.arange(100) / 100, curves["ankle"][0], period=1.0)
        assert info[f"stiffness/ankle_{name}"] == pytest.approx(factor[:, 2 * side] * ankle * own, rel=1e-6)


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
        for to in ("onnx", "numpy"):
            export_policy(policy, tmp_path / folder / f"walk{FORMATS[to]}", to)
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == ["play_walk.py", "walk.npz", "walk.npz.json", "walk.onnx", "walk.onnx.json"]
    assert all((tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes() for name in names)


@pytest.mark.parametrize("to", FORMATS)
def test_the_walk_that_an_export_makes_earns_what_the_policys_does(to, tmp_path):
    policy = read_policy("pretrained")
    alone = dict.fromkeys(("height_range", "mass_range", "speed_range", "speed_interval", "slope_range_deg"))
    settings = settings_from(**(settings_to_json(policy.settings) | alone | {"episode_seconds": 10.0}))
    biped, play = Biped(settings, 8), exported(policy, tmp_path, to)
    ours, _, fell = evaluate_returns(biped, policy, 0)
    theirs, _, they_fell = evaluate_returns(biped, lambda rows: np.asarray(play(rows)[0]), 0)
    assert theirs.mean() == pytest.approx(ours.mean(), rel=0.005)
    assert np.array_equal(fell, they_fell)


def test_the_onnx_file_is_a_policy_again_with_the_settings_it_was_trained_in(tmp_path):
    policy = drawn(speed=1.3, action_mode="residual")
    out = tmp_path / "walk.onnx"
    export_policy(policy, out, "onnx")
    again, rows = load_policy(out), observations(policy)
    assert again.settings == policy.settings and np.abs(again(rows) - policy(rows)).max() <= 1e-5
    assert again(rows[0]).shape == (4,)
    out.with_name("walk.onnx.json").unlink()  # it carries its contract
    assert load_policy(out).settings == policy.settings


def test_torch_and_the_player_need_no_springfoot(tmp_path):
    policy = drawn()
    for to in ("torch", "numpy"):
        export_policy(policy, tmp_path / f"walk{FORMATS[to]}", to)
    rows = observations(policy)[:5]
    np.save(tmp_path / "rows.npy", rows)
    for code in (
        "import torch; program = torch.export.load('walk.pt2').module(); action, _ = program(torch.from_numpy(rows))",
        "from play_walk import load; action, _ = load('walk.npz')(rows); assert 'torch' not in sys.modules",
    ):
        code = f"import sys; sys.modules['springfoot'] = None; import numpy as np; rows = np.load('rows.npy'); {code}"
        code += "; np.save('action.npy', np.asarray(action))"
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert np.load(tmp_path / "action.npy") == pytest.approx(policy(rows), abs=1e-5)


def test_the_player_is_short():
    assert len(Path(numpy_player.__file__).read_text(encoding="utf-8").splitlines()) <= 40


def test_no_export_holds_a_pickle(tmp_path):
    for to in ("torch", "numpy"):
        export_policy(drawn(), tmp_path / f"walk{FORMATS[to]}", to)
        with zipfile.ZipFile(tmp_path / f"walk{FORMATS[to]}") as file:
            assert not any(b"\x80\x02" in file.read(name)[:2] for name in file.namelist())
            assert not any(file.getinfo(name).file_size for name in file.namelist() if name.endswith((".pt", ".pkl")))


def test_every_number_in_the_onnx_file_is_of_float32_or_an_index(tmp_path):
    export_policy(drawn(), tmp_path / "walk.onnx", "onnx")
    model = onnx.load(tmp_path / "walk.onnx")
    assert {tensor.data_type for tensor in model.graph.initializer} == {onnx.TensorProto.FLOAT, onnx.TensorProto.INT64}
    assert [value.name for value in (*model.graph.input, *model.graph.output)] == ["observation", "action", "stiffness"]


def test_a_write_that_fails_leaves_nothing(tmp_path):
    policy = replace(drawn(), fingerprint={})
    (tmp_path / "walk.onnx.json").mkdir()
    with pytest.raises(SpringfootError, match=r"walk.onnx.json already exists"):
        export_policy(policy, tmp_path / "walk.onnx", "onnx")
    assert isinstance(policy, Policy) and [path.name for path in tmp_path.iterdir()] == ["walk.onnx.json"]
