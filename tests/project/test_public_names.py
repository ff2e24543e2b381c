"""Each room hands out its public names, and readers need no other import."""

import ast
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = ("gait", "envs", "agents", "evaluation", "studies")
PUBLIC = {f"springfoot.{room}": import_module(f"springfoot.{room}") for room in ROOMS}
FOR_EXAMPLES = {"springfoot.extras": {"exiting_if_missing"}}
"""Names of modules that are no rooms, for programs that need an extra."""


@pytest.mark.parametrize("room", PUBLIC)
def test_every_public_name_is_there(room):
    module = PUBLIC[room]
    assert module.__doc__ and len(set(module.__all__)) == len(module.__all__)
    assert all(getattr(module, name) is not None for name in module.__all__)
    with pytest.raises(AttributeError, match=f"module '{room}' has no attribute 'nothing'"):
        module.nothing  # noqa: B018


def test_a_name_means_one_thing_in_every_room():
    meanings: dict[str, set[int]] = {}
    for module in PUBLIC.values():
        for name in module.__all__:
            meanings.setdefault(name, set()).add(id(getattr(module, name)))
    assert not [name for name, things in meanings.items() if len(things) > 1]


def test_no_public_name_hides_a_module_beside_it():
    for folder in (path.parent for room in ROOMS for path in (ROOT / room).rglob("__init__.py")):
        package = import_module("springfoot." + ".".join(folder.relative_to(ROOT).parts))
        modules = {path.stem for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()}
        assert modules.isdisjoint(getattr(package, "__all__", ())), folder


def sources():
    """What readers copy: the examples, and the Python blocks of the pages."""
    for path in sorted((ROOT / "examples").glob("*.py")):
        yield path.name, path.read_text(encoding="utf-8")
    for page in sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]):
        blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
        if blocks:
            yield str(page.relative_to(ROOT)), "\n".join(blocks)


@pytest.mark.parametrize(("name", "code"), [pytest.param(*source, id=source[0]) for source in sources()])
def test_readers_import_from_rooms_only(name, code):
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("springfoot"):
            assert node.module in {*PUBLIC, *FOR_EXAMPLES}, f"{name}: {node.module}"
            known = FOR_EXAMPLES.get(node.module) or set(PUBLIC[node.module].__all__)
            assert {alias.name for alias in node.names} <= known, name
        elif isinstance(node, ast.Import):
            ours = {alias.name for alias in node.names if alias.name.startswith("springfoot")}
            assert ours <= {"springfoot", *PUBLIC}, f"{name}: {ours}"


LIGHT = [
    ("import springfoot.cli.score", {"matplotlib", "mujoco", "numba", "torch"}),
    (
        "import springfoot.cli.train, springfoot.cli.evaluate, springfoot.cli.export, springfoot.cli.live",
        {"mujoco", "numba", "torch"},
    ),
    ("from springfoot.agents import TrainingConfig; from springfoot.envs import BipedSettings", {"mujoco", "numba"}),
    ("from springfoot.evaluation import measure, policy_and_settings, record", {"matplotlib", "PIL", "torch"}),
    (
        "from springfoot.agents import baseline, load_policy; load_policy('pretrained')",
        {"stable_baselines3", "torch"},
    ),
    ("from springfoot.cli.main import STUDIES, study_class; [study_class(name) for name in STUDIES]", {"torch"}),
]
"""Programs and the packages that none of them imports, the lightest first: one process runs them all, so that what one
imports counts for those below it too."""


@pytest.mark.slow
def test_a_light_name_imports_nothing_heavy():
    told = "print(*{name.partition('.')[0] for name in sys.modules})"
    code = "import sys\n" + "".join(f"{program}\n{told}\n" for program, _ in LIGHT)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    imported = [set(line.split()) for line in done.stdout.splitlines()]
    assert [program for (program, absent), names in zip(LIGHT, imported, strict=True) if absent & names] == []
