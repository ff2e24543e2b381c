"""Copies of the repository that run its tests, and the processes that run in them."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from types import MappingProxyType

from benchmarks import executed_lines

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


class Checkout:
    """The repository at a commit, in a folder of its own, and a Python with it as springfoot."""

    def __init__(self, folder: Path, processes: Processes) -> None:
        self.folder = folder.resolve()
        self.repository = self.folder / "main"
        self._python = self.folder / "venv" / "bin" / "python"
        self._made = self.folder / "made"
        self._processes = processes

    def clone(self, tree: Path) -> None:
        """Become the newest commit of a repository, unless a commit of it is here already."""
        if self.repository.exists():
            return
        self._begin(tree)
        unfinished = self.folder / "unfinished"
        subprocess.run(["git", "clone", "--quiet", "--shared", tree.resolve(), unfinished], check=True)
        unfinished.rename(self.repository)

    def copy(self, other: "Checkout") -> None:
        """Become the copy of another checkout, with the kernels that are compiled in it."""
        if not self._made.exists():
            self._begin(other.repository)
        self.restore(other)

    def restore(self, other: "Checkout") -> None:
        """Make the files those of another checkout, with the times by which Python and numba know compiled files."""
        shutil.rmtree(self.repository, ignore_errors=True)
        shutil.copytree(other.repository, self.repository, symlinks=True)

    def install(self) -> None:
        """Make a Python with the packages that are installed here, and the checkout as springfoot."""
        if self._made.exists():
            return
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", self.folder / "venv"], check=True)
        (packages,) = (self.folder / "venv" / "lib").glob("python*/site-packages")
        installed = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
        shutil.copy(executed_lines.__file__, packages / "executed_lines.py")
        startup = [*installed, "import executed_lines; executed_lines.start()"]
        (packages / "installed.pth").write_text("\n".join(startup) + "\n", encoding="utf-8")
        pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-build-isolation"]
        done = self.python([*pip, "--editable", "."])
        if done.code != 0:
            raise SystemExit(f"cannot install {self.repository}:\n{done.output}")
        self._made.touch()

    def python(self, words: Sequence[str], limit: float | None = None, variables: Mapping[str, str] = NONE) -> Ended:
        """Run the checkout's Python in its root."""
        return self._processes.run([self._python, *words], self.repository, limit, variables)

    def _begin(self, tree: Path) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        shared = tree.resolve().parent / "shared"
        if shared.exists():  # measured data beside the repository, which some tests read
            (self.folder / "shared").symlink_to(shared.resolve())
