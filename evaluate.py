"""Evaluate a policy: `python evaluate.py pretrained`, `python evaluate.py runs/walk --episodes 100`."""

import sys

from springfoot.evaluation.evaluate_command import evaluate_main
from springfoot.terminal import at_terminal

if __name__ == "__main__":
    sys.exit(at_terminal(evaluate_main))
