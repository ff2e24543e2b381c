"""Files that were damaged are refused: every bit of a policy and of a training state counts."""

import json
import re
import shutil
from typing import Any

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load, save

from springfoot.agents.policies.policy import POLICY_ENTRIES, read_policy
from springfoot.agents.training.checkpoint import STATE_KEY, newest_checkpoint, read_checkpoint
from springfoot.agents.training.config import TrainingConfig
from springfoot.agents.training.training import resume, train
from springfoot.envs import BipedSettings
from springfoot.files.json_file import read_object
from springfoot.files.tensor_file import DIGEST, MOST_TENSOR_BYTES, digest_of, read_tensors, write_tensors
from springfoot.gait import SpringfootError

TINY = TrainingConfig(
    timesteps=64,
    num_envs=4,
    update_steps=64,
    minibatches=2,
    epochs=1,
    hidden=(8,),
    eval_episodes=1,
    threads=1,
    environment=BipedSettings(episode_seconds=0.2),
)
STATE = "state-64.safetensors"
READERS = {
    "best.safetensors": read_policy,
    STATE: read_checkpoint,
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("damage") / "run"
    train(TINY, folder)
    return folder


@pytest.mark.parametrize(("name", "read"), READERS.items(), ids=READERS)
def test_any_flipped_bit_is_refused(run, tmp_path, name, read):
    content = (run / name).read_bytes()
    damaged = tmp_path / name
    damaged.write_bytes(content)
    read(damaged)
    random = np.random.default_rng(0)
    header = 8 + int.from_bytes(content[:8], "little")
    places = np.concatenate([random.integers(0, header, 250), random.integers(header, len(content), 250)])
    for place, bit in zip(places.tolist(), random.integers(0, 8, len(places)).tolist(), strict=True):
        flipped = bytearray(content)
        flipped[place] ^= 1 << bit
        damaged.write_bytes(flipped)
        with pytest.raises(SpringfootError) as caught:
            read(damaged)
        assert str(caught.value).isprintable(), (place, bit)


def test_a_file_cut_short_or_too_large_is_refused(run, tmp_path):
    content = (run / "best.safetensors").read_bytes()
    path = tmp_path / "policy.safetensors"
    for size in (0, 7, 100, len(content) - 1):
        path.write_bytes(content[:size])
        with pytest.raises(SpringfootError, match=r"is not a \.safetensors file"):
            read_policy(path)
    with path.open("wb") as file:
        file.truncate(MOST_TENSOR_BYTES + 1)  # sparse: it takes no room
    with pytest.raises(SpringfootError, match=r"must have at most 134,217,728 bytes, has 134,217,729"):
        read_policy(path)


def test_a_header_that_says_it_is_huge_is_refused_unread(tmp_path):
    path = tmp_path / "policy.safetensors"
    with path.open("wb") as file:
        file.write((2**26).to_bytes(8, "little"))
        file.truncate(2**26 + 9)
    said = r"^\S+ is not a .safetensors file: its header would have 67,108,864 bytes, at most 16,777,216 are read"
    with pytest.raises(SpringfootError, match=said):
        read_policy(path)


POLICY = [
    ("layer.0.weight", 3e38, "layer.0.weight must be in [-1e+06, 1e+06], has 3e+38"),
    ("layer.1.bias", -2e6, "layer.1.bias must be in [-1e+06, 1e+06], has -2e+06"),
    ("observation.variance", -1e-3, "observation.variance must be in [0, 1e+30], has -0.001"),
    ("observation.mean", 1e31, "observation.mean must be in [-1e+30, 1e+30], has 1e+31"),
    ("layer.0.weight", np.nan, "layer.0.weight must be finite float32 or float64 numbers"),
    ("layer.0.weight", None, "layer.0.weight must be (8, 43), is absent"),
]


@pytest.mark.parametrize(("name", "value", "said"), POLICY)
def test_numbers_that_no_training_makes_are_refused_in_a_policy_whose_digest_fits(run, tmp_path, name, value, said):
    header, tensors = read_tensors(run / "best.safetensors", "springfoot", "policy", POLICY_ENTRIES)
    path = _forged(tmp_path / "forged.safetensors", "springfoot", header, tensors, name, value)
    with pytest.raises(SpringfootError) as caught:
        read_policy(path)
    assert str(caught.value) == f"{path}: {said}"


@pytest.mark.parametrize("clip", [float("inf"), 1e300, 0.0, -1.0])
def test_a_clip_that_clips_nothing_or_all_is_refused(run, tmp_path, clip):
    header, tensors = read_tensors(run / "best.safetensors", "springfoot", "policy", POLICY_ENTRIES)
    header["network"]["observation_clip"] = clip
    text = json.dumps({"springfoot": json.dumps(header)})  # JSON proper has no infinity: a digest cannot be written
    path = tmp_path / "forged.safetensors"
    path.write_bytes(save(tensors, json.loads(text)))
    with pytest.raises(SpringfootError, match=r"observation_clip must be in \(0, 1e\+06\] or null, is"):
        read_policy(path)


STATES = [
    ("network.action_net.weight", 3e38, "network.action_net.weight must be in [-1e+06, 1e+06], has 3e+38"),
    ("adam.0.exp_avg_sq", -1.0, "adam.0.exp_avg_sq must be in [0, 1e+12], has -1"),
    ("adam.1.exp_avg", None, "has no adam.1.exp_avg"),
    ("adam.2.step", None, "has no adam.2.step"),
    ("observation.var", -1.0, "observation.var must be in [0, 1e+30], has -1"),
    ("return.count", -1.0, "return.count must be in [0, 1e+30], has -1"),
]


@pytest.mark.parametrize(("name", "value", "said"), STATES)
def test_numbers_that_no_training_makes_are_refused_in_a_state(run, tmp_path, name, value, said):
    header, tensors = read_checkpoint(run / STATE)
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    _forged(folder / STATE, STATE_KEY, header, tensors, name, value)
    with pytest.raises(
        SpringfootError, match=re.escape(f"the training state{'' if said[:3] == 'has' else ':'} {said}")
    ):
        resume(folder, 64)


def _forged(path, key, header, tensors, name, value):
    """The file with one number of `name` changed, or without it, and with a digest that fits."""
    tensors = {each: values.copy() for each, values in tensors.items()}
    if value is None:
        del tensors[name]
    else:
        tensors[name][...] = np.where(
            np.arange(tensors[name].size).reshape(tensors[name].shape) == 0, value, tensors[name]
        )
    write_tensors(path, key, header, tensors)
    return path


HEADERS = [
    ("seconds", None, "in its header, value of key 'seconds' of dict is neither float or int"),
    ("seconds", 1e999, "Out of range float values are not JSON compliant"),
    ("timesteps", -1, "timesteps must be a whole number >= 0, got -1"),
    ("config", [], "in its header, value of key 'config' of dict is not a dict"),
    ("config.environment", [], "springfoot.envs.settings.settings.settings_from() argument after ** must be a mapping"),
    ("config.seed", -1, "seed must be a whole number >= 0"),
    ("fingerprint.legs", 3, "in its header, value of key 'legs' of value of key 'fingerprint' of dict is not a"),
    ("record.sessions", [], "sessions must be one or more"),
    ("record.sessions", [1], "in its header, item 0 of value of key 'sessions' of value of key 'record' of dict is"),
    ("record.sessions.0.best", 1, "best must be an object"),
    ("record.sessions.0.from_timesteps", "0", "from_timesteps must be a whole number >= 0, got '0'"),
    ("record.evaluations.0", {}, "it has no 'timesteps'"),
    ("record.evaluations.0.return_mean", "x", "return_mean must be a finite number >= -inf, got 'x'"),
    ("events.a", -1, "size of a must be a whole number >= 0, got -1"),
    ("learning.generators.0", None, "in its header, item 0 of value of key 'generators' of value of key 'learning'"),
    ("learning.episodes.0", {"r": 1.0}, "in its header, item 0 of value of key 'episodes' of value of key 'learning'"),
]
"""What no training writes into the header of a checkpoint, and how it is refused where its digest fits."""


@pytest.mark.parametrize(("place", "value", "said"), HEADERS, ids=lambda each: str(each)[:30])
def test_a_header_that_no_training_writes_is_refused_though_its_digest_fits(run, tmp_path, place, value, said):
    header, tensors = _header_with(run, place, value)
    path = tmp_path / STATE
    content = save(tensors, {STATE_KEY: json.dumps(header | {DIGEST: digest_of(header, tensors)}, sort_keys=True)})
    path.write_bytes(content)
    with pytest.raises(SpringfootError) as caught:
        read_checkpoint(path)
    assert str(caught.value).startswith(f"{path} is damaged: {said}")


def _header_with(run, place, value):
    header, tensors = read_checkpoint(run / STATE)
    *into, last = (int(part) if part.isdecimal() else part for part in place.split("."))
    found: Any = header
    for part in into:
        found = found[part]
    found[last] = value
    return header, tensors


MISFITS = [
    ("learning.updates", 10**400, "updates must be a whole number >= 0 and <= 1000000000000, got infinity"),
    ("learning.numpy", [1.0], "not enough values to unpack (expected 3, got 1)"),
    ("learning.numpy.0", 10**30, "Python int too large to convert to C long"),
    ("learning.actions", {}, "state must be for a PCG64 RNG"),
    ("learning.generators.0", {}, "'bit_generator'"),
    ("learning.logged.a", [1.0], "logged must be values, each with the formats that leave it out"),
    ("learning.logged.a", ["x", []], "must be real number, not str"),
]
"""What has the types of a header, and yet cannot be gone on from."""


@pytest.mark.parametrize(("place", "value", "said"), MISFITS, ids=lambda each: str(each)[:30])
def test_a_state_that_cannot_be_gone_on_from_is_one_line(run, tmp_path, place, value, said):
    folder = shutil.copytree(run, tmp_path / "run")
    write_tensors(folder / STATE, STATE_KEY, *_header_with(run, place, value))
    with pytest.raises(SpringfootError, match=re.escape(said)):
        resume(folder, 64)


@pytest.mark.parametrize(("name", "value"), [("num_envs", 8), ("hidden", [16])])
def test_a_record_that_says_another_shape_than_was_trained_is_one_line(run, tmp_path, name, value):
    folder = shutil.copytree(run, tmp_path / "run")
    record = read_object(folder / "run.json", "record of a run")
    trained = record["config"][name]
    (folder / "run.json").write_text(json.dumps(record | {"config": record["config"] | {name: value}}))
    with pytest.raises(SpringfootError, match=re.escape(f"{folder} was trained with {name} {trained}; its run.json")):
        resume(folder, 64)


def test_a_checkpoint_without_a_digest_is_passed_over(run, tmp_path, capsys):
    header, tensors = read_checkpoint(run / STATE)
    older = shutil.copyfile(run / STATE, tmp_path / STATE)
    newer = tmp_path / "state-128.safetensors"
    newer.write_bytes(save(tensors, {STATE_KEY: json.dumps(header)}))
    found = newest_checkpoint(tmp_path)
    assert found is not None and found[0] == header
    said = f"Warning: {newer} is damaged or was changed: it has no sha256; going on from {older.name}\n"
    assert capsys.readouterr().err == said


def test_a_number_of_too_many_digits_is_damage(run, tmp_path, capsys):
    """Python reads no number of more than 4,300 digits."""
    long = '{"timesteps": ' + 5000 * "1" + "}"
    _, tensors = read_checkpoint(run / STATE)
    policy = tmp_path / "best.safetensors"
    policy.write_bytes(save(load((run / "best.safetensors").read_bytes()), {"springfoot": long}))
    with pytest.raises(SpringfootError, match=r"best\.safetensors: the springfoot entry of its header is not JSON"):
        read_policy(policy)
    older = shutil.copyfile(run / STATE, tmp_path / STATE)
    newer = tmp_path / "state-128.safetensors"
    newer.write_bytes(save(tensors, {STATE_KEY: long}))
    assert newest_checkpoint(tmp_path) is not None
    assert capsys.readouterr().err.endswith(f"going on from {older.name}\n")


def test_a_policy_of_an_earlier_version_has_no_digest_and_is_read(run, tmp_path):
    content = (run / "best.safetensors").read_bytes()
    with safe_open(run / "best.safetensors", framework="numpy") as file:
        header = json.loads(file.metadata()["springfoot"])
    assert len(header.pop(DIGEST)) == 64
    (tmp_path / "old.safetensors").write_bytes(save(load(content), {"springfoot": json.dumps(header)}))
    assert read_policy(tmp_path / "old.safetensors").header == read_policy(run / "best.safetensors").header


def test_any_flipped_bit_of_a_record_is_refused(run, tmp_path):
    content, damaged = (run / "run.json").read_bytes(), tmp_path / "run.json"
    read_object(run / "run.json", "record of a run")
    random = np.random.default_rng(0)
    for place, bit in zip(random.integers(0, len(content), 500), random.integers(0, 8, 500), strict=True):
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(bit)
        damaged.write_bytes(flipped)
        with pytest.raises(SpringfootError, match="is damaged or was changed"):
            read_object(damaged, "record of a run")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"evaluations": ["x"]}, "evaluations must be a list of objects"),
        ({"sessions": {}}, "sessions must be a list of objects"),
        ({"seconds": None}, "seconds must be a finite number >= 0 s, got None"),
        ({"config": []}, "config must be an object"),
    ],
)
def test_a_record_that_is_none_is_refused(run, tmp_path, change, words):
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    record = read_object(folder / "run.json", "record of a run")  # and written without its digest
    (folder / "run.json").write_text(json.dumps(record | change), encoding="utf-8")
    with pytest.raises(SpringfootError, match=words):
        resume(folder, 64)
