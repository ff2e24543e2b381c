"""docs/thesis.md is what its command writes, and its pictures are there."""

import re
from decimal import Decimal
from functools import cache
from pathlib import Path

import pytest
from PIL import Image

from springfoot.cli.main import study_main
from springfoot.studies.thesis_page import page, walks

DOCS = Path(__file__).parents[1] / "docs"
NUMBER = re.compile(r"[−+]?\d+(?:\.\d+)?")
FIGURES = [f"figure-{number}.png" for number in range(6, 11)]
LIGHT = 60 * 1024


@cache
def texts() -> tuple[str, str]:
    """Committed and written anew, on one line: a number that rounds otherwise may move a line's end."""
    committed = (DOCS / "thesis.md").read_text(encoding="utf-8")
    return " ".join(committed.split()), " ".join(page().split())


def test_committed_page_is_the_one_its_command_writes():
    committed, written = texts()
    assert NUMBER.sub("#", committed) == NUMBER.sub("#", written)


def test_its_numbers_are_those_computed_to_the_last_digit():
    for committed, written in zip(*(NUMBER.findall(text) for text in texts()), strict=True):
        a, b = (Decimal(number.replace("−", "-")) for number in (committed, written))
        last_digit = Decimal(1).scaleb(int(a.as_tuple().exponent))
        assert abs(a - b) <= last_digit, (committed, written)


def test_page_shows_each_picture_once_and_they_are_light():
    committed, _ = texts()
    assert re.findall(r"!\[[^]]*\]\(thesis/([^)]+)\)", committed) == FIGURES
    for name in FIGURES:
        assert (DOCS / "thesis" / name).stat().st_size < LIGHT


def test_pictures_are_written(tmp_path):
    assert study_main(["thesis", "--out", str(tmp_path / "out"), "--page", str(tmp_path / "thesis.md")]) == 0
    assert (tmp_path / "thesis.md").read_bytes() == (tmp_path / "out" / "thesis.md").read_bytes()
    for name in FIGURES:
        assert (tmp_path / "thesis" / name).read_bytes() == (tmp_path / "out" / "thesis" / name).read_bytes()
        with Image.open(tmp_path / "thesis" / name) as new, Image.open(DOCS / "thesis" / name) as committed:
            assert new.size == committed.size and len(new.getcolors() or ()) > 8  # more than an empty sheet


def test_walks_share_one_frame():
    """This foot stands at 0 before the window and two steps further on after it; the plan's force bears the body."""
    for walk in walks():
        assert walk.ankle[0][0] == pytest.approx(0.0, abs=0.03)
        assert walk.ankle[0][-1] == pytest.approx(2 * walk.step_length, abs=0.01)
        assert walk.force[1][:500].mean() == pytest.approx(1.0, abs=0.06)
        assert walk.com[0][500] - walk.com[0][0] == pytest.approx(walk.step_length, abs=1e-6)


def test_bad_folder_is_one_line_and_nothing_half_written(tmp_path, capsys):
    (tmp_path / "file").touch()
    assert study_main(["thesis", "--out", str(tmp_path / "file")]) == 2
    assert study_main(["thesis", "--page", str(tmp_path / "nowhere" / "thesis.md")]) == 2
    first, error = capsys.readouterr().err.splitlines(keepends=True)
    assert "file exists already" in first and "no folder" in error
    assert error.startswith("springfoot study thesis: error:") and error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
