"""Networks trained elsewhere become policies: the same actions, and one line for what cannot be."""

import dataclasses
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3 import A2C, PPO, SAC, TD3
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

from springfoot.agents import SegmentedFootBipedVecEnv, policy_from_mlp, policy_from_sb3, read_policy, save_policy
from springfoot.agents.policies.conversion import IGNORED, NEVER_VARIED, TORCH_NAMES, ignoring_unvaried
from springfoot.agents.policies.policy import ACTIVATIONS
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.observation import OBSERVATION
from springfoot.errors import SpringfootError
from springfoot.evaluation import policy_and_settings, record

D = len(OBSERVATION)
LOW, HIGH = np.array([(entry.low, entry.high) for entry in OBSERVATION]).T


def observations(count=10_000):
    """Observations anywhere within their bounds: a fifth at their ends, one of zeros, the others between."""
    random = np.random.default_rng(0)
    rows = random.uniform(LOW, HIGH, (count, D))
    ends = count // 5
    rows[:ends] = np.where(random.random((ends, D)) < 0.5, LOW, HIGH)
    rows[0], rows[1], rows[2] = LOW, HIGH, 0.0
    return rows.astype(np.float32)


def predicted(model, rows):
    """The model's deterministic actions for raw observations."""
    normalizer = model.get_vec_normalize_env()
    return model.predict(normalizer.normalize_obs(rows) if normalizer else rows, deterministic=True)[0]


def spread(model):
    """The model with an action layer that fills [-1, 1], as a trained one does; training begins near zero."""
    actor = getattr(model.policy, "actor", model.policy)
    layer: Any = actor.action_net if hasattr(actor, "action_net") else actor.mu
    layer = layer[-2] if isinstance(layer, torch.nn.Sequential) else layer
    for _ in range(3):
        with torch.no_grad():
            layer.weight *= 0.4 / float(predicted(model, observations(1000)).std())
    return model


def normalized(**settings):
    return VecNormalize(SegmentedFootBipedVecEnv(4, episode_seconds=1.0, **settings), gamma=0.98)


