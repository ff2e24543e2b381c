"""PPO of skrl, tried with skrl 2.1.1: `python examples/learners/skrl_ppo.py --out skrl.safetensors`."""

import gymnasium as gym

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import torch
    import tyro
    from skrl.agents.torch.ppo import PPO
    from skrl.envs.wrappers.torch import wrap_env
    from skrl.memories.torch import RandomMemory
    from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
    from skrl.resources.preprocessors.torch import RunningStandardScaler
    from skrl.trainers.torch import SequentialTrainer
    from skrl.utils import set_seed
    from torch import nn

    from springfoot.agents import policy_from_mlp, save_policy

ID, TASK = "springfoot.envs:SegmentedFootBiped-v0", {"episode_seconds": 10.0, "push_newton": 150.0}


class _Actor(GaussianMixin, Model):
    def __init__(self, **spaces) -> None:
        Model.__init__(self, **spaces), GaussianMixin.__init__(self)
        self.net = nn.Sequential(nn.Linear(43, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 4))
        nn.init.normal_(self.net[-1].weight, std=0.001), nn.init.zeros_(self.net[-1].bias)
        self.log_std = nn.Parameter(torch.full((4,), -0.9))

    def compute(self, inputs: dict, role: str) -> tuple:
        return self.net(inputs["observations"]), {"log_std": self.log_std}


class _Critic(DeterministicMixin, Model):
    def __init__(self, **spaces) -> None:
        Model.__init__(self, **spaces), DeterministicMixin.__init__(self)
        self.net = nn.Sequential(nn.Linear(43, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1))

    def compute(self, inputs: dict, role: str) -> tuple:
        return self.net(inputs["observations"]), {}


def main(out: str = "skrl.safetensors", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write the mean action as a policy file."""
    torch.set_num_threads(1)
    set_seed(seed)
    env = wrap_env(gym.make_vec(ID, num_envs=64, **TASK), wrapper="gymnasium")
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space, "device": "cpu"}
    cfg = {"rollouts": 32, "mini_batches": 8, "learning_rate": 1e-3, "discount_factor": 0.98, "value_clip": 0.0}
    cfg |= {"experiment": {"write_interval": 0, "checkpoint_interval": 0}, "value_loss_scale": 0.5}
    cfg |= {"rewards_shaper": lambda reward, *_: 0.02 * reward, "time_limit_bootstrap": True}
    cfg |= {"observation_preprocessor": RunningStandardScaler, "observation_preprocessor_kwargs": {"size": 43}}
    models = {"policy": _Actor(**spaces), "value": _Critic(**spaces)}
    agent = PPO(models=models, memory=RandomMemory(memory_size=32, num_envs=64), cfg=cfg, **spaces)
    SequentialTrainer(env=env, agents=agent, cfg={"timesteps": timesteps // 64, "headless": True}).train()
    seen, layers = agent.checkpoint_modules["observation_preprocessor"], models["policy"].net[::2]
    norm = {"observation_mean": seen.running_mean, "observation_variance": seen.running_variance}
    layers = [(layer.weight, layer.bias) for layer in layers]
    save_policy(out, policy_from_mlp(layers, TASK, activation="tanh", observation_clip=5.0, **norm))


if __name__ == "__main__":
    tyro.cli(main)
