"""train.py as it is typed: flags, refusals that leave nothing behind, Ctrl-C, and going on."""

import itertools
import json
import math
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import tyro

import train
from springfoot.agents.policies.policy import read_policy
from springfoot.agents.training.config import PRESETS, TrainingConfig, config_to_json
from springfoot.agents.training.run_record import RLLIB, write_record
from springfoot.cli import train as train_command
from springfoot.cli.main import main as springfoot
from springfoot.envs.settings.settings import THEME_OF, THEMES, BipedSettings, settings_to_json
from springfoot.studies.base.flags import SettingsFlags, given

SCRIPT, RUN = Path(train.__file__), "run.json"
SHORT = [
    *("--num-envs", "8", "--threads", "1", "--update-steps", "1024", "--eval-interval", "1024"),
    *("--eval-episodes", "2", "--episode-seconds", "1"),
]


def main(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["train.py", *map(str, words)])
    return train_command.train_main()


def test_every_setting_is_a_flag_with_the_settings_own_help(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "100")  # a wider one sets groups side by side
    with pytest.raises(SystemExit) as stopped:
        main(monkeypatch, "--help")
    assert stopped.value.code == 0
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())  # frames of the groups
    for name in (*BipedSettings.__dataclass_fields__, *TrainingConfig.__dataclass_fields__):
        assert name == "environment" or f"--{name.replace('_', '-')} " in text
    assert "Commanded walking speed [m/s]. (default: 1.2)" in text
    assert "None" not in text.replace("(default: None)", "")


