"""Specialists: gaps between a person and its own further training on one foot, and the command."""

import pytest

from springfoot.cli.main import study_main
from springfoot.studies.feet.specialists import QUICK_CELLS, gap_table


def a_row(fibre, gap, falls=0.0):
    numbers = {"falls": falls, "walked_m_s": 1.2, "fibre_J_kg_m": fibre}
    row = {f"{who}_{key}": value for who in ("generalist", "specialist") for key, value in numbers.items()}
    return {"cell": "sound", **row, "fibre_J_kg_m_gap": gap, "effort_gap": gap, "gained": None}


def test_a_line_tells_the_range_over_persons_and_a_fallen_pair_has_no_gap():
    rows = [a_row(3.0, -0.05), a_row(3.5, 0.01), a_row(None, None, falls=1.0)]
    (line,) = gap_table(rows).splitlines()[2:]
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    of_fibre = "3.00 to 3.50 → 3.00 to 3.50"
    assert cells == ["sound", "0% to 100%", "0% to 100%", "1.20 → 1.20", of_fibre, *["-5.0% to +1.0%"] * 2, "–"]


@pytest.mark.slow
def test_quick_trains_a_cell_once_and_a_folder_of_another_training_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["specialists", "--quick", "--threads", "1", "--runs", "runs"]
    pages, written = [], []
    for number in range(2):
        assert study_main([*words, "--out", f"out-{number}"]) == 0
        pages.append((tmp_path / f"out-{number}" / "specialists.csv").read_bytes())
        written.append([path.stat().st_mtime_ns for path in sorted((tmp_path / "runs-quick").glob("*/run.json"))])
    assert written[0] == written[1] and len(written[0]) == QUICK_CELLS
    assert pages[0] == pages[1] and pages[0].count(b"learned,") == QUICK_CELLS
    capsys.readouterr()
    assert study_main([*words, "--training-seed", "1"]) == 2
    assert "was trained with other settings; choose another folder" in capsys.readouterr().err


def test_a_policy_that_moves_no_person_is_refused(capsys, tmp_path):
    assert study_main(["specialists", "pretrained", "--quick", "--runs", str(tmp_path / "runs")]) == 2
    assert "pretrained moves no person" in capsys.readouterr().err
    assert study_main(["specialists", "learned", "learned", "--runs", str(tmp_path / "runs")]) == 2
    assert "learned is given 2 times; give each person once" in capsys.readouterr().err