MODELS = {
    "PPO and VecNormalize": lambda: PPO(
        "MlpPolicy", normalized(push_newton=150.0), n_steps=128, batch_size=128, n_epochs=2, seed=0, device="cpu"
    ),
    "PPO of other layers": lambda: PPO(
        "MlpPolicy",
        normalized(),
        n_steps=32,
        batch_size=32,
        policy_kwargs={"net_arch": [32, 16, 8], "activation_fn": torch.nn.ELU},
        seed=0,
        device="cpu",
    ),
    "PPO on what it sees": lambda: PPO(
        "MlpPolicy", SegmentedFootBipedVecEnv(4), n_steps=32, batch_size=32, seed=0, device="cpu"
    ),
    "A2C on gym.make": lambda: A2C(
        "MlpPolicy",
        VecNormalize(make_vec_env("springfoot.envs:SegmentedFootBiped-v0", 2, env_kwargs={"push_newton": 150.0})),
        policy_kwargs={"activation_fn": torch.nn.SiLU},
        seed=0,
        device="cpu",
    ),
    "SAC": lambda: SAC("MlpPolicy", SegmentedFootBipedVecEnv(4), learning_starts=100, seed=0, device="cpu"),
    "TD3": lambda: TD3("MlpPolicy", normalized(), learning_starts=100, seed=0, device="cpu"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_a_model_of_stable_baselines3_becomes_a_file_that_acts_the_same(name, tmp_path):
    model = spread(MODELS[name]().learn(200))
    policy = policy_from_sb3(model)
    save_policy(tmp_path / "mine.safetensors", policy)
    rows = observations()
    expected = predicted(model, rows)
    again = read_policy(tmp_path / "mine.safetensors")
    assert np.abs(again(rows) - expected).max() <= 1e-6
    assert expected.std() > 0.3 and np.abs(expected).max() <= 1.0
    assert again.settings == model.get_env().get_attr("settings")[0]
    assert again.header == policy.header


def test_what_varied_by_the_limit_is_kept():
    width = len(OBSERVATION)
    policy = policy_from_mlp([(np.zeros((4, width)), np.zeros(4))], BipedSettings(), activation="tanh")
    limit = dataclasses.replace(policy, observation_variance=np.full(width, NEVER_VARIED))
    assert (ignoring_unvaried(limit).observation_variance == NEVER_VARIED).all()
    below = dataclasses.replace(policy, observation_variance=np.full(width, 0.99 * NEVER_VARIED))
    assert (ignoring_unvaried(below).observation_variance == IGNORED).all()


def test_what_never_varied_is_ignored_if_asked():
    model = spread(MODELS["PPO and VecNormalize"]().learn(1024))
    rows = observations(100)
    taller = rows.copy()
    taller[:, [entry.name for entry in OBSERVATION].index("height_ratio")] *= 1.1
    faithful, ours = policy_from_sb3(model), policy_from_sb3(model, ignore_unvaried=True)
    assert not np.array_equal(faithful(taller), faithful(rows))
    assert ours(taller) == pytest.approx(ours(rows), abs=1e-5)
    environments = model.get_vec_normalize_env()
    environments.training = False
    seen = environments.reset()
    expected, _ = model.predict(seen, deterministic=True)
    assert ours(environments.get_original_obs()) == pytest.approx(expected, abs=1e-4)


def test_evaluate_judges_the_file(tmp_path):
    model = MODELS["PPO and VecNormalize"]().learn(512)
    save_policy(tmp_path / "mine.safetensors", policy_from_sb3(model))
    policy, settings = policy_and_settings(str(tmp_path / "mine.safetensors"), {"episode_seconds": 1.0})
    assert settings.action_mode == "absolute" and settings.push_newton == 0.0
    assert record(policy, settings, name="mine", episodes=1).returns[0] > 0


def test_a_model_without_its_environment_is_told_settings_and_statistics():
    model = MODELS["PPO and VecNormalize"]().learn(512)
    normalizer, rows = model.get_vec_normalize_env(), observations(100)
    expected = policy_from_sb3(model)
    model.env = None
    with pytest.raises(SpringfootError) as refused:
        policy_from_sb3(model)
    assert str(refused.value) == (
        "the model has no environment of springfoot's: give settings, and the VecNormalize if it had one"
    )
    told = policy_from_sb3(model, {"push_newton": 150.0, "episode_seconds": 1.0}, normalizer)
    assert np.array_equal(told(rows), expected(rows)) and told.header == expected.header


def refused_sb3(environments, kind: Any = PPO, **how):
    with pytest.raises(SpringfootError) as refused:
        policy_from_sb3(kind("MlpPolicy", environments, device="cpu", **how))
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_networks_that_no_policy_file_has_are_refused():
    environments = SegmentedFootBipedVecEnv(2)
    assert refused_sb3(environments, policy_kwargs={"activation_fn": torch.nn.GELU}) == (
        "its actor is Linear, GELU, Linear, GELU, Linear: no layers with one activation between them, "
        "of tanh, relu, leaky_relu, elu, silu"
    )
    steep = {"activation_fn": lambda: torch.nn.LeakyReLU(0.2)}
    assert refused_sb3(environments, policy_kwargs=steep) == (
        "its activation LeakyReLU(negative_slope=0.2) is not of the default slope"
    )
    assert refused_sb3(environments, SAC, use_sde=True).startswith(
        "its actor is Linear, ReLU, Linear, ReLU, Linear, Hardtanh: no layers"
    )
    walk, ends = "springfoot.envs:SegmentedFootBiped-v0", (np.zeros(4, np.float32), np.ones(4, np.float32))
    rescaled = make_vec_env(lambda: gym.wrappers.RescaleAction(gym.make(walk), *ends), 1)
    assert refused_sb3(rescaled) == "the model acts on another range than [-1, 1]: a wrapper rescales the actions"
    timed = make_vec_env(
        lambda: gym.wrappers.FlattenObservation(gym.wrappers.FrameStackObservation(gym.make(walk), 2)), 1
    )
    assert refused_sb3(timed) == f"layer 0: weight must be (outputs, {D}), the observation's entries, is (64, {2 * D})"


def network(activation, sizes=(D, 32, 16, 4)) -> tuple[torch.nn.Sequential, list[Any]]:
    """A torch network whose actions reach beyond [-1, 1], and its layers as `policy_from_mlp` takes them."""
    torch.manual_seed(0)
    parts = []
    for inputs, outputs in pairwise(sizes):
        parts += [torch.nn.Linear(inputs, outputs), getattr(torch.nn, TORCH_NAMES[activation])()]
    made = torch.nn.Sequential(*parts[:-1]).double()
    return made, [(part.weight, part.bias) for part in made if hasattr(part, "weight")]


@pytest.mark.parametrize("output", ["clip", "tanh"])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_any_mlp_becomes_a_policy_that_acts_the_same(activation, output, tmp_path):
    made, layers = network(activation)
    random = np.random.default_rng(1)
    mean, variance = random.normal(size=D), random.uniform(0.01, 2.0, D)
    policy = policy_from_mlp(
        layers,
        {"speed": 1.3},
        activation=activation,
        output=output,
        observation_mean=mean,
        observation_variance=variance,
        observation_clip=5.0,
        variance_floor=1e-3,
    )
    save_policy(tmp_path / "mine.safetensors", policy)
    rows = observations(1000)
    seen = np.clip((rows - mean) / np.sqrt(variance + 1e-3), -5.0, 5.0)
    with torch.no_grad():
        raw = made(torch.from_numpy(seen))
        expected = raw.tanh() if output == "tanh" else raw.clamp(-1, 1)
    again = read_policy(tmp_path / "mine.safetensors")
    assert np.abs(again(rows) - expected.numpy()).max() <= 1e-7
    assert again.settings == BipedSettings(speed=1.3) and again.header == policy.header


def test_without_statistics_observations_reach_the_network_as_they_are():
    made, layers = network("tanh")
    rows = observations(100)
    with torch.no_grad():
        expected = made(torch.from_numpy(rows.astype(float))).clamp(-1, 1).numpy()
    plain = [(weight.detach().numpy(), bias.tolist()) for weight, bias in layers]
    assert np.abs(policy_from_mlp(plain, BipedSettings(), activation="tanh")(rows) - expected).max() <= 1e-7


W, B = np.zeros((4, D)), np.zeros(4)


@pytest.mark.parametrize(
    ("layers", "how", "said"),
    [
        ([(W, B)], {"activation": "gelu"}, "activation must be one of tanh, relu, leaky_relu, elu, silu, got 'gelu'"),
        ([(W, B)], {"output": "sign"}, "output must be one of clip, tanh, got 'sign'"),
        ([(W[:, :24], B)], {}, f"layer 0: weight must be (outputs, {D}), the observation's entries, is (4, 24)"),
        ([(W.T, B)], {}, f"layer 0: weight must be (outputs, {D}), the observation's entries, is ({D}, 4)"),
        ([(W, B), (W, B)], {}, f"layer 1: weight must be (outputs, 4), the outputs of the layer before, is (4, {D})"),
        ([(W, B[:3])], {}, "layer 0: bias must be (4,), is (3,)"),
        ([(W[:2], B[:2])], {}, "the last layer must have 4 outputs, one for each action, has 2"),
        (
            [(W, B)],
            {"mirrored": True},
            "the last layer must have 2 outputs, one for each action of the left leg, has 4",
        ),
        ([], {}, f"the last layer must have 4 outputs, one for each action, has {D}"),
        ([(W * np.nan, B)], {}, "layer 0: weight must be finite, has NaN or infinity"),
        ([(W, B + np.inf)], {}, "layer 0: bias must be finite, has NaN or infinity"),
        ([("weights", B)], {}, "layer 0: weight must be an array of numbers, got str"),
        ([(W, B)], {"observation_mean": W[0]}, "give observation_mean and observation_variance together, or neither"),
        (
            [(W, B)],
            {"observation_mean": B, "observation_variance": W[0] + 1},
            f"observation_mean must be ({D},), is (4,)",
        ),
        (
            [(W, B)],
            {"observation_mean": W[0], "observation_variance": W[0] - 1},
            "observation_variance with variance_floor must be positive",
        ),
        ([(W, B)], {"observation_clip": 0}, "observation_clip must be a finite number > 0, got 0"),
        ([(W, B)], {"settings": {"mass": -1}}, None),
    ],
)
def test_weights_that_make_no_policy_are_refused_with_one_line(layers, how, said):
    with pytest.raises(SpringfootError) as refused:
        policy_from_mlp(layers, **{"settings": {}, "activation": "tanh"} | how)
    assert "\n" not in str(refused.value)
    assert said in (None, str(refused.value))


def test_a_wrapper_that_changes_observations_is_not_overlooked():
    env = gym.wrappers.NormalizeObservation(gym.make("springfoot.envs:SegmentedFootBiped-v0"))
    with pytest.raises(SpringfootError, match="a wrapper changes the observations before the model sees them"):
        policy_from_sb3(PPO("MlpPolicy", env, device="cpu"))
