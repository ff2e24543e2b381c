"""Settings: defaults, JSON round trip, and one clear line for everything that is not allowed."""

import inspect
import json
from copy import deepcopy
from dataclasses import fields, replace
from math import radians

import numpy as np
import pytest

from springfoot.envs.physics.foot import Spring
from springfoot.envs.settings.settings import (
    CONDITION_SETTINGS,
    CONDITION_THEMES,
    DEFAULT_WEIGHTS,
    DRAWN_SETTINGS,
    THEME_OF,
    THEMES,
    TUNED,
    BipedSettings,
    reference_gait,
    settings_from,
    settings_to_json,
)
from springfoot.errors import SpringfootError
from springfoot.gait.people.human import human_gait
from springfoot.gait.people.own_data import OwnGait
from springfoot.gait.springs.stiffness import StiffnessSchedule

OWN = {"name": "my_gait.csv", "strides": 12, "speed": None, "stride_time": 1.2, "step_length": None, "toe_off": 0.63}
OWN |= {"mean": {"knee": [[0.4, 0], [0.1, -0.2]]}, "sd": {}}


def test_json_round_trip_keeps_every_value():
    settings = settings_from(
        height=1.5,
        mass=45,
        speed=np.float32(0.9),
        equilibrium="phase",
        schedule={"ankle": [[0, 300, 0.1], (0.6, 30.0, 0.0)], "toe": [[0.0, 28.0, 0.0]]},
        ankle_stiffness_range=[10, 900],
        start=0.25,
        reward_weights={"stiffness": -0.2},
        human=OWN,
    )
    text = json.dumps(settings_to_json(settings), allow_nan=False)
    assert settings_from(**json.loads(text)) == settings
    assert json.dumps(settings_to_json(settings_from(**json.loads(text)))) == text


def test_settings_hold_their_own_copy_of_what_was_given():
    weights = {"alive": 0.5}
    settings = settings_from(reward_weights=weights)
    weights["alive"] = 9.0
    assert settings.reward_weights == {"alive": 0.5}


def test_the_guides_own_person_walks_by_default():
    for guide, own in (("people", TUNED), ("plan", "predicted")):
        settings = settings_from(guide=guide)
        assert settings.person is None and settings.walker == own
        assert settings_from(guide=guide, person=own) == settings
    learned = BipedSettings(person="learned")
    assert learned.walker == learned.person == "learned"
    assert BipedSettings(acts="both", person=TUNED).walker == BipedSettings(acts="both", guide="plan").walker == TUNED


def test_feet_schedule_and_human_are_objects_whether_given_plain_or_as_objects():
    springs = {"ankle": [[0.0, 300.0, 0.1]], "toe": [[0.0, 28.0, 0.0]]}
    passive = {"kind": "passive", "ankle_stiffness": 400.0}
    settings = BipedSettings(schedule=springs, human=OWN, left_foot=passive)  # type: ignore[arg-type]
    assert isinstance(settings.schedule, StiffnessSchedule) and isinstance(settings.human, OwnGait)
    assert settings.left_foot.foot.ankle.device == Spring(stiffness=400.0, rest=radians(2.0))
    again = settings_from(schedule=settings.schedule, human=settings.human, left_foot=settings.left_foot)
    assert again == settings == replace(settings) == deepcopy(settings)
    written = settings_to_json(settings)
    assert (written["schedule"], written["left_foot"], written["right_foot"]) == (springs, passive, "intact")
    assert settings != replace(settings, human=OWN | {"strides": 13})


def test_defaults_are_the_body_and_speed_of_the_thesis():
    settings = BipedSettings()
    assert (settings.height, settings.mass, settings.speed) == (1.70, 63.0, 1.2)
    assert settings == settings_from()


def test_own_data_stand_in_peoples_place_and_people_where_they_are_missing():
    people, own = human_gait(1.1, 1.8), reference_gait(settings_from(speed=1.1, height=1.8, human=OWN))
    assert own.condition == "my_gait.csv" and own.stride_time == 1.2
    assert own.mean("knee", 0.25) == pytest.approx(0.4 + 0.2)
    assert own.mean("thigh", 0.25) == people.mean("thigh", 0.25)
    assert "thigh" in own.borrowed and "knee" not in own.borrowed and "knee sd" in own.borrowed
    nobody = reference_gait(BipedSettings(speed=1.1, height=1.8))
    assert nobody.mean("knee", 0.25) == people.mean("knee", 0.25) and nobody.borrowed == ()


def test_every_setting_is_documented():
    source = inspect.getsource(BipedSettings)
    for setting in fields(BipedSettings):
        after = source.split(f"\n    {setting.name}: ")[1].split("\n", 1)[1]
        assert after.startswith('    """'), setting.name


def test_every_setting_has_a_theme_and_every_theme_a_setting():
    assert list(THEME_OF) == [setting.name for setting in fields(BipedSettings)]
    assert set(THEME_OF.values()) == set(THEMES)
    assert set(CONDITION_THEMES) < set(THEMES)


def test_an_evaluation_sets_anew_who_walks_where_and_leaves_a_policy_its_springs_and_reward():
    kept = {"speed_rate", "episode_seconds", "push_seconds", "push_interval"}
    asked = {name for name, theme in THEME_OF.items() if theme in CONDITION_THEMES}
    assert kept < asked and set(CONDITION_SETTINGS) == (asked - kept) | {"drawn_feet", "stiffness_by"}
    assert all(getattr(BipedSettings(), name) is None for name in DRAWN_SETTINGS)
    assert set(DRAWN_SETTINGS) < set(CONDITION_SETTINGS)


