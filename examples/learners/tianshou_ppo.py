"""Tianshou's PPO on its own vector of single environments.

python examples/learners/tianshou_ppo.py --out tianshou.safetensors     (tried with tianshou 2.0.1)
"""

import gymnasium as gym
import numpy as np

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import torch
    import tyro
    from tianshou.algorithm import PPO
    from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
    from tianshou.algorithm.optim import AdamOptimizerFactory
    from tianshou.data import Collector, VectorReplayBuffer
    from tianshou.env import DummyVectorEnv, VectorEnvNormObs
    from tianshou.trainer import OnPolicyTrainerParams
    from tianshou.utils.net.common import Net
    from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic
    from torch import nn
    from torch.distributions import Independent, Normal

    from springfoot.agents import policy_from_mlp, save_policy

ID, TASK = "springfoot.envs:SegmentedFootBiped-v0", {"episode_seconds": 10.0, "push_newton": 150.0}


def main(out: str = "tianshou.safetensors", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write the mean action as a policy file."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    np.random.seed(seed)  # noqa: NPY002
    one = lambda: gym.wrappers.TransformReward(gym.make(ID, **TASK), lambda reward: 0.02 * reward)  # noqa: E731
    envs = VectorEnvNormObs(DummyVectorEnv([one] * 16))
    envs.seed(seed)
    bodies = [Net(state_shape=43, hidden_sizes=[64, 64], activation=nn.Tanh) for _ in range(2)]
    actor = ContinuousActorProbabilistic(preprocess_net=bodies[0], action_shape=4, unbounded=True)
    head = actor.mu.model[-1]
    nn.init.normal_(head.weight, std=0.001), nn.init.zeros_(head.bias)
    nn.init.constant_(actor.sigma_param, -0.9)
    policy = ProbabilisticActorPolicy(
        actor=actor,
        dist_fn=lambda output: Independent(Normal(*output), 1),
        action_space=gym.spaces.Box(-1, 1, (4,)),
    )
    critic, adam = ContinuousCritic(preprocess_net=bodies[1]), AdamOptimizerFactory(lr=1e-3)
    ppo = PPO(policy=policy, critic=critic, optim=adam, gamma=0.98, ent_coef=0.0, max_grad_norm=0.5)
    collector = Collector(ppo, envs, VectorReplayBuffer(2048, 16))
    schedule = {"collection_step_num_env_steps": 2048, "batch_size": 256, "update_step_num_repetitions": 8}
    length = {"max_epochs": 1, "epoch_num_steps": timesteps, "show_progress": False, "verbose": False}
    if timesteps:
        ppo.run_training(OnPolicyTrainerParams(training_collector=collector, **schedule, **length))
    seen = envs.get_obs_rms()
    mean, variance = np.broadcast_to(seen.mean, 43), np.broadcast_to(seen.var, 43)
    norm = {"observation_mean": mean, "observation_variance": variance, "variance_floor": seen.eps}
    layers = [(layer.weight, layer.bias) for layer in [*bodies[0].model.model[::2], head]]
    save_policy(out, policy_from_mlp(layers, TASK, activation="tanh", observation_clip=seen.clip_max, **norm))


if __name__ == "__main__":
    tyro.cli(main)
