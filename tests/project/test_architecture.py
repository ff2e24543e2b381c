"""The house stays easy to see: no public name with two meanings; and no file is run by reading it."""

import ast
from collections import defaultdict
from importlib import import_module
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
ROOMS = ("files", "gait", "envs", "agents", "evaluation", "studies", "cli")
FILES = sorted(path for room in ROOMS for path in (REPOSITORY / room).rglob("*.py"))


def names_defined_in(path: Path) -> set[str]:
    """Names without a leading underscore that a module defines at its top level; imports do not define."""
    names: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names |= {part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)}
    return {name for name in names if not name.startswith("_")} - {"main"}  # what a module does as a command


def test_no_public_name_means_different_things_in_two_packages():
    rooms_of: dict[str, set[str]] = defaultdict(set)
    for path in FILES:
        for name in names_defined_in(path):
            rooms_of[name].add(path.relative_to(REPOSITORY).parts[0])
    assert {name: sorted(rooms) for name, rooms in rooms_of.items() if len(rooms) > 1} == {}


def opened_in(path: Path) -> list[str]:
    """Lines of a module that open or read a file by its path, but for resources of the package and writing."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        call = ast.unparse(node)
        name = ast.unparse(node.func)
        mode = next((each.value for each in node.args if isinstance(each, ast.Constant)), "r")
        writes = isinstance(mode, str) and set(mode) & {"w", "x", "a"}
        reads = name.endswith((".read_text", ".read_bytes", ".open")) or name in (
            "open",
            "np.load",
            "json.load",
            "ZipFile",
        )
        resource = "resources.files" in call or "folder.joinpath" in call or "BytesIO" in call
        if reads and not writes and not resource:
            found.append(f"{path.relative_to(REPOSITORY)}:{node.lineno}: {call}")
    return found


def test_files_is_the_only_room_that_opens_a_path():
    elsewhere = [line for path in FILES if path.parts[-2] != "files" for line in opened_in(path)]
    assert elsewhere == []


SOURCES = sorted(path for room in ("package", "examples", "benchmarks") for path in (REPOSITORY / room).rglob("*.py"))
SOURCES += [*FILES, *sorted(REPOSITORY.glob("*.py"))]
LOADERS = {"torch.load", "PPO.load", "VecNormalize.load"}


def test_nothing_executes_what_a_file_says():
    """Of what reads pickles, the calls that the rules S102 to S307 of ruff and the contracts do not know."""
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert ".".join(called.split(".")[-2:]) not in LOADERS, f"{path}:{node.lineno}"
                assert "allow_pickle" not in {keyword.arg for keyword in node.keywords}, f"{path}:{node.lineno}"


def test_studies_import_the_public_names_of_other_rooms_only():
    for path in sorted((REPOSITORY / "studies").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("springfoot."):
                continue
            module = node.module or ""
            room, *inside = module.split(".")[1:]
            if room in ("gait", "envs", "agents", "evaluation"):
                assert len(inside) <= 1, f"{path}:{node.lineno}: {module}"
                public = import_module(module).__all__
                assert {alias.name for alias in node.names} <= set(public), f"{path}:{node.lineno}"
