"""Train a policy (`python train.py --out runs/walk`) or go on with a run (`python train.py --resume runs/walk`)."""

import sys

from springfoot.agents.train_command import train_main
from springfoot.terminal import at_terminal

if __name__ == "__main__":
    sys.exit(at_terminal(train_main))
