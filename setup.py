"""Add the README of the package index to pyproject.toml, and rewrite the installed pages: neither has all files of the
repository beside it."""

import posixpath
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).parent
LINK = re.compile(r"(!?)\[([^\]]+)\]\((?!https://)([^)]+)\)")
"""A picture or a link to a file of the repository: mark, text, path."""
INSTALL = re.compile(r'pip install -e "\.(\[[^"]+\])"')
"""The command that installs a clone with extras."""
OF_A_CLONE = (" -c constraints.txt", ", in a clone")
"""Words of a command or a sentence that are true of a clone alone."""
PLACEHOLDER = "https://example.org"
"""Beginning of the repository's address as long as it has none."""


def linked(
    page: str, source: str | None, version: str, folder: str = "", stays: Callable[[str], bool] = lambda path: False
) -> str:
    """Return a page of the repository's `folder` as it is read without a clone.

    It installs the package by its name. Links are absolute by the repository's address `source`; with None they become
    plain text. Links to paths that `stays` accepts stay.

    A release links to its tag, any other version to the newest commit, addressed as GitHub and GitLab do.
    """
    commit = "HEAD" if "dev" in version else f"v{version}"

    def absolute(link: re.Match[str]) -> str:
        mark, text, path = link.groups()
        if stays(path):
            return link[0]
        if source is None:
            return f"*{text}*" if mark else text
        address = posixpath.normpath(posixpath.join(folder, path))
        return f"{mark}[{text}]({source}/{'raw' if mark else 'blob'}/{commit}/{address})"

    page = INSTALL.sub(r'pip install "springfoot\1"', page)
    for words in OF_A_CLONE:
        page = page.replace(words, "")
    return LINK.sub(absolute, page)


def index_page(source: str | None, version: str) -> str:
    """Return the README with absolute links, as `linked` says."""
    return linked((HERE / "README.md").read_text(encoding="utf-8"), source, version)


def project_source() -> str | None:
    """Return the address of the repository in pyproject.toml, None without one."""
    project = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return project.get("urls", {}).get("Source")


def package_version() -> str:
    """Return the version of the package, which is read, not run: it imports Gymnasium."""
    package = (HERE / "package" / "__init__.py").read_text(encoding="utf-8")
    return re.findall(r'^__version__ = "(.+)"$', package, re.MULTILINE)[0]


class BuildWithPages(build_py):
    """Build the package; links of its pages to pictures that it lacks lead to the repository."""

    def run(self) -> None:
        """Copy the modules and pages, and rewrite the pages."""
        super().run()
        if self.editable_mode:  # the pages are those of the repository
            return
        source = project_source()
        if source is not None and source.startswith(PLACEHOLDER):
            source = None
        package = Path(self.build_lib) / "springfoot"
        for page in (package / "docs").rglob("*.md"):

            def stays(path: str, folder: Path = page.parent) -> bool:
                return path.startswith("#") or (folder / path.partition("#")[0]).exists()

            folder = page.parent.relative_to(package).as_posix()
            text = linked(page.read_text(encoding="utf-8"), source, package_version(), folder, stays)
            page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    setup(
        cmdclass={"build_py": BuildWithPages},
        long_description=index_page(project_source(), package_version()),
        long_description_content_type="text/markdown",
    )
