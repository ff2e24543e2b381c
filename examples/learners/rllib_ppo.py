"""RLlib's PPO; `gym_env_vectorize_mode="vector_entry_point"` makes it step one batch, not a list of environments.

python examples/learners/rllib_ppo.py --out rllib.safetensors     (tried with ray 2.60.0, which wants gymnasium 1.2.2)
"""

import gymnasium as gym
import ray
import torch
import tyro
from gymnasium.wrappers.vector import NormalizeObservation, TransformReward
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.algorithms.ppo.torch.default_ppo_torch_rl_module import DefaultPPOTorchRLModule
from ray.rllib.core.rl_module import RLModuleSpec
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.tune.registry import register_env
from torch import nn

from springfoot.agents import policy_from_mlp, save_policy

ID, TASK = "springfoot.envs:SegmentedFootBiped-v0", {"episode_seconds": 10.0, "push_newton": 150.0}


def _batch(config: dict) -> gym.vector.VectorEnv:
    """Make the environment that RLlib steps: `config` is TASK and the number of environments."""
    return TransformReward(NormalizeObservation(gym.make_vec(ID, **config)), lambda reward: 0.02 * reward)


class _Module(DefaultPPOTorchRLModule):
    def setup(self) -> None:
        super().setup()
        head = self.pi.net.mlp[-1]
        nn.init.normal_(head.weight, std=0.001), nn.init.zeros_(head.bias), nn.init.constant_(self.pi.log_std, -0.9)


def main(out: str = "rllib.safetensors", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write the mean action as a policy file."""
    torch.set_num_threads(1)
    register_env("batch", _batch)
    ray.init(num_cpus=1, include_dashboard=False, logging_level="ERROR")
    network = DefaultModelConfig(fcnet_hiddens=[64, 64], vf_share_layers=False, free_log_std=True)
    ppo = PPOConfig().environment("batch", env_config=TASK).debugging(seed=seed)
    ppo.env_runners(num_env_runners=0, num_envs_per_env_runner=64, gym_env_vectorize_mode="vector_entry_point")
    ppo.rl_module(rl_module_spec=RLModuleSpec(module_class=_Module, model_config=network))
    ppo.training(train_batch_size_per_learner=2048, minibatch_size=256, num_epochs=8, lr=1e-3, gamma=0.98, lambda_=0.95)
    ppo.training(clip_param=0.2, use_kl_loss=False, vf_loss_coeff=0.5, vf_clip_param=100.0, grad_clip=0.5)
    algorithm = ppo.build_algo()
    for _ in range(timesteps // 2048):
        algorithm.train()
    module, seen = algorithm.get_module(), algorithm.env_runner.env.env.env.obs_rms
    norm = {"observation_mean": seen.mean, "observation_variance": seen.var}
    layers = [
        (layer.weight, layer.bias) for layer in [*module.encoder.actor_encoder.net.mlp[::2], module.pi.net.mlp[-1]]
    ]
    save_policy(out, policy_from_mlp(layers, TASK, activation="tanh", **norm))
    algorithm.stop()
    ray.shutdown()


if __name__ == "__main__":
    tyro.cli(main)
