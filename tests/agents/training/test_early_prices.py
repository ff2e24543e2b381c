"""Early factors on the reward's weights: they hold at the start alone, and an interruption changes no bit."""

import dataclasses

import numpy as np
import pytest

from springfoot.agents import TrainingConfig, read_policy, train
from springfoot.agents.training.run_record import read_record
from springfoot.agents.training.training import resume
from springfoot.envs import Biped, BipedSettings
from springfoot.envs.settings.settings import DEFAULT_WEIGHTS
from springfoot.envs.task.reward import TERMS
from springfoot.errors import SpringfootError

WHOLE = TrainingConfig(
    timesteps=512,
    num_envs=8,
    threads=1,
    update_steps=128,
    minibatches=2,
    eval_interval=256,
    eval_episodes=2,
    environment=BipedSettings(episode_seconds=1.0),
)
EARLY = dataclasses.replace(WHOLE, early_factors={"grf": 0.0, "pose": 0.5}, early_share=0.5)


def trained(config, out, **how):
    train(config, out, **how)
    return np.concatenate([weight.ravel() for weight in read_policy(out / "last.safetensors").weights])


def test_the_reward_is_the_sum_of_weights_times_factors_times_terms():
    settings = BipedSettings(reward_weights={"impact": -2.0})
    biped = Biped(settings, 2)
    biped.reset(np.arange(2), [0, 1])
    factors = {"grf": 0.25, "impact": 3.0}
    for given in (factors, {}):
        biped.weigh(given)
        result = biped.step(np.zeros((2, 4)))
        terms = {name: result.info[f"reward/{name}"] for name in TERMS}
        weights = DEFAULT_WEIGHTS | settings.reward_weights
        expected = sum(weights[name] * given.get(name, 1.0) * terms[name] for name in TERMS)
        np.testing.assert_allclose(result.reward, expected, rtol=1e-9)


def test_they_hold_in_their_share_of_the_steps_and_are_those_of_other_weights(tmp_path):
    whole, early = (trained(config, tmp_path / name) for name, config in (("whole", WHOLE), ("early", EARLY)))
    always = trained(dataclasses.replace(EARLY, early_share=1.0), tmp_path / "always")
    cheap = BipedSettings(episode_seconds=1.0, reward_weights={"grf": 0.0, "pose": 0.5 * DEFAULT_WEIGHTS["pose"]})
    other = trained(dataclasses.replace(WHOLE, environment=cheap), tmp_path / "other")
    assert (always == other).all()
    assert (early != whole).any() and (early != always).any()
    begun, other_begun = (read_record(tmp_path / name)["evaluations"][0] for name in ("early", "other"))
    assert begun["return_mean"] > other_begun["return_mean"]  # evaluations have the whole weights


def test_a_training_that_is_stopped_amid_them_goes_on_with_the_same_bits(tmp_path):
    whole = trained(EARLY, tmp_path / "whole")
    trained(dataclasses.replace(EARLY, eval_interval=128), tmp_path / "cut", callbacks=[lambda entry: False])
    assert read_record(tmp_path / "cut")["timesteps"] < 256
    resume(tmp_path / "cut")
    cut = np.concatenate([weight.ravel() for weight in read_policy(tmp_path / "cut" / "last.safetensors").weights])
    assert (whole == cut).all()


def test_further_steps_and_another_beginning_have_the_whole_prices(tmp_path):
    train(EARLY, tmp_path / "run")
    resume(tmp_path / "run", timesteps=512)
    assert read_record(tmp_path / "run")["config"]["early_share"] == 0.25  # the same 256 steps
    train(EARLY, tmp_path / "next", begin_from=tmp_path / "run")
    assert read_record(tmp_path / "next")["config"]["early_share"] == 0.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"early_share": 1.5}, "early_share must be a finite number >= 0 and <= 1, got 1.5"),
        ({"early_factors": {"grf": -1.0}}, "early_factors['grf'] must be a finite number >= 0 and <= 1000, got -1.0"),
        ({"early_factors": [1.0]}, "early_factors must map names of reward terms to numbers, got [1.0]"),
        ({"early_factors": {"gait": 1.0}}, "early_factors has no term 'gait'; valid: alive, speed, com_x"),
    ],
)
def test_bad_ones_are_refused_in_one_line(given, message):
    with pytest.raises(SpringfootError) as error:
        dataclasses.replace(WHOLE, **given)
    assert str(error.value).startswith(message)
