"""Let `python -m springfoot` be the command `springfoot`."""

import sys

from springfoot.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