BAD = [
    ({"height": -1.7}, ["height", "-1.7"]),
    ({"mass": -63.0}, ["mass", "-63"]),
    ({"mass": float("nan")}, ["mass", "nan"]),
    ({"speed": 0.0}, ["speed", "[0.4, 2] m/s", "got 0"]),
    ({"speed": -1.0}, ["speed", "-1"]),
    ({"speed": 2.1}, ["speed", "[0.4, 2] m/s", "2.1"]),
    ({"speed": "fast"}, ["speed", "'fast'"]),
    ({"speed": True}, ["speed", "True"]),
    ({"cadence": "mine"}, ["cadence", "'people'", "'thesis'"]),
    ({"equilibrium": "x"}, ["equilibrium", "'planned'", "'phase'"]),
    ({"equilibrium": ["planned"]}, ["equilibrium", "'planned'"]),
    ({"equilibrium": "phase"}, ["phase", "schedule"]),
    ({"cadence": "effort"}, ["cadence 'effort' needs guide 'plan', got 'people'"]),
    ({"cadence": "effort", "guide": "plan"}, ["cadence 'effort' needs a plan_file, whose styles tell the step time"]),
    ({"step_time_ratio": 1.3}, ["step_time_ratio", "0.8", "1.2", "got 1.3"]),
    ({"step_time_ratio": 0.9, "cadence": "thesis"}, ["step_time_ratio needs cadence 'people', got 'thesis'"]),
    (
        {"drawn_bodies": [{"step_time_ratio": 0.9}], "cadence": "thesis"},
        ["step_time_ratio needs cadence 'people', got 'thesis'"],
    ),
    ({"person": ""}, ["person must be None, 'tuned' or the name of a policy file, got ''"]),
    ({"action_mode": "relative"}, ["action_mode", "'absolute'", "'residual'"]),
    ({"decisions": "30hz"}, ["decisions", "'100hz'", "'event'"]),
    ({"stiffness_joints": "knee"}, ["stiffness_joints", "'ankle'", "'toe'"]),
    ({"ankle_stiffness_range": (800.0, 20.0)}, ["ankle_stiffness_range", "0 < low < high", "(800.0, 20.0)"]),
    ({"toe_stiffness_range": (0.0, 20.0)}, ["toe_stiffness_range", "(0.0, 20.0)"]),
    ({"toe_stiffness_range": 40.0}, ["toe_stiffness_range", "40.0"]),
    ({"toe_stiffness_range": (5.0, float("inf"))}, ["toe_stiffness_range", "inf"]),
    ({"schedule": [1, 2]}, ["schedule"]),
    ({"schedule": {"k": 1.0}}, ["schedule", "ankle", "toe"]),
    ({"schedule": {"ankle": [[0.0, float("nan"), 0.0]], "toe": [[0.0, 28.0, 0.0]]}}, ["ankle stiffness", "nan"]),
    ({"human": "my_gait.csv"}, ["human", "read_gait", "'my_gait.csv'"]),
    ({"human": OWN | {"stride_time": -1.0}}, ["my_gait.csv", "stride_time", "-1"]),
    ({"human": OWN | {"mean": {"elbow": [[0, 0]]}}}, ["human", "elbow", "knee"]),
    ({"episode_seconds": 0.0}, ["episode_seconds", "0.02"]),
    ({"start": "lying"}, ["start", "'random'", "[0, 1)"]),
    ({"start": 1.0}, ["start", "1.0"]),
    ({"start_noise": 2.0}, ["start_noise", "2.0"]),
    ({"push_newton": -150.0}, ["push_newton", "-150.0"]),
    ({"push_seconds": 5.0}, ["push_seconds", "4", "5.0"]),
    ({"push_interval": 0.0}, ["push_interval"]),
    ({"friction": 0.3}, ["friction", "0.4", "1.2", "0.3"]),
    ({"slope_deg": 6.0}, ["slope_deg", "-5", "5 deg", "6.0"]),
    ({"slope_range_deg": (5.0, -5.0)}, ["slope_range_deg", "low < high", "[-5, 5] deg", "(5.0, -5.0)"]),
    ({"unevenness_m": 0.04}, ["unevenness_m", "0.03 m", "0.04"]),
    ({"sensor_noise": -0.1}, ["sensor_noise", "-0.1"]),
    ({"stiffness_delay_s": 0.05}, ["stiffness_delay_s", "0.04 s", "0.05"]),
    ({"stiffness_delay_s": 0.015}, ["stiffness_delay_s", "whole steps of 0.01 s", "0.015"]),
    ({"stiffness_delay_range_s": (0.0, 0.025)}, ["stiffness_delay_range_s", "whole steps of 0.01 s"]),
    ({"reward_weights": {"allive": 1.0}}, ["allive", *DEFAULT_WEIGHTS]),
    ({"reward_weights": {"stiffness": 0.1}}, ["stiffness", "cost", "0.1"]),
    ({"reward_weights": {"alive": -0.1}}, ["alive", "-0.1"]),
    ({"reward_weights": [0.1]}, ["reward_weights"]),
    ({"heigth": 1.8}, ["heigth", "height"]),
    ({"zzz": 1}, ["zzz", "height", "push_newton"]),
]


@pytest.mark.parametrize(("values", "words"), BAD, ids=[str(next(iter(values.items()))) for values, _ in BAD])
def test_what_is_not_allowed_is_refused_in_one_clear_line(values, words):
    with pytest.raises(SpringfootError) as caught:
        settings_from(**values)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message
