"""Many walks at once: a batch in which every body has another ankle stiffness.

python examples/many_walks.py --num 16
"""

import argparse

import gymnasium as gym
import numpy as np


def main() -> None:
    """Walk them all from the same phase, and print how far each one comes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--num", type=int, default=16, help="bodies, from the softest ankle to the stiffest")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of the episodes")
    parser.add_argument("--push-newton", type=float, default=0.0, help="pushes on the trunk")
    args = parser.parse_args()

    envs = gym.make_vec(
        "springfoot.envs:SegmentedFootBiped-v0",
        num_envs=args.num,
        num_threads=2,  # any number gives the same bits
        episode_seconds=args.seconds,
        push_newton=args.push_newton,
        start=0.2,
    )
    actions = np.zeros((args.num, 4), np.float32)  # toes: the middle of their range, 31.6 N m/rad
    actions[:, [0, 2]] = np.linspace(-1, 1, args.num)[:, None]  # ankles: 20 to 800 N m/rad on a log scale

    envs.reset(seed=0)
    walking = np.ones(args.num, bool)
    seconds, distance = np.zeros(args.num), np.zeros(args.num)
    while walking.any():  # a fallen body is put back and walks on, but no longer counts
        _, _, terminated, truncated, info = envs.step(actions)
        seconds[walking] = info["time"][walking]
        distance[walking] += 0.02 * info["speed"][walking]
        walking &= ~(terminated | truncated)
    print("ankle N m/rad   walked s   mean speed m/s")
    for stiffness, time, metres in zip(20 * 40 ** ((actions[:, 0] + 1) / 2), seconds, distance, strict=True):
        print(f"{stiffness:13.0f} {time:10.2f} {metres / time:16.2f}")
    envs.close()


if __name__ == "__main__":
    main()
