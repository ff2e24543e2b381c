"""The examples run as their own words say, with short settings."""

import ast
import json
import re
import runpy
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from PIL import Image

from springfoot.cli.main import main
from springfoot.evaluation import policy_and_settings

EXAMPLES = Path(__file__).parents[2] / "examples"
RUNS = {
    "one_walk.py": (["--ankle", "250", "--seconds", "1"], "1.00 s, no fall, return "),
    "many_walks.py": (
        ["--num", "3", "--seconds", "3", "--push-newton", "900"],
        "ankle N m/rad   walked s   mean speed m/s\n           20 ",
    ),
    "train_with_sb3.py": (
        ["--timesteps", "32", "--num-envs", "4", "--steps", "8", "--seconds", "0.4"],
        "walked 0.40 s, return ",
    ),
    "plot_schedule.py": (
        ["schedule", "--episodes", "1", "--seconds", "7", "--out", "schedule.png"],
        "schedule.png: 0 of 1 fell",
    ),
    "clone_from_minari.py": (["--epochs", "1", "--dataset", "springfoot/walk/random-v0"], " steps, mean squared error"),
    "search_with_optuna.py": (
        ["--trials", "2", "--timesteps", "9000", "--seconds", "0.4"],
        "best of 2 trials: learning rate ",
    ),
}


def test_every_example_is_run_and_short():
    assert {path.name for path in EXAMPLES.glob("*.py")} == {"__init__.py", *RUNS}
    assert all(len(path.read_text().splitlines()) <= 60 for path in EXAMPLES.glob("*.py"))


def imported(source: str) -> set[tuple[str, str]]:
    """Module and name of every `from springfoot… import` in some Python code."""
    found = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
    parts = [(node.module or "", part.name) for node in found for part in node.names]
    return {(module, name) for module, name in parts if module.startswith("springfoot")}


def test_what_notebooks_and_the_wheels_check_import_is_there():
    sources = []
    for path in (EXAMPLES / "notebooks").iterdir():
        cells = json.loads(path.read_bytes())["cells"]
        sources += ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    wheel = ast.parse((EXAMPLES.parent / "benchmarks" / "wheel.py").read_text(encoding="utf-8"))
    texts = [node.value for node in ast.walk(wheel) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    sources += [text for text in texts if text.lstrip().startswith("from springfoot")]
    names: set[tuple[str, str]] = set().union(*map(imported, sources))
    assert ("springfoot.evaluation", "record") in names
    for module, name in names:
        assert hasattr(import_module(module), name), (module, name)


def test_no_example_names_a_file_that_the_wheel_lacks():
    for path in [*EXAMPLES.rglob("*.py"), *EXAMPLES.rglob("*.ipynb")]:
        assert not re.search(r"\b(evaluate|train)\.py", path.read_text(encoding="utf-8")), path


def test_notebooks_hold_no_results():
    books = [json.loads(path.read_bytes()) for path in (EXAMPLES / "notebooks").iterdir()]
    code = [cell for book in books for cell in book["cells"] if cell["cell_type"] == "code"]
    assert len(books) == 2 and len(code) > 4
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)


def test_examples_are_copied_out_of_the_package_into_a_new_folder(tmp_path, capsys):
    copy = tmp_path / "mine"
    assert main(["examples", "--copy", str(copy)]) == 0
    known = {path.relative_to(EXAMPLES) for path in EXAMPLES.rglob("*.*") if path.suffix in (".py", ".txt", ".ipynb")}
    copied = {path.relative_to(copy): path.read_bytes() for path in copy.rglob("*.*")}
    assert copied == {path: (EXAMPLES / path).read_bytes() for path in known - {Path("__init__.py")}}
    said = capsys.readouterr().out
    assert f"{copy / 'one_walk.py'}: One walk, step by step" in said
    assert f"{copy / 'notebooks' / 'first_walk.ipynb'}: A first walk\n" in said
    assert main(["examples", "--copy", str(copy)]) == 2
    error = f"springfoot examples: error: {copy} exists already; give --copy a new folder\n"
    assert capsys.readouterr().err == error


def test_the_list_names_the_examples_as_they_lie_in_a_copy_and_says_how_to_copy(tmp_path, capsys):
    assert main(["examples"]) == 0
    *listed, empty, last = capsys.readouterr().out.splitlines()
    assert (empty, last) == ("", "springfoot examples --copy FOLDER copies them into a new folder.")
    assert main(["examples", "--copy", str(tmp_path / "mine")]) == 0
    assert [f"{tmp_path / 'mine'}/{line}" for line in listed] == capsys.readouterr().out.splitlines()


MISSING = {
    "clone_from_minari.py": ("minari", "'springfoot[minari]'"),
    "plot_schedule.py": ("matplotlib", "'springfoot[evaluate]'"),
    "search_with_optuna.py": ("optuna", "optuna"),
    "train_with_sb3.py": ("stable_baselines3", "'springfoot[train]'"),
}
"""Example -> a package that it needs, and the argument of `pip install` that brings it."""


@pytest.mark.parametrize("name", MISSING)
def test_an_example_without_its_package_says_in_one_line_what_to_install(name, tmp_path):
    package, installed_by = MISSING[name]
    # Python takes a module that is None in `sys.modules` for one that is not there.
    without = f"import runpy, sys; sys.modules[{package!r}] = None; sys.argv = sys.argv[1:]; "
    command = [sys.executable, "-c", f"{without}runpy.run_path(sys.argv[0], run_name='__main__')", str(EXAMPLES / name)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr == f"{name}: error: the package {package} is missing: pip install {installed_by}\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_example_does_what_it_says(name, tmp_path, monkeypatch):
    words, said = RUNS[name]
    if name == "search_with_optuna.py":
        pytest.importorskip("optuna", reason="needs Optuna: pip install optuna")
    if name == "clone_from_minari.py":
        monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
        assert main(["datasets", "random", "--episodes", "2"]) == 0
    command = [sys.executable, "-W", "error", str(EXAMPLES / name), *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert said in done.stdout
    if name == "train_with_sb3.py":
        assert policy_and_settings(str(tmp_path / "mine.safetensors"), {})[1].action_mode == "absolute"
    if name == "plot_schedule.py":
        with Image.open(tmp_path / "schedule.png") as picture:
            assert len(picture.convert("RGB").getcolors(1 << 20) or []) > 50  # curves, no blank page


@pytest.mark.parametrize(
    ("library", "learner", "installed_as"),
    [
        ("rsl_rl", "rsl_rl_ppo", "rsl-rl-lib"),
        ("sb3_contrib", "sb3_recurrent", "sb3-contrib"),
        ("skrl", "skrl_ppo", "skrl"),
        ("tianshou", "tianshou_ppo", "tianshou"),
        ("tensordict", "torchrl_ppo", "tensordict"),
    ],
)
def test_a_learner_without_its_library_says_how_to_install_it(library, learner, installed_as, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, library, None)  # as if it were not there
    monkeypatch.setattr(sys, "argv", [f"{learner}.py"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(EXAMPLES / "learners" / f"{learner}.py"), run_name="__main__")
    assert ended.value.code == 2
    wanted = f"{learner}.py: error: the package {library} is missing: pip install {installed_as}\n"
    assert capsys.readouterr().err == wanted
