"""Files that were damaged are refused: every bit of a policy and of a training state counts."""

import json
import shutil

import numpy as np
import pytest

from springfoot.agents.config import TrainingConfig
from springfoot.agents.policy import read_policy
from springfoot.agents.tensor_file import DIGEST, MOST_BYTES, read_tensors
from springfoot.agents.training import STATE, STATE_KEY, resume, train
from springfoot.envs import BipedSettings
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
READERS = {
    "best.safetensors": read_policy,
    STATE: lambda path: read_tensors(path, STATE_KEY, "training state", {"timesteps"}),
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
        file.truncate(MOST_BYTES + 1)  # sparse: it takes no room
    with pytest.raises(SpringfootError, match=r"must have at most 1,073,741,824 bytes, has 1,073,741,825"):
        read_policy(path)


def test_a_policy_of_an_earlier_version_has_no_digest_and_is_read(run, tmp_path):
    from safetensors import safe_open
    from safetensors.numpy import load, save

    content = (run / "best.safetensors").read_bytes()
    with safe_open(run / "best.safetensors", framework="numpy") as file:
        header = json.loads(file.metadata()["springfoot"])
    assert len(header.pop(DIGEST)) == 64
    (tmp_path / "old.safetensors").write_bytes(save(load(content), {"springfoot": json.dumps(header)}))
    assert read_policy(tmp_path / "old.safetensors").header == read_policy(run / "best.safetensors").header


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
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    (folder / "run.json").write_text(json.dumps(record | change), encoding="utf-8")
    with pytest.raises(SpringfootError, match=words):
        resume(folder, 64)
