"""Agreement of policies: judged where the joint carries load, and the command's tables."""

import shlex

import numpy as np
import pytest
from drawn import kept_figures

from springfoot.cli.main import study_main
from springfoot.evaluation.numbers.metrics import Gait
from springfoot.gait import SpringfootError
from springfoot.studies.springs import agreement as agreement
from springfoot.studies.springs.agreement import Agreement


def joint(stiffness):
    """Policies with load at 20 to 60 percent."""
    percent = np.arange(101)
    torque = np.where((percent >= 20) & (percent <= 60), 1.0, 0.05)
    shape = np.ones((len(stiffness), 101))
    return Agreement(joint="ankle", stiffness=stiffness, equilibrium=shape, torque=torque * shape)


def test_only_stiffness_under_load_is_judged():
    stiffness = np.full((2, 101), 100.0)
    stiffness[1, 5] = 900.0
    assert joint(stiffness).worst[0] == 0.0 and joint(stiffness).agree
    stiffness[1, 40] = 130.0
    each = joint(stiffness)
    assert each.worst == (pytest.approx(30 / 2**0.5 / 115), 40) and not each.agree
    assert "20–60 % of the stride" in agreement.agreement_table([each])


def test_one_policy_or_one_that_walks_not_is_refused():
    with pytest.raises(SpringfootError, match="two policies or more"):
        agreement.agreements([Gait()])
    with pytest.raises(SpringfootError, match="nobody walks no strides"):
        agreement.agreements([Gait(metrics={"policy": "nobody"})] * 2)


def test_the_command_prints_both_tables_and_writes_picture_and_curves(capsys, tmp_path):
    words = ["schedule", "constant:250,30", "--episodes", "1", "--seconds", "6", "--threads", "1"]
    words += ["--out", str(tmp_path / "a")]
    with kept_figures() as figures:
        assert study_main(["agreement", *words]) == 0
    out = capsys.readouterr().out
    assert "**do not agree**" in next(line for line in out.splitlines() if line.startswith("| ankle |"))
    *limits, missed = [line.split(" | ")[3:] for line in out.split("\n\n")[1].splitlines()[2:]]
    for column, count in enumerate(missed):  # in bold what the row `missed` counts
        assert sum("**" in row[column] for row in limits) == int(count.strip(" |")) > 0
    tables, results = out.strip().rsplit("\n\n", 1)
    assert results == f"Results: {tmp_path / 'a'} (report.md, agreement.csv, policies.csv, agreement.png)"
    written = (tmp_path / "a" / "report.md").read_text()
    assert tables in written
    assert f"Made by `springfoot study agreement {shlex.join(words[:-2])}`." in written and str(tmp_path) not in written
    assert (tmp_path / "a" / "agreement.png").exists()
    header, *rows = (tmp_path / "a" / "agreement.csv").read_text().splitlines()
    column = header.split(",").index("ankle_stiffness_Nm_per_rad")
    values = np.array([row.split(",") for row in rows], float)
    stiffness = figures["agreement.png"].axes[0]
    assert stiffness.get_title(loc="left").startswith("Ankle K, worst CV under load") and len(stiffness.lines) == 2
    drawn = np.mean([line.get_ydata() for line in stiffness.lines], axis=0)
    assert drawn == pytest.approx(values[:, column], rel=1e-4)
    assert len(rows) == 101 and 100 < values[:, column].mean() < 300
