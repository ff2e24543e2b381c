"""The settings `left_foot` and `right_foot`: their forms, on the command line too, and one line for a wrong one."""

import json
from math import inf, nan
from typing import Any

import numpy as np
import pytest
import tyro

from springfoot.agents.policies.export import scale_of
from springfoot.cli.evaluate import evaluate_main
from springfoot.envs import SegmentedFootBiped, SegmentedFootBipedVector
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.feet import KINDS
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json
from springfoot.errors import SpringfootError
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.studies.base.flags import SettingsFlags, given

PASSIVE = {"kind": "passive", "ankle_stiffness": 400}
KIND_LIST = ", ".join(map(repr, KINDS))
OF_A_SPRING = "ankle_stiffness, ankle_deg, toe_stiffness, toe_deg, damping_time"
RATIOS = "shank_mass_ratio, shank_com_ratio, shank_inertia_ratio, foot_mass_ratio, foot_inertia_ratio"
OF_AN_ORTHOSIS = f"{OF_A_SPRING}, engages"
OF_A_FOOT = f"{RATIOS}, orthosis"
OF_PASSIVE = f"{OF_A_SPRING}, {RATIOS}, ankle_table, toe_table, orthosis"
WAY_LIST = "one of 'dorsiflexion', 'plantarflexion'"
OF_ADAPTIVE = f"ankle_deg, toe_deg, damping_time, {RATIOS}, schedule, orthosis"

