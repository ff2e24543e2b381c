"""The files of an evaluation and its command line."""

import csv
import io
import itertools
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from springfoot.agents.policies.policy import Policy, fingerprint, save_policy
from springfoot.cli.evaluate import evaluate_main
from springfoot.envs import Biped, BipedSettings
from springfoot.envs.settings.settings import reference_gait, settings_from
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.numbers.series import GAIT_CYCLE_COLUMNS
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import load_recording, record
from springfoot.evaluation.report.gait_table import people_metrics, print_table, print_tables
from springfoot.evaluation.report.report import write_report
from springfoot.files.markdown import plus_minus
from springfoot.gait import SpringfootError
from springfoot.studies.walks.bodies import draw_pairs, walk_pairs

FILES = {
    "metrics.json",
    "gait_cycle.csv",
    "gait_cycle_left.csv",
    "gait_cycle_right.csv",
    "strides.npz",
    "every_stride.csv",
    "gait.png",
    "stiffness.png",
    "walk.gif",
    "stiffness_schedule.csv",
    "finite_states.json",
    "walk.mot",
    "walk.sto",
    "model.xml",
    "external_loads.xml",
}
PARQUET = {"every_stride.parquet"}  # where pyarrow is installed


def walked(episodes=2, name="schedule", **settings):
    policy, environment = policy_and_settings(name, {"episode_seconds": 6.0} | settings)
    return record(policy, environment, name=name, episodes=episodes, threads=1)


@pytest.fixture(scope="module")
def recording():
    return walked()


@pytest.fixture(scope="module")
def folder(recording, tmp_path_factory):
    write_report(path := tmp_path_factory.mktemp("report"), recording, measure(recording))
    return path


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_folder_holds_what_it_promises(folder, recording):
    assert {path.name for path in folder.iterdir()} - PARQUET == FILES
    metrics = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    assert metrics == measure(load_recording(folder / "strides.npz")).metrics


def test_gait_cycles_have_a_row_for_each_percent_and_a_spread_for_each_curve(folder):
    for name in ("gait_cycle", "gait_cycle_left", "gait_cycle_right"):
        rows = rows_of(folder / f"{name}.csv")
        assert [int(row["percent"]) for row in rows] == list(range(101))
        assert set(GAIT_CYCLE_COLUMNS) | {f"{curve}_sd" for curve in GAIT_CYCLE_COLUMNS} < set(rows[0])
    counts = [int(rows_of(folder / f"gait_cycle{foot}.csv")[0]["n"]) for foot in ("_left", "_right", "")]
    assert counts[0] + counts[1] == counts[2] > 2


def test_csv_and_metrics_agree(folder):
    metrics = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    vertical = [float(row["grf_vertical_bw"]) for row in rows_of(folder / "gait_cycle.csv")]
    assert max(vertical[3:26]) == pytest.approx(metrics["grf"]["vertical_peak1_bw"], rel=1e-5)
    assert max(vertical[35:61]) == pytest.approx(metrics["grf"]["vertical_peak2_bw"], rel=1e-5)


@pytest.mark.slow
def test_a_walk_that_only_falls_is_reported_too(tmp_path):
    fallen = walked(episodes=1, name="constant", push_newton=3000.0, push_interval=0.5)
    gait = measure(fallen)
    assert gait.metrics["falls"] == 1 and gait.metrics["strides"]["count"] == 0
    write_report(tmp_path, fallen, gait)
    assert {path.name for path in tmp_path.iterdir()} - PARQUET == FILES
    assert "nan" not in (tmp_path / "gait_cycle.csv").read_text(encoding="utf-8").lower()
    assert rows_of(tmp_path / "gait_cycle.csv")[50]["knee_flexion_deg"] == ""
    text = printed(gait.metrics)
    assert "1 of 1" in text and "fell" in text


def printed(metrics, **console):
    stream = io.StringIO()
    print_table(metrics, Console(file=stream, highlight=False, **console))
    return stream.getvalue()


