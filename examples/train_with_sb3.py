"""Training by hand: stable-baselines3's PPO on the batched environment, without train.py.

python examples/train_with_sb3.py --timesteps 1000000
"""

import argparse
from typing import cast

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from springfoot.agents import SegmentedFootBipedVecEnv
from springfoot.envs import TERMINATIONS


def main() -> None:
    """Train, then walk one episode with the mean action."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--timesteps", type=int, default=1_000_000)
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=128, help="of each environment between two updates")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of the episodes")
    args = parser.parse_args()

    batch = SegmentedFootBipedVecEnv(args.num_envs, num_threads=2, episode_seconds=args.seconds, push_newton=150.0)
    envs = VecNormalize(batch, norm_reward=True, gamma=0.98)
    ppo = PPO(
        "MlpPolicy",
        envs,
        n_steps=args.steps,
        batch_size=args.num_envs * args.steps // 8,
        n_epochs=8,
        gamma=0.98,
        policy_kwargs={"log_std_init": -0.7},  # gentle noise: a walker that falls at once learns little
        seed=0,
        device="cpu",
    )
    ppo.learn(args.timesteps)

    walk = SegmentedFootBipedVecEnv(1, episode_seconds=args.seconds)
    walk.seed(0)
    observation, done = walk.reset(), np.array([False])
    infos: list[dict] = []
    while not done[0]:
        action, _ = ppo.predict(envs.normalize_obs(cast(np.ndarray, observation)), deterministic=True)
        observation, _, done, infos = walk.step(action)
    episode, reason = infos[0]["episode"], TERMINATIONS[infos[0]["termination"]]
    print(f"walked {0.02 * episode['l']:.2f} s, return {episode['r']:.1f}, {reason or 'no fall'}")


if __name__ == "__main__":
    main()
