"""PPO in one file, as CleanRL writes it: torch and Gymnasium's vector wrappers around `gym.make_vec`.

python examples/learners/cleanrl_ppo.py --out cleanrl.safetensors     (tried with gymnasium 1.4.0, torch 2.13.0)
"""

import gymnasium as gym
from gymnasium.wrappers.vector import NormalizeObservation, TransformReward

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    import torch
    import tyro
    from torch import nn
    from torch.distributions import Normal

    from springfoot.agents import policy_from_mlp, save_policy

TASK = {"episode_seconds": 10.0, "push_newton": 150.0}
ENVS, STEPS, GAMMA = 64, 32, 0.98


def main(out: str = "cleanrl.safetensors", timesteps: int = 131_072, seed: int = 0) -> None:
    """Train, and write the mean action as a policy file."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    seen = NormalizeObservation(gym.make_vec("springfoot.envs:SegmentedFootBiped-v0", num_envs=ENVS, **TASK))
    envs = TransformReward(seen, lambda reward: 0.02 * reward)  # per second: values of a few units
    actor = nn.Sequential(nn.Linear(43, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 4))
    critic = nn.Sequential(nn.Linear(43, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1))
    nn.init.normal_(actor[-1].weight, std=0.001), nn.init.zeros_(actor[-1].bias)  # mean action 0: mid-range stiffness
    log_std = nn.Parameter(torch.full((4,), -0.9))
    parameters = [*actor.parameters(), *critic.parameters(), log_std]
    adam = torch.optim.Adam(parameters, lr=1e-3, eps=1e-5)
    now, over = torch.as_tensor(envs.reset(seed=seed)[0]), torch.zeros(ENVS, dtype=torch.bool)
    for _ in range(timesteps // (ENVS * STEPS)):
        rows = []
        for _ in range(STEPS):
            with torch.no_grad():
                action = (noise := Normal(actor(now), log_std.exp())).sample()
            observation, *step = (torch.as_tensor(each) for each in envs.step(action.numpy())[:4])
            rows.append((now, action, noise.log_prob(action).sum(-1), *step, ~over))  # after an end a step only resets
            now, over = observation, step[1] | step[2]
        seens, actions, log_probs, rewards, fell, late, real = map(torch.stack, zip(*rows, strict=True))
        with torch.no_grad():
            values = critic(torch.cat([seens, now[None]]))[..., 0]
        advantages, later = rewards + GAMMA * values[1:] * ~fell - values[:-1], torch.zeros(ENVS)
        for t in reversed(range(STEPS)):
            advantages[t] = later = advantages[t] + GAMMA * 0.95 * ~(fell | late)[t] * later
        data = [each[real] for each in (seens, actions, log_probs, advantages, advantages + values[:-1])]
        for part in (part for _ in range(8) for part in torch.randperm(len(data[0])).chunk(8)):
            x, action, log_prob, gain, target = (each[part] for each in data)
            ratio = (Normal(actor(x), log_std.exp()).log_prob(action).sum(-1) - log_prob).exp()
            gain = (gain - gain.mean()) / (gain.std() + 1e-8)
            loss = 0.5 * (critic(x)[:, 0] - target).square().mean()
            loss = loss - torch.min(ratio * gain, ratio.clamp(0.8, 1.2) * gain).mean()
            adam.zero_grad(), loss.backward(), nn.utils.clip_grad_norm_(parameters, 0.5), adam.step()
    layers = [(layer.weight, layer.bias) for layer in actor[::2]]
    norm = {"observation_mean": seen.obs_rms.mean, "observation_variance": seen.obs_rms.var}
    save_policy(out, policy_from_mlp(layers, TASK, activation="tanh", **norm))


if __name__ == "__main__":
    tyro.cli(main)