def test_help_breaks_lines_only_where_they_are_full(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        main(monkeypatch, "--help")
    lines = [line.strip("│ ") for line in capsys.readouterr().out.splitlines()]
    (first,) = (k for k, line in enumerate(lines) if line.startswith("--begin-from"))
    text = lines[first + 1 : first + 5]  # names of values as long as these stand on a line of their own
    assert text[0].startswith("Folder of a run") and text[3].endswith("not.")
    assert all(len(line) + 1 + len(after.split()[0]) > 53 for line, after in itertools.pairwise(text))


def flagged(*words: str) -> dict:
    """The settings that these words on a command line give."""
    return given(tyro.cli(SettingsFlags, args=words))


def test_flags_that_were_not_given_are_not_given():
    assert flagged() == {}
    assert flagged("--height", "1.8", "--start", "random") == {"height": 1.8, "start": "random"}
    assert flagged("--stop-at", "None", "--height-range", "None") == {"stop_at": None, "height_range": None}


def test_lists_are_json_text_or_a_file(tmp_path):
    feet = [{"foot": {"kind": "passive", "ankle_stiffness": [150, 1500]}, "on": "both"}, {"foot": "rigid"}]
    (tmp_path / "feet.json").write_text(json.dumps(feet))
    words = ["--drawn-feet", json.dumps(feet), "--drawn-bodies", "None"]
    assert flagged(*words) == {"drawn_feet": feet, "drawn_bodies": None}
    assert flagged("--drawn-feet", str(tmp_path / "feet.json")) == {"drawn_feet": feet}
    (tmp_path / "foot.json").write_text(json.dumps(feet[0]))
    with pytest.raises(SystemExit):
        flagged("--drawn-feet", str(tmp_path / "foot.json"))
    config = train_command.configured(PRESETS["walk"], {}, flagged(*words))
    assert settings_to_json(config.environment)["drawn_feet"][0]["foot"]["ankle_stiffness"] == [150.0, 1500.0]


def test_help_groups_the_settings_by_theme_and_says_what_a_trained_policy_brings(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "100")
    with pytest.raises(SystemExit):
        flagged("--help")
    _, *parts = re.split(r"(\w+) options [-─╮]+", " ".join(capsys.readouterr().out.replace("│", " ").split()))
    groups = dict(zip(parts[::2], parts[1::2], strict=True))
    assert list(groups) == list(THEMES)
    for theme, says in THEMES.items():
        assert says in groups[theme]
        for name, its in THEME_OF.items():
            assert (f"--{name.replace('_', '-')} " in groups[theme]) == (its == theme), name
    assert "a trained policy brings nothing with it" in groups["body"]
    assert "a trained policy brings --speed-rate with it" in groups["speed"]
    assert "nothing" in groups["episode"] and "A trained policy brings its own." in groups["springs"]


def test_a_flag_of_a_yes_or_no_is_yes_alone_and_takes_both_words(capsys):
    for words, value in ((["--mirrored"], True), (["--mirrored", "True"], True), (["--mirrored", "False"], False)):
        flags = tyro.cli(train_command.TrainingFlags, args=[*words, "--seed", "3"])
        assert given(flags) == {"mirrored": value, "seed": 3}
    for words in (["--mirrored", "yes"], ["--mirrored", "True", "False"]):
        with pytest.raises(SystemExit):
            tyro.cli(train_command.TrainingFlags, args=words)
    assert "must be one of True, False, got 'yes'" in " ".join(capsys.readouterr().err.replace("│", " ").split())


def test_flags_take_the_place_of_the_preset():
    preset = PRESETS["walk"]
    config = train_command.configured(preset, {"timesteps": 5}, {"height": 1.8, "ankle_stiffness_range": (30, 300)})
    assert config.timesteps == 5 and config.learning_rate == preset.learning_rate
    assert config.environment.height == 1.8
    assert config.environment.ankle_stiffness_range == (30.0, 300.0)
    assert config.environment.push_newton == preset.environment.push_newton
    assert PRESETS["any-body"].environment.height_range is not None
    assert train_command.configured(PRESETS["any-body"], {}, {"height_range": None}).environment.height_range is None


def test_a_task_takes_no_preset_and_no_other_action(tmp_path, capsys):
    words = ["--task", "Walk-v0", "--out", str(tmp_path / "run")]
    for more, message in (
        (["--preset", "person"], "--task begins a training with its own preset; drop --resume or --preset"),
        (["--decisions", "event"], "--task does not leave decisions open; drop --decisions"),
        (["--people-file", "people.json"], "--task does not leave people_file open; drop --people-file"),
    ):
        assert train_command.train_main([*words, *more]) == 2
        assert capsys.readouterr().err == f"train.py: error: {message}\n"
    assert list(tmp_path.iterdir()) == []


def test_given_weights_leave_the_others_of_the_preset():
    preset = PRESETS["person"]
    weights = train_command.configured(preset, {}, {"reward_weights": {"pose": 1.0}}).environment.reward_weights
    assert weights == preset.environment.reward_weights | {"pose": 1.0}
    assert weights["fibre_work"] == -45.0


def test_human_names_a_file_one_of_its_conditions_or_several_files(tmp_path):
    rows = [f"{percent},{10 + percent % 100 / 2},{name}" for name in ("slow", "fast") for percent in range(101)]
    (tmp_path / "mean.csv").write_text("\n".join(["percent,knee_flexion_deg,condition", *rows]))
    own = flagged("--human", f"{tmp_path / 'mean.csv'}:fast")["human"]
    assert own["name"] == "mean.csv:fast" and list(own["mean"]) == ["knee"]
    configured = train_command.configured(PRESETS["walk"], {}, {"human": own})
    assert settings_to_json(configured.environment)["human"] == own
    time = [k / 100 for k in range(500)]
    thigh = [f"{t},{20 * math.cos(2 * math.pi * t)}" for t in time]
    knee = [f"{t},{30 - 30 * math.cos(2 * math.pi * (t - 0.22))}" for t in time]
    for name, curve in (("thigh", thigh), ("knee", knee)):
        (tmp_path / f"{name}.csv").write_text("\n".join([f"time_s,{name}_flexion_deg", *curve]))
    own = flagged("--human", f"{tmp_path / 'thigh.csv'},{tmp_path / 'knee.csv'}")["human"]
    assert own["name"] == "thigh.csv,knee.csv" and own["stride_time"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--out", "new", "--human", "nothing.csv"], "no file nothing.csv"),
        (["--out", "new", "--human", "file"], "must be a .csv, .txt, .mot, .sto or .c3d file"),
        ([], "give either --out NEW_FOLDER or --resume FOLDER"),
        (["--out", "new", "--resume", "old"], "give either"),
        (["--out", "new", "--mass", "-1"], "mass must be"),
        (["--out", "new", "--ankle-stiffness-range", "800", "20"], "ankle_stiffness_range must be"),
        (["--out", "new", "--reward-weights", '{"speeed": 1}'], "'speeed'"),
        (["--out", "new", "--timesteps", "0"], "timesteps must be"),
        (["--out", "new", "--equilibrium", "phase"], "schedule"),
        (["--out", "file/new"], "cannot make the folder"),
        (["--out", "file"], "already exists"),
        (["--resume", "old"], "holds no run"),
        (["--resume", "old", "--height", "1.8"], "drop --height"),
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_on_disk(monkeypatch, capsys, tmp_path, words, message):
    (tmp_path / "file").write_text("kept")
    monkeypatch.chdir(tmp_path)
    assert main(monkeypatch, *words) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.count("\n") == 1 and message in error
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize("words", [["--hight", "1.7"], ["--height", "tall"], ["--reward-weights", "nothing.json"]])
def test_what_is_no_flag_is_refused(monkeypatch, capsys, tmp_path, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(monkeypatch, "--out", "new", *words)
    assert stopped.value.code == 2
    assert words[0] in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_it_ends_with_where_the_results_lie_and_what_to_type_next(monkeypatch, capsys, tmp_path):
    (tmp_path / "weights.json").write_text('{"grf": 0.1}')
    weights = tmp_path / "weights.json"
    words = ["--out", tmp_path / "run", "--timesteps", "1024", *SHORT, "--reward-weights", weights]
    assert main(monkeypatch, *words) == 0
    out, progress = capsys.readouterr()
    assert "0 of 1,024 steps · return " in progress and "1,024 of 1,024 steps · return " in progress
    assert f"Results: {tmp_path / 'run'} (best.safetensors" in out
    assert re.search(r"Best: .* of 2 episodes fell under pushes of ±150 N within 1 s, after", out)
    assert f"springfoot evaluate {tmp_path / 'run'}" in out
    assert read_policy(tmp_path / "run").settings.reward_weights == {"grf": 0.1}


def test_what_to_type_next_depends_on_what_was_learned():
    def lines(*returns, status="finished", **settings):
        evaluations = [{"timesteps": 1000 * k, "return_mean": value} for k, value in enumerate(returns)]
        config = {"timesteps": 5000, "environment": settings_to_json(BipedSettings(**settings))}
        record = {"config": config, "status": status, "sessions": [], "evaluations": evaluations}
        return train_command.next_lines(record, Path("runs/a walk"))

    evaluate, resume = "springfoot evaluate 'runs/a walk'", "springfoot train --resume 'runs/a walk'"
    assert lines(1.0, 3.0, 2.0) == [f"Next:    {evaluate}"]
    assert lines(1.0, 3.0, status="interrupted") == [f"Next:    {evaluate}", f"Or:      {resume}"]
    assert (
        lines(status="interrupted")
        == lines(2.0, status="interrupted")
        == [f"Next:    {evaluate}", f"Or:      {resume}"]
    )
    nothing = "Learned: nothing yet, the last return, 2.0, is not above the first, 2.0"
    assert lines(2.0, 3.0, 2.0) == [nothing, f"Next:    {resume} --timesteps 5000", f"Or:      {evaluate}"]
    assert lines(2.0, 2.0, status="interrupted") == [nothing, f"Next:    {resume}", f"Or:      {evaluate}"]
    note = "Note:    evaluate has no pushes, draws nothing unless flags ask: returns differ"
    assert lines(1.0, 2.0, push_newton=150.0) == lines(1.0, 2.0, mass_range=(50, 90)) == [f"Next:    {evaluate}", note]


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_leaves_a_usable_policy_and_a_run_to_go_on_with(monkeypatch, tmp_path, number):
    folder = tmp_path / "run"
    command = [sys.executable, SCRIPT, "--out", folder, "--timesteps", "10_000_000", *SHORT]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            deadline = time.monotonic() + 60
            while not (folder / RUN).exists() or json.loads((folder / RUN).read_text())["timesteps"] < 1024:
                assert process.poll() is None, process.stderr and process.stderr.read()
                assert time.monotonic() < deadline
                time.sleep(0.05)
            process.send_signal(number)
            out, error = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 128 + number, error
    assert "Traceback" not in error
    assert f"springfoot train --resume {folder}" in out
    record = json.loads((folder / RUN).read_text())
    assert (record["status"], record["signal"]) == ("interrupted", number.name)
    policy = read_policy(folder)
    action = policy(policy.observation_mean)
    assert action.shape == (4,) and (abs(action) <= 1).all()
    if number == signal.SIGINT:
        done = record["timesteps"]
        assert main(monkeypatch, "--resume", folder, "--timesteps", 1000) == 0
        assert json.loads((folder / RUN).read_text())["timesteps"] == done + 1024


@pytest.mark.parametrize("flag", ["--out", "--resume"])
def test_without_ray_rllib_names_the_extra_that_brings_it(monkeypatch, capsys, tmp_path, flag):
    folder = tmp_path / "far"
    if flag == "--resume":
        folder.mkdir()
        past = {"sessions": [], "evaluations": [], "config": config_to_json(TrainingConfig())}
        write_record(folder, past | {"engine": {"name": RLLIB, "num_env_runners": 1}})
    # Python takes a module that is None in `sys.modules` for one that is not there.
    monkeypatch.setitem(sys.modules, "ray", None)
    before = sorted(tmp_path.rglob("*"))
    assert springfoot(["train", "--engine", "rllib", flag, str(folder)]) == 2
    told = "springfoot train: error: the package ray is missing: pip install 'springfoot[rllib]'\n"
    assert capsys.readouterr().err == told
    hidden = "import runpy, sys; sys.modules['ray'] = None; script = sys.argv.pop(1); sys.argv[0] = script; "
    hidden += "runpy.run_path(script, run_name='__main__')"
    words = [sys.executable, "-c", hidden, SCRIPT, "--engine", "rllib", flag, str(folder)]
    done = subprocess.run(words, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (2, told.replace("springfoot train", "train.py"))
    assert sorted(tmp_path.rglob("*")) == before
