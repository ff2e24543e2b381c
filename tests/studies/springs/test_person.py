"""The command `springfoot person`: planted truth comes back, its files are read again, bad input is one line."""

import csv
import json
from itertools import pairwise

import numpy as np
import pytest

from springfoot.cli.main import main
from springfoot.envs.settings.settings import body_of
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import WARM_UP, record
from springfoot.evaluation.report.exports import write_opensim
from springfoot.gait import GRAVITY, human_gait
from springfoot.gait.people.human import COLUMNS
from springfoot.gait.people.measured_person import read_person
from springfoot.gait.people.own_data import read_gait

PHASE = np.linspace(0, 1, 101)
FILES = ("report.md", "quasi_stiffness.csv", "curves.csv", "schedule.csv", "finite_states.json")
PICTURES = ("curves.png", "torque_angle.png")


def rows_of(path):
    """Return the rows of a CSV file."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def slope_of(angle, moment, row):
    """Return the slope of a curve (P,) over equal parts of the stride in the phase of a row of quasi_stiffness.csv."""
    at = np.linspace(float(row["from_percent"]), float(row["to_percent"]), 2001) / 100
    parts = np.linspace(0, 1, len(angle))
    return np.polyfit(np.interp(at, parts, angle), np.interp(at, parts, moment), 1)[0]


def raw_loop(recording, leg, joint):
    """Return the mean angle [rad] and moment [N m] (2001,) of a joint, straight from the recorded samples.

    Angles are at the ends of ticks of 10 ms, torques and forces are means over ticks.
    """
    ticks = int(recording.ticks[0])
    ends = 0.01 * np.arange(1, ticks + 1)
    middles = ends - 0.005
    angle, torque, force = (
        recording.series[name][0, :ticks].astype(float) for name in ("angle", "joint_torque", "force")
    )
    vertical = force[:, leg, :, 1].sum(axis=1)
    threshold = 0.05 * body_of(recording.settings).total_mass * GRAVITY
    loaded = vertical > threshold
    rises = [k for k in range(1, ticks) if loaded[k] and not loaded[max(k - 15, 0) : k].any() and middles[k] > WARM_UP]
    strikes = [middles[k - 1] + 0.01 * (threshold - vertical[k - 1]) / (vertical[k] - vertical[k - 1]) for k in rises]
    part = np.linspace(0, 1, 2001)

    def mean(times, series):
        return np.mean([np.interp(a + (b - a) * part, times, series) for a, b in pairwise(strikes)], axis=0)

    return mean(ends, angle[:, leg, joint]), -mean(middles, torque[:, leg, joint])


PLANTED = {
    "schedule": ("schedule", {}),
    "flat": ("constant:300,40", {}),
    "soft toe": ("constant:300,20", {}),
    "right foot passive": ("schedule", {"right_foot": "passive"}),
}


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "given"), PLANTED.values(), ids=PLANTED)
def test_planted_truth_comes_back(policy, given, tmp_path, capsys):
    act, settings = policy_and_settings(policy, {"episode_seconds": 14.0} | given)
    recording = record(act, settings, name=policy, episodes=1)
    write_opensim(tmp_path, recording)
    words = [str(tmp_path / "walk.mot"), str(tmp_path / "walk.sto"), "--out", str(tmp_path / "me")]
    assert main(["person", *words]) == 0
    rows = rows_of(tmp_path / "me" / "quasi_stiffness.csv")
    compared, values = 0, {}
    for leg, side in enumerate(("left", "right")):
        for index, joint in ((2, "ankle"), (3, "toe")):
            angle, moment = raw_loop(recording, leg, index)
            for row in rows:
                if (row["joint"], row["side"]) == (joint, side) and row["quasi_stiffness"]:
                    truth = slope_of(angle, moment, row)
                    found = float(row["quasi_stiffness"])
                    # The toe of a flat foot hardly bears: 0.5 N m/rad is the noise of a slope near 0.
                    assert found == pytest.approx(truth, rel=0.05, abs=0.5)
                    values[side, joint, row["phase"]] = found
                    compared += 1
    assert compared >= 12
    rising = [values[side, "ankle", "early rising"] for side in ("left", "right")]
    assert rising[1] > 2 * rising[0] if given else rising[1] == pytest.approx(rising[0], rel=0.15)
    told = capsys.readouterr().out
    assert "95 % interval over strides" in told and f"Left out: the first {WARM_UP:g} s." in told


def off_plate(path, side, strides, end):
    """Lose what a plate loses that ends under the foot at `end` of each stride (S, 3) [s], or for `end` None bears only
    0.65 of the foot."""
    lines = path.read_text(encoding="utf-8").splitlines()
    start = lines.index("endheader") + 2
    names = lines[start - 1].split("\t")
    rows = np.array([line.split("\t") for line in lines[start:]], float)
    own = [k for k, name in enumerate(names) if name.startswith(f"ground_force_{side}_v") or f"_{side}_moment" in name]
    for strike, _, following in strides:
        stance = (rows[:, 0] - strike + 0.02) / (following - strike)
        lost = (stance > (end or 0.0)) & (stance < 1.0)
        rows[np.ix_(lost, own)] *= 0.65 if end is None else 0.0
    text = ["\t".join(f"{value:.8g}" for value in row) for row in rows]
    path.write_text("\n".join([*lines[:start], *text]) + "\n", encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("end", [0.48, 0.57, None], ids=["ends at 48 %", "ends at 57 %", "bears 0.65"])
def test_planted_truth_comes_back_though_a_plate_loses_force(end, tmp_path, capsys):
    act, settings = policy_and_settings("schedule", {"episode_seconds": 14.0})
    recording = record(act, settings, name="schedule", episodes=1)
    write_opensim(tmp_path, recording)
    files = [tmp_path / "walk.mot", tmp_path / "walk.sto"]
    strides = read_person(files).legs["left"].times
    off_plate(files[1], "l", strides[1::3], end)
    assert main(["person", *map(str, files), "--out", str(tmp_path / "me")]) == 0
    curves = measure(recording).feet[0]
    angle, moment = np.radians(curves.mean("ankle_dorsiflexion_deg")), curves.mean("ankle_moment_Nm_per_kg")
    rows = [
        row
        for row in rows_of(tmp_path / "me" / "quasi_stiffness.csv")
        if (row["joint"], row["side"]) == ("ankle", "left") and row["quasi_stiffness"]
    ]
    assert len(rows) == 4
    for row in rows:
        truth = body_of(settings).total_mass * slope_of(angle, moment, row)
        assert float(row["quasi_stiffness"]) == pytest.approx(truth, rel=0.05)
    told = capsys.readouterr().out
    assert "Forces and moments of 3 left" in told and "a foot was partly off its plate" in told
    off_plate(files[1], "l", strides, end)
    assert main(["person", *map(str, files), "--side", "left", "--out", str(tmp_path / "none")]) == 2
    told = capsys.readouterr().err
    assert "no stride tells a stiffness: in each a foot was partly off its plate" in told and told.count("\n") == 1
    assert not (tmp_path / "none").exists()


@pytest.fixture(scope="module")
def mine(tmp_path_factory):
    """Mean curves of somebody over percent, the right ankle's moment less."""
    human = human_gait(1.3)
    columns = {"percent": 100 * PHASE, "speed_m_s": np.full(101, 1.3), "toe_off_percent": np.full(101, 62.0)}
    for name in ("thigh", "knee", "ankle", "ankle_moment", "grf_vertical"):
        unit = 180 / np.pi if COLUMNS[name].endswith("_deg") else 1.0
        for side, share in (("left", 1.0), ("right", 0.8 if name == "ankle_moment" else 1.0)):
            columns[f"{COLUMNS[name]}_{side}"] = unit * share * human.mean(name, PHASE)
    lines = [",".join(columns), *(",".join(f"{v:.6g}" for v in row) for row in zip(*columns.values(), strict=True))]
    path = tmp_path_factory.mktemp("mine") / "mine.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_every_file_is_written_and_read_again(mine, tmp_path, capsys):
    out = tmp_path / "me"
    assert main(["person", str(mine), "--mass", "71", "--train", "runs/me", "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {*FILES, *PICTURES}
    for words in (
        "springfoot train --human",
        f"springfoot train --preset person --begin-from learned --human {out / 'curves.csv'} --height-range 1.68 "
        "1.72 --mass-range 69 73 --speed-range ",
        " --drawn-bodies None --out runs/me-person",
        "no property of a spring",
        "Without intervals",
        "Mass: 71.0 kg, as given",
    ):
        assert words in told
    assert "Borrowed from the norm: stride time, step length, hip, toe," in told
    assert told.strip().startswith((out / "report.md").read_text(encoding="utf-8").partition("\n\nMade by")[0])
    own = read_gait(out / "curves.csv").gait(1.3, 1.7)
    human = human_gait(1.3)
    np.testing.assert_allclose(own.mean("knee", PHASE), human.mean("knee", PHASE), atol=1e-4)
    np.testing.assert_allclose(own.mean("ankle_moment", PHASE), 0.9 * human.mean("ankle_moment", PHASE), atol=1e-3)
    rows = {(row["side"], row["phase"]): row for row in rows_of(out / "quasi_stiffness.csv")}
    left, right, norm = (float(rows[side, "late rising"]["quasi_stiffness"]) for side in ("left", "right", "norm"))
    assert right == pytest.approx(0.8 * left, rel=1e-4) and left == pytest.approx(norm, rel=0.02)
    for name in ("schedule.csv", "finite_states.json"):
        _, settings = policy_and_settings(str(out / name), {"mass": 71.0})
        assert settings.schedule is not None
        stiffness, _ = settings.schedule.at(0.4)
        assert settings.equilibrium == "phase" and 200 < stiffness[0] < 900
    states = json.loads((out / "finite_states.json").read_text(encoding="utf-8"))
    assert [state["name"] for state in states["states"]] == ["loading", "mid-stance", "push-off", "swing"]
    assert all(path.stat().st_size > 10_000 for path in (out / name for name in PICTURES))


def test_one_side_alone_and_no_mass(mine, tmp_path, capsys):
    assert main(["person", str(mine), "--side", "right", "--out", str(tmp_path / "me")]) == 0
    told = capsys.readouterr().out
    assert "| quasi-stiffness, N·m/(rad·kg) | right | norm |" in told and "Mass: unknown" in told


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ([], "give the motion files of one person, such as walk.mot forces.mot"),
        (["none.csv"], "no file none.csv"),
        (["MINE", "--columns", "knee"], "--columns must be OURS=THEIRS, such as knee_angle_r=KneeRight, got 'knee'"),
        (["MINE", "--columns", "percent=a", "--columns", "percent=b"], "names one of our columns twice"),
        (["MINE", "--columns", "percent=a"], "no column 'a' in a text file; there are percent"),
        (["MINE", "--mass", "1"], "mass"),
        (["MINE", "--speed", "9"], "speed"),
        (["MINE", "--height", "9"], "height"),
        (["MINE", "--mass", "60", "--mass", "70"], "--mass is given twice"),
        (
            [
                *("MINE", "--columns", "mtp_dorsiflexion_deg_left=ankle_dorsiflexion_deg_left"),
                *("--side", "left", "--trust-units"),
            ],
            "no ankle angle",
        ),
    ],
)
def test_bad_input_is_one_line(words, error, mine, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        code = main(["person", *(str(mine) if word == "MINE" else word for word in words)])
    except SystemExit as end:
        code = end.code
    told = capsys.readouterr().err
    assert code == 2 and error in told and told.count("\n") == 1, told
    assert list(tmp_path.iterdir()) == []
