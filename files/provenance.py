"""Tell the origin of a result: versions of packages, and the commit."""

import platform
import subprocess
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any


def versions_and_commit(packages: Iterable[str]) -> dict[str, Any]:
    """Return entries for a result's record: the versions of Python and `packages`, and the git commit.

    The commit, and whether files differ from it, are None outside a clone of the project.
    """

    def git(*words: str) -> str | None:
        """Return the output of a git command in this folder; None if it fails, as without git or outside a clone."""
        command = ["git", "-C", str(Path(__file__).parent), *words]
        try:
            return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
        except (OSError, subprocess.CalledProcessError):
            return None

    # An installed copy may lie in somebody else's repository: there git does not track this file.
    in_clone = git("ls-files", "--error-unmatch", Path(__file__).name) is not None
    return {
        "commit": git("rev-parse", "HEAD") if in_clone else None,
        "modified": bool(git("status", "--porcelain", "--untracked-files=no")) if in_clone else None,
        "versions": {"python": platform.python_version()} | {name: version(name) for name in packages},
    }
