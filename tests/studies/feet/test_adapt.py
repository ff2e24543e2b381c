"""The search for a person who adapts to a foot: what it moves, what it pays for, and what it writes."""

import json
from dataclasses import asdict, replace
from math import exp

import numpy as np
import pytest

from springfoot.cli.main import study_main
from springfoot.envs.control.person import HELD_BY_SOUND
from springfoot.envs.settings.adapted import ADAPTED
from springfoot.envs.settings.settings import settings_from
from springfoot.errors import SpringfootError
from springfoot.studies.feet import person_cost
from springfoot.studies.feet.adapt import Adapt, beginning
from springfoot.studies.feet.person_search import OF_MUSCLES, Person, PersonSearch
from springfoot.studies.searches.leg_walks import walk

SETTINGS = settings_from(action_mode="residual", start=0.2)


def test_the_search_begins_at_its_start_and_moves_each_side():
    begin = beginning({"kind": "passive"}, 1.2)
    search = PersonSearch(begin, 1.2, design=1.0)
    there = search.person(np.zeros(search.size))
    usual = {"ankle_stiffness": 600.0, "ankle_deg": 2.0, "toe_stiffness": 60.0, "toe_deg": 0.0}
    assert there == replace(begin, foot={"kind": "passive", **usual})
    stepped = search.person(np.ones(search.size))
    assert stepped.foot == pytest.approx(
        {"ankle_stiffness": 600 * exp(0.15), "ankle_deg": 3.0, "toe_stiffness": 60 * exp(0.15), "toe_deg": 3.0}
        | {"kind": "passive"},
        abs=1e-3,
    )
    one = np.zeros(search.size)
    one[0] = 1.0  # the first of the sound hip's knots
    assert search.person(one).other == begin.other
    assert search.person(one).sound.hip_knots_deg[0] == pytest.approx(begin.sound.hip_knots_deg[0] + 2.0)


@pytest.mark.parametrize("kind", ["rigid", "weak"])
def test_legs_share_phase_and_trunk_and_a_device_keeps_what_only_muscles_read(kind):
    begin = beginning(kind, 1.2)
    search = PersonSearch(begin, 1.2, design=0.0)
    person = search.person(0.3 * np.random.default_rng(0).standard_normal(search.size))
    for name in HELD_BY_SOUND:
        assert getattr(person.other, name) == getattr(person.sound, name)
        stays = name == "swing_place_gain"  # who follows people has none
        assert (getattr(person.sound, name) == getattr(begin.sound, name)) == stays
    kept = [getattr(person.other, name) == getattr(begin.other, name) for name in OF_MUSCLES]
    assert kept == [kind == "rigid"] * len(OF_MUSCLES)
    assert person.foot == kind
    assert person.sound.neutral_deg == begin.sound.neutral_deg


def test_an_adaptive_foot_begins_as_the_passive_one():
    passive, adaptive = (beginning({"kind": kind}, 1.2) for kind in ("passive", "adaptive"))
    walks = []
    for person in (passive, adaptive):
        walked = walk(
            SETTINGS, [person.sound], [0], 1, foreign=(), seconds=1.0, right=[person.other], feet=[person.feet]
        )
        assert walked.biped.num_envs == 1
        walks.append(walked.episode(0)["angle"])
    # A device's damping is that of the joint's muscles unless it has its own.
    np.testing.assert_allclose(*walks, atol=1e-6)  # float32


def missed(person: Person, **settings) -> dict[str, float]:
    own = replace(SETTINGS, **settings)
    walked = walk(own, [person.sound], [0], 1, foreign=(), right=[person.other], feet=[person.feet])
    assert walked.missing[0] == 0.0
    found = person_cost.misses(walked.episode(0), walked.biped, bend=0.0, bend_weight=2.0)
    assert found is not None
    return dict(zip(["speed", "step", "stance", "peak L", "peak R"], found, strict=False)) | {"bend": found[-1]}


def test_sound_feet_walk_at_their_speed_evenly_and_bend_their_toes():
    even = missed(beginning("intact", 1.2))
    assert abs(even["speed"]) < 3
    assert abs(even["step"]) < 1
    assert even["peak L"] < 1
    assert even["bend"] * person_cost.TOLERANCE["bend"] == pytest.approx(2.0 * np.deg2rad(32), abs=0.2)


def test_a_foot_that_makes_steps_uneven_costs_and_falls_cost_most():
    stiff = beginning({"kind": "passive"}, 1.2)
    assert missed(stiff)["step"] < -2  # the leg behind the stiff foot steps shorter
    own = settings_from()
    paid = person_cost.cost(own, [beginning("intact", 1.2), stiff, beginning("rigid", 1.2)], 0, 1, 150.0)
    assert paid[0] < paid[1] < 30 < paid[2]


