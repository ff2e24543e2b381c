"""Add the README of the package index, where no file of the repository lies beside it, to pyproject.toml."""

import re
import tomllib
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).parent
LINK = re.compile(r"(!?)\[([^\]]+)\]\((?!https://)([^)]+)\)")
"""A picture or a link to a file of the repository: mark, text, path."""


def index_page(source: str | None, version: str) -> str:
    """Return the README with links made absolute by the repository's address `source`; with None links become plain
    text.

    A release links to its tag, any other version to the newest commit, addressed as GitHub and GitLab do.
    """
    commit = "HEAD" if "dev" in version else f"v{version}"

    def absolute(link: re.Match[str]) -> str:
        mark, text, path = link.groups()
        if source is None:
            return f"*{text}*" if mark else text
        return f"{mark}[{text}]({source}/{'raw' if mark else 'blob'}/{commit}/{path})"

    return LINK.sub(absolute, (HERE / "README.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    project = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    package = (HERE / "package" / "__init__.py").read_text(encoding="utf-8")  # read, not run: it imports Gymnasium
    version = re.findall(r'^__version__ = "(.+)"$', package, re.MULTILINE)[0]
    setup(
        long_description=index_page(project.get("urls", {}).get("Source"), version),
        long_description_content_type="text/markdown",
    )
