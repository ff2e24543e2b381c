"""Convert networks trained elsewhere into policies: any MLP's weights, and stable-baselines3's models.

The result is a `Policy`, which `save_policy` writes as a .safetensors file. Models are given as objects: their files
are pickles, which run code when read, and are never opened here. This module does not import torch.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from gymnasium import ObservationWrapper

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.envs.task.mirror import Mirror, mirror_of
from springfoot.errors import SpringfootError, require_number

from .fingerprint import fingerprint
from .policy import ACTIVATIONS, VARIANCE_FLOOR, Output, Policy

TORCH_NAMES = {"tanh": "Tanh", "relu": "ReLU", "leaky_relu": "LeakyReLU", "elu": "ELU", "silu": "SiLU"}
"""Name in `ACTIVATIONS` -> class of `torch.nn` with the same function, at its default arguments."""

NEVER_VARIED = 1e-6
"""Variance below which an entry of the observation counts as constant in training [unit squared]; entries that vary
have more than 1e-5."""
IGNORED = 1e12
"""Variance that a constant entry gets in the policy: it is divided by the root and so has no effect."""

Layers = Sequence[tuple[Any, Any]]
"""Weight (outputs, inputs) and bias (outputs,) or None of each layer, from the observation to the action: arrays, or
torch's parameters."""


def policy_from_mlp(
    layers: Layers,
    settings: BipedSettings | Mapping[str, Any],
    *,
    activation: str,
    output: Output = "clip",
    observation_mean: Any = None,
    observation_variance: Any = None,
    observation_clip: float | None = None,
    variance_floor: float = VARIANCE_FLOOR,
    mirrored: bool = False,
) -> Policy:
    """Return a policy from the weights of a multilayer perceptron that gives the mean action.

    Args:
        layers: weight (outputs, inputs) and bias (outputs,) of each layer, in torch's orientation; a bias may be None.
        settings: settings of the training's environment, as its `settings` or as keyword arguments.
        activation: function between the layers: tanh, relu, leaky_relu (slope 0.01), elu (alpha 1) or silu.
        output: function that bounds the last layer's output to [-1, 1]: clip (as PPO) or tanh (as SAC).
        observation_mean: (D,) mean subtracted from observations in training; None if they were not normalised.
        observation_variance: (D,) variance; its root divided observations in training.
        observation_clip: largest magnitude of a normalised observation; None for no limit.
        variance_floor: added to the variance before the root.
        mirrored: True if the layers lead to the actions of the left leg alone, (2,): the policy takes those of the
            right leg from the mirrored observation.

    Raises `SpringfootError`, one line, for widths that do not lead from observation to action, an unknown activation
    and numbers that are not finite.
    """
    settings = settings if isinstance(settings, BipedSettings) else settings_from(**settings)
    biped = Biped(settings, 1)
    if activation not in ACTIVATIONS:
        raise SpringfootError(f"activation must be one of {', '.join(ACTIVATIONS)}, got {activation!r}")
    if output not in get_args(Output):
        raise SpringfootError(f"output must be one of {', '.join(get_args(Output))}, got {output!r}")
    if (observation_mean is None) != (observation_variance is None):
        raise SpringfootError("give observation_mean and observation_variance together, or neither")
    if observation_clip is not None:
        require_number("observation_clip", observation_clip, 0, above=True)
    width = len(biped.observation_names)
    if observation_mean is None:
        observation_mean = np.zeros(width)
        observation_variance = np.ones(width)
        variance_floor = 0.0
    require_number("variance_floor", variance_floor, 0)
    mirror = mirror_of(biped.observation_names, biped.action_names) if mirrored else None
    weights, biases = _checked_layers(layers, width, len(biped.action_names), mirrored)
    mean = _array("observation_mean", observation_mean)
    variance = _array("observation_variance", observation_variance)
    for name, value in (("observation_mean", mean), ("observation_variance", variance)):
        if value.shape != (width,):
            raise SpringfootError(f"{name} must be ({width},), is {value.shape}")
    if (variance < 0).any() or (variance + variance_floor <= 0).any():
        raise SpringfootError("observation_variance with variance_floor must be positive")
    return Policy(
        settings=settings,
        fingerprint=fingerprint(biped),
        weights=weights,
        biases=biases,
        observation_mean=mean,
        observation_variance=variance,
        observation_clip=None if observation_clip is None else float(observation_clip),
        variance_floor=float(variance_floor),
        activation=activation,
        output=output,
        mirror=mirror,
    )


