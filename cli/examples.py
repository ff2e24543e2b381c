"""Copy the examples out of the package: `springfoot examples`."""

import shutil
from ast import get_docstring, parse
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated

import tyro

from springfoot.command_line import exit_code
from springfoot.command_line import parse as parse_flags
from springfoot.errors import SpringfootError
from springfoot.files.json_file import read_object
from springfoot.files.text_table import read_bytes
from springfoot.files.writing import is_taken, whole_folder


@dataclass(frozen=True, kw_only=True)
class ExamplesFlags:
    """List the programs to start from, learners/ for other libraries, or copy them."""

    copy: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER", help_behavior_hint="(default: only list them)")] = None
    """New folder for the copies."""


def examples_main(arguments: Sequence[str], program: str = "springfoot examples") -> int:
    """List or copy the examples; return 0, and 2 for bad input."""
    flags = parse_flags(ExamplesFlags, arguments, program)
    return exit_code(program, lambda: run_examples(flags))


def run_examples(flags: ExamplesFlags) -> None:
    """Copy the examples if a folder is given; print the path of each copy, or its name in it, and its first line."""
    source = Path(str(resources.files("springfoot.examples")))
    files = (path for ending in ("py", "ipynb") for path in source.rglob(f"*.{ending}"))
    programs = [path for path in sorted(files) if path.name != "__init__.py"]
    if flags.copy is not None:
        if is_taken(flags.copy):
            raise SpringfootError(f"{flags.copy} exists already; give --copy a new folder")
        with whole_folder(flags.copy, flags.copy) as (folder, _):
            for path in (*programs, *source.rglob("*.txt")):  # texts name the packages that they need
                copied = folder / path.relative_to(source)
                copied.parent.mkdir(exist_ok=True)
                shutil.copyfile(path, copied)
    for path in programs:
        print(f"{(flags.copy or Path()) / path.relative_to(source)}: {_first_line(path)}")
    if flags.copy is None:
        print("\nspringfoot examples --copy FOLDER copies them into a new folder.")


def _first_line(path: Path) -> str:
    """Return the first line of a program's docstring, or the title of a notebook."""
    if path.suffix == ".ipynb":
        first_cell = read_object(path, "notebook")["cells"][0]
        return first_cell["source"][0].strip("# \n")  # a Markdown heading
    return (get_docstring(parse(read_bytes(path))) or "").partition("\n")[0]
