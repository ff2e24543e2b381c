"""Copies of the repository that run its tests."""

import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks import executed_lines
from benchmarks.processes import NONE, Ended, Processes


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
