"""Tell the origin of a result: versions of packages, and the commit."""

import platform
import subprocess
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any


def source(packages: Iterable[str]) -> dict[str, Any]:
    """Return the versions of Python and `packages`, and the git commit (None outside a clone of the project)."""

    def git(*words: str) -> str | None:
        command = ["git", "-C", str(Path(__file__).parent), *words]
        try:
            return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
        except (OSError, subprocess.CalledProcessError):
            return None

    ours = git("ls-files", "--error-unmatch", Path(__file__).name) is not None
    return {
        "commit": git("rev-parse", "HEAD") if ours else None,
        "modified": bool(git("status", "--porcelain", "--untracked-files=no")) if ours else None,
        "versions": {"python": platform.python_version()} | {name: version(name) for name in packages},
    }
