"""One walk, step by step: Gymnasium's loop, with ankles and toes of constant stiffness.

python examples/one_walk.py --ankle 300 --toe 40
"""

import argparse

import gymnasium as gym
import numpy as np

from springfoot.envs import TERMINATIONS


def main() -> None:
    """Walk one episode and say how it went."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--ankle", type=float, default=300.0, help="stiffness [N m/rad], 20 to 800")
    parser.add_argument("--toe", type=float, default=40.0, help="stiffness [N m/rad], 5 to 200")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of the episode")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()

    env = gym.make("springfoot.envs:SegmentedFootBiped-v0", episode_seconds=args.seconds)
    # -1 to 1 is the stiffness range on a log scale: ankle 20 to 800, toe 5 to 200 N m/rad.
    ankle = 2 * np.log(args.ankle / 20) / np.log(800 / 20) - 1
    toe = 2 * np.log(args.toe / 5) / np.log(200 / 5) - 1
    action = np.array([ankle, toe, ankle, toe], np.float32)  # ankle_left, toe_left, ankle_right, toe_right

    _, info = env.reset(seed=args.seed)
    total, work, ended = 0.0, 0.0, False
    while not ended:
        _, reward, terminated, truncated, info = env.step(action)
        total += float(reward)
        work += info["work/equilibrium/ankle_left"]
        ended = terminated or truncated
    print(f"{info['time']:.2f} s, {TERMINATIONS[info['termination']] or 'no fall'}, return {total:.1f}")
    print(f"left ankle: {info['stiffness/ankle_left']:.0f} N m/rad, {work:+.1f} J by moving its equilibrium")
    print("last step's reward terms:", {name: round(float(v), 3) for name, v in info.items() if "reward/" in name})
    env.close()


if __name__ == "__main__":
    main()
