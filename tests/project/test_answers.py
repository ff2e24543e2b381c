"""`make answers`: studies that there are, with flags that they understand, each kept and in a folder of its own."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import tyro

from springfoot.cli.main import study_class

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("words", [[], ["QUICK=1"]], ids=["whole", "quick"])
def test_every_study_of_the_answers_has_a_folder_and_goes_on_from_what_it_kept(words):
    done = subprocess.run(
        ["make", "--dry-run", "--always-make", "answers", *words], cwd=ROOT, capture_output=True, text=True, check=True
    )
    studies = {}
    for line in re.findall(r"-m springfoot study (.*?)(?: \\)?$", done.stdout, re.MULTILINE):
        name, *flags = shlex.split(line)
        studies[name] = tyro.cli(study_class(name), args=flags)  # exits where it does not understand
    assert set(studies) == {"landscape", "when", "toe", "effects", "controls"}
    for name, study in studies.items():
        folder = Path("build/answers-quick" if words else "build/answers")
        assert study.out == folder / name and study.quick == bool(words)
        assert study.keep == (None if words else folder / "kept" / name)
