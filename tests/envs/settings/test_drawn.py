"""Settings of feet and bodies that resets draw: their forms, their refusals, and what is drawn from them."""

import json
from math import log
from typing import Any

import numpy as np
import pytest

from springfoot.envs.settings.drawn import draw_feet, draw_index
from springfoot.envs.settings.settings import settings_from, settings_of_bodies, settings_to_json
from springfoot.errors import SpringfootError
from springfoot.evaluation.recording.policies import CONDITIONS
from springfoot.evaluation.recording.recording import record

TABLE = [[-10.0, 60.0], [20.0, -100.0]]
SPRING: dict[str, Any] = {"kind": "passive", "ankle_stiffness": [150, 1500], "ankle_deg": (0, 8), "toe_deg": 3}
BRACED: dict[str, Any] = {"kind": "weak", "strength": [0.2, 0.35], "orthosis": {"ankle_stiffness": [50.0, 500.0]}}
FEET: list[dict[str, Any]] = [
    {"foot": SPRING},
    {"foot": "rigid", "on": "both", "weight": 2},
    {"foot": {"kind": "passive", "ankle_table": TABLE, "damping_time": [0.01, 0.04]}, "on": "left"},
    {"foot": BRACED, "on": "right"},
]
BODIES = [{"leg_ratio": 1.03}, {"carried_ratio": 0.2, "weight": 3}, {}]


def draws(feet: list[dict[str, Any]], count: int = 400) -> list[Any]:
    """Pairs of feet in plain values, None for the environment's own."""
    random = np.random.default_rng(0)
    drawn = settings_from(drawn_feet=feet).drawn_feet or ()
    return [tuple(foot and foot.to_json() for foot in draw_feet(drawn, random)) for _ in range(count)]


def test_json_keeps_drawn_feet_and_bodies_and_numbers_become_floats():
    settings = settings_from(drawn_feet=FEET, drawn_bodies=BODIES)
    plain = json.loads(json.dumps(settings_to_json(settings), allow_nan=False))
    assert settings_from(**plain) == settings != settings_from(drawn_feet=FEET)
    assert plain["drawn_feet"][0] == {
        "foot": {"kind": "passive", "ankle_stiffness": [150.0, 1500.0], "ankle_deg": [0.0, 8.0], "toe_deg": 3.0},
        "on": "one",
        "weight": 1.0,
    }
    assert plain["drawn_bodies"] == [
        {"leg_ratio": 1.03, "weight": 1.0},
        {"carried_ratio": 0.2, "weight": 3.0},
        {"weight": 1.0},
    ]
    assert settings_from().drawn_feet is settings_from().drawn_bodies is None


def test_feet_are_drawn_by_their_weights_and_put_on_their_sides():
    kinds = [
        tuple(foot if foot is None or isinstance(foot, str) else foot["kind"] for foot in pair) for pair in draws(FEET)
    ]
    rates = {pair: kinds.count(pair) / len(kinds) for pair in set(kinds)}
    # Of weights 1, 2, 1, 1 the passive spring on either side, rigid on both, the passive line on the left, weak right.
    expected = {("passive", None): 0.3, (None, "passive"): 0.1, ("rigid", "rigid"): 0.4, (None, "weak"): 0.2}
    assert rates.keys() == expected.keys()
    for pair, rate in expected.items():
        assert rates[pair] == pytest.approx(rate, abs=0.08)  # more than three standard errors of 400 draws


def test_stiffness_and_damping_are_drawn_on_the_log_scale_and_all_else_evenly():
    feet = [{"foot": SPRING, "on": "left"}, {"foot": {"kind": "passive", "damping_time": [0.001, 0.1]}, "on": "left"}]
    lefts = [left for left, _ in draws(feet)]
    stiffness = np.array([left["ankle_stiffness"] for left in lefts if "ankle_stiffness" in left])
    angle = np.array([left["ankle_deg"] for left in lefts if "ankle_deg" in left])
    time = np.array([left["damping_time"] for left in lefts if "damping_time" in left])
    share = (np.log(stiffness) - log(150)) / log(10), angle / 8.0, np.log10(time / 0.001) / 2.0
    for even in share:
        assert 0.0 <= even.min() < 0.05 and 0.95 < even.max() <= 1.0
        assert even.mean() == pytest.approx(0.5, abs=0.08)
    assert abs(np.corrcoef(stiffness, angle)[0, 1]) < 0.25  # each number is drawn for itself
    assert {left["toe_deg"] for left in lefts if "toe_deg" in left} == {3.0}


def test_both_feet_are_the_same_and_their_orthosis_is_drawn_too():
    pairs = draws([{"foot": BRACED, "on": "both"}], 20)
    assert all(left == right for left, right in pairs)
    assert (
        len({left["orthosis"]["ankle_stiffness"] for left, _ in pairs})
        == len({left["strength"] for left, _ in pairs})
        == 20
    )


def test_a_range_has_the_same_draws_wherever_its_foot_is_held():
    assert draws(FEET) == draws(
        json.loads(json.dumps([drawn.to_json() for drawn in settings_from(drawn_feet=FEET).drawn_feet or ()]))
    )