WRONG_KINDS: list[tuple[Any, str]] = [
    ("rigd", f"right_foot must be one of {KIND_LIST}, got 'rigd'; perhaps rigid?"),
    ("Rigid", f"right_foot must be one of {KIND_LIST}, got 'Rigid'; perhaps rigid?"),
    ("", f"right_foot must be one of {KIND_LIST}, got ''"),
    ("passive ", f"right_foot must be one of {KIND_LIST}, got 'passive '; perhaps passive?"),
    (None, f"right_foot must be one of {KIND_LIST}, or a dictionary with one of them as its 'kind', got None"),
    (600, f"right_foot must be one of {KIND_LIST}, or a dictionary with one of them as its 'kind', got 600"),
    ([], f"right_foot must be one of {KIND_LIST}, or a dictionary with one of them as its 'kind', got []"),
    (True, f"right_foot must be one of {KIND_LIST}, or a dictionary with one of them as its 'kind', got True"),
    (nan, f"right_foot must be one of {KIND_LIST}, or a dictionary with one of them as its 'kind', got nan"),
    ({}, f"right_foot: a dictionary needs a 'kind', one of {KIND_LIST}"),
    ({"ankle_stiffness": 600}, f"right_foot: a dictionary needs a 'kind', one of {KIND_LIST}"),
    ({"kind": None}, f"right_foot must be one of {KIND_LIST}, got None"),
    ({"kind": "pasive"}, f"right_foot must be one of {KIND_LIST}, got 'pasive'; perhaps passive?"),
    (
        {"kind": "orthosis", "ankle_stiffness": 200},
        f"right_foot must be one of {KIND_LIST}, got 'orthosis'; an orthosis is a key of a foot: "
        '{"kind": "intact", "orthosis": {"ankle_stiffness": 200}}',
    ),
    (
        "prosthesis",
        f"right_foot must be one of {KIND_LIST}, got 'prosthesis'; a prosthesis is 'passive', or 'adaptive' if the "
        "policy sets its stiffness",
    ),
    ({"kind": ["passive"]}, f"right_foot must be one of {KIND_LIST}, got ['passive']"),
    ({"kind": {"kind": "passive"}}, f"right_foot must be one of {KIND_LIST}, got {{'kind': 'passive'}}"),
]
WRONG_KEYS: list[tuple[Any, str]] = [
    (
        {"kind": "passive", "ankle_stifness": 600},
        f"right_foot: a foot of kind 'passive' has no 'ankle_stifness'; valid: {OF_PASSIVE}; perhaps ankle_stiffness?",
    ),
    (
        PASSIVE | {"K": 600},
        f"right_foot: a foot of kind 'passive' has no 'K'; valid: {OF_PASSIVE}",
    ),
    (
        {"kind": "rigid", "toe_stiffness": 90},
        f"right_foot: a foot of kind 'rigid' has no 'toe_stiffness'; valid: {OF_A_FOOT}",
    ),
    ({"kind": "intact", "strength": 0.3}, f"right_foot: a foot of kind 'intact' has no 'strength'; valid: {OF_A_FOOT}"),
    ({"kind": "weak", "share": 0.3}, f"right_foot: a foot of kind 'weak' has no 'share'; valid: strength, {OF_A_FOOT}"),
    (
        {"kind": "adaptive", "ankle_stiffness": 600},
        f"right_foot: a foot of kind 'adaptive' has no 'ankle_stiffness'; valid: {OF_ADAPTIVE}",
    ),
    ({"kind": "drop", 7: 1.0}, f"right_foot: a foot of kind 'drop' has no 7; valid: {OF_A_FOOT}"),
    ({"kind": "no_toe", "mass": 1.0}, f"right_foot: a foot of kind 'no_toe' has no 'mass'; valid: {OF_A_FOOT}"),
    (
        {"kind": "drop", "orthosis": 20},
        f"right_foot: orthosis must be a dictionary of {OF_AN_ORTHOSIS}, got 20",
    ),
    (
        {"kind": "drop", "orthosis": [20, 0]},
        f"right_foot: orthosis must be a dictionary of {OF_AN_ORTHOSIS}, got [20, 0]",
    ),
    (
        {"kind": "drop", "orthosis": {"stiffness": 20}},
        f"right_foot: orthosis: an orthosis has no 'stiffness'; valid: {OF_AN_ORTHOSIS}; perhaps toe_stiffness?",
    ),
    (
        {"kind": "drop", "orthosis": {"kind": "passive"}},
        f"right_foot: orthosis: an orthosis has no 'kind'; valid: {OF_AN_ORTHOSIS}",
    ),
    (
        PASSIVE | {"adapted": "passive"},
        'right_foot: adapted people are gone; the setting person="learned" walks on every foot',
    ),
    (
        PASSIVE | {"engages": "dorsiflexion"},
        f"right_foot: a foot of kind 'passive' has no 'engages'; valid: {OF_PASSIVE}",
    ),
]
WRONG_NUMBERS: list[tuple[Any, str]] = [
    (PASSIVE | {"ankle_stiffness": -1}, "right_foot: ankle_stiffness must be in [0, 3000] N m/rad, got -1"),
    (PASSIVE | {"ankle_stiffness": 5000}, "right_foot: ankle_stiffness must be in [0, 3000] N m/rad, got 5000"),
    (PASSIVE | {"ankle_stiffness": "600"}, "right_foot: ankle_stiffness must be in [0, 3000] N m/rad, got '600'"),
    (PASSIVE | {"ankle_stiffness": None}, "right_foot: ankle_stiffness must be in [0, 3000] N m/rad, got None"),
    (PASSIVE | {"ankle_stiffness": nan}, "right_foot: ankle_stiffness must be in [0, 3000] N m/rad, got nan"),
    (PASSIVE | {"ankle_stiffness": True}, "right_foot: ankle_stiffness must be in [0, 3000] N m/rad, got True"),
    (PASSIVE | {"toe_stiffness": inf}, "right_foot: toe_stiffness must be in [0, 1000] N m/rad, got inf"),
    (PASSIVE | {"toe_stiffness": [60]}, "right_foot: toe_stiffness must be in [0, 1000] N m/rad, got [60]"),
    (PASSIVE | {"ankle_deg": 31}, "right_foot: ankle_deg must be in [-30, 30] deg, got 31"),
    (PASSIVE | {"toe_deg": -31}, "right_foot: toe_deg must be in [-30, 45] deg, got -31"),
    (PASSIVE | {"damping_time": -0.01}, "right_foot: damping_time must be in [0, 0.1] s, got -0.01"),
    (PASSIVE | {"damping_time": 10**400}, "right_foot: damping_time must be in [0, 0.1] s, got inf"),
    ({"kind": "weak", "strength": 0.05}, "right_foot: strength must be in [0.1, 0.6] (of the sound leg), got 0.05"),
    ({"kind": "weak", "strength": 30}, "right_foot: strength must be in [0.1, 0.6] (of the sound leg), got 30"),
    ({"kind": "adaptive", "ankle_deg": "2"}, "right_foot: ankle_deg must be in [-30, 30] deg, got '2'"),
    (
        {"kind": "adaptive", "damping_time": 0.01},
        "right_foot: damping_time of an adaptive foot needs its schedule; else it is the muscles'",
    ),
    (
        {"kind": "rigid", "shank_mass_ratio": 0},
        "right_foot: shank_mass_ratio must be in [0.1, 3] (of the intact one), got 0",
    ),
    (
        {"kind": "rigid", "foot_inertia_ratio": -0.5},
        "right_foot: foot_inertia_ratio must be in [0.1, 6] (of the intact one), got -0.5",
    ),
    (
        {"kind": "drop", "orthosis": {"ankle_stiffness": 1001}},
        "right_foot: orthosis: ankle_stiffness must be in [0, 1000] N m/rad, got 1001",
    ),
    (
        {"kind": "weak", "orthosis": {"ankle_deg": nan}},
        "right_foot: orthosis: ankle_deg must be in [-30, 30] deg, got nan",
    ),
    *(
        (
            {"kind": "weak", "orthosis": {"engages": way}},
            f"right_foot: orthosis: engages must be {WAY_LIST}, got {way!r}",
        )
        for way in ("up", "", 1, True, ["dorsiflexion"])
    ),
    (
        {"kind": "weak", "orthosis": {"engages": "dorsiflexion", "damping_time": 0}},
        "right_foot: orthosis: give engages or damping_time, not both",
    ),
]
WRONG = [*WRONG_KINDS, *WRONG_KEYS, *WRONG_NUMBERS]


