"""Define actor and critic for RLlib, with the layers and initial weights of stable-baselines3's.

Observations are normalised inside by statistics that stay as they are: RLlib's own filter merges the counts of its
runners anew after every update, so that they grow without bound. With a mirror one network serves both legs, as in
`springfoot.agents.training.mirrored_network`.
"""

from itertools import pairwise
from typing import Any

import numpy as np
import torch
from ray.rllib.core.columns import Columns  # pyright: ignore[reportMissingImports]
from ray.rllib.core.rl_module.apis import ValueFunctionAPI  # pyright: ignore[reportMissingImports]
from ray.rllib.core.rl_module.torch import TorchRLModule  # pyright: ignore[reportMissingImports]
from torch import nn

from springfoot.agents.policies.policy import VARIANCE_FLOOR

OBSERVATION_CLIP = 10.0
"""Largest magnitude of a normalised observation, as in stable-baselines3's VecNormalize."""
_HIDDEN_GAIN, _ACTION_GAIN, _VALUE_GAIN = 2**0.5, 0.01, 1.0
"""Gains of the orthogonal first weights, as in stable-baselines3's ActorCriticPolicy."""


class ActorCritic(TorchRLModule, ValueFunctionAPI):
    """Two tanh networks on normalised observations: mean actions with a common log standard deviation, and the value.

    `model_config` holds `hidden` (widths of the hidden layers), `log_std` (of the actions, at the start), `mean` and
    `variance` (D,) of the observations, and for a mirrored network `mirror`: `index`, `sign` (D,) and `legs_order` (A,)
    of a `Mirror`.
    """

    def setup(self) -> None:
        """Make the layers; the mean action begins at 0."""
        config: dict[str, Any] = dict(self.model_config)
        observations = int(np.prod(self.observation_space.shape))
        actions = int(np.prod(self.action_space.shape))
        self.register_buffer("mean", torch.tensor(config["mean"], dtype=torch.float32))
        self.register_buffer("variance", torch.tensor(config["variance"], dtype=torch.float32))
        mirror = config.get("mirror")
        self.is_mirrored = mirror is not None
        if mirror is not None:
            actions //= 2  # those of the left leg
            self.register_buffer("index", torch.tensor(mirror["index"]), persistent=False)
            self.register_buffer("sign", torch.tensor(mirror["sign"], dtype=torch.float32), persistent=False)
            self.register_buffer("legs_order", torch.tensor(mirror["legs_order"]), persistent=False)
        self.actor = _network([observations, *config["hidden"], actions], _ACTION_GAIN)
        self.critic = _network([observations, *config["hidden"], 1], _VALUE_GAIN)
        self.log_std = nn.Parameter(torch.full((actions,), float(config["log_std"])))

    def _forward(self, batch: dict[str, Any], **_: Any) -> dict[str, Any]:
        """Return the inputs of the distribution of A actions, (N, 2 A): A means, then A log standard deviations."""
        mean = self.actor(self._normalized_observations(batch))
        log_std = self.log_std
        if self.is_mirrored:  # (N, 2, A / 2): both legs' actions
            mean = mean.flatten(-2)[..., self.legs_order]
            log_std = log_std.repeat(2)[self.legs_order]
        return {Columns.ACTION_DIST_INPUTS: torch.cat([mean, log_std.expand_as(mean)], dim=-1)}

    def compute_values(self, batch: dict[str, Any], embeddings: Any = None) -> torch.Tensor:
        """Return the critic's values (N,) of the observations of a batch."""
        values = self.critic(self._normalized_observations(batch)).squeeze(-1)
        return values.sum(-1) if self.is_mirrored else values

    def _normalized_observations(self, batch: dict[str, Any]) -> torch.Tensor:
        """Return the observations (N, D) of a batch less `mean`, over the root of `variance`, clipped to
        ±`OBSERVATION_CLIP`; with a mirror each beside its image, (N, 2, D)."""
        centred = (batch[Columns.OBS] - self.mean) / torch.sqrt(self.variance + VARIANCE_FLOOR)
        normalized = centred.clamp(-OBSERVATION_CLIP, OBSERVATION_CLIP)
        return (
            torch.stack((normalized, normalized[..., self.index] * self.sign), -2) if self.is_mirrored else normalized
        )


def _network(widths: list[int], gain: float) -> nn.Sequential:
    """Return a network of these `widths`, input first: tanh layers, and a last one that is linear.

    Weights are orthogonal, those of the last layer times `gain`; biases are 0.
    """
    layers: list[nn.Module] = []
    for index, (below, above) in enumerate(pairwise(widths)):
        last = index == len(widths) - 2
        layer = nn.Linear(below, above)
        nn.init.orthogonal_(layer.weight, gain if last else _HIDDEN_GAIN)
        nn.init.zeros_(layer.bias)
        layers += [layer] if last else [layer, nn.Tanh()]
    return nn.Sequential(*layers)


def actor_layers(state: dict[str, np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return weight and bias of each layer of the actor, from the state of an `ActorCritic`."""
    names = sorted(
        (name.removesuffix(".weight") for name in state if name.startswith("actor.") and name.endswith(".weight")),
        key=lambda name: int(name.split(".")[1]),  # actor.INDEX: 10 after 9
    )
    return [(np.array(state[f"{name}.weight"]), np.array(state[f"{name}.bias"])) for name in names]
