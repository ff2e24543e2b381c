"""The spring that holds a drop foot."""

import csv

import pytest

from springfoot.cli.main import study_main
from springfoot.studies.feet.drop_foot import weakest_cure


def test_a_cure_has_no_falls_with_any_stiffer_spring_of_its_rest_angle():
    falls = {(0.0, 0.0): 1, (5.0, 0.0): 0, (10.0, 0.0): 1, (20.0, 0.0): 0, (0.0, 5.0): 1, (5.0, 5.0): 1}
    falls |= {(10.0, 5.0): 0, (20.0, 5.0): 0}
    map_of = [{"spring_Nm_rad": k, "rest_deg": rest, "falls": fell} for (k, rest), fell in falls.items()]
    cure = weakest_cure(map_of, "falls")
    assert cure is not None
    assert (cure["spring_Nm_rad"], cure["rest_deg"]) == (10.0, 5.0)
    assert weakest_cure([row | {"falls": 1} for row in map_of], "falls") is None


@pytest.mark.slow
def test_a_drop_foot_alone_catches_its_toe_under_a_policy_that_does_not_adapt(tmp_path):
    assert study_main(["drop-foot", "pretrained", "--quick", "--threads", "1", "--out", str(tmp_path / "out")]) == 0
    lines = list(csv.DictReader((tmp_path / "out" / "drop.csv").read_text().splitlines()))
    slack = [line for line in lines if float(line["spring_Nm_rad"]) == 0.0]
    assert slack and all(float(line["falls"]) == 1.0 for line in slack)
    assert "Weakest with which 0 of 1 fell" in (tmp_path / "out" / "report.md").read_text()