def policy_from_sb3(
    model: Any,
    settings: Any = None,
    normalizer: Any = None,
    *,
    ignore_unvaried: bool = False,
) -> Policy:
    """Return the mean action of a stable-baselines3 model with an MLP policy: of PPO, A2C, TRPO, SAC, TQC, TD3 or DDPG.

    Args:
        model: the model; from its environment, if it has one, come `settings` and `normalizer` unless given.
        settings: settings of the training's environment, needed if the model has no environment of springfoot's.
        normalizer: the `VecNormalize` of the training, if the model's environment is not inside it.
        ignore_unvaried: leave entries of the observation that never varied in training (body, commanded speed) out of
            the action, as train.py does; their weights are still random, and other bodies and speeds would meet them.

    For every observation it acts as `model.predict(normalizer.normalize_obs(observation), deterministic=True)` does, to
    the precision of float32; with `ignore_unvaried`, for those that training could meet. Raises `SpringfootError`, one
    line, for a network that is no MLP of one activation, behind a Gymnasium wrapper of observations, and for missing
    settings.
    """
    if settings is None:
        try:
            settings = model.get_env().get_attr("settings")[0]
        except AttributeError:
            raise SpringfootError(
                "the model has no environment of springfoot's: give settings, and the VecNormalize if it had one"
            ) from None
    normalizer = model.get_vec_normalize_env() if normalizer is None else normalizer
    low = model.action_space.low
    high = model.action_space.high
    if not ((low == -1).all() and (high == 1).all()):
        raise SpringfootError("the model acts on another range than [-1, 1]: a wrapper rescales the actions")
    layers, activation, output = actor_of(model.policy)
    mirror = getattr(model.policy, "mirror", None)  # of a MirroredNetwork
    statistics = statistics_of(normalizer)
    if mirror is not None and not _mirror_keeps_statistics(mirror, **statistics):
        raise SpringfootError("its network is mirrored, but its VecNormalize treats left and right differently")
    policy = policy_from_mlp(
        layers, settings, activation=activation, output=output, mirrored=mirror is not None, **statistics
    )
    if model.get_env() is not None and any(model.get_env().env_is_wrapped(ObservationWrapper)):
        raise SpringfootError(
            "a wrapper changes the observations before the model sees them: train with VecNormalize instead, "
            "or give its statistics to policy_from_mlp"
        )
    return ignoring_unvaried(policy) if ignore_unvaried else policy


def ignoring_unvaried(policy: Policy) -> Policy:
    """Return the policy without the effect of observation entries that never varied in training.

    Their variance becomes `IGNORED`, so that they are 0 once normalised.
    """
    variance = np.where(policy.observation_variance < NEVER_VARIED, IGNORED, policy.observation_variance)
    return replace(policy, observation_variance=variance)


def actor_of(network: Any) -> tuple[Layers, str, Output]:
    """Return the layers, the activation between them and the output function of a stable-baselines3 policy's actor.

    The flattened actor must read Linear, activation, Linear, …, Linear, with one kind of activation. Raises
    `SpringfootError` for any other network.
    """
    if hasattr(network, "lstm_actor"):
        raise SpringfootError("a recurrent policy has a memory; a policy of springfoot sees one observation only")
    actor = getattr(network, "actor", network)
    if type(actor.features_extractor).__name__ != "FlattenExtractor":
        kind = type(actor.features_extractor).__name__
        raise SpringfootError(f"its features are extracted by {kind}; only a plain MLP can be a policy file")
    output: Output = "tanh" if network.squash_output else "clip"
    if hasattr(network, "action_net"):  # PPO, A2C, TRPO
        parts = [network.mlp_extractor.policy_net, network.action_net]
    else:  # SAC and TQC; TD3 and DDPG
        parts = [actor.latent_pi, actor.mu] if hasattr(actor, "latent_pi") else [actor.mu]
    leaves = [leaf for part in parts for leaf in part.modules() if not list(leaf.children())]  # modules without parts
    kinds = [type(leaf).__name__ for leaf in leaves]
    if not hasattr(actor, "latent_pi") and output == "tanh" and kinds[-1:] == ["Tanh"]:
        leaves = leaves[:-1]  # in TD3 and DDPG the output function is a module too
        kinds = kinds[:-1]
    # Every other module is a layer, those between are activations.
    layers = leaves[::2]
    between = leaves[1::2]
    names = {kind: name for name, kind in TORCH_NAMES.items()}
    activations = set(kinds[1::2]) or {"Tanh"}  # a single layer has none: any name does
    if len(kinds) % 2 == 0 or set(kinds[::2]) != {"Linear"} or len(activations) > 1 or not activations <= set(names):
        raise SpringfootError(
            f"its actor is {', '.join(kinds)}: no layers with one activation between them, of {', '.join(ACTIVATIONS)}"
        )
    for activation in between:
        # Parameters of LeakyReLU and ELU, at their defaults in torch; other activations have neither.
        if (getattr(activation, "negative_slope", 0.01), getattr(activation, "alpha", 1.0)) != (0.01, 1.0):
            raise SpringfootError(f"its activation {activation} is not of the default slope")
    return [(layer.weight, layer.bias) for layer in layers], names[activations.pop()], output


