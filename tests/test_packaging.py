"""The package as others get it: complete, importable floor by floor, free of pickle and of anyone's paths."""

import ast
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
ROOMS = ("gait", "envs", "agents", "evaluation", "studies")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def files(*folders):
    """Our files under `folders`, relative to the root, without caches and hidden ones."""
    found = (path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).rglob("*"))
    return sorted(
        path
        for path in found
        if (ROOT / path).is_file() and not any(part == "__pycache__" or part[0] == "." for part in path.parts)
    )


def run(code, cwd=None):
    done = subprocess.run([sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_package_folder_is_listed():
    folders = {path.parent.as_posix() for path in files(*ROOMS) if path.name == "__init__.py"}
    listed = PROJECT["tool"]["setuptools"]
    assert set(listed["package-dir"].values()) == folders
    assert set(listed["packages"]) == {"springfoot." + folder.replace("/", ".") for folder in folders}
    assert set(listed["package-dir"]) == set(listed["packages"])


def test_wheel_holds_every_file_of_the_rooms(tmp_path):
    names = {"pyproject.toml", "LICENSE", PROJECT["project"].get("readme", "LICENSE")}
    ours = files(*ROOMS)
    for path in [*map(Path, names), *ours]:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes((ROOT / path).read_bytes())
    run("from setuptools import build_meta; build_meta.build_wheel('.')", cwd=tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    packed = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert packed == {f"springfoot/{path.as_posix()}" for path in ours}


def test_installed_version_is_this_one():
    assert version("springfoot") == PROJECT["project"]["version"]


def test_constraints_pin_every_requirement_inside_its_range():
    lines = re.findall(r"^([\w.-]+)==([\w.]+)", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    pins = {canonicalize_name(name): pin for name, pin in lines}
    assert len(pins) == len(lines)
    extras = PROJECT["project"]["optional-dependencies"].values()
    for line in [*PROJECT["project"]["dependencies"], *(line for extra in extras for line in extra)]:
        requirement = Requirement(line)
        if requirement.name == PROJECT["project"]["name"]:  # an extra that includes another
            assert requirement.extras <= set(PROJECT["project"]["optional-dependencies"])
            continue
        assert pins[canonicalize_name(requirement.name)] in requirement.specifier, line


@pytest.mark.parametrize(
    ("room", "absent"),
    [
        ("gait", {"gymnasium", "matplotlib", "mujoco", "stable_baselines3", "torch"}),
        ("envs", {"matplotlib", "stable_baselines3", "torch", "tyro"}),
    ],
)
def test_a_room_works_without_the_floors_above(room, absent):
    modules = [
        ".".join(["springfoot", *path.with_suffix("").parts]).removesuffix(".__init__")
        for path in files(room)
        if path.suffix == ".py"
    ]
    code = "; ".join(f"import {module}" for module in modules)
    loaded = run(f"import sys; {code}; print(*{{name.partition('.')[0] for name in sys.modules}})").split()
    assert {"springfoot", "numpy"} <= set(loaded)
    assert not absent & set(loaded)


def test_evaluating_and_the_studies_that_train_nothing_need_no_learner():
    names = ("compare", "best-constant", "seeds", "bodies", "criteria", "conditions", "agreement", "any-stiffness")
    code = f"""
import sys
from springfoot.studies.command import main, study_class
assert main(["--help"]) == main(["study", "--help"]) == 0
assert not {{"numpy", "mujoco", "tyro"}} & set(sys.modules)
for name in {(*names, "learning-curves", "thesis")}:
    study_class(name)
try:
    main(["evaluate", "--help"])
except SystemExit:
    print(*sys.modules)
"""
    loaded = run(code).splitlines()[-1].split()
    extra = {Requirement(line).name for line in PROJECT["project"]["optional-dependencies"]["train"]}
    learner = {"stable_baselines3", *(extra - {"springfoot", "stable-baselines3"})}
    assert "springfoot.evaluation.evaluate_command" in loaded
    assert not learner & set(loaded)


SOURCES = [path for path in files(*ROOMS, "examples", "benchmarks") if path.suffix == ".py"] + [
    path.relative_to(ROOT) for path in sorted(ROOT.glob("*.py"))
]
UNPICKLERS = {"pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve"}
LOADERS = {"torch.load", "PPO.load", "VecNormalize.load"}


@pytest.mark.parametrize("path", SOURCES, ids=str)
def test_nothing_executes_what_a_file_says(path):
    for node in ast.walk(ast.parse((ROOT / path).read_text())):
        if isinstance(node, ast.Import):
            names = {alias.name.partition(".")[0] for alias in node.names}
            assert not UNPICKLERS & names, f"{path}:{node.lineno}"
        elif isinstance(node, ast.ImportFrom):
            assert (node.module or "").partition(".")[0] not in UNPICKLERS, f"{path}:{node.lineno}"
        elif isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in {"eval", "exec"}, f"{path}:{node.lineno}"
            assert ".".join(called.split(".")[-2:]) not in LOADERS, f"{path}:{node.lineno}"
            assert "allow_pickle" not in {keyword.arg for keyword in node.keywords}, f"{path}:{node.lineno}"


def test_no_file_names_a_place_on_somebodys_machine():
    place = re.compile(rb"(?<![\w./])/(?:home|root|work|tmp|Users|opt|mnt)/\w|[A-Z]:\\\\?Users")
    here = [path.relative_to(ROOT) for path in ROOT.iterdir() if path.is_file() and path.name != ".git"]
    everything = [*files(*ROOMS, "tests", "docs", "examples", "benchmarks"), Path(".ci/run"), *here]
    found = [str(path) for path in everything if place.search((ROOT / path).read_bytes())]
    assert not found