def test_there_are_forty_wrong_feet():
    assert len(WRONG) >= 40


@pytest.mark.parametrize(("foot", "text"), WRONG, ids=lambda value: repr(value)[:40])
def test_a_wrong_foot_is_refused_in_one_clear_line(foot, text):
    with pytest.raises(SpringfootError) as caught:
        settings_from(right_foot=foot)
    assert str(caught.value) == text
    with pytest.raises(SpringfootError) as caught:  # built directly, too
        BipedSettings(left_foot=foot)
    assert str(caught.value).startswith("left_foot") and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("rigd", "must be one of 'intact'"),
        ('{"kind": "rigd"}', "must be one of 'intact'"),
        ("no-such-foot.json", "no file no-such-foot.json"),
        ('{"kind": "weak", "strength": 3}', "strength must be in [0.1, 0.6]"),
        ('{"kind": "weak", "orthosis": {"stiffness": 3}}', "an orthosis has no 'stiffness'"),
    ],
)
def test_the_command_line_says_so_with_exit_code_2_and_leaves_nothing(words, text, tmp_path, capsys):
    out = tmp_path / "out"
    assert evaluate_main(["pretrained", "--right-foot", words, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert text in error and len(error.strip().splitlines()) == 1 and not out.exists()


def test_the_command_line_takes_a_word_json_or_a_file(tmp_path):
    (tmp_path / "foot.json").write_text(json.dumps(PASSIVE), encoding="utf-8")
    for words, wanted in (
        ("rigid", "rigid"),
        (json.dumps(PASSIVE), PASSIVE),
        (str(tmp_path / "foot.json"), PASSIVE),
    ):
        flags = tyro.cli(SettingsFlags, args=["--left-foot", words])
        assert given(flags) == {"left_foot": wanted}
    assert given(tyro.cli(SettingsFlags, args=[])) == {}


def test_json_round_trip_keeps_a_foot_and_numbers_become_floats():
    foot: dict[str, Any] = PASSIVE | {
        "toe_deg": np.float32(5.0),
        "orthosis": {"ankle_stiffness": 20},
        "shank_mass_ratio": 0.6,
    }
    settings = settings_from(left_foot=foot, right_foot={"kind": "rigid"})
    both_ways, one_way = ({"kind": "drop", "orthosis": {"engages": way}} for way in (None, "plantarflexion"))
    assert settings_from(left_foot=both_ways).left_foot.plain == {"kind": "drop", "orthosis": {}}
    worn = settings_from(left_foot=one_way)
    assert settings_from(**json.loads(json.dumps(settings_to_json(worn)))) == worn and worn.left_foot.plain == one_way
    assert settings_from(**json.loads(json.dumps(settings_to_json(settings), allow_nan=False))) == settings
    assert settings.right_foot.plain == "rigid"
    foot["orthosis"]["ankle_stiffness"] = 99
    numbers = {"ankle_stiffness": 400.0, "toe_deg": 5.0, "shank_mass_ratio": 0.6}
    assert settings.left_foot.plain == {"kind": "passive", **numbers, "orthosis": {"ankle_stiffness": 20.0}}
    assert "400.0" in repr(settings.left_foot)


def test_an_exported_policy_returns_the_stiffness_of_the_joints_it_controls():
    def joints_of(settings):
        scale = scale_of(settings)
        assert scale is not None
        return [ACTIONS[joint] for joint in scale.joints]

    for right, names in (
        ("intact", ACTIONS),
        ("rigid_toe", ACTIONS[:3]),
        ("passive", ACTIONS[:2]),
        ("adaptive", ACTIONS),
    ):
        assert joints_of(settings_from(right_foot=right)) == list(names)
    ankle = settings_from(stiffness_joints="ankle", left_foot="rigid")
    assert joints_of(ankle) == ["ankle_right"]


def test_an_evaluation_takes_the_feet_it_is_told_and_else_the_policys_own():
    assert policy_and_settings("pretrained", {"right_foot": "rigid"})[1].right_foot.plain == "rigid"
    assert policy_and_settings("pretrained", {})[1].right_foot.plain == "intact"
    assert policy_and_settings("constant", {"left_foot": PASSIVE})[1].left_foot.plain == {
        "kind": "passive",
        "ankle_stiffness": 400.0,
    }


def test_a_list_of_feet_is_for_a_vector_and_has_one_for_each():
    with pytest.raises(SpringfootError, match="left_foot must be one foot or a list of 3, got 2 feet"):
        SegmentedFootBipedVector(3, left_foot=["rigid", "intact"])
    with pytest.raises(SpringfootError, match=r"right_foot must be one of .*, got 'rigd'"):
        SegmentedFootBipedVector(2, right_foot=["rigid", "rigd"])
    with pytest.raises(SpringfootError, match="left_foot must be one of"):
        SegmentedFootBiped(left_foot=["rigid"])
