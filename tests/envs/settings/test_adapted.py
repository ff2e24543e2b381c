"""People who have adapted to a foot: what a foot's `adapted` may be, and the legs it gives each side."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from springfoot.agents.policies.fingerprint import fingerprint
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.constants import leg_constants
from springfoot.envs.control.person import HELD_BY_SOUND, person_constants
from springfoot.envs.settings.adapted import ADAPTED, LEGS, committed_feet
from springfoot.envs.settings.feet import foot_setting
from springfoot.envs.settings.settings import settings_from, settings_to_json
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.errors import SpringfootError

TUNED = leg_constants("planned", "people")
SOUND = replace(TUNED, trunk_pitch_deg=TUNED.trunk_pitch_deg + 1.0, hip_stiffness=(200.0, 470.0))
OTHER = replace(TUNED, knee_knots_deg=tuple(knot + 3.0 for knot in TUNED.knee_knots_deg))
PERSON = {"1.2": {"sound": asdict(SOUND), "other": asdict(OTHER)}}
FOOT = {"kind": "rigid", ADAPTED: PERSON}


def walked(biped: Biped, steps: int = 30) -> np.ndarray:
    biped.reset(np.arange(1), [3], start=0.2)
    return np.stack([biped.step(np.zeros((1, 4))).observation for _ in range(steps)])


def test_a_person_walks_on_the_legs_given_with_the_foot():
    settings = settings_from(right_foot=FOOT, action_mode="residual")
    bare = settings_from(right_foot="rigid", action_mode="residual")
    other = replace(OTHER, **{name: getattr(SOUND, name) for name in HELD_BY_SOUND})
    ours, its = Biped(settings, 1), Biped(bare, 1, legs=[SOUND], right_legs=[other])
    assert walked(ours).tobytes() == walked(its).tobytes()
    assert settings_from(**settings_to_json(settings)) == settings


@pytest.mark.parametrize("side", [0, 1])
def test_the_sound_leg_is_that_of_the_other_side_and_holds_the_trunk(side):
    settings = settings_from(**{("left_foot", "right_foot")[side]: FOOT})
    legs = [person_constants(settings, 1.2, each) for each in (0, 1)]
    assert legs[1 - side] == SOUND
    assert legs[side].knee_knots_deg == OTHER.knee_knots_deg
    assert legs[side].trunk_pitch_deg == SOUND.trunk_pitch_deg


def test_at_other_speeds_the_committed_legs_are_moved_as_far():
    settings = settings_from(right_foot=FOOT, speed=0.8)
    slow = leg_constants("planned", "people", 0.8)
    legs = [person_constants(settings, 0.8, side) for side in (0, 1)]
    assert legs[1].knee_knots_deg == pytest.approx(np.add(slow.knee_knots_deg, 3.0))
    assert legs[0].trunk_pitch_deg == legs[1].trunk_pitch_deg == pytest.approx(slow.trunk_pitch_deg + 1.0)
    assert legs[0].knee_knots_deg == pytest.approx(slow.knee_knots_deg)
    two = {"1.2": PERSON["1.2"], "0.8": {leg: asdict(slow) for leg in LEGS}}
    between = settings_from(right_foot={"kind": "rigid", ADAPTED: two}, speed=1.0)
    middle = person_constants(between, 1.0, 1)
    here = leg_constants("planned", "people", 1.0)
    assert middle.knee_knots_deg == pytest.approx(np.add(here.knee_knots_deg, 1.5))


def test_policies_of_other_legs_have_another_fingerprint():
    one, two = (fingerprint(Biped(settings_from(right_foot=foot), 1)) for foot in ("rigid", FOOT))
    assert one["legs"] != two["legs"]
    assert one["model"] == two["model"]
    moved = {"1.2": PERSON["1.2"] | {"other": asdict(replace(OTHER, knee_stiffness=(400.0, 100.0)))}}
    three = fingerprint(Biped(settings_from(right_foot={"kind": "rigid", ADAPTED: moved}), 1))
    assert three["legs"] != two["legs"]


@pytest.mark.parametrize("name", committed_feet())
def test_every_committed_person_can_be_named(name):
    foot = committed_feet()[name]
    bare = {key: value for key, value in foot.items() if key != ADAPTED}
    assert foot_setting("right_foot", foot).plain == foot
    Biped(settings_from(right_foot={**bare, ADAPTED: name}), 1)


@pytest.mark.parametrize(
    ("adapted", "told"),
    [
        ("nobody", "right_foot: adapted must be one of"),
        ("passive", "right_foot: adapted 'passive' is a person on a foot of kind 'passive', got kind 'rigid'"),
        (3, "right_foot: adapted must be a name or a dictionary of speed -> sound and other, got 3"),
        ({}, "right_foot: adapted must be a name or a dictionary"),
        ({"fast": PERSON["1.2"]}, r"right_foot: adapted: speed must be in \[0.4, 2\] m/s, got nan"),
        ({"9": PERSON["1.2"]}, "right_foot: adapted: speed must be in"),
        ({"1.2": {"sound": asdict(SOUND)}}, "right_foot: adapted at 1.2 m/s must be sound and other"),
        ({"1.2": {"sound": asdict(SOUND), "other": {"hip": "x"}}}, "right_foot: adapted at 1.2 m/s must be sound and"),
    ],
)
def test_what_is_no_person_is_refused_in_one_line(adapted, told):
    with pytest.raises(SpringfootError, match=told) as error:
        settings_from(right_foot={"kind": "rigid", ADAPTED: adapted})
    assert "\n" not in str(error.value)


def test_legs_without_all_constants_two_people_and_other_springs_are_refused():
    short = {"1.2": {"sound": {"hip_stiffness": [1.0, 2.0]}, "other": asdict(OTHER)}}
    with pytest.raises(SpringfootError, match="adapted: constants must be a dictionary with hip_knots_deg, "):
        Biped(settings_from(right_foot={"kind": "rigid", ADAPTED: short}), 1)
    with pytest.raises(SpringfootError, match="a person adapts to one foot"):
        Biped(settings_from(right_foot=FOOT, left_foot=FOOT), 1)
    with pytest.raises(SpringfootError, match="right_foot: adapted legs are of 'planned' constants, got 'neutral'"):
        Biped(settings_from(right_foot=FOOT, equilibrium="neutral"), 1)


def test_a_list_of_feet_has_one_person():
    SegmentedFootBipedVector(2, right_foot=[FOOT, {"kind": "passive", ADAPTED: PERSON}]).close()
    with pytest.raises(SpringfootError, match="right_foot: all feet of a list must have the same adapted"):
        SegmentedFootBipedVector(2, right_foot=[FOOT, "rigid"])