def test_the_table_is_plain_text_within_80_columns(recording):
    text = printed(measure(recording).metrics, width=80)
    assert "\x1b" not in text and "…" not in text
    for words in ("falls", "knee angle, RMSE", "vertical force, peak 1", "people", "cost of transport"):
        assert words in text


def test_a_narrow_terminal_cuts_no_number_of_the_table(recording):
    metrics = measure(recording).metrics
    wide, narrow = (printed(metrics, width=width) for width in (100, 60))
    tables = [text.split("toe feedback")[0].split("─")[-1] for text in (wide, narrow)]
    cells = [sorted(re.findall(r"[-+]?\d[\d./]*", table)) for table in tables]
    assert len(cells[0]) > 60 and cells[0] == cells[1]
    assert max(map(len, tables[1].splitlines())) <= 60 and "…" not in narrow


def walks_in(text):
    """Return the lines of the speed, one for each table, and all lines, without the spaces that align them."""
    lines = [" ".join(line.split()) for line in text.splitlines()]
    return [line for line in lines if line.startswith("speed")], lines


def test_several_policies_are_the_columns_of_one_table_unless_the_terminal_is_too_narrow(recording):
    walks = [measure(recording).metrics, measure(walked(name="constant", push_newton=900.0)).metrics]
    speeds = [plus_minus(walk["speed_m_s"], ".3f") for walk in walks]

    def together(**console):
        print_tables(walks, Console(file=(stream := io.StringIO()), highlight=False, **console))
        return walks_in(stream.getvalue())

    assert walks[1]["fall_reasons"]
    for console in ({"width": 40}, {"width": 80, "force_terminal": True, "color_system": None}):  # a pipe has no width
        rows, lines = together(**console)
        assert rows == [f"speed m/s {speeds[0]} {speeds[1]} 1.200"]
        assert "schedule constant people" in lines
        assert all(f"constant: {count} × {reason}" in lines for reason, count in walks[1]["fall_reasons"].items())
    rows, lines = together(width=60, force_terminal=True, color_system=None)
    assert rows == [f"speed, m/s {speeds[0]} 1.200"]  # the other fell too early to have one
    assert lines.count("model people r in ±SD") == 2


def test_policies_beside_different_people_have_a_table_each(recording):
    faster = walked(speed=1.4)
    print_tables([measure(walk).metrics for walk in (recording, faster)], Console(file=(stream := io.StringIO())))
    rows, _ = walks_in(stream.getvalue())
    assert [row.split()[-1] for row in rows] == ["1.200", "1.400"]


def test_a_legend_explains_the_words_of_the_table(recording):
    text = printed(measure(recording).metrics, width=80)
    legend = text.split("toe feedback")[1]
    words = (
        "people",
        "±",
        "return",
        "RMSE",
        "r",
        "in ±SD",
        "BW",
        "effort",
        "CoM",
        "CoP",
        "ZMP",
        "stiffness",
        "feedback",
    )
    for word in (*words, "cost of transport", "rest angles"):
        assert f"{word}: " in legend or f"{word}, no unit: " in legend, word
    assert "springs' rest angles planned" in text and "of both" in legend


def test_people_beside_the_model_are_those_of_the_reference():
    people = people_metrics(BipedSettings())
    assert people["step_length_m"] == pytest.approx(0.655, abs=0.005)
    assert people["toe_off_percent"] == pytest.approx(63.3, abs=0.2)
    assert people["moments"]["ankle"] == pytest.approx(1.31, abs=0.02)
    assert people["fibre_J_kg_m"] == pytest.approx(2.99, abs=0.05)


def test_an_episode_is_the_same_whatever_runs_beside_it(recording):
    more = walked(episodes=3)
    for name, values in recording.series.items():
        assert np.array_equal(values, more.series[name][:2], equal_nan=True), name
    assert np.array_equal(recording.returns, more.returns[:2])


