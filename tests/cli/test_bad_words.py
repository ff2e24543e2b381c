# ruff: noqa: E501  (a message a line)
"""Words that a command line does not understand: one printable line on standard error, exit code 2, nothing written."""

import json

import pytest

from springfoot.cli.main import STUDIES, main
from springfoot.cli.train import TrainFlags
from springfoot.command_line import parse
from springfoot.studies.base.flags import given

# fmt: off
EVALUATE = [
    (["--heigth", "1"], "unrecognized options: --heigth, 1; perhaps --height?"),
    (["--push-newtons", "150"], "unrecognized options: --push-newtons, 150; perhaps --push-newton?"),
    (["--push", "100"], "unrecognized options: --push, 100; perhaps --push-newton, --push-seconds or --push-interval?"),
    (["--delay", "0.02"], "unrecognized options: --delay, 0.02; perhaps --stiffness-delay-s or --stiffness-delay-range-s?"),
    (["--height", "None"], "--height must be a number, got 'None'"),
    (["--height", "tall"], "--height must be a number, got 'tall'"),
    (["--height"], "--height needs a value"),
    (["--height", "1\x1b[31m"], "--height must be a number, got '1\\x1b[31m'"),
    (["--height", "9" * 400 + "m"], f"--height must be a number, got '{'9' * 56}..."),
    (["--episodes", "1.5"], "--episodes must be a whole number, got '1.5'"),
    (["--episodes", "many"], "--episodes must be a whole number, got 'many'"),
    (["--seconds", "ten"], "--seconds must be a number, got 'ten'"),
    (["--equilibrium", "soft"], "--equilibrium must be one of planned, angle, neutral, phase, got 'soft'"),
    (["--equilibrium", "None"], "--equilibrium must be one of planned, angle, neutral, phase, got 'None'"),
    (["--start", "lying"], "--start must be one of random, standing or a number, got 'lying'"),
    (["--decisions", "10hz"], "--decisions must be one of 100hz, 50hz, 25hz, event, got '10hz'"),
    (["--speed-range", "1"], "--speed-range must be 2 numbers, got '1'"),
    (["--speed-range", "1", "fast"], "--speed-range must be 2 numbers, got '1 fast'"),
    (["--ankle-stiffness-range", "None", "1"], "--ankle-stiffness-range must be 2 numbers, got 'None 1'"),
    (["--speed-interval", "often"], "--speed-interval must be a number, got 'often'"),
    (["--right-foot", '{"kind'], "--right-foot must be JSON, but line 1, column 2: unterminated string starting at: '{\"kind'"),
    (["--ankle-stiffness-range", "1"], "--ankle-stiffness-range needs 2 values"),
    (["--reward-weights", "{"], "--reward-weights must be JSON, but line 1, column 2: expecting property name enclosed in double quotes: '{'"),
    (["--reward-weights", "no.json"], "--reward-weights must be JSON text in braces or the name of a JSON file, got 'no.json'"),
    (["--reward-weights", "[1]"], "--reward-weights must be JSON text in braces or the name of a JSON file, got '[1]'"),
    (["--reward-weights", "None"], "--reward-weights must be JSON text in braces or the name of a JSON file, got 'None'"),
    (["--drawn-feet", "rigid"], "--drawn-feet must be JSON text in brackets or the name of a JSON file, got 'rigid'"),
    (["--drawn-feet", '[{"foot"'], "--drawn-feet must be JSON, but line 1, column 9: expecting ':' delimiter: '[{\"foot\"'"),
    (["--drawn-feet", '[{"foot": "rigd"}]'], "drawn_feet[0] must be one of 'intact', 'rigid', 'rigid_toe', 'no_toe', 'passive', 'adaptive', 'weak', 'drop', got 'rigd'; perhaps rigid?"),
    (["--drawn-bodies", '[{"leg_ratio": 2}]'], "drawn_bodies[0]: leg_ratio must be in [0.94, 1.06] (relative), got 2"),
    (["--schedule", '{"ankle": ' + "[" * 100_000], "--schedule must be JSON, but it is nested too deeply: '{\"ankle\": [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[..."),
    (["--human", "None"], "None must be a .csv, .txt, .mot, .sto or .c3d file"),
    (["--human", "n" * 240 + ".csv"], f"no file {'n' * 78}...{'n' * 74}.csv"),
    (["--out", "o" * 400], f"File name too long: {'o' * 78}...{'o' * 78}"),
    (["--out"], "--out needs a value"),
    (["-z"], "unrecognized options: -z"),
    (["--right-foot", "rigid", "--right-foot", "passive"], "--right-foot is given twice; give it once"),
    (["--seconds", "4", "--episode_seconds=6"], "--seconds is given twice; give it once"),
    (["--right_foot=rigid", "--speed", "1", "--right-foot", "rigid"], "--right-foot is given twice; give it once"),
]
TRAIN = [
    (["--hidden", "64", "wide"], "--hidden must be whole numbers, got '64 wide'"),
    (["--hidden", "None"], "--hidden must be whole numbers, got 'None'"),
    (["--timesteps", "1e6"], "--timesteps must be a whole number, got '1e6'"),
    (["--timesteps", "9" * 5000], f"--timesteps must be a whole number, got '{'9' * 56}..."),
    (["--seed", "None"], "--seed must be a whole number, got 'None'"),
    (["--learning-rate", "fast"], "--learning-rate must be a number, got 'fast'"),
    (["--out"], "--out needs a value"),
    (["--seeds", "2", "--device", "cuda"], "--seeds trains on the CPU; drop --device"),
    (["--engine", "rllib", "--device", "cuda"], "--engine rllib learns on the CPU; drop --device cuda, or --engine"),
    (["--engine", "rllib", "--critic-steps", "9"], "--engine rllib trains actor and critic together; drop --critic-steps, or --engine"),
]
POLICIES = (
    "give a .safetensors or .onnx file, a run folder, a schedule in a .csv or .json file, module:function, frozen:POLICY, "
    "or one of pretrained, expert, medium, learned, learned-2, learned-3, learned-4, learned-5, predicted, untrained, random, constant, schedule, "
    "quasi_stiffness, thesis, thesis_printed"
)
COMMANDS_IN_WORDS = "train, evaluate, live, feet, person, score, export, submit, judge, study, datasets, examples and completion"
CASES = [
    *((["evaluate", "schedule", *words], f"springfoot evaluate: error: {said}") for words, said in EVALUATE),
    *((["train", "--out", "x", *words], f"springfoot train: error: {said}") for words, said in TRAIN),
    (["score", "mine.csv", "--speed", "x"], "springfoot score: error: --speed must be a number, got 'x'"),
    (["person", "mine.csv", "--mass", "x"], "springfoot person: error: --mass must be a number, got 'x'"),
    (["evaluat", "schedule"], f"springfoot: error: no command 'evaluat'; there are {COMMANDS_IN_WORDS}; perhaps evaluate?"),
    (["zzz"], f"springfoot: error: no command 'zzz'; there are {COMMANDS_IN_WORDS}"),
    (["study", "comapre"], f"springfoot study: error: no study 'comapre'; there are {', '.join(STUDIES)}; perhaps compare?"),
    (["evaluate", "pretraind"], f"springfoot evaluate: error: no policy 'pretraind': {POLICIES}; perhaps pretrained?"),
    (["live", "schedul:1.2"], f"springfoot live: error: no policy 'schedul:1.2': {POLICIES}; perhaps schedule?"),
    (["evaluate", "zzz"], f"springfoot evaluate: error: no policy 'zzz': {POLICIES}"),
    (["export", "predictd", "--out", "new.onnx"], "springfoot export: error: no policy predictd: give a .safetensors or .onnx file, a run folder, module:function, or one of pretrained, expert, medium, learned, learned-2, learned-3, learned-4, learned-5, predicted; perhaps predicted?"),
    (["study", "compare", "schedule", "--epochs", "3"], "springfoot study compare: error: unrecognized options: --epochs, 3"),
]
# fmt: on