def test_bodies_are_drawn_by_their_weights_and_keep_the_settings_ratios():
    settings = settings_from(drawn_bodies=BODIES, foot_ratio=0.97)
    random = np.random.default_rng(1)
    counts = np.bincount([draw_index(settings.drawn_bodies or (), random) for _ in range(500)], minlength=3)
    np.testing.assert_allclose(counts / 500, [0.2, 0.6, 0.2], atol=0.07)
    ratios = [(each.leg_ratio, each.foot_ratio, each.carried_ratio) for each in settings_of_bodies(settings)]
    assert ratios == [(1.03, 0.97, 0.0), (1.0, 0.97, 0.2), (1.0, 0.97, 0.0)]
    assert settings_of_bodies(settings_from()) == (settings_from(),)


def test_step_times_are_drawn_with_the_bodies():
    of_bodies = settings_of_bodies(settings_from(drawn_bodies=[{}, {"step_time_ratio": 0.9}], step_time_ratio=1.1))
    assert [each.step_time_ratio for each in of_bodies] == [1.1, 0.9]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"foot": "rigd"}, r"drawn_feet\[1\] must be one of 'intact', .* got 'rigd'"),
        (
            {"foot": {"kind": "passive", "ankle_stiffness": [0, 5]}},
            r"drawn_feet\[1\]: ankle_stiffness must be a number or \[low, high\] with 0 < low < high, got \[0, 5\]",
        ),
        (
            {"foot": {"kind": "passive", "ankle_deg": [5, 5]}},
            r"drawn_feet\[1\]: ankle_deg .* with low < high, got \[5, 5\]",
        ),
        (
            {"foot": {"kind": "passive", "toe_deg": [1, 2, 3]}},
            r"drawn_feet\[1\]: toe_deg must be a number or \[low, high\]",
        ),
        (
            {"foot": {"kind": "passive", "toe_deg": ["a", 2]}},
            r"drawn_feet\[1\]: toe_deg must be a number or \[low, high\]",
        ),
        (
            {"foot": {"kind": "passive", "ankle_stiffness": [50, 5000]}},
            r"drawn_feet\[1\]: ankle_stiffness must be in \[0, 3000\] N m/rad, got 5000",
        ),
        (
            {"foot": {"kind": "passive", "ankle_deg": [-50, 5]}},
            r"drawn_feet\[1\]: ankle_deg must be in \[-30, 30\] deg, got -50",
        ),
        (
            {"foot": {"kind": "weak", "orthosis": {"toe_stiffness": [1, 2000]}}},
            r"drawn_feet\[1\]: orthosis: toe_stiffness must be in",
        ),
        (
            {"foot": {"kind": "passive", "ankle_table": [[0, [1, 2]], [9, -9]]}},
            r"drawn_feet\[1\]: ankle_table: torque must be in",
        ),
        ({"foot": {"kind": "adaptive", "schedule": [1, 2]}}, r"drawn_feet\[1\]: schedule: "),
        ({"foot": {"kind": "passive", "adapted": "passive"}}, r"drawn_feet\[1\]: adapted people are gone"),
        ({"on": "one"}, r"drawn_feet\[1\] needs a foot"),
        (
            {"foot": "rigid", "on": "top"},
            r"drawn_feet\[1\]: on must be one of 'one', 'both', 'left', 'right', got 'top'",
        ),
        ({"foot": "rigid", "weight": 0}, r"drawn_feet\[1\]: weight must be a finite number > 0"),
        ({"foot": "rigid", "side": "left"}, r"drawn_feet\[1\] has no 'side'; valid: foot, on, weight"),
        ("rigid", r"drawn_feet\[1\] must be a dictionary of foot, on, weight, got 'rigid'"),
    ],
)
def test_a_bad_foot_is_refused_by_its_number(entry, message):
    with pytest.raises(SpringfootError, match=message):
        settings_from(drawn_feet=[{"foot": "intact"}, entry])


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"leg_ratio": 2}, r"drawn_bodies\[0\]: leg_ratio must be in \[0.94, 1.06\]"),
        ({"carried_ratio": "a"}, r"drawn_bodies\[0\]: carried_ratio must be in"),
        ({"step_time_ratio": 1.3}, r"drawn_bodies\[0\]: step_time_ratio must be .*0.8.*1.2.*got 1.3"),
        (
            {"height": 1.8},
            r"drawn_bodies\[0\] has no 'height'; valid: leg_ratio, foot_ratio, carried_ratio, step_time_ratio, weight",
        ),
        ({"weight": -1}, r"drawn_bodies\[0\]: weight must be a finite number > 0"),
    ],
)
def test_a_bad_body_is_refused_by_its_number(entry, message):
    with pytest.raises(SpringfootError, match=message):
        settings_from(drawn_bodies=[entry])


@pytest.mark.parametrize("name", ["drawn_feet", "drawn_bodies"])
@pytest.mark.parametrize("value", [[], "rigid", {"foot": "rigid"}, 3])
def test_other_values_than_lists_are_refused(name, value):
    with pytest.raises(SpringfootError, match=f"{name} must be None or a list of dictionaries of"):
        settings_from(**{name: value})


def test_an_evaluation_is_of_the_settings_feet_and_body_whatever_the_training_drew():
    assert CONDITIONS["drawn_feet"] is CONDITIONS["drawn_bodies"] is None and "left_foot" not in CONDITIONS
    for name, value in (("drawn_feet", FEET), ("drawn_bodies", BODIES)):
        with pytest.raises(SpringfootError, match=f"a recording is of one body .*{name}.* must be None"):
            record(lambda observation: observation[:, :4], settings_from(**{name: value}), name="drawn")
