"""The stiffness schedule of a policy over the stride, with the equilibrium and the moment it belongs to.

    python examples/plot_schedule.py pretrained --out schedule.png

Needs no torch: a policy file is read and run with NumPy.
"""

import argparse

from springfoot.extras import exiting_if_missing
from springfoot.gait import PERCENT

with exiting_if_missing():
    from matplotlib.figure import Figure

    from springfoot.evaluation import measure, policy_and_settings, record

ROWS = {
    "stiffness\nN·m/rad": ("ankle_stiffness_Nm_per_rad", "toe_stiffness_Nm_per_rad"),
    "equilibrium\n° dorsiflexion": ("ankle_equilibrium_deg", "mtp_equilibrium_deg"),
    "moment\nN·m/kg": ("ankle_moment_Nm_per_kg", "mtp_moment_Nm_per_kg"),
}


def main() -> None:
    """Record, measure, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("policy", nargs="?", default="pretrained", help="a file, a run folder, or a name")
    parser.add_argument("--episodes", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--out", default="schedule.png")
    args = parser.parse_args()

    policy, settings = policy_and_settings(args.policy, {"episode_seconds": args.seconds})
    gait = measure(record(policy, settings, name=args.policy, episodes=args.episodes))

    figure = Figure(figsize=(8, 7), layout="constrained")
    axes = figure.subplots(len(ROWS), 2, sharex=True)
    for row, (label, curves) in zip(axes, ROWS.items(), strict=True):
        row[0].set_ylabel(label)
        for panel, curve in zip(row, curves, strict=True):
            mean, sd = gait.both.mean(curve), gait.both.sd(curve)
            panel.plot(PERCENT, mean)
            panel.fill_between(PERCENT, mean - sd, mean + sd, alpha=0.3, linewidth=0)
            panel.axvline(gait.metrics["toe_off_percent"], color="grey", linestyle=":")
    for panel, joint in zip(axes[0], ("ankle", "toe"), strict=True):
        panel.set_title(f"{joint}, mean ± SD over {gait.both.count} strides")
    for panel in axes[-1]:
        panel.set_xlabel("% of stride (dotted: toe-off)")
    figure.savefig(args.out, dpi=120)
    print(f"{args.out}: {gait.metrics['falls']} of {args.episodes} fell")


if __name__ == "__main__":
    main()
