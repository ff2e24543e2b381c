"""Callbacks of a training: TensorBoard, and callbacks that may end it but change no bit."""

import dataclasses
import json

import numpy as np
import pytest
from stable_baselines3.common.callbacks import BaseCallback
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData  # type: ignore[attr-defined]

from springfoot.agents.policies.policy import read_policy
from springfoot.agents.training import training
from springfoot.agents.training.config import TrainingConfig
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.reward import TERMS

SHORT = TrainingConfig(
    timesteps=4_000,
    num_envs=8,
    threads=1,
    update_steps=512,
    eval_interval=1024,
    eval_episodes=2,
    environment=BipedSettings(episode_seconds=1.0, push_newton=50.0, reward_weights={"grf": 0.2}),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "short"
    return folder, training.train(SHORT, folder)


def test_tensorboard_knows_terms_stiffness_falls_and_configuration(run):
    events = EventAccumulator(str(run[0])).Reload()
    scalars = set(events.Tags()["scalars"])
    assert {f"reward/{term}" for term in TERMS} <= scalars
    assert {f"stiffness/{action}" for action in ACTIONS} <= scalars
    alive = [event.value for event in events.Scalars("reward/alive")]
    assert alive and all(0.9 < value <= 1.0 for value in alive)  # mean over a rollout's steps
    assert {"episode/falls_share", "episode/return", "evaluation/falls", "evaluation/return_mean"} <= scalars
    curve = [(event.step, event.value) for event in events.Scalars("evaluation/return_mean")]
    told = [(entry["timesteps"], pytest.approx(entry["return_mean"])) for entry in run[1]["evaluations"]]
    assert [each for each in curve if each != (0, 0.0)] == told
    text = events.Tensors("configuration/text_summary")[0].tensor_proto.string_val[0].decode()
    assert json.loads(text.removeprefix("```json\n").removesuffix("\n```")) == run[1]["config"]
    started = events.summary_metadata["_hparams_/session_start_info"].plugin_data.content
    values = HParamsPluginData.FromString(started).session_start_info.hparams
    assert values["learning_rate"].number_value == SHORT.learning_rate
    assert values["environment/reward_weights/grf"].number_value == 0.2


class Counting(BaseCallback):
    """A callback of stable-baselines3's that ends the training after some steps."""

    def __init__(self, most):
        super().__init__()
        self.most, self.ended = most, 0

    def _on_step(self):
        return self.num_timesteps < self.most

    def _on_training_end(self):
        self.ended += 1


@pytest.mark.slow
def test_a_callback_may_end_the_training_which_can_be_resumed(tmp_path):
    counting, told = Counting(1200), []
    record = training.train(SHORT, tmp_path / "run", callbacks=[counting, told.append])
    assert (record["status"], record["timesteps"], counting.ended) == ("interrupted", 1024, 1)
    assert told == record["evaluations"] and counting.model is not None
    assert training.resume(tmp_path / "run", callbacks=[told.append])["status"] == "finished"
    assert [entry["timesteps"] for entry in told][-1] >= SHORT.timesteps


@pytest.mark.slow
def test_a_function_of_evaluations_may_end_the_training(tmp_path):
    record = training.train(SHORT, tmp_path / "run", callbacks=[lambda evaluation: evaluation["timesteps"] < 2048])
    assert record["status"] == "interrupted" and record["evaluations"][-1]["timesteps"] == 2048
    whole = dataclasses.replace(SHORT, timesteps=1024, eval_interval=1024)
    record = training.train(whole, tmp_path / "whole", callbacks=[lambda evaluation: evaluation["timesteps"] < 1024])
    assert record["status"] == "finished"  # there was nothing left to end


@pytest.mark.slow
def test_callbacks_change_no_bit_of_what_is_trained(run, tmp_path):
    training.train(SHORT, tmp_path / "run", callbacks=[Counting(10**9), lambda evaluation: None])
    alone, seen = (read_policy(folder / training.LAST) for folder in (run[0], tmp_path / "run"))
    assert all(np.array_equal(a, b) for a, b in zip(alone.weights, seen.weights, strict=True))
