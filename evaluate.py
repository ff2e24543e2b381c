"""Evaluate a policy: `python evaluate.py pretrained`, `python evaluate.py runs/walk --episodes 100`."""

import sys

from springfoot.evaluation.evaluate_command import evaluate_main

if __name__ == "__main__":
    sys.exit(evaluate_main())
