"""A live walk without a browser: what is asked acts, and what is told is what acted."""

import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.foot import INTACT
from springfoot.errors import SpringfootError
from springfoot.evaluation.live.foot_entries import has_entry, with_entry
from springfoot.evaluation.live.steered_walk import LYING_SECONDS, LiveSession


def walk(session, steps):
    for _ in range(steps):
        session.step()
    return session.frame


def acting(session):
    """(side, (ankle, toe)) K in MuJoCo's own controls."""
    return session.data().ctrl.reshape(2, 4, 2)[:, 2:, 0]


@pytest.fixture(scope="module")
def walking():
    session = LiveSession("schedule")
    walk(session, 5)
    return session


@pytest.fixture
def twins():
    """Two sessions of the same walk."""
    return LiveSession("pretrained"), LiveSession("pretrained")


def test_left_to_the_policy_it_is_the_walk_of_the_environment():
    session = LiveSession("pretrained")
    policy, settings = session._policy, session._settings
    biped = Biped(settings, 1)
    alone = {name: np.array([getattr(settings, name)]) for name in ("height", "mass", "speed")}
    biped.reset(np.arange(1), [0], None, alone)
    observation = biped.observe()
    for _ in range(150):
        observation = biped.step(policy(observation)).observation
    assert walk(session, 150).speed == biped.measurement.com_velocity[0, 0]
    assert np.array_equal(session.data().qpos, biped.data(0).qpos)


def test_k_by_hand_is_the_k_that_acts_in_mujoco(twins):
    session, left_alone = twins
    session.ask(ankle_source="by hand", ankle_stiffness=260.0, toe_source="scaled", toe_factor=0.5)
    frame, other = session.step(), left_alone.step()
    assert frame.stiffness[:, 0] == pytest.approx(260.0, rel=1e-12)
    lowest = session.stiffness_ranges()[1, 0]
    assert frame.stiffness[:, 1] == pytest.approx(np.maximum(0.5 * other.stiffness[:, 1], lowest), rel=1e-9)
    assert np.array_equal(frame.stiffness, acting(session))
    assert np.abs(other.stiffness[:, 0] - 260.0).min() > 5.0
    session.ask(ankle_source="policy", toe_source="policy")
    assert np.array_equal(session.step().stiffness, acting(session)) and np.ptp(session.frame.stiffness[:, 0]) > 1.0


def test_k_by_hand_acts_as_far_as_factors_reach_where_actions_are_factors():
    session = LiveSession("untrained", {"action_mode": "residual"})
    schedule = session.step().stiffness[:, 0]
    session.restart()
    session.ask(ankle_source="by hand", ankle_stiffness=float(1.5 * schedule[0]))
    reached = np.clip(1.5 * schedule[0], schedule / np.e, schedule * np.e)
    assert session.step().stiffness[:, 0] == pytest.approx(reached, rel=1e-9) and reached[0] != reached[1]
    assert np.array_equal(session.frame.stiffness, acting(session))


def test_theta_eq_moves_by_what_is_added_and_the_walk_goes_on(twins):
    session, left_alone = twins
    walk(session, 40)
    walk(left_alone, 40)
    session.ask(ankle_offset_deg=3.0, toe_offset_deg=-2.0)
    frame, other = session.step(), left_alone.step()
    assert frame.time == other.time == pytest.approx(41 * session.dt)
    assert np.degrees(frame.equilibrium - other.equilibrium) == pytest.approx(np.array([[3.0, -2.0]] * 2), abs=0.01)
    assert frame.speed == pytest.approx(other.speed, abs=0.02)


@pytest.mark.parametrize("newton", [200.0, -200.0])
def test_a_push_changes_the_speed_of_the_com_by_its_impulse(twins, newton):
    session, left_alone = twins
    walk(session, 60)
    walk(left_alone, 60)
    session.push(newton)
    pushed = [walk(session, 1).push for _ in range(7)]
    walk(left_alone, 7)
    assert pushed == [newton] * 5 + [0.0] * 2  # 0.1 s
    impulse = newton * 0.1 / session.body.total_mass
    assert 0.5 < (session.frame.speed - left_alone.frame.speed) / impulse < 1.3  # the ground takes or adds some


def test_speed_changes_under_way_and_slope_body_and_feet_begin_anew():
    session = LiveSession("schedule")
    walk(session, 50)
    session.ask(speed=1.0)
    before = walk(session, 150).time
    assert before == pytest.approx(200 * session.dt)
    assert np.mean([walk(session, 1).speed for _ in range(100)]) == pytest.approx(1.0, abs=0.08)
    session.ask(slope_deg=2.0, height=1.85, mass=85.0, right_foot="passive")
    assert session.frame.time == 0.0
    frame = walk(session, 200)
    assert session.model.body_mass.sum() == pytest.approx(85.0, rel=1e-6)
    assert frame.stiffness[1] == pytest.approx([600.0, 60.0])  # the spring's own, whatever is asked
    assert frame.time == pytest.approx(200 * session.dt)
    x, z = session.data().qpos[:2]
    assert session.frame.fell == "" and x > 1.5 and z == pytest.approx(1.0 + x * np.tan(np.radians(2.0)), abs=0.15)


