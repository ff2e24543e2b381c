"""Define the learner: stable-baselines3's PPO on normalised observations, and its whole state as named arrays.

PPO: proximal policy optimisation (Schulman et al. 2017, arXiv 1707.06347). The state is kept as .safetensors only;
`PPO.save`, `PPO.load` and VecNormalize's own files are pickles, which run code when read, and are never used.
"""

import warnings
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from springfoot.envs.physics.timing import ACTION_STEP
from springfoot.envs.task.mirror import mirror_of
from springfoot.errors import SpringfootError

from ..policies.conversion import actor_of, ignoring_unvaried
from ..policies.number_bounds import require_bounded, require_moments
from ..policies.policy import Policy
from .config import TrainingConfig
from .mirrored_network import MirroredMeanStd, MirroredNetwork

POLICY_SAMPLES = 1_000_000.0
"""Samples that the statistics of a policy's observations stand for where training begins with it; its file does not
say; chosen."""


def _learning_rate(config: TrainingConfig, left: float) -> float:
    """Return the learning rate when the fraction `left` of a training is still to come; its last update may end beyond
    it, with a negative one."""
    left = max(left, 0.0)
    return config.learning_rate * (left + config.learning_rate_end * (1 - left))


class _CriticFirstPPO(PPO):
    """stable-baselines3's PPO; its actor and exploration stay as they are in the first `critic_steps` steps."""

    critic_steps = 0

    def train(self) -> None:
        """Learn from the rollout."""
        learns_all = self.num_timesteps >= self.critic_steps
        optimizer = self.policy.optimizer
        for name, parameter in self.policy.named_parameters():
            if "value" not in name:  # the critic's layers are `mlp_extractor.value_net` and `value_net`
                parameter.requires_grad_(learns_all)
                if not learns_all and parameter not in optimizer.state:  # as before the first step, for the checkpoints
                    optimizer.state[parameter] = {
                        "step": torch.tensor(0.0),
                        "exp_avg": torch.zeros_like(parameter),
                        "exp_avg_sq": torch.zeros_like(parameter),
                    }
        super().train()


