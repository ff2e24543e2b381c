"""Train a policy (`python train.py --out runs/walk`) or go on with a run (`python train.py --resume runs/walk`)."""

import sys

from springfoot.extras import exiting_if_missing
from springfoot.terminal import at_terminal


def main() -> int:
    """Train; Ctrl-C and SIGTERM end it even while its imports run."""
    with exiting_if_missing():
        from springfoot.cli.train import train_main

        return train_main()


if __name__ == "__main__":
    sys.exit(at_terminal(main))