@pytest.mark.parametrize(
    ("wish", "said"),
    [
        ({"height": 3.0}, "height must be a finite number >= 1.45 and <= 2, got 3.0"),
        ({"left_foot": "wood"}, "left_foot must be one of"),
        ({"ankle_source": "scaled", "ankle_factor": 0.0}, "ankle_factor must be a finite number >= 0.25"),
        ({"slope_deg": 9.0}, "slope_deg must be a finite number >= -5"),
        ({"toe_stiffness": float("nan")}, "toe_stiffness must be a finite number > 0"),
        ({"carried_ratio": 0.5}, r"carried_ratio must be in \[0, 0.4\]"),
        ({"left_foot.kind": "wood"}, "left_foot must be one of"),
        ({"left_foot.kind": "weak", "left_foot.strength": 0.9}, r"left_foot: strength must be in \[0.1, 0.6\]"),
        ({"left_foot.ankle_stiffness": 300.0}, "left_foot: a foot of kind 'intact' has no 'ankle_stiffness'"),
        ({"right_foot.orthosis.ankle_stiffness": -1.0}, r"right_foot: orthosis: ankle_stiffness must be in \[0"),
        ({"right_foot.orthosis.engages": "up"}, "right_foot: orthosis: engages must be one of"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_changes(walking, wish, said):
    session = walking
    wishes, place = session.wishes, session.data().qpos.copy()
    with pytest.raises(SpringfootError, match=said):
        session.ask(**wish)
    assert session.wishes == wishes and np.array_equal(session.data().qpos, place)


def test_who_falls_lies_a_while_and_walks_anew():
    session = LiveSession("constant:30,10")
    while not session.step().fell:
        assert session.frame.time < 20.0
    assert session.falls == 1
    fallen = session.frame
    assert walk(session, round(LYING_SECONDS / session.dt) - 1) is fallen
    assert walk(session, 1).time == 0.0 and walk(session, 1).fell == ""


@pytest.mark.parametrize("height", [1.45, 1.71, 1.8, 2.0])
def test_a_walk_starts_at_any_height(height):
    session = LiveSession("schedule", {"height": height})
    assert session.body.height == height
    assert walk(session, 20).fell == ""


def test_settings_begin_where_flags_say_and_pushes_come_by_hand_alone():
    own = {"right_foot": {"kind": "passive", "ankle_stiffness": 400.0}}
    session = LiveSession("schedule", own | {"push_newton": 0.0, "speed_range": None})
    assert walk(session, 20).stiffness[1, 0] == pytest.approx(400.0)
    assert session._settings.push_newton == 0.0


@pytest.mark.parametrize(
    ("name", "value", "instead"),
    [
        ("push_newton", 300.0, "the button Push pushes"),
        ("push_seconds", 0.2, "the button Push pushes for 0.1 s"),
        ("episode_seconds", 5.0, "the walk has no end"),
        ("height_range", (1.6, 1.8), "the slider height sets it"),
        ("speed_range", (1.0, 1.4), "the slider speed sets it"),
        ("speed_interval", 4.0, "the slider speed sets it"),
        ("slope_range_deg", (-1.0, 1.0), "the slider slope sets it"),
    ],
)
def test_settings_that_a_live_walk_would_ignore_are_refused(name, value, instead):
    with pytest.raises(SpringfootError, match=f"^live takes no {name}: {instead}$"):
        LiveSession("schedule", {name: value})


@pytest.fixture(scope="module")
def with_person():
    """A learned person whose stiffness is the schedule's."""
    return LiveSession("schedule", {"person": "learned"})


@pytest.mark.parametrize(
    ("foot", "wish", "joint", "read", "value"),
    [
        ("passive", {"left_foot.ankle_stiffness": 300.0}, "ankle", "device.stiffness", 300.0),
        ("passive", {"left_foot.ankle_deg": 6.0}, "ankle", "device.rest", np.radians(6.0)),
        ("passive", {"left_foot.toe_stiffness": 90.0}, "toe", "device.stiffness", 90.0),
        ("passive", {"left_foot.toe_deg": 8.0}, "toe", "device.rest", np.radians(8.0)),
        ("adaptive", {"left_foot.ankle_deg": 5.0}, "ankle", "rest", np.radians(5.0)),
        ("weak", {"left_foot.strength": 0.5}, "ankle", "strength", 0.5),
        ("intact", {"left_foot.orthosis.ankle_stiffness": 200.0}, "ankle", "orthosis.stiffness", 200.0),
        (
            {"kind": "weak", "orthosis": {"ankle_stiffness": 200.0}},
            {"left_foot.orthosis.ankle_deg": -4.0},
            *("ankle", "orthosis.rest", np.radians(-4.0)),
        ),
        (
            {"kind": "drop", "orthosis": {"ankle_stiffness": 50.0}},
            {"left_foot.orthosis.engages": "plantarflexion"},
            *("ankle", "orthosis.engages", "plantarflexion"),
        ),
        (
            {"kind": "drop", "orthosis": {"ankle_stiffness": 50.0, "engages": "dorsiflexion"}},
            {"left_foot.orthosis.engages": "both ways"},
            *("ankle", "orthosis.engages", None),
        ),
    ],
)
def test_an_entry_of_a_foot_is_worn_on_that_side_and_the_walk_begins_anew(with_person, foot, wish, joint, read, value):
    session = with_person
    assert walk(session, 3).time > 0.0
    session.ask(left_foot=foot, right_foot="intact", **wish)
    assert session.frame.time == 0.0
    left, right = session._biped.feet[0]
    worn = getattr(left, joint)
    for name in read.split("."):
        worn = getattr(worn, name)
    assert worn == (value if value is None or isinstance(value, str) else pytest.approx(value))
    assert right == INTACT
    assert walk(session, 3).fell == ""


def test_sliders_of_a_passive_foot_set_the_k_that_acts_in_mujoco(with_person):
    session = with_person
    session.ask(**{"right_foot.kind": "passive", "right_foot.ankle_stiffness": 310.0, "right_foot.toe_stiffness": 45.0})
    assert session.step().stiffness[1] == pytest.approx([310.0, 45.0])
    told = session.frame.stiffness
    assert np.array_equal(told[told > 0.0], acting(session)[told > 0.0])  # a slack ankle has its tissue's, told as 0


def test_another_kind_keeps_orthosis_and_segments_and_forgets_other_numbers(with_person):
    kept = {"shank_mass_ratio": 0.8, "orthosis": {"ankle_stiffness": 100.0, "engages": "dorsiflexion"}}
    session = with_person
    session.ask(**{"left_foot": {"kind": "passive", "ankle_stiffness": 400.0, **kept}, "left_foot.kind": "weak"})
    assert session.wishes.left_foot == {"kind": "weak", **kept}
    session.ask(**{"left_foot.kind": "passive"})
    assert session.wishes.named("left_foot.ankle_stiffness") == 600.0


def test_an_orthosis_without_stiffness_is_none(twins):
    session, left_alone = twins
    session.ask(**{"left_foot.orthosis.ankle_stiffness": 0.0})
    assert walk(session, 30).speed == walk(left_alone, 30).speed


def test_a_load_is_carried(with_person):
    session = with_person
    session.ask(mass=60.0, carried_ratio=0.2, left_foot="intact", right_foot="intact")
    assert session.model.body_mass.sum() == pytest.approx(72.0, rel=1e-6) and session.body.total_mass == 72.0
    frames = [session.step() for _ in range(150)]
    lifted = np.mean([frame.force[:, 3].sum() for frame in frames[50:]])  # of the weight of body and load
    assert frames[-1].fell == "" and lifted == pytest.approx(1.0, abs=0.05)
    session.ask(mass=63.0, carried_ratio=0.0)
    assert session.model.body_mass.sum() == pytest.approx(63.0, rel=1e-6)


@pytest.mark.parametrize("foot", [{"kind": "passive", "ankle_table": [[-10, 100], [20, -100]]}, "intact", "weak"])
def test_entries_that_do_nothing_are_not_offered(foot):
    kind = foot if isinstance(foot, str) else foot["kind"]
    offered = {path for path in ("ankle_stiffness", "ankle_deg", "toe_stiffness", "strength") if has_entry(foot, path)}
    assert offered == {"passive": {"toe_stiffness"}, "intact": set(), "weak": {"strength"}}[kind]
    assert has_entry(foot, "orthosis.ankle_stiffness") and not has_entry(foot, "orthosis.ankle_deg")
    braced = with_entry(foot, "orthosis.ankle_stiffness", 50.0)
    assert has_entry(braced, "orthosis.ankle_deg") and has_entry(braced, "orthosis.engages")


def test_a_person_may_be_the_policy_or_walk_under_one(with_person):
    assert with_person.person == "learned" and LiveSession("schedule").person == ""
    session = LiveSession("learned")
    assert session.person == "learned"
    walk(session, 100)
    assert session.frame.fell == "" and session.frame.speed > 0.8
    session.ask(ankle_source="by hand", ankle_stiffness=260.0)
    assert session.step().stiffness[:, 0] == pytest.approx(260.0)
    assert np.any(session._action(session._biped.observe())[0, 4:])  # the person still acts


def test_k_is_not_taken_by_hand_from_a_policy_that_sets_none():
    session = LiveSession("learned", {"stiffness_by": "schedule"})
    with pytest.raises(SpringfootError, match=r"^toe_source must be 'policy': its actions set no K, got 'scaled'$"):
        session.ask(toe_source="scaled")
