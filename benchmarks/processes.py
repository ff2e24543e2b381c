"""Processes of a benchmark, each with its children in a group of its own, so that a stop ends them all."""

import os
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from types import MappingProxyType
from typing import TypeVar

Given = TypeVar("Given")
Answer = TypeVar("Answer")
NONE: Mapping[str, str] = MappingProxyType({})
"""No environment variables besides those of this process."""


@dataclass(frozen=True, kw_only=True)
class Ended:
    """A process that ended."""

    code: int
    """Exit code, -N where signal N ended it."""
    output: str
    timed_out: bool


class Processes:
    """Processes that run now, each with its children in a group of its own, so that a stop ends them all."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._running: set[int] = set()
        self._stopped = False

    def run(
        self, words: Sequence[str | Path], folder: Path, limit: float | None = None, variables: Mapping[str, str] = NONE
    ) -> Ended:
        """Run a command to its end, or for `limit` seconds."""
        environment = {"OMP_NUM_THREADS": "1", **os.environ, **variables}
        environment.pop("PYTHONPATH", None)  # the copy's own packages, and no others
        timed_out = False
        with tempfile.TemporaryFile() as output:
            with self._lock:
                if self._stopped:
                    raise KeyboardInterrupt
                process = subprocess.Popen(
                    words,
                    cwd=folder,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
                self._running.add(process.pid)
            try:
                process.wait(limit)
            except subprocess.TimeoutExpired:
                timed_out = True
            finally:
                with self._lock:
                    self._end(process.pid)  # children that outlive a process, too
                    self._running.discard(process.pid)
            process.wait()
            if self._stopped:
                raise KeyboardInterrupt
            output.seek(0)
            text = output.read().decode(errors="replace")
        return Ended(code=process.returncode, output=text, timed_out=timed_out)

    def in_parallel(self, function: Callable[[Given], Answer], given: Sequence[Given], jobs: int) -> Iterator[Answer]:
        """Yield the answers as they come; a stop or an error ends the processes that work on the others."""
        with ThreadPoolExecutor(jobs) as pool:
            try:
                for done in as_completed([pool.submit(function, each) for each in given]):
                    yield done.result()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                self.stop()
                raise

    def stop(self) -> None:
        """End all that run, and start no more."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                self._end(process)

    @staticmethod
    def _end(process: int) -> None:
        with suppress(ProcessLookupError):
            os.killpg(process, signal.SIGKILL)
