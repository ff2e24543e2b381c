"""Training by hand: stable-baselines3's PPO on the batched environment, to a file that is judged.

python examples/train_with_sb3.py --timesteps 1000000 --out mine.safetensors
springfoot evaluate mine.safetensors
"""

import argparse
from pathlib import Path

from springfoot.extras import exiting_if_missing

with exiting_if_missing():
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecNormalize

    from springfoot.agents import SegmentedFootBipedVecEnv, policy_from_sb3, save_policy
    from springfoot.evaluation import policy_and_settings, record


def main() -> None:
    """Train, save the policy, then walk one episode with it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--timesteps", type=int, default=1_000_000)
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=128, help="of each environment between two updates")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of the episodes")
    parser.add_argument("--out", type=Path, default=Path("mine.safetensors"))
    args = parser.parse_args()
    if args.out.exists():
        parser.error(f"{args.out} exists already; give --out a new file")

    # The preset's task: pushes of 150 N, and actions that set the stiffness itself (action_mode "absolute").
    batch = SegmentedFootBipedVecEnv(args.num_envs, num_threads=2, episode_seconds=args.seconds, push_newton=150.0)
    envs = VecNormalize(batch, norm_reward=True, gamma=0.98)
    ppo = PPO(
        "MlpPolicy",
        envs,
        n_steps=args.steps,
        batch_size=args.num_envs * args.steps // 8,
        n_epochs=8,
        gamma=0.98,
        policy_kwargs={"log_std_init": -0.9},  # gentle noise: a walker that falls at once learns little
        seed=0,
        device="cpu",
    )
    ppo.learn(args.timesteps)
    save_policy(args.out, policy_from_sb3(ppo, ignore_unvaried=True))  # with the statistics of VecNormalize

    policy, settings = policy_and_settings(str(args.out), {"episode_seconds": args.seconds})
    walk = record(policy, settings, name=args.out.stem, episodes=1)
    print(f"walked {0.01 * walk.ticks[0]:.2f} s, return {walk.returns[0]:.1f}, {walk.fall_reason[0] or 'no fall'}")
    print(f"Next: springfoot evaluate {args.out}")


if __name__ == "__main__":
    main()
