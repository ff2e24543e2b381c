"""What the documents say exists and runs."""

import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import tyro

from springfoot.cli.completion import Shell
from springfoot.cli.datasets import DatasetsFlags
from springfoot.cli.evaluate import EvaluateFlags
from springfoot.cli.examples import ExamplesFlags
from springfoot.cli.export import ExportFlags
from springfoot.cli.live import LiveFlags
from springfoot.cli.main import STUDIES, main, study_class
from springfoot.cli.train import TrainFlags
from springfoot.envs.task.observation_entries import PERSON_OBSERVATION
from springfoot.gait import human_gait
from springfoot.studies.feet.foot_choice import FootChoice
from springfoot.studies.springs.person import Person
from springfoot.studies.walks.score import Score

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
PREFIXES = ("python ", "make ", "springfoot ", "train.py ", "evaluate.py ")


def commands_in(text):
    """Every command in a page: each line of a block of shell, and each `code` that begins like one."""
    blocks = re.findall(r"```(?:sh|bash)?\n(.*?)```", text, re.DOTALL)
    lines = [line.partition("#")[0] for block in blocks for line in block.splitlines()]
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    lines += [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", prose)]
    return [line.strip() for line in lines if line.startswith(PREFIXES)]


MAKE_HELP = re.findall(r'@echo "(make [\w-]+)', (ROOT / "Makefile").read_text(encoding="utf-8"))
COMMANDS = sorted({*(line for page in PAGES for line in commands_in(page.read_text(encoding="utf-8"))), *MAKE_HELP})


def program_of(command):
    """The program of a command, as words, and what is told it."""
    words = shlex.split(command)
    if words[0] in ("train.py", "evaluate.py"):
        words = ["python", *words]
    if words[0] == "python" and words[1] in ("train.py", "evaluate.py"):
        words = ["springfoot", words[1].removesuffix(".py"), *words[2:]]
    several = words[:2] in (["python", "-m"], ["springfoot", "study"])
    size = 3 if several and words[2:] and words[2] not in ("--help", "--all", "NAME") else 2
    return tuple(words[:size]), words[size:]


PROGRAMS = sorted({program_of(command)[0] for command in COMMANDS})


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A reader's folder, with the file of own curves that the README speaks of."""
    percent = np.arange(101)
    knee = np.degrees(human_gait(1.2).mean("knee", percent / 100))
    rows = [f"{at},{angle:.3f}" for at, angle in zip(percent, knee, strict=True)]
    (tmp_path / "my_gait.csv").write_text("\n".join(["percent,knee_flexion_deg", *rows]) + "\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)#]+)", re.sub(r"\s+", " ", page.read_text(encoding="utf-8")))
    paths = [(page.parent / link).resolve() for link in links if not link.startswith("https://")]
    assert [path for path in paths if not path.exists()] == []
    docs = ROOT / "docs"
    if page.is_relative_to(docs):  # the site holds nothing else
        assert [path for path in paths if not path.is_relative_to(docs)] == []


def test_the_reference_is_the_code_s():
    generated = runpy.run_path(str(ROOT / "docs" / "generate.py"))
    for name, text in generated["pages"]().items():
        page = generated["FOLDER"] / f"{name}.md"
        assert page.read_text(encoding="utf-8") == text, "`make docs` writes it anew"


def test_the_reference_lists_every_entry_of_an_observation():
    page = (ROOT / "docs" / "reference" / "observations.md").read_text()
    found = re.findall(r"^\| (\d+) +\| (\w+) ", page, re.MULTILINE)
    expected = [(str(number), entry.name) for number, entry in enumerate(PERSON_OBSERVATION)]
    assert [row for row in found if row in expected] == expected


def test_every_page_is_reachable_from_the_index():
    index = ROOT / "docs" / "index.md"
    reached = set()
    new = {index}
    while new:
        page = new.pop()
        reached.add(page)
        links = re.findall(r"\]\(([^)#]+\.md)", page.read_text(encoding="utf-8"))
        new |= {(page.parent / link).resolve() for link in links if not link.startswith("https://")} - reached
    assert set((ROOT / "docs").rglob("*.md")) <= reached


@pytest.mark.slow
def test_readme_examples_run_in_their_order(folder):
    code = "\n".join(BLOCKS)
    assert BLOCKS
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_examples_of_the_page_on_policies_run(folder):
    page = (ROOT / "docs" / "how-to" / "policies.md").read_text(encoding="utf-8")
    for command in commands_in(re.findall(r"```sh.*?```", page, re.DOTALL)[0]):
        assert main(shlex.split(command)[1:]) == 0
    code = "\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stderr


def test_the_documents_name_the_commands_there_are():
    assert {("springfoot", "train"), ("springfoot", "evaluate"), ("make", "test"), ("make", "walk")} <= set(PROGRAMS)
    named = {program[2] for program in PROGRAMS if program[:2] == ("springfoot", "study") and program[2:]}
    assert named == set(STUDIES)


@pytest.mark.slow
@pytest.mark.parametrize("program", PROGRAMS, ids=" ".join)
def test_every_program_that_a_document_names_answers_help(program, monkeypatch, capsys):
    if program[0] == "make":
        done = subprocess.run(["make", "--dry-run", "--always-make", *program[1:]], cwd=ROOT, capture_output=True)
        assert done.returncode == 0, done.stderr
    elif program[:2] == ("python", "-m") and not program[2].startswith("benchmarks."):
        done = subprocess.run([sys.executable, *program[1:], "--help"], cwd=ROOT, capture_output=True)
        assert done.returncode == 0 and done.stdout, done.stderr
    elif program[:2] == ("python", "-m"):  # here: what most of them import takes a new process seconds
        monkeypatch.setattr(sys, "argv", ["-m", "--help"])
        monkeypatch.delitem(sys.modules, program[2], raising=False)  # another test's import
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(program[2], run_name="__main__", alter_sys=True)
        assert not ended.value.code and "usage: " in capsys.readouterr().out
    elif program[0] == "python":
        assert (ROOT / program[1]).is_file()  # test_examples.py runs it
    else:
        try:
            code = main([*program[1:], "--help"])
        except SystemExit as end:  # how tyro ends
            code = end.code
        assert code == 0 and "usage: springfoot" in capsys.readouterr().out


@pytest.mark.parametrize("command", [command for command in COMMANDS if "…" not in command])
def test_every_command_that_a_document_names_is_understood(command):
    program, words = program_of(command)
    if program[:2] == ("springfoot", "study") and program[2:]:
        tyro.cli(study_class(program[2]), args=words)  # exits where it does not understand
    elif program == ("springfoot", "completion"):
        assert not words or words[0] in get_args(Shell)
    elif program[0] == "springfoot" and program[1] != "study" and words:
        flags = {"train": TrainFlags, "evaluate": EvaluateFlags, "export": ExportFlags, "live": LiveFlags}
        flags |= {
            "datasets": DatasetsFlags,
            "examples": ExamplesFlags,
            "feet": FootChoice,
            "person": Person,
            "score": Score,
        }
        tyro.cli(flags[program[1]], args=words)
    else:
        assert program[0] != "springfoot" or words in ([], ["--help"], ["--all"], ["NAME"])


def test_every_test_that_guarantees_name_exists():
    page = (ROOT / "docs" / "explanation" / "guarantees.md").read_text(encoding="utf-8")
    named = re.findall(r"`(test_\w+\.py)::(test_\w+)`", page)
    assert len(named) > 20
    for file, test in named:
        texts = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob(file)]
        assert any(f"def {test}(" in text for text in texts), (file, test)