@pytest.mark.parametrize(("words", "said"), CASES, ids=[str(k) for k in range(len(CASES))])
def test_words_that_are_not_understood_are_one_printable_line_and_exit_code_2(
    monkeypatch, capsys, tmp_path, words, said
):
    monkeypatch.chdir(tmp_path)
    try:
        code = main(words)
    except SystemExit as end:
        code = end.code
    assert (code, *capsys.readouterr()) == (2, "", f"{said}\n")
    assert said.isprintable() and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("typed", "meant"), [("runs/wlak", "runs/walk"), ("wlk.onnx", "walk.onnx"), ("frozen:runs/wlak/", "runs/walk")]
)
def test_a_policy_that_is_not_there_is_told_the_most_similar_beside_it(monkeypatch, capsys, tmp_path, typed, meant):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs" / "walk").mkdir(parents=True)
    (tmp_path / "walk.onnx").touch()
    assert main(["evaluate", typed]) == 2
    assert capsys.readouterr().err.endswith(f"; perhaps {meant}?\n")


@pytest.mark.parametrize("words", [["evaluate", "loop"], ["live", "loop"]])
def test_a_link_to_itself_is_no_policy(monkeypatch, capsys, tmp_path, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    assert main(words) == 2
    assert capsys.readouterr().err == f"springfoot {words[0]}: error: no policy 'loop': {POLICIES}\n"


def test_none_is_a_value_of_settings_that_can_be_none():
    words = ["--preset", "any-body", "--slope-range-deg", "None", "--speed-interval", "None", "--schedule", "None"]
    flags = parse(TrainFlags, words, "train.py")
    assert given(flags.environment) == {"slope_range_deg": None, "speed_interval": None, "schedule": None}
    assert given(parse(TrainFlags, [], "train.py").environment) == {}


def test_json_for_a_setting_may_stand_in_a_file(tmp_path, capsys):
    (tmp_path / "weights.json").write_text(json.dumps({"alive": 2.0}), encoding="utf-8")
    words = ["--reward-weights", str(tmp_path / "weights.json")]
    assert given(parse(TrainFlags, words, "train.py").environment) == {"reward_weights": {"alive": 2.0}}
    (tmp_path / "weights.json").write_text("[2.0", encoding="utf-8")
    with pytest.raises(SystemExit):
        parse(TrainFlags, words, "train.py")
    said = "is no setting in JSON: it is not JSON, line 1, column 5"
    assert said in capsys.readouterr().err