def test_every_tick_is_recorded_and_what_a_constant_sets_arrives_in_the_curves():
    held = walked(episodes=1, name="constant")
    assert held.ticks[0] == 600
    assert held.series["stiffness"][0] == pytest.approx(np.tile([300.0, 40.0], (600, 2, 1)), rel=1e-6)
    assert measure(held).both.mean("ankle_stiffness_Nm_per_rad") == pytest.approx(300.0, rel=1e-6)


def test_conditions_are_the_same_for_every_policy_and_flags_win():
    _, standard = policy_and_settings("schedule", {})
    assert (standard.height, standard.mass, standard.speed, standard.push_newton) == (1.70, 63.0, 1.2, 0.0)
    _, flagged = policy_and_settings("thesis", {"speed": 1.0, "equilibrium": "angle"})
    assert (flagged.speed, flagged.equilibrium) == (1.0, "angle")


def test_a_policy_file_with_no_weight_walks_as_the_untrained_in_the_same_conditions(tmp_path):
    biped = Biped(BipedSettings(speed=1.1, push_newton=120.0), 1)
    size = len(biped.observation_names)
    zero = Policy(
        settings=biped.settings,
        fingerprint=fingerprint(biped),
        weights=(np.zeros((8, size)), np.zeros((4, 8))),
        biases=(np.zeros(8), np.zeros(4)),
        observation_mean=np.zeros(size),
        observation_variance=np.ones(size),
    )
    save_policy(tmp_path / "zero.safetensors", zero)
    policy, settings = policy_and_settings(str(tmp_path / "zero.safetensors"), {"episode_seconds": 2.0})
    assert (settings.speed, settings.push_newton) == (1.2, 0.0)
    untrained = walked(1, "untrained", episode_seconds=2.0)
    assert np.array_equal(record(policy, settings, name="zero", episodes=1).returns, untrained.returns)


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """Runs evaluate.py in an empty folder: (exit code, standard output, standard error)."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["evaluate.py", *words])
        try:
            code = evaluate_main()
        except SystemExit as exit:  # what tyro does with a flag it does not know
            code = exit.code
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


@pytest.mark.slow
def test_the_command_numbers_its_folders_and_says_where_they_are(command, tmp_path):
    (tmp_path / "runs" / "eval-random-1").mkdir(parents=True)
    code, out, _ = command("random", "--episodes", "1", "--seconds", "1")
    assert code == 0
    assert str(Path("runs", "eval-random-2")) in out
    assert {path.name for path in (tmp_path / "runs").iterdir()} == {"eval-random-1", "eval-random-2"}
    written = {path.name for path in (tmp_path / "runs" / "eval-random-2").iterdir()}
    assert written - PARQUET == {*FILES, "report.html"}
    assert set(out.splitlines()[-1].split(", ")) == written


@pytest.mark.slow
def test_a_gait_that_was_measured_here_can_be_walked_after(command, folder, tmp_path):
    curves = folder / "gait_cycle.csv"
    code, out, _ = command("schedule", "--episodes", "1", "--seconds", "10", "--human", str(curves), "--out", "own")
    assert code == 0 and "own: gait_cycle.csv; people's instead: nothing" in out
    assert "frozen:" not in out  # a schedule has no copy to be walked next
    metrics = json.loads((tmp_path / "own" / "metrics.json").read_text(encoding="utf-8"))
    first = rows_of(curves)[0]
    assert metrics["falls"] == 0
    assert metrics["reference"]["condition"] == "gait_cycle.csv"
    assert metrics["reference"]["speed_m_s"] == float(first["speed_m_s"])
    own = reference_gait(settings_from(**metrics["environment"]))
    assert np.degrees(own.mean("knee", 0.0)) == pytest.approx(float(first["knee_flexion_deg"]), abs=1.0)
    assert metrics["cadence_steps_min"] == pytest.approx(120 / own.stride_time, rel=0.05)


@pytest.mark.parametrize(
    "words",
    [
        ["nonsense"],
        ["constant", "--mass", "-3"],
        ["constant", "--episodes", "0"],
        ["constant", "--seconds", "0"],
        ["constant", "--episodes", "1", "--seconds", "1e12", "--out", "large"],
        ["constant", "--seed", "-1"],
        ["constant", "--ankle-stiffness-range", "800", "20"],
        ["constant", "--equilibrium", "phase"],
        ["constant:1,2,3"],
        ["foreign.safetensors"],
        ["constant", "--human", "foreign.safetensors"],
        ["constant", "--human", "nothing.csv"],
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_written(command, tmp_path, words):
    (tmp_path / "foreign.safetensors").write_bytes(b"12345678 no policy")
    code, out, err = command(*words)
    assert code == 2
    assert len(err.strip().splitlines()) == 1 and out == ""
    assert [path.name for path in tmp_path.iterdir()] == ["foreign.safetensors"]


def test_an_existing_folder_is_refused_before_anything_runs(command, tmp_path):
    (tmp_path / "mine").mkdir()
    code, _, err = command("constant", "--out", "mine")
    assert code == 2 and "mine" in err
    assert not list((tmp_path / "mine").iterdir())


def test_a_foreign_policy_name_lists_what_is_allowed():
    with pytest.raises(SpringfootError, match=r"run folder.*pretrained.*thesis"):
        policy_and_settings("nonsense", {})


# The page of metrics says what all of it means ----------------------------------------------------------------------

DOCUMENT = (Path(__file__).parents[3] / "docs" / "reference" / "metrics.md").read_text(encoding="utf-8")


def documented(heading):
    """Names in the first column of the table under `heading`, {a,b} written out."""
    lines = DOCUMENT.split(f"{heading}")[1].split("\n#")[0].splitlines()
    cells = [line.split("|")[1] for line in lines if line.startswith("| `")]
    names = [name for cell in cells for name in re.findall(r"`([^`]+)`", cell)]
    parts = [[part.strip("{}").split(",") for part in re.split(r"\.(?![^{]*})", name)] for name in names]
    return [".".join(name) for part in parts for name in itertools.product(*part)]


def keys_of(value, at=""):
    if not isinstance(value, dict) or at in ("environment.", "fall_reasons."):
        return [at.removesuffix(".")]
    return [key for name, inner in value.items() for key in keys_of(inner, f"{at}{name}.")]


def test_every_number_is_documented_and_nothing_else(folder):
    metrics = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    assert sorted(documented("## `metrics.json`")) == sorted(keys_of(metrics))


def test_every_column_and_array_is_documented_and_nothing_else(folder):
    columns = rows_of(folder / "gait_cycle.csv")[0]
    assert sorted(documented("### `gait_cycle.csv`")) == sorted(
        set(columns) - {f"{curve}_sd" for curve in GAIT_CYCLE_COLUMNS}
    )
    with np.load(folder / "strides.npz") as file:
        assert sorted(documented("### `strides.npz`")) == sorted(file)
    assert (*documented("### `every_stride.csv`"), *GAIT_CYCLE_COLUMNS) == (*rows_of(folder / "every_stride.csv")[0],)
    assert sorted(documented("### `stiffness_schedule.csv`")) == sorted(rows_of(folder / "stiffness_schedule.csv")[0])
    states = json.loads((folder / "finite_states.json").read_text(encoding="utf-8"))
    inside = {f"states[].{key}" for state in states["states"] for key in keys_of(state)}
    assert sorted(documented("### `finite_states.json`")) == sorted({*states, *inside} - {"states"})


def test_every_column_of_a_pair_is_documented_and_nothing_else():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 0.1})
    pairs = walk_pairs(policy, settings, draw_pairs(settings, 1), name="schedule")
    assert documented("### `pairs.csv`") == list(pairs[0])