class Learner:
    """An untrained actor and critic on a batch of environments, with stable-baselines3's PPO to train them.

    Raises `SpringfootError` for a GPU that torch does not find.

    As stable-baselines3 makes them, weights are orthogonal and biases zero; with gain 0.01 on the action layer the mean
    action begins near 0. Observations and rewards are normalised by their running statistics. If the configuration is
    `mirrored`, network and statistics come from the module `mirrored_network`; with several `threads` its actor and
    critic compute side by side on the CPU, with the same bits.
    """

    def __init__(self, config: TrainingConfig, environments: VecEnv, seed: int, threads: int = 1) -> None:
        if config.device == "cuda" and not torch.cuda.is_available():
            raise SpringfootError("device cuda needs a GPU that torch finds; there is none, give cpu")
        torch.set_num_threads(1)  # more would compete with the physics' threads, up to 200 times slower
        self._environment = config.environment
        steps_of_20ms = config.environment.step_seconds / ACTION_STEP  # gamma and lambda are per 20 ms
        gamma = config.gamma**steps_of_20ms
        gae_lambda = config.gae_lambda**steps_of_20ms
        self.normalized = VecNormalize(environments, gamma=gamma)
        self._mirror = None
        network: dict[str, Any] = {}
        if config.mirrored:
            (biped,) = environments.get_attr("biped", 0)
            self._mirror = mirror_of(biped.observation_names, biped.action_names)
            network |= {"mirror": self._mirror, "side_by_side": threads > 1 and config.device == "cpu"}
            self.normalized.obs_rms = MirroredMeanStd(self._mirror)
        self.rollout_steps = config.update_steps // config.num_envs
        samples = self.rollout_steps * config.num_envs
        with warnings.catch_warnings():  # a last minibatch that is a few samples smaller does no harm
            warnings.filterwarnings("ignore", message="You have specified a mini-batch size")
            self.ppo = _CriticFirstPPO(
                MirroredNetwork if config.mirrored else "MlpPolicy",
                self.normalized,
                learning_rate=partial(_learning_rate, config),
                n_steps=self.rollout_steps,
                batch_size=-(-samples // config.minibatches),  # rounded up
                n_epochs=config.epochs,
                gamma=gamma,
                gae_lambda=gae_lambda,
                clip_range=config.clip_range,
                policy_kwargs={
                    "net_arch": list(config.hidden),
                    "activation_fn": torch.nn.Tanh,
                    "log_std_init": config.log_std,
                    **network,
                },
                seed=seed,
                device=config.device,
            )
        self.ppo.critic_steps = config.critic_steps

    def policy(self, fingerprint: dict[str, str]) -> Policy:
        """Return a copy of the actor as a policy that acts by its mean action, with the environment's `fingerprint`.

        Entries of the observation that never varied in training are left out of the action.
        """
        layers, _, _ = actor_of(self.ppo.policy)
        of_observations = self._statistics()["observation"]
        # The weights of observations that never varied (body, commanded speed) are still their random initial ones.
        return ignoring_unvaried(
            Policy(
                settings=self._environment,
                fingerprint=fingerprint,
                weights=tuple(weight.detach().cpu().numpy().copy() for weight, _ in layers),
                biases=tuple(bias.detach().cpu().numpy().copy() for _, bias in layers),
                observation_mean=of_observations.mean.copy(),
                observation_variance=of_observations.var,
                observation_clip=self.normalized.clip_obs,
                mirror=self._mirror,
            )
        )

    def begin_with(self, policy: Policy) -> None:
        """Copy the network and the observations' statistics of `policy`; critic and exploration stay as they are.

        Raises `SpringfootError` if it has other layers, another activation or other bounds of its output and its
        observations than the actor has.
        """
        layers, activation, output = actor_of(self.ppo.policy)
        shapes = [tuple(weight.shape) for weight, _ in layers]
        own = _network_words(shapes, activation, output, self.normalized.clip_obs, self._mirror is not None)
        given = _network_words(
            [weight.shape for weight in policy.weights],
            policy.activation,
            policy.output,
            policy.observation_clip,
            policy.mirror is not None,
        )
        if own != given:
            raise SpringfootError(f"the policy to begin from has a network of {given}, this training one of {own}")
        with torch.no_grad():
            for (weight, bias), own_weight, own_bias in zip(layers, policy.weights, policy.biases, strict=True):
                weight.copy_(torch.from_numpy(own_weight))
                bias.copy_(torch.from_numpy(own_bias))
        observation = self._statistics()["observation"]
        observation.mean = policy.observation_mean.astype(np.float64)
        observation.var = policy.observation_variance.astype(np.float64)
        observation.count = POLICY_SAMPLES

    def state(self) -> dict[str, np.ndarray]:
        """Return copies of all arrays that learning changes, by name: network, Adam's moments, running statistics."""
        tensors = {f"network.{name}": value for name, value in self.ppo.policy.state_dict().items()}
        for index, moments in self.ppo.policy.optimizer.state_dict()["state"].items():
            tensors |= {f"adam.{index}.{name}": value for name, value in moments.items()}
        arrays = {name: value.detach().cpu().numpy().copy() for name, value in tensors.items()}
        for name, statistics in self._statistics().items():
            for item in ("mean", "var", "count"):
                arrays[f"{name}.{item}"] = np.array(getattr(statistics, item), dtype=np.float64)
        return arrays

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Continue from `arrays` as `state` returns them; raise `SpringfootError` if they do not fit this learner."""
        subject = "the training state"  # its name in errors
        require_bounded(subject, arrays)
        require_moments(subject, arrays, len(list(self.ppo.policy.parameters())))
        try:
            network = {name: value for name, value in arrays.items() if name.startswith("network.")}
            self.ppo.policy.load_state_dict(
                {name.removeprefix("network."): torch.from_numpy(value) for name, value in network.items()}
            )
            optimizer = self.ppo.policy.optimizer
            parameters = list(self.ppo.policy.parameters())
            moments: dict[int, dict[str, torch.Tensor]] = {}
            for name, value in arrays.items():
                if name.startswith("adam."):
                    _, index, item = name.split(".")  # adam.INDEX OF THE PARAMETER.ITEM
                    expected = () if item == "step" else tuple(parameters[int(index)].shape)
                    _require_shape(name, value, expected)
                    moments.setdefault(int(index), {})[item] = torch.from_numpy(value)
            optimizer.load_state_dict({**optimizer.state_dict(), "state": moments})
            for name, statistics in self._statistics().items():
                for item in ("mean", "var", "count"):
                    value = arrays[f"{name}.{item}"]
                    _require_shape(f"{name}.{item}", value, np.shape(getattr(statistics, item)))
                    setattr(statistics, item, value if value.shape else float(value))  # of shape (): a plain number
        except (KeyError, IndexError, ValueError, RuntimeError) as error:
            reason = " ".join(str(error).split())
            raise SpringfootError(f"{subject} does not fit its configuration: {reason}") from None

    def _statistics(self) -> dict[str, RunningMeanStd]:
        """Return the running mean and variance by name, `observation` and `return`: the learner's, not copies."""
        observation: Any = self.normalized.obs_rms  # a dictionary only for dictionary observations
        return {"observation": observation, "return": self.normalized.ret_rms}


def _network_words(
    shapes: Sequence[tuple[int, ...]], activation: str, output: str, clip: float | None, mirrored: bool
) -> str:
    """Return a network in words: the widths of the layers with weights of these `shapes`, activation, bounds of
    output and normalised observation, and whether it acts for one leg."""
    widths = " - ".join(map(str, [shapes[0][1], *(outputs for outputs, _ in shapes)]))
    bounds = f"output by {output}, observations within {'any size' if clip is None else f'{clip:g}'}"
    return f"{widths}, {activation}, {bounds}{', mirrored' if mirrored else ''}"


def _require_shape(name: str, value: np.ndarray, shape: tuple[int, ...]) -> None:
    """Raise `ValueError` unless the array `name` of a state has this shape."""
    if value.shape != shape:
        raise ValueError(f"{name} has shape {value.shape}, not {shape}")
