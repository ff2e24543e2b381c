"""Define an actor and critic that treat left and right alike: one network on the world and on its mirror image.

z: normalised observation, z': that of the mirrored world. The actor gives f(z) to the left leg's actions and f(z') to
their images of the right leg; the critic values g(z) + g(z'), so that a state and its image are worth the same.
"""

from concurrent.futures import ThreadPoolExecutor
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

    It needs observations normalised alike on both sides, as by `MirroredMeanStd`. With `side_by_side`, actor and critic
    compute on two threads, with the same bits. All other arguments are those of `ActorCriticPolicy`.
    """

    _legs_order: torch.Tensor

    def __init__(self, *arguments: Any, mirror: Mirror, side_by_side: bool = False, **keywords: Any) -> None:
        self.mirror = mirror  # before the layers, which are built in there
        self._side_by_side = side_by_side
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
            side_by_side=self._side_by_side,
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

    def __init__(self, *arguments: Any, mirror: Mirror, side_by_side: bool, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self.register_buffer("_index", torch.from_numpy(mirror.index), persistent=False)
        self.register_buffer("_sign", torch.from_numpy(mirror.sign.astype(np.float32)), persistent=False)
        self._second_thread = ThreadPoolExecutor(1) if side_by_side else None

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the last hidden layers, of H units, of the actor (N, 2, H) and the critic (N, H) for observations (N,
        D)."""
        images = self._with_images(features)
        if self._second_thread:
            actor, critic = _SideBySide.apply(
                images, self.policy_net, self.value_net, self._second_thread, *self.parameters()
            )
        else:
            actor, critic = self.policy_net(images), self.value_net(images)
        return actor, torch.add(*critic.unbind(-2))  # several times as fast as a sum over an axis of two

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the actor's last hidden layer, of H units, for observations (N, D) and their images: (N, 2, H)."""
        return self.policy_net(self._with_images(features))

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return the critic's last hidden layer (N, H), of H units: the sum for observations (N, D) and images."""
        return torch.add(*self.value_net(self._with_images(features)).unbind(-2))

    def _with_images(self, features: torch.Tensor) -> torch.Tensor:
        """Return normalised observations (N, D) with their mirror images, (N, 2, D): the image has index 1."""
        return torch.stack((features, features.index_select(-1, self._index) * self._sign), -2)


class _SideBySide(torch.autograd.Function):
    """Two networks on the same input, each forward and backward on its own thread; torch alone goes backward through
    both on one. The bits are the same."""

    @staticmethod
    def forward(
        ctx: Any,
        given: torch.Tensor,
        one: torch.nn.Module,
        other: torch.nn.Module,
        second_thread: ThreadPoolExecutor,
        *parameters: torch.Tensor,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the outputs of both networks for the input `given`; `parameters` are those of `one`, then of
        `other`."""

        def output_of(network: torch.nn.Module) -> torch.Tensor:
            with torch.enable_grad():
                return network(given)

        later = second_thread.submit(output_of, other)
        ctx.outputs = output_of(one), later.result()
        ctx.second_thread = second_thread
        ctx.parameters = [list(network.parameters()) for network in (one, other)]
        return ctx.outputs[0].detach(), ctx.outputs[1].detach()

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        """Return the gradients of the parameters from those of the outputs; None where a network does not learn."""

        def gradients_of(network: int) -> tuple[torch.Tensor | None, ...]:
            output, parameters = ctx.outputs[network], ctx.parameters[network]
            if not output.requires_grad:
                return (None,) * len(parameters)
            return torch.autograd.grad(output, parameters, gradients[network])

        later = ctx.second_thread.submit(gradients_of, 1)
        return None, None, None, None, *gradients_of(0), *later.result()


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
