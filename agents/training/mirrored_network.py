"""Define an actor and critic that treat left and right alike: one network on the world and on its mirror image.

z: normalised observation, z': that of the mirrored world. The actor gives f(z) to the left leg's actions and f(z') to
their images of the right leg; the critic values g(z) + g(z'), so that a state and its image are worth the same.
"""

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.distributions import DiagGaussianDistribution, Distribution
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.torch_layers import MlpExtractor
from stable_baselines3.common.type_aliases import Schedule

from springfoot.arrays import NDArray
from springfoot.envs.task.mirror import Mirror


class MirroredNetwork(ActorCriticPolicy):
    """stable-baselines3's MLP policy on both images of an observation, with one action layer and one exploration for
    both legs.

    It needs observations normalised alike on both sides, as by `MirroredMeanStd`. All other arguments are those of
    `ActorCriticPolicy`.
    """

    _legs_order: torch.Tensor

    def __init__(self, *arguments: Any, mirror: Mirror, **keywords: Any) -> None:
        self.mirror = mirror  # before the layers, which are built in there
        super().__init__(*arguments, **keywords)

    def _build(self, lr_schedule: Schedule) -> None:
        """Create network and optimizer: action layer and log std have the width of one leg's actions."""
        self.action_dist = DiagGaussianDistribution(len(self.mirror.action_index) // 2)
        self.register_buffer("_legs_order", torch.from_numpy(self.mirror.legs_order), persistent=False)
        super()._build(lr_schedule)

    def _build_mlp_extractor(self) -> None:
        """Create the hidden layers of actor and critic, which see an observation and its mirror image."""
        self.mlp_extractor = _BothImages(
            self.features_dim,
            net_arch=self.net_arch,
            activation_fn=self.activation_fn,
            device=self.device,
            mirror=self.mirror,
        )

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        """Return the distribution of N rows of A actions, those of both legs in the environment's order.

        `latent_pi` (N, 2, H) is the actor's last hidden layer, of H units, for the observation and for its image.
        """
        mean = self.action_net(latent_pi).flatten(-2)[..., self._legs_order]
        assert isinstance(self.action_dist, DiagGaussianDistribution)
        return self.action_dist.proba_distribution(mean, self.log_std.repeat(2)[self._legs_order])


class _BothImages(MlpExtractor):
    """Hidden layers of actor and critic, on an observation and on its mirror image."""

    _index: torch.Tensor
    _sign: torch.Tensor

    def __init__(self, *arguments: Any, mirror: Mirror, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self.register_buffer("_index", torch.from_numpy(mirror.index), persistent=False)
        self.register_buffer("_sign", torch.from_numpy(mirror.sign.astype(np.float32)), persistent=False)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the actor's last hidden layer, of H units, for observations (N, D) and their images: (N, 2, H)."""
        return self.policy_net(self._with_images(features))

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return the critic's last hidden layer (N, H), of H units: the sum for observations (N, D) and images."""
        return self.value_net(self._with_images(features)).sum(-2)

    def _with_images(self, features: torch.Tensor) -> torch.Tensor:
        """Return normalised observations (N, D) with their mirror images, (N, 2, D): the image has index 1."""
        return torch.stack((features, features[..., self._index] * self._sign), -2)


class MirroredMeanStd(RunningMeanStd):
    """Running mean and variance of observations and of their mirror images: alike on both sides, to the last bit."""

    def __init__(self, mirror: Mirror) -> None:
        super().__init__(shape=mirror.index.shape)
        self._mirror = mirror

    def update(self, arr: NDArray) -> None:
        """Add the observations `arr` (N, D) and their mirror images to the running mean and variance."""
        mean = np.mean(arr, axis=0)
        variance = np.var(arr, axis=0)
        image = self._mirror.of(mean)
        # Mean and variance of both halves together; sums of two numbers have the same bits in either order.
        both = (mean + image) / 2
        variance = (variance + variance[self._mirror.index]) / 2 + ((mean - image) / 2) ** 2
        self.update_from_moments(both, variance, 2 * len(arr))
