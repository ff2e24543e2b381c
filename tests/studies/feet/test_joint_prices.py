"""Prices of joints: their sum, their changes, and the command."""

import csv

import pytest

from springfoot.cli.main import study_main
from springfoot.envs.physics import JOINTS, SIDES
from springfoot.studies.feet.joint_prices import JOINT_COLUMNS, JOINT_COMPARISONS, JOINT_CONDITIONS, joint_table


def rows_of(persons, changed, **changes):
    """Return a row of each person and condition, alike but for `changes` under the condition `changed`."""
    alike = {"falls": 0.0, "fibre_J_kg_m": 4.0, "effort": 1.0, **dict.fromkeys(JOINT_COLUMNS, 1.0)}
    return [
        {"person": person, "condition": name, **alike, **(changes if name == changed else {})}
        for person in persons
        for name in JOINT_CONDITIONS
    ]


def cells_of(rows, name):
    lines = joint_table(rows).splitlines()[2:]
    (line,) = [line for line in lines if line.startswith(f"| {name}, against {JOINT_COMPARISONS[name]} |")]
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


def test_a_line_tells_the_change_of_each_joint_and_price_from_the_condition_it_is_compared_with():
    rows = rows_of(["a"], "rigid right foot", left_hip_J_kg_m=1.25, fibre_J_kg_m=5.0, effort=0.9, ankle_activation=0.5)
    assert cells_of(rows, "rigid right foot") == ["+0.25", *["+0.00"] * 4, "+25%", "-10%", "-50%"]
    passive = "passive right foot, 400 N·m/rad"
    assert cells_of(rows, passive) == ["+0.00"] * 5 + ["+0%"] * 3  # of the same sound walk
    two = [*rows, *rows_of(["b"], "sound", right_hip_J_kg_m=0.5)]
    assert cells_of(two, passive)[0] == "+0.25 (+0.00 to +0.50)"


def test_a_fallen_walk_has_no_change():
    rows = rows_of(["a", "b"], "slack springs", falls=0.2)
    assert cells_of(rows, "two-way springs, 150 N·m/rad") == ["–"] * 8
    assert cells_of(rows, "150 N·m/rad, scheduled K")[-1] == "+0% (+0% to +0%)"


@pytest.mark.slow
def test_joints_sum_to_the_whole_and_a_missing_ankle_spends_nothing(tmp_path):
    assert study_main(["joint-prices", "--quick", "--threads", "1", "--out", str(tmp_path / "out")]) == 0
    rows = list(csv.DictReader((tmp_path / "out" / "joint_prices.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["condition"] for row in rows] == list(JOINT_CONDITIONS)
    for row in rows:
        parts = sum(float(row[f"{side}_{joint}_J_kg_m"]) for side in SIDES for joint in JOINTS)
        assert parts == pytest.approx(float(row["fibre_J_kg_m"]), rel=1e-4)
    ankle = {row["condition"]: float(row["right_ankle_J_kg_m"]) for row in rows}
    assert ankle["rigid right foot"] == ankle["passive right foot, 400 N·m/rad"] == 0.0 < ankle["sound"]


def test_a_person_that_is_given_twice_is_refused(capsys):
    assert study_main(["joint-prices", "learned", "learned"]) == 2
    assert "learned is given 2 times; give each person once" in capsys.readouterr().err
