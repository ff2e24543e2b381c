"""TorchRL's PPO, on the whole batch by one collector, or on one environment by `GymEnv` or `GymWrapper`.

python examples/learners/torchrl_ppo.py --out torchrl.safetensors     (tried with torchrl 0.14.1, tensordict 0.14.3)
"""

from typing import Literal

import gymnasium as gym

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import torch
    import tyro
    from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
    from torch import nn
    from torchrl.collectors import Collector
    from torchrl.envs import Compose, GymEnv, GymWrapper, RewardScaling, TransformedEnv, VecNormV2
    from torchrl.modules import IndependentNormal, ProbabilisticActor, ValueOperator
    from torchrl.objectives import ClipPPOLoss
    from torchrl.objectives.value import GAE

    from springfoot.agents import policy_from_mlp, save_policy

ID, TASK = "springfoot.envs:SegmentedFootBiped-v0", {"episode_seconds": 10.0, "push_newton": 150.0}
Face = Literal["vector", "GymEnv", "GymWrapper"]


def main(out: str = "torchrl.safetensors", face: Face = "vector", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write the mean action as a policy file."""
    torch.set_num_threads(1), torch.manual_seed(seed)
    faces = {
        "vector": lambda: GymWrapper(gym.make_vec(ID, num_envs=64, autoreset_mode="Disabled", **TASK)),
        "GymEnv": lambda: GymEnv(ID, **TASK).auto_register_info_dict(),
        "GymWrapper": lambda: GymWrapper(gym.make(ID, **TASK)),
    }
    norm = VecNormV2(in_keys=["observation"], decay=1.0, reduce_batch_dims=face == "vector")
    env = TransformedEnv(faces[face](), Compose(RewardScaling(0.0, 0.02), norm))
    env.set_seed(seed)
    env.reset()
    mean = nn.Sequential(nn.Linear(43, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 4))
    value = nn.Sequential(nn.Linear(43, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1))
    nn.init.normal_(mean[-1].weight, std=0.001), nn.init.zeros_(mean[-1].bias)
    noise = AddStateIndependentNormalScale(4)
    nn.init.constant_(noise.state_independent_scale, -0.9)
    module = TensorDictModule(nn.Sequential(mean, noise), ["observation"], ["loc", "scale"])
    actor = ProbabilisticActor(module, ["loc", "scale"], distribution_class=IndependentNormal, return_log_prob=True)
    advantage = GAE(gamma=0.98, lmbda=0.95, value_network=(critic := ValueOperator(value, in_keys=["observation"])))
    details = {"entropy_bonus": False, "critic_coeff": 0.5, "loss_critic_type": "l2", "normalize_advantage": True}
    ppo = ClipPPOLoss(actor, critic, **details)
    adam = torch.optim.Adam(ppo.parameters(), lr=1e-3)
    for data in Collector(env, actor, frames_per_batch=2048, total_frames=timesteps) if timesteps else ():
        data = advantage(data).reshape(-1).detach()
        for part in (part for _ in range(8) for part in torch.randperm(len(data)).chunk(8)):
            loss = ppo(data[part])
            adam.zero_grad(), (loss["loss_objective"] + loss["loss_critic"]).backward()
            nn.utils.clip_grad_norm_(ppo.parameters(), 0.5), adam.step()
    seen = {"observation_mean": norm.loc["observation"], "observation_variance": norm.scale["observation"] ** 2}
    layers = [(layer.weight, layer.bias) for layer in mean[::2]]
    save_policy(out, policy_from_mlp(layers, TASK, activation="tanh", variance_floor=0.0, **seen))


if __name__ == "__main__":
    tyro.cli(main)
