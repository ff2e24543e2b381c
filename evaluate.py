"""Evaluate a policy: `python evaluate.py pretrained`, `python evaluate.py runs/walk --episodes 100`."""

import sys

from springfoot.extras import exiting_if_missing
from springfoot.terminal import at_terminal


def main() -> int:
    """Evaluate; Ctrl-C and SIGTERM end it even while its imports run."""
    with exiting_if_missing():
        from springfoot.cli.evaluate import evaluate_main

        return evaluate_main()


if __name__ == "__main__":
    sys.exit(at_terminal(main))
