"""What the documents say exists and runs."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tyro

from springfoot.agents.train_command import TrainFlags
from springfoot.evaluation.evaluate_command import EvaluateFlags
from springfoot.gait import human_gait
from springfoot.studies import comparison as studies

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
COMMANDS = re.findall(
    r"(?:^|`)python (train\.py|evaluate\.py|-m springfoot\.studies\.comparison) ([^`#\n…]*)(?=[`#\n])",
    README,
    re.MULTILINE,
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A reader's folder, with the file of own curves that the README speaks of."""
    percent = np.arange(101)
    knee = np.degrees(human_gait(1.2).mean("knee", percent / 100))
    rows = [f"{at},{angle:.3f}" for at, angle in zip(percent, knee, strict=True)]
    (tmp_path / "my_gait.csv").write_text("\n".join(["percent,knee_flexion_deg", *rows]) + "\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)#]+)", re.sub(r"\s+", " ", page.read_text(encoding="utf-8")))
    assert all(link.startswith("https://") or (page.parent / link).exists() for link in links), links


def test_readme_examples_run_in_their_order(folder):
    code = "\n".join(BLOCKS).replace("range(500)", "range(50)").replace("episodes=4", "episodes=1")
    assert len(BLOCKS) == 5
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stderr


def test_readme_commands_are_understood(folder):
    programs = {
        "train.py": TrainFlags,
        "evaluate.py": EvaluateFlags,
        "-m springfoot.studies.comparison": studies.BestConstant | studies.Compare | studies.Seeds | studies.Bodies,
    }
    assert {program for program, _ in COMMANDS} <= set(programs)
    for program, words in COMMANDS:
        tyro.cli(programs[program], args=shlex.split(words.replace("TBD", "1")))  # exits where it does not understand
