"""RSL-RL's PPO: a `VecEnv` of RSL-RL's kind around `gym.make_vec`.

python examples/learners/rsl_rl_ppo.py --out rsl_rl.safetensors     (tried with rsl-rl-lib 5.5.1)
"""

import gymnasium as gym

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import torch
    import tyro
    from rsl_rl.env import VecEnv
    from rsl_rl.runners import OnPolicyRunner
    from tensordict import TensorDict
    from torch import nn

    from springfoot.agents import policy_from_mlp, save_policy

ID, TASK = "springfoot.envs:SegmentedFootBiped-v0", {"episode_seconds": 10.0, "push_newton": 150.0}


class _Batch(VecEnv):
    def __init__(self, num_envs: int, seed: int) -> None:
        self.batch = gym.make_vec(ID, num_envs=num_envs, autoreset_mode="SameStep", **TASK)
        self.num_envs, self.num_actions, self.device, self.cfg = num_envs, 4, "cpu", TASK
        self.max_episode_length, self.episode_length_buf = 500, torch.zeros(num_envs, dtype=torch.long)
        self.observation = self.batch.reset(seed=seed)[0]

    def get_observations(self) -> TensorDict:
        return TensorDict({"policy": torch.as_tensor(self.observation)}, [self.num_envs])

    def step(self, actions: torch.Tensor) -> tuple:
        self.observation, reward, terminated, truncated, _ = self.batch.step(actions.numpy())
        done = torch.as_tensor(terminated | truncated)
        self.episode_length_buf = (self.episode_length_buf + 1) * ~done
        late = {"time_outs": torch.as_tensor(truncated)}
        return self.get_observations(), 0.02 * torch.as_tensor(reward).float(), done.long(), late


def main(out: str = "rsl_rl.safetensors", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write the mean action as a policy file."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    network = {"class_name": "MLPModel", "hidden_dims": [64, 64], "activation": "tanh", "obs_normalization": True}
    noise = {"class_name": "GaussianDistribution", "init_std": 0.4, "std_type": "log"}
    ppo = {"class_name": "PPO", "num_learning_epochs": 8, "num_mini_batches": 8, "gamma": 0.98, "entropy_coef": 0.0}
    ppo |= {"learning_rate": 1e-3, "schedule": "fixed", "value_loss_coef": 0.5, "use_clipped_value_loss": False}
    config = {"num_steps_per_env": 32, "obs_groups": {"actor": ["policy"], "critic": ["policy"]}, "algorithm": ppo}
    config |= {"actor": network | {"distribution_cfg": noise}, "critic": dict(network), "save_interval": 1000}
    runner = OnPolicyRunner(_Batch(64, seed), config)
    actor, seen = runner.alg.actor, runner.alg.actor.obs_normalizer
    nn.init.normal_(actor.mlp[-1].weight, std=0.001)
    nn.init.zeros_(actor.mlp[-1].bias)
    runner.learn(timesteps // (64 * 32))
    norm = {"observation_mean": seen.mean, "observation_variance": (seen.std + seen.eps) ** 2, "variance_floor": 0.0}
    layers = [(layer.weight, layer.bias) for layer in actor.mlp if isinstance(layer, nn.Linear)]
    save_policy(out, policy_from_mlp(layers, TASK, activation="tanh", **norm))


if __name__ == "__main__":
    tyro.cli(main)
