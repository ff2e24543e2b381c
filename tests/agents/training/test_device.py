"""The network may learn on a GPU: the policy is the same but for the last bits, and a run goes on on either device."""

import dataclasses

import numpy as np
import pytest
import torch

from springfoot.agents import TrainingConfig, read_policy, resume, train
from springfoot.agents.training.run_record import read_record, write_record
from springfoot.cli.train import train_main
from springfoot.envs import BipedSettings
from springfoot.errors import SpringfootError

GPU = torch.cuda.is_available()
SHORT = TrainingConfig(
    timesteps=512,
    num_envs=8,
    threads=1,
    update_steps=256,
    minibatches=2,
    eval_interval=512,
    eval_episodes=2,
    mirrored=True,
    environment=BipedSettings(episode_seconds=1.0),
)


def weights_of(folder):
    return np.concatenate([weight.ravel() for weight in read_policy(folder / "last.safetensors").weights])


@pytest.mark.skipif(not GPU, reason="needs a GPU")
def test_a_policy_learned_on_a_gpu_goes_on_on_the_cpu(tmp_path):
    train(dataclasses.replace(SHORT, device="cuda"), tmp_path / "gpu")
    first = weights_of(tmp_path / "gpu")
    record = resume(tmp_path / "gpu", timesteps=512, device="cpu")
    assert record["status"] == "finished" and record["config"]["device"] == "cpu"
    assert 0.0 < np.abs(weights_of(tmp_path / "gpu") - first).max() < 0.1


@pytest.mark.skipif(GPU, reason="needs a machine without a GPU")
def test_a_gpu_that_is_missing_is_one_line_and_nothing_is_written(tmp_path, capsys):
    said = "device cuda needs a GPU that torch finds; there is none, give cpu"
    assert train_main(["--device", "cuda", "--out", str(tmp_path / "run")]) == 2
    assert capsys.readouterr().err.splitlines()[-1] == f"train.py: error: {said}"
    assert not (tmp_path / "run").exists()


def test_a_run_of_a_machine_with_a_gpu_goes_on_without_one(tmp_path):
    run = tmp_path / "run"
    train(SHORT, run)
    record = read_record(run)
    write_record(run, record | {"config": record["config"] | {"device": "cuda"}})
    if not GPU:
        with pytest.raises(SpringfootError, match="device cuda needs a GPU that torch finds"):
            resume(run, timesteps=256)
    resume(run, timesteps=256, device="cpu")
    assert read_record(run)["config"]["device"] == "cpu"


@pytest.mark.parametrize("value", ["gpu", "", None, 0])
def test_another_device_is_refused(value):
    with pytest.raises(SpringfootError, match=r"^device must be cpu or cuda, got "):
        dataclasses.replace(SHORT, device=value)