@pytest.mark.slow
def test_it_writes_feet_that_walk_and_goes_on_from_them(tmp_path, capsys):
    feet = tmp_path / "adapted.json"
    words = ["adapt", "--generations", "1", "--population", "2", "--searches", "1", "--feet", str(feet)]
    words += ["--episodes", "1", "--seconds", "6"]
    passive = [*words, "--foot", "passive", "--design", "1"]
    assert study_main([*passive, "--out", str(tmp_path / "one")]) == 0
    kept = json.loads(feet.read_text())
    foot = kept["feet"]["passive"]
    assert json.loads((tmp_path / "one" / "foot-1.json").read_text()) == foot
    assert kept["found_by"]["passive"].startswith("springfoot study adapt --generations 1")
    assert "--out" not in kept["found_by"]["passive"]
    assert settings_from(right_foot=foot).right_foot.plain == foot
    assert foot[ADAPTED]["1.2"].keys() == {"sound", "other"}
    told = capsys.readouterr().out
    assert "| passive, not adapted | 0.00 | " in told
    assert "| passive | " in told
    again = [*words, "--start", "passive", "--sigma", "1e-9", "--foot", "passive", "--name", "same", "--design", "1"]
    assert study_main([*again, "--out", str(tmp_path / "two")]) == 0
    same = json.loads(feet.read_text())["feet"]["same"]
    assert same["ankle_stiffness"] == pytest.approx(foot["ankle_stiffness"])
    assert same[ADAPTED]["1.2"]["sound"]["hip_stiffness"] == pytest.approx(
        foot[ADAPTED]["1.2"]["sound"]["hip_stiffness"], rel=1e-4
    )
    capsys.readouterr()
    assert study_main([*words, "--start", "nobody", "--out", str(tmp_path / "three")]) == 2
    assert "no foot 'nobody' to start from" in capsys.readouterr().err
    assert study_main([*words, "--foot", "wooden", "--out", str(tmp_path / "three")]) == 2
    assert "foot must be one of 'intact', 'rigid'" in capsys.readouterr().err


@pytest.mark.slow
def test_the_same_seed_finds_the_same(tmp_path):
    found = []
    for index in range(2):
        study = Adapt(
            generations=1,
            population=3,
            searches=(2,),
            episodes=1,
            seconds=6.0,
            feet=tmp_path / f"{index}.json",
            threads=index + 1,
        )
        found.append(study.ask(lambda done: None).files)
    assert found[0] == found[1]
    assert "rigid, search 2" in json.loads((tmp_path / "0.json").read_text())["feet"]


@pytest.mark.slow
def test_a_search_that_was_stopped_is_searched_anew_and_a_finished_one_is_not(tmp_path, capsys, monkeypatch):
    command = "springfoot study adapt --foot rigid --searches 1 --generations 1 --population 2 --episodes 1 --seconds 1"
    known, to = tmp_path / "known.json", tmp_path / "to.json"
    person = beginning("rigid", 1.2).setting(1.2)
    known.write_text(json.dumps({"found_by": {"rigid": command}, "feet": {"rigid": person}}))
    to.write_text(json.dumps({"found_by": {}, "feet": {"rigid": person}}))  # as a search leaves it half-way
    words = ["adapt-all", "--feet", str(known), "--to", str(to), "--out", str(tmp_path / "out")]
    assert study_main(words) == 0
    found = json.loads(to.read_text())
    assert found["found_by"] == {"rigid": command}
    assert found["feet"]["rigid"] != person
    assert "| rigid | other |" in capsys.readouterr().out
    monkeypatch.setattr(person_cost, "cost", None)  # nothing is searched for again
    assert study_main([*words[:-1], str(tmp_path / "again")]) == 0
    assert json.loads(to.read_text()) == found


def test_a_candidate_is_kept_with_its_foot_and_speed():
    person = beginning({"kind": "weak", "strength": 0.3}, 0.8)
    setting = person.setting(0.8)
    assert setting["kind"] == "weak"
    assert setting["strength"] == 0.3
    assert setting[ADAPTED]["0.8"]["other"] == json.loads(json.dumps(asdict(person.other)))


@pytest.mark.parametrize(
    ("flags", "told"),
    [({"generations": 0}, "generations"), ({"searches": (0,)}, "searches"), ({"design": -1.0}, "design")],
)
def test_counts_out_of_range_are_refused(flags, told):
    with pytest.raises(SpringfootError, match=told):
        Adapt(**flags).check()