def _mirror_keeps_statistics(
    mirror: Mirror, observation_mean: Any = 0.0, observation_variance: Any = 1.0, **_: Any
) -> bool:
    """Return True if mean and variance (D,) of observations are those of the mirrored observations, bit for bit.

    Arguments beside `mirror` are those of `statistics_of`; others than the two are not read.
    """
    mean, variance = (np.broadcast_to(value, len(mirror.index)) for value in (observation_mean, observation_variance))
    return np.array_equal(mirror.of(mean), mean) and np.array_equal(variance[mirror.index], variance)


def statistics_of(normalizer: Any) -> dict[str, Any]:
    """Return the statistics of a `VecNormalize` as keyword arguments of `policy_from_mlp`; {} for None, or if it does
    not normalise observations."""
    if normalizer is None or not normalizer.norm_obs:
        return {}
    return {
        "observation_mean": normalizer.obs_rms.mean,
        "observation_variance": normalizer.obs_rms.var,
        "observation_clip": normalizer.clip_obs,
        "variance_floor": normalizer.epsilon,
    }


def _checked_layers(
    layers: Layers, observation_entries: int, actions: int, mirrored: bool
) -> tuple[tuple[NDArray, ...], tuple[NDArray, ...]]:
    """Return the weights (outputs, inputs) and the biases (outputs,) of all layers as arrays, 0 for a bias of None.

    Raises `SpringfootError` unless the first layer takes `observation_entries` numbers, each other layer the outputs of
    the one before, and the last one returns `actions` numbers; half of them if `mirrored`.
    """
    weights = []
    biases = []
    inputs = observation_entries
    for index, (weight, bias) in enumerate(layers):
        name = f"layer {index}"
        w = _array(f"{name}: weight", weight)
        if w.ndim != 2 or w.shape[1] != inputs:
            source = "the observation's entries" if index == 0 else "the outputs of the layer before"
            raise SpringfootError(f"{name}: weight must be (outputs, {inputs}), {source}, is {w.shape}")
        b = np.zeros(len(w), w.dtype) if bias is None else _array(f"{name}: bias", bias)
        if b.shape != (len(w),):
            raise SpringfootError(f"{name}: bias must be ({len(w)},), is {b.shape}")
        weights.append(w)
        biases.append(b)
        inputs = len(w)
    outputs = actions // 2 if mirrored else actions
    if not weights or inputs != outputs:
        of_leg = " of the left leg" if mirrored else ""
        raise SpringfootError(f"the last layer must have {outputs} outputs, one for each action{of_leg}, has {inputs}")
    return tuple(weights), tuple(biases)


def _array(name: str, value: Any) -> NDArray:
    """Return a copy of an array or torch tensor as float32 or float64; raise `SpringfootError` if it is not finite."""
    try:
        array = np.array(value.detach().cpu().numpy() if hasattr(value, "detach") else value)
        array = array if array.dtype in (np.float32, np.float64) else array.astype(np.float64)
    except (TypeError, ValueError):
        raise SpringfootError(f"{name} must be an array of numbers, got {type(value).__name__}") from None
    if not np.isfinite(array).all():
        raise SpringfootError(f"{name} must be finite, has NaN or infinity")
    return array
