"""Schedules that an evaluation writes, and that are policies again: K over the stride, and finite states."""

import csv
import json

import numpy as np
import pytest

from springfoot.agents.policies.baselines import has_feedback
from springfoot.cli.evaluate import evaluate_main
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.settings import settings_from
from springfoot.envs.task.observation import OBSERVATION
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.open_loop import decisions_of
from springfoot.evaluation.recording.policies import policy_and_settings, policy_label
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.schedule_tables import STATES, schedule_curves, write_schedules
from springfoot.gait import SpringfootError
from springfoot.gait.springs.stiffness import SPRINGS


def walked(name, episodes=4, **given):
    policy, settings = policy_and_settings(str(name), {"episode_seconds": 8.0} | given)
    return record(policy, settings, name=str(name), episodes=episodes, threads=1)


@pytest.fixture(scope="module")
def recording():
    return walked("pretrained")


@pytest.fixture(scope="module")
def folder(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("schedules")
    write_schedules(path, recording)
    return path


def test_the_schedule_of_a_walk_is_a_policy_that_walks_the_same_gait(folder, recording):
    played = walked(folder / "stiffness_schedule.csv")
    assert (played.fall_reason == "").all()
    own, again = measure(recording), measure(played)
    for column in ("thigh_flexion_deg", "knee_flexion_deg", "ankle_dorsiflexion_deg"):
        assert np.sqrt(((own.both.mean(column) - again.both.mean(column)) ** 2).mean()) < 0.3


def test_what_a_schedule_says_is_what_it_plays_on_each_side(folder, tmp_path):
    with (folder / "stiffness_schedule.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["percent"]) for row in rows] == list(range(101))
    for row in rows:
        row["ankle_right_stiffness_Nm_per_rad"] = "123.0"
        del row["sha256"]
    with (tmp_path / "limp.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    played = walked(tmp_path / "limp.csv", episodes=1)
    percent = [float(row["percent"]) / 100 for row in rows]
    for side, name in enumerate(SIDES):
        phase, stiffness = decisions_of(played, [side])
        for joint, spring in enumerate(SPRINGS):
            said = [float(row[f"{spring}_{name}_stiffness_Nm_per_rad"]) for row in rows]
            assert stiffness[:, joint] == pytest.approx(np.interp(phase, percent, said), rel=1e-3)


def test_mean_and_spread_of_a_schedule_are_those_put_in():
    policy, settings = policy_and_settings("constant", {"episode_seconds": 12.0})
    random = np.random.default_rng(1)
    scatter = np.array([0.05, 0.02, 0.05, 0.02])

    def scattered(observation):  # actions are on a log scale
        return policy(observation) + random.normal(0, scatter, (len(observation), 4)).astype(np.float32)

    curves = schedule_curves(record(scattered, settings, name="", episodes=8, threads=1))
    low, high = settings.ankle_stiffness_range
    expected = 300.0 * 0.05 * np.log(high / low) / 2
    assert curves["ankle_left_stiffness_Nm_per_rad"].mean() == pytest.approx(300.0, rel=0.02)
    assert curves["ankle_left_stiffness_Nm_per_rad_sd"].mean() == pytest.approx(expected, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("side", SIDES)
def test_the_finite_states_of_a_walk_are_a_policy_that_walks(folder, side):
    file = folder / f"finite_states_{side}.json"  # its toes are not alike
    table = json.loads(file.read_text(encoding="utf-8"))
    assert [state["name"] for state in table["states"]] == list(STATES)
    played = walked(file, episodes=20, episode_seconds=20.0)
    assert (played.fall_reason == "").all() and played.settings.equilibrium == "phase"
    lines = played.settings.schedule
    assert lines is not None
    for state, ankle, toe in zip(table["states"], lines.ankle, lines.toe, strict=True):
        assert ankle == pytest.approx(
            (state["phase"], state["ankle"]["stiffness_Nm_per_rad"], np.radians(state["ankle"]["equilibrium_deg"]))
        )
        assert toe.stiffness == pytest.approx(state["toe"]["stiffness_Nm_per_rad"])


def test_a_finite_state_has_the_mean_stiffness_and_the_mean_torque_of_the_walk(folder, recording):
    states = json.loads((folder / "finite_states_left.json").read_text(encoding="utf-8"))["states"]
    after = {
        name: values[:, 300:, 0].reshape(-1, *values.shape[3:])
        for name, values in recording.series.items()
        if name in ("angle", "velocity", "torque", "stiffness")
    }
    phase = recording.series["phase"][:, 300:, 0].ravel() % 1.0
    inside = (phase >= states[2]["phase"]) & (phase < states[3]["phase"])
    ankle = {name: values[inside, 0 if name == "stiffness" else 2].mean() for name, values in after.items()}
    own = states[2]["ankle"]
    torque = own["stiffness_Nm_per_rad"] * (
        np.radians(own["equilibrium_deg"]) - ankle["angle"] - own["damping_time_s"] * ankle["velocity"]
    )
    assert own["stiffness_Nm_per_rad"] == pytest.approx(ankle["stiffness"], rel=1e-5)
    assert torque == pytest.approx(ankle["torque"], rel=1e-5)


def test_schedules_scale_with_the_body_and_go_with_flags(folder):
    for name in ("stiffness_schedule.csv", "finite_states_right.json"):
        observation = np.zeros((3, 43), np.float32)
        small, large = (
            policy_and_settings(str(folder / name), {"height": h, "mass": m}) for h, m in ((1.6, 55.0), (1.9, 95.0))
        )
        assert np.array_equal(small[0](observation), large[0](observation))  # actions are of the body's own range
        assert policy_and_settings(str(folder / name), {"equilibrium": "neutral"})[1].equilibrium == "neutral"
    schedules = [settings.schedule for _, settings in (small, large)]
    springs = [schedule.ankle[0] for schedule in schedules if schedule is not None]
    assert springs[1].stiffness / springs[0].stiffness == pytest.approx(95.0 * 1.9 / (55.0 * 1.6))


def test_a_schedule_taken_with_springs_of_phases_brings_their_rest_angles(tmp_path):
    recording = walked("thesis")
    write_schedules(tmp_path, recording)
    played = walked(tmp_path / "stiffness_schedule.csv")
    assert played.settings.equilibrium == "phase" and (played.fall_reason == "").all()
    own, again = (measure(each).both for each in (recording, played))
    for column in ("ankle_dorsiflexion_deg", "knee_flexion_deg"):
        assert np.sqrt(((own.mean(column) - again.mean(column)) ** 2).mean()) < 2.0


def test_a_table_of_two_columns_is_a_schedule_of_both_legs_of_the_reference_body(tmp_path):
    (tmp_path / "mine.csv").write_text(
        "percent,ankle_stiffness_Nm_per_rad,toe_stiffness_Nm_per_rad\n0,100,20\n50,300,40\n", encoding="utf-8"
    )
    policy, settings = policy_and_settings(str(tmp_path / "mine.csv"), {})
    same, _ = policy_and_settings("constant:200,30", {})
    quarter = np.zeros((1, 43), np.float32)
    names = [entry.name for entry in OBSERVATION]
    quarter[0, names.index("phase_sin")] = 1.0
    assert settings == settings_from() and policy(quarter) == pytest.approx(same(quarter), abs=1e-6)


def test_no_copy_and_a_label_without_folders():
    assert not has_feedback("runs/eval/stiffness_schedule.csv") and not has_feedback("mine.json")
    assert policy_label("runs/eval/finite_states.json") == "finite_states"


LABELS = {
    "...csv": "policy",
    "..csv": "policy",
    ".hidden.csv": "hidden",
    "frozen:..safetensors": "frozen-policy",
    "a\nb\t\x1b\udcff\\.csv": "a-b----",
    "Gang, 3 (zwölf).csv": "Gang, 3 (zwölf)",
    f"{'x' * 200}.csv": "x" * 60,
}


@pytest.mark.parametrize("name", LABELS, ids=ascii)
def test_a_label_is_a_folder_inside_that_of_the_results(name, tmp_path):
    assert policy_label(name) == LABELS[name]
    (tmp_path / LABELS[name]).mkdir()
    assert [path.name for path in tmp_path.iterdir()] == [LABELS[name]]


HEAD = "percent,ankle_stiffness_Nm_per_rad,toe_stiffness_Nm_per_rad"
STATE = {joint: {"stiffness_Nm_per_rad": 50.0, "equilibrium_deg": 1.0} for joint in SPRINGS}
BAD = [
    ("a.csv", None, "no file a.csv"),
    ("a.csv", "x,y\n1,2\n", "a.csv, line 1: needs a column percent, of the leg's stride"),
    (
        "a.csv",
        "percent,ankle_stiffness_Nm_per_rad\n0,2\n",
        "a.csv, line 1: needs a column toe_stiffness_Nm_per_rad, or toe_left_stiffness_Nm_per_rad and "
        "toe_right_stiffness_Nm_per_rad",
    ),
    ("a.csv", f"{HEAD}\n0,100,\n", "a.csv, line 2, column toe_stiffness_Nm_per_rad: must be a number, got ''"),
    ("a.csv", f"{HEAD}\n0,100,-1\n", "a.csv: stiffness must be above 0 and at most 100000 N m/rad, got -1 to 100"),
    (
        "a.csv",
        f"{HEAD}\n0,100,1\n0,100,1\n",
        "a.csv, line 3, column percent: 0 must be greater than 0 in the row before",
    ),
    ("a.csv", f"{HEAD}\n101,100,1\n", "a.csv, line 2, column percent: must be in [0, 100], got 101"),
    ("a.csv", f"{HEAD}\n100,100,1\n", "a.csv needs a row of less than 100 percent"),
    (
        "a.csv",
        f"equilibrium,{HEAD}\nmine,0,100,1\n",
        "a.csv, line 2, column equilibrium: must be one of planned, angle, neutral, phase, got 'mine'",
    ),
    ("a.json", None, "no file a.json"),
    (
        "a.json",
        "[1]",
        "a.json is no table of finite states: it must be an object in braces",
    ),
    (
        "a.json",
        '{"states": 1}',
        "a.json is no table of finite states: an object with states, a list in which each has phase, ankle and toe, "
        "and these stiffness_Nm_per_rad, damping_time_s, equilibrium_deg",
    ),
    (
        "a.json",
        json.dumps({"states": [{"phase": 0.0, **STATE, "toe": {"stiffness_Nm_per_rad": None}}]}),
        "a.json: toe stiffness_Nm_per_rad must be a finite number > 0 N m/rad, got None",
    ),
    (
        "a.json",
        json.dumps({"states": [{"phase": 0.0, **STATE, "toe": STATE["toe"] | {"damping_time_s": 0.1}}]}),
        "a.json: toe damping_time_s must be 0.02 s, the model's, got 0.1",
    ),
    (
        "a.json",
        json.dumps({"states": [{"phase": 0.5, **STATE}, {"phase": 0.2, **STATE}]}),
        "a.json: ankle segments must ascend in phase, at least one, got starts [0.5, 0.2]",
    ),
    ("a.json", json.dumps({"states": []}), "a.json: ankle segments must ascend in phase, at least one, got starts []"),
    ("a.json", '{"states": ' + "[" * 100_000, "a.json is no table of finite states"),
]


@pytest.mark.parametrize(("name", "text", "said"), BAD)
def test_a_file_that_is_no_schedule_is_refused_in_one_line(name, text, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if text is not None:
        (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(SpringfootError) as error:
        policy_and_settings(name, {})
    assert str(error.value).startswith(said)
    assert evaluate_main([name]) == 2
    assert capsys.readouterr().err.splitlines() == [f"evaluate.py: error: {error.value}"]
    assert not (tmp_path / "runs").exists()


def test_a_walk_without_decisions_has_empty_tables_that_are_refused(tmp_path):
    write_schedules(tmp_path, walked("schedule", episodes=1, episode_seconds=1.0))
    assert "nan" not in (tmp_path / "stiffness_schedule.csv").read_text(encoding="utf-8")
    for name in ("stiffness_schedule.csv", "finite_states.json"):
        with pytest.raises(SpringfootError, match="must be a"):
            policy_and_settings(str(tmp_path / name), {})
