"""Count the seconds of a study's stages over all its runs."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

from springfoot.errors import require_number
from springfoot.files.json_file import read_object
from springfoot.files.writing import write_atomically


class StageSeconds:
    """Wall time of each stage [s], kept in the JSON file `path`, so that a stopped study adds to it.

    Raises `SpringfootError` for a file of another kind.
    """

    def __init__(self, path: Path):
        self._path = path
        self.seconds: dict[str, float] = read_object(path, "file of seconds") if path.exists() else {}
        """Name of a stage -> its seconds so far, in the order in which stages began."""
        for name, seconds in self.seconds.items():
            require_number(f"{path}: seconds of {name!r}", seconds, 0)

    @contextmanager
    def of(self, stage: str) -> Iterator[Callable[[object], None]]:
        """Count the time of a `with` block for `stage`, also if it ends by a stop; yield a function that keeps the time
        so far.

        A process that is killed loses the time since that function was last called, and no more.
        """
        before = self.seconds.get(stage, 0.0)
        began = monotonic()

        def keep(_: object = None) -> None:
            """Write the time so far into the file."""
            self.seconds[stage] = before + monotonic() - began
            write_atomically(self._path, (json.dumps(self.seconds, indent=1) + "\n").encode())

        try:
            yield keep
        finally:
            keep()
