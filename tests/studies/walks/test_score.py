"""The command `springfoot score`: evaluations come back from their files, people score as people, bad input is told."""

import csv
import json

import numpy as np
import pytest

from springfoot.cli.main import main
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.exports import write_opensim
from springfoot.gait import human_gait
from springfoot.gait.people.human import COLUMNS
from springfoot.studies.walks.score import BESIDE, CURVES, published_walks

PHASE = np.linspace(0, 1, 101)


def score_of(tmp_path, *words):
    """Run the command; return its score.csv: (curve, number) -> row."""
    out = tmp_path / "score"
    assert main(["score", *map(str, words), "--out", str(out)]) == 0
    with (out / "score.csv").open(encoding="utf-8") as file:
        return {(row["curve"], row["number"]): row for row in csv.DictReader(file)}


def write_curves(path, speed, curves, sides=("",), shift=0.0):
    """Write people's mean curves at a speed as a CSV over percent; the right leg's angles are `shift` [rad] more."""
    human = human_gait(speed)
    columns = {
        "percent": 100 * PHASE,
        "speed_m_s": np.full(101, speed),
        "toe_off_percent": 100 * np.full(101, human.toe_off),
    }
    for name in curves:
        in_degrees = COLUMNS[name].endswith("_deg")
        for side in sides:
            values = human.mean(name, PHASE) + (shift if in_degrees and side == "_right" else 0.0)
            columns[COLUMNS[name] + side] = np.degrees(values) if in_degrees else values
    lines = [",".join(columns), *(",".join(f"{v:.8g}" for v in row) for row in zip(*columns.values(), strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.slow
def test_an_exported_episode_scores_as_its_evaluation(tmp_path, capsys):
    act, settings = policy_and_settings("schedule", {})
    recording = record(act, settings, name="schedule", episodes=1)
    write_opensim(tmp_path, recording)
    metrics = measure(recording).metrics
    rows = score_of(tmp_path, tmp_path / "walk.mot", tmp_path / "walk.sto", "--speed", settings.speed)
    for joint in ("thigh", "knee", "ankle", "toe"):
        assert float(rows[joint, "rmse_deg"]["both"]) == pytest.approx(metrics["joints"][joint]["rmse_deg"], abs=0.02)
        assert float(rows[joint, "r"]["both"]) == pytest.approx(metrics["joints"][joint]["r"], abs=0.002)
    for name in ("vertical_r", "forward_r"):
        assert float(rows["grf", name]["both"]) == pytest.approx(metrics["grf"][name], abs=0.002)
    assert float(rows["grf", "vertical_peak2_bw"]["both"]) == pytest.approx(
        metrics["grf"]["vertical_peak2_bw"], rel=0.01
    )
    for joint in ("hip", "knee", "ankle"):
        assert float(rows[f"{joint}_moment", "r"]["both"]) == pytest.approx(metrics["moments"][joint]["r"], abs=0.002)
    told_again = json.loads((tmp_path / "score" / "score.json").read_text(encoding="utf-8"))
    for joint, of_joint in told_again["joints"].items():
        assert of_joint["rmse_deg"] == pytest.approx(metrics["joints"][joint]["rmse_deg"], abs=0.02)
    assert told_again["grf"]["vertical_r"] == pytest.approx(metrics["grf"]["vertical_r"], abs=0.002)
    assert told_again["moments"]["ankle"]["peak_Nm_kg"] == pytest.approx(
        metrics["moments"]["ankle"]["peak_Nm_kg"], rel=0.01
    )
    assert told_again["per_leg"].keys() == {"left", "right"}
    told = capsys.readouterr().out
    assert f"{metrics['strides']['count'] // 2} left" in told and "Left out: the first 3 s." in told


@pytest.mark.parametrize("speed", [0.9, 1.3, 1.9])
def test_people_score_as_people(speed, tmp_path, capsys):
    rows = score_of(tmp_path, write_curves(tmp_path / "people.csv", speed, CURVES))
    for (curve, name), row in rows.items():
        if name == "rmse_deg":
            assert float(row["both"]) < 1e-4, curve
        elif name in ("r", "vertical_r", "forward_r"):
            assert float(row["both"]) == pytest.approx(1.0, abs=1e-5), curve
        elif name.startswith("within"):
            assert float(row["both"]) > 98, curve  # where the SD is 0, rounding counts
        elif row["people"] and "rmse" not in name:
            assert float(row["both"]) == pytest.approx(float(row["people"]), abs=1e-5), (curve, name)
    told = capsys.readouterr().out
    assert f"At {speed:.2f} m/s: thigh 0.0°" in told and "not scored: nothing" in told


def test_each_leg_is_scored_and_what_is_missing_is_named(tmp_path, capsys):
    path = write_curves(tmp_path / "legs.csv", 1.3, ("thigh", "knee"), ("_left", "_right"), shift=np.radians(4.0))
    rows = score_of(tmp_path, path)
    assert rows.keys() == {
        (joint, name) for joint in ("thigh", "knee") for name in ("rmse_deg", "r", "within_1sd_percent", "rmse_sd")
    }
    found = [float(rows["knee", "rmse_deg"][side]) for side in ("left", "right", "both")]
    assert found == pytest.approx([0.0, 4.0, 2.0], abs=1e-4)
    told = capsys.readouterr().out
    missing = "angle of the ankle, angle of the toe, vertical force, fore-aft force, moment of the hip"
    assert missing in told and "Mass: unknown. --mass gives it." in told
    assert "| these files (thigh for hip) | 1.30 | 2.0 | 2.0 | – | – |" in told
    assert "angles, SD between adults" in told and "all curves together, SD" in told


def test_one_leg_has_one_column(tmp_path):
    path = write_curves(tmp_path / "legs.csv", 1.3, ("thigh", "knee"), ("_left", "_right"))
    assert list(score_of(tmp_path, path, "--side", "right")["knee", "r"]) == ["curve", "number", "right", "people"]


BAD = (
    [],
    ["none.csv"],
    ["notes.doc"],
    ["bad.csv"],
    ["KNEE", "--columns", "knee"],
    ["KNEE", "--columns", "percent=a"],
    ["KNEE", "--mass", "1"],
    ["KNEE", "--mass", "60", "--mass", "70"],
    ["KNEE", "--speed", "9"],
    ["KNEE", "--height", "9"],
)


@pytest.mark.parametrize("words", BAD)
def test_bad_input_is_refused_in_the_words_of_person(words, tmp_path, monkeypatch, capsys):
    knee = write_curves(tmp_path / "knee.csv", 1.3, ("knee", "ankle"))
    (tmp_path / "bad.csv").write_text("percent,knee_flexion_deg\n0,x\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    told = []
    for command in ("person", "score"):
        try:
            code = main([command, *(str(knee) if word == "KNEE" else word for word in words)])
        except SystemExit as end:
            code = end.code
        assert code == 2
        told.append(capsys.readouterr().err.replace(f"springfoot {command}", "springfoot"))
    assert told[0] == told[1] and told[0].count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


def test_a_start_longer_than_the_walk_is_refused(tmp_path, capsys):
    time = np.arange(0, 4, 0.01)
    lines = ["time_s,knee_flexion_deg", *(f"{t:.2f},{30 - 30 * np.cos(6 * t):.5f}" for t in time)]
    (tmp_path / "walk.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for words, error in (
        ("9", "walk.csv lasts 3.99 s, and 9 s are left out"),
        ("-1", "skip must be in [0, 10000] s, got -1"),
    ):
        for command in ("score", "person"):
            assert main([command, str(tmp_path / "walk.csv"), "--skip", words]) == 2
            assert error in capsys.readouterr().err


def test_every_published_walk_has_a_number_a_source_and_words_on_its_licence():
    for row in published_walks():
        assert all(row[name] for name in ("walk", "kind", "counted", "source", "place", "licence")), row
        numbers = [row[name] for name in BESIDE if name != "speed_m_s" and row[name]]
        assert numbers and all(float(number.lstrip("<> ")) > 0 for number in numbers), row
