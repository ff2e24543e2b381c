"""What a run shows of itself: learning curve and gallery in its folder, curves and configuration in TensorBoard."""

import dataclasses
import json

import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image
from stable_baselines3.common.callbacks import BaseCallback
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData  # type: ignore[attr-defined]

from springfoot.agents.policies.policy import read_policy
from springfoot.agents.training import training
from springfoot.agents.training.config import TrainingConfig
from springfoot.agents.training.run_pictures import LEFT_COLOUR, RIGHT_COLOUR, curve_figure, gallery_figure
from springfoot.agents.training.session import EVALUATION_SEED
from springfoot.envs.batch.biped_batch import Biped
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


def test_policies_are_kept_at_the_beginning_at_each_quarter_and_at_the_end(run):
    kept = sorted(int(path.stem) for path in (run[0] / "gallery").iterdir())
    assert kept == [0, 1024, 2048, 4096]  # the first updates of 512 at or after 0, 25, 50 and 100 % of 4000
    last = read_policy(run[0] / training.LAST)
    same = read_policy(run[0] / "gallery" / "4096.safetensors")
    assert all(np.array_equal(a, b) for a, b in zip(same.weights, last.weights, strict=True))


def test_the_gallery_shows_the_first_evaluation_episode_of_each(run):
    kept = [0, 1024, 2048, 4096]
    policies = {steps: read_policy(run[0] / "gallery" / f"{steps}.safetensors") for steps in kept}
    biped = Biped(SHORT.environment, 3)  # the fourth policy walks after the others
    figure = gallery_figure(policies, 4000, biped, EVALUATION_SEED)
    assert [ax.get_title(loc="left").partition(":")[0] for ax in figure.axes] == [
        "after 0 steps (0 %)",
        "after 1,024 steps (25 %)",
        "after 2,048 steps (50 %)",
        "after 4,096 steps (100 %)",
    ]
    biped.reset(np.arange(1), [EVALUATION_SEED])
    hip = biped.measurement.base[0, :2]
    legs = [line for line in figure.axes[0].lines if to_hex(line.get_color()) in (LEFT_COLOUR, RIGHT_COLOUR)]
    assert len(legs) == 2
    for line in legs:
        points = line.get_xydata()
        assert np.isnan(points[:, 0]).sum() == 4  # a figure each 0.3 s of the episode of 1 s, apart from each other
        assert points[0] == pytest.approx(hip)  # as the episode begins
        assert np.nanmin(points[:, 1]) == pytest.approx(0.0, abs=0.03)  # on the ground


def test_the_curve_is_of_the_records_evaluations(run):
    record = run[1]
    returns, falls = curve_figure(record).axes
    steps = [entry["timesteps"] for entry in record["evaluations"]]
    mean = [entry["return_mean"] for entry in record["evaluations"]]
    assert len(steps) > 3 and np.array_equal(returns.lines[0].get_xydata(), np.transpose([steps, mean]))
    share = [100 * entry["falls"] / entry["episodes"] for entry in record["evaluations"]]
    assert falls.lines[0].get_ydata().tolist() == share
    assert returns.lines[1].get_xydata().tolist() == [[record["best"]["timesteps"], record["best"]["return_mean"]]]
    for name in ("learning_curve.png", "gallery.png"):
        with Image.open(run[0] / name) as picture:
            assert len(picture.convert("L").getcolors() or []) > 20  # lines and letters, no blank page


def test_tensorboard_knows_terms_stiffness_falls_and_configuration(run):
    events = EventAccumulator(str(run[0])).Reload()
    scalars = set(events.Tags()["scalars"])
    assert {f"reward/{term}" for term in TERMS} <= scalars
    assert {f"stiffness/{action}" for action in ACTIONS} <= scalars
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


def test_a_callback_may_end_the_training_which_can_be_resumed(tmp_path):
    counting, told = Counting(1200), []
    record = training.train(SHORT, tmp_path / "run", callbacks=[counting, told.append])
    assert (record["status"], record["timesteps"], counting.ended) == ("interrupted", 1024, 1)
    assert told == record["evaluations"] and counting.model is not None
    assert training.resume(tmp_path / "run", callbacks=[told.append])["status"] == "finished"
    assert [entry["timesteps"] for entry in told][-1] >= SHORT.timesteps


def test_a_function_of_evaluations_may_end_the_training(tmp_path):
    record = training.train(SHORT, tmp_path / "run", callbacks=[lambda evaluation: evaluation["timesteps"] < 2048])
    assert record["status"] == "interrupted" and record["evaluations"][-1]["timesteps"] == 2048
    whole = dataclasses.replace(SHORT, timesteps=1024, eval_interval=1024)
    record = training.train(whole, tmp_path / "whole", callbacks=[lambda evaluation: evaluation["timesteps"] < 1024])
    assert record["status"] == "finished"  # there was nothing left to end


def test_onlookers_change_no_bit_of_what_is_trained(run, tmp_path):
    training.train(SHORT, tmp_path / "run", callbacks=[Counting(10**9), lambda evaluation: None])
    alone, seen = (read_policy(folder / training.LAST) for folder in (run[0], tmp_path / "run"))
    assert all(np.array_equal(a, b) for a, b in zip(alone.weights, seen.weights, strict=True))
