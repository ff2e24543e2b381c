"""What no policy has together."""

import csv

import pytest
from drawn import kept_figures

from springfoot.cli.main import study_main
from springfoot.evaluation.numbers.criteria import Criterion
from springfoot.studies.criteria_met import CRITERIA
from springfoot.studies.front import beyond_percent


@pytest.mark.parametrize(
    ("low", "high", "value", "percent"),
    [
        (0.126, 0.234, 0.2574, 10.0),
        (0.126, 0.234, 0.1134, 10.0),
        (0.126, 0.234, 0.2106, -10.0),
        (-0.2, -0.12, -0.21, 5.0),
        (-0.2, -0.12, -0.108, 10.0),
        (0.98, float("inf"), 0.98, 0.0),
        (-float("inf"), 0.0, 3.0, None),  # of falls, none allowed
        (0.0, 1.0, None, None),
    ],
)
def test_beyond_is_the_distance_to_the_nearer_end_as_a_share_of_it(low, high, value, percent):
    criterion = Criterion(name="it", path=("it",), low=low, high=high)
    found = beyond_percent(criterion, {"it": value})
    assert found == (None if percent is None else pytest.approx(percent, abs=1e-9))
    if percent:
        assert criterion.holds({"it": value}) == (percent < 0)


def test_the_table_has_what_one_policy_misses_at_least_and_the_file_has_all(tmp_path, capsys):
    policies = ["schedule", "constant:250,30"]
    words = ["--episodes", "1", "--seconds", "6", "--out", str(tmp_path / "new")]
    with kept_figures() as figures:
        assert study_main(["front", *policies, *words]) == 0
    head, _, *rows = capsys.readouterr().out.splitlines()[:4]
    with (tmp_path / "new" / "front.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["criterion"] for line in lines] == 2 * [each.name for each in CRITERIA]
    for name, row in zip(policies, rows, strict=True):
        missed = [line["criterion"] for line in lines if line["policy"] == name and line["holds"] == "False"]
        assert row.startswith(f"| `{name}` |") and row.count("**") == 2 * len(missed)
        assert row.split("|")[3].strip() == str(len(missed))
    columns = [cell.strip() for cell in head.split("|")[4:-1]]
    either = {line["criterion"] for line in lines if line["holds"] == "False"}
    assert columns == [f"{each.label or each.name} {each.text}" for each in CRITERIA if each.name in either]
    (ax,) = figures["front.png"].axes
    rows = [text.get_text() for text in ax.get_yticklabels()]
    for name in policies:
        drawn = next(line for line in ax.lines if line.get_label() == name)
        missed = {line["criterion"] for line in lines if line["policy"] == name and line["holds"] == "False"}
        beyond = {rows[int(y)] for x, y in zip(*drawn.get_data(), strict=True) if x > 0}
        assert beyond == {f"{each.label or each.name} {each.text}" for each in CRITERIA if each.name in missed}
