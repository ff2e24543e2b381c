"""Test the person's actions: offsets to rest angles, and the source of the stiffness."""

from math import radians

import mujoco
import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.person_actions import FARTHEST_AIM
from springfoot.envs.control.stiffness_source import DRAWN_SOURCES
from springfoot.envs.physics.contact import CONTACTS
from springfoot.envs.physics.model import ACTIONS, ANKLE, HIP, KNEE, PERSON_ACTIONS, SIDES
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.observation_entries import OBSERVATION, PERSON_OBSERVATION
from springfoot.envs.task.reward import HELD_SECONDS
from springfoot.errors import SpringfootError

NAMES = [entry.name for entry in PERSON_OBSERVATION]


def started(settings: BipedSettings, num: int = 1, seed: int = 0) -> Biped:
    biped = Biped(settings, num)
    biped.reset(np.arange(num), [seed + index for index in range(num)])
    return biped


def rest_torques(biped: Biped) -> np.ndarray:
    """Return K and K theta_eq (side, joint) each of the first body."""
    return np.moveaxis(biped._control[0].copy(), -1, 0)


def test_offsets_move_the_rest_angles_of_hips_knees_and_ankles_by_their_range() -> None:
    still = started(BipedSettings(acts="both", action_mode="residual"))
    moved = started(BipedSettings(acts="both", action_mode="residual"))
    offsets = np.array([1.0, -1.0, 0.5, -0.25, 0.0, 1.0])
    for biped, of_person in ((still, np.zeros(6)), (moved, offsets)):
        step = biped._decode(np.concatenate([np.zeros(4), of_person])[None], None)
        biped._before_step(step)
    stiffness, drive = rest_torques(moved)
    _, still_drive = rest_torques(still)
    shift = (drive - still_drive)[:, [HIP, KNEE, ANKLE]] / stiffness[:, [HIP, KNEE, ANKLE]]
    np.testing.assert_allclose(shift.ravel(), radians(14.0) * offsets, atol=1e-12)


def test_no_offset_walks_as_without_a_person_to_the_bit() -> None:
    alone = started(BipedSettings(action_mode="residual", start="standing"), 3)  # walking starts differ
    with_person = started(BipedSettings(action_mode="residual", start="standing", acts="both"), 3)
    random = np.random.default_rng(0)
    for _ in range(250):
        action = random.uniform(-1, 1, (3, 4))
        expected = alone.step(action)
        result = with_person.step(np.concatenate([action, np.zeros((3, 6))], 1))
        assert result.observation[:, : len(OBSERVATION)].tobytes() == expected.observation.tobytes()
        assert result.reward.tobytes() == expected.reward.tobytes()


@pytest.mark.parametrize(
    ("acts", "names"), [("stiffness", ACTIONS), ("person", PERSON_ACTIONS), ("both", ACTIONS + PERSON_ACTIONS)]
)
def test_spaces_follow_acts(acts: str, names: tuple[str, ...]) -> None:
    source = "schedule" if acts == "person" else "action"
    biped = started(BipedSettings(acts=acts, stiffness_by=source))  # type: ignore[arg-type]
    assert biped.action_names == names
    entries = OBSERVATION if acts == "stiffness" else PERSON_OBSERVATION
    assert biped.observation_names == tuple(entry.name for entry in entries)
    assert biped.observe().shape == (1, len(entries))
    with pytest.raises(SpringfootError, match=rf"actions must have shape \(1, {len(names)}\), got \(1, 5\)"):
        biped.step(np.zeros((1, 5)))


def test_bad_offsets_change_nothing() -> None:
    biped = started(BipedSettings(acts="both"))
    before = biped.state()
    with pytest.raises(SpringfootError, match="actions must be finite"):
        biped.step(np.full((1, 10), np.nan))
    after = biped.state()
    assert all(before[name].tobytes() == after[name].tobytes() for name in before if name != "generators")


def test_a_person_sees_the_feet_the_last_offsets_and_the_stiffness() -> None:
    settings = BipedSettings(
        acts="both",
        right_foot={"kind": "passive", "ankle_stiffness": 600, "ankle_deg": 4},  # type: ignore[arg-type]
        slope_deg=3.0,
    )
    biped = started(settings)
    assert biped.observe()[0, NAMES.index("stiffness_ankle_right")] == pytest.approx(np.log(2.0))
    seen = biped.step(np.array([[0, 0, 0, 0, 1, 0, 0, 0, 0, -0.5]])).observation[0]
    told = dict(zip(NAMES, seen.tolist(), strict=True))
    assert told["muscles_ankle_left"] == told["muscles_toe_left"] == 1.0
    assert told["muscles_ankle_right"] == told["muscles_toe_right"] == 0.0
    assert told["stiffness_ankle_right"] == pytest.approx(np.log(600 / 300))
    assert told["device_rest_ankle_right"] == pytest.approx(radians(4))
    assert told["slope"] == pytest.approx(radians(3))
    assert told["last_rest_hip_left"] == pytest.approx(radians(14))
    assert told["last_rest_ankle_right"] == pytest.approx(radians(-7))
    assert told["own_stiffness"] == 1.0


@pytest.mark.parametrize("source", ["schedule", "scaled", "constant", "random"])
def test_others_set_the_stiffness_and_the_action_is_read_as_none(source: str) -> None:
    settings = BipedSettings(acts="both", action_mode="residual", stiffness_by=source)  # type: ignore[arg-type]
    biped = started(settings, 2)
    twin = started(settings, 2)
    random = np.random.default_rng(1)
    for _ in range(20):
        person = random.uniform(-0.1, 0.1, (2, 6))
        of_stiffness = random.uniform(-1, 1, (2, 4))
        result = biped.step(np.concatenate([of_stiffness, person], 1))
        expected = twin.step(np.concatenate([np.zeros((2, 4)), person], 1))
        assert result.observation.tobytes() == expected.observation.tobytes()
    assert not result.observation[:, NAMES.index("last_action_ankle_left")].any()
    assert not biped.controlled.any()
    assert not result.info["controlled/ankle_left"].any()


def test_a_constant_stiffness_stays_and_a_random_one_changes() -> None:
    kinds = {}
    for source in ("constant", "random", "scaled"):
        biped = started(BipedSettings(acts="both", action_mode="residual", stiffness_by=source), 1, 5)  # type: ignore
        kinds[source] = np.array([biped.step(np.zeros((1, 10))).info["stiffness/ankle_left"][0] for _ in range(10)])
    assert np.ptp(kinds["constant"]) == 0.0
    assert 20.0 <= kinds["random"].min() < kinds["random"].max() <= 800.0
    assert len(set(kinds["random"])) == 10
    assert np.ptp(kinds["scaled"]) > 0.0


def test_each_source_is_drawn_in_its_share_of_the_episodes() -> None:
    episodes = 1000
    source = started(BipedSettings(acts="both", stiffness_by="drawn"), episodes).subjects.rows["source"]
    drawn = {
        "action": source["not_action"] == 0,
        "scaled": source["scheduled"] == 1,
        "constant": (source["not_action"] == 1) & (source["scheduled"] == 0) & (source["anew"] == 0),
        "random": source["anew"] == 1,
    }
    for name, share in DRAWN_SOURCES.items():
        assert drawn[name].sum() == pytest.approx(share * episodes, abs=4 * np.sqrt(share * (1 - share) * episodes))
    assert sum(DRAWN_SOURCES.values()) == pytest.approx(1.0)


def test_alone_as_in_a_batch_and_from_a_kept_state_to_the_bit() -> None:
    settings = BipedSettings(acts="both", action_mode="residual", stiffness_by="drawn", push_newton=50.0)
    batch = started(settings, 3, 7)
    alone = started(settings, 1, 9)
    random = np.random.default_rng(2)
    for step in range(60):
        action = random.uniform(-0.5, 0.5, (3, 10))
        result = batch.step(action)
        assert alone.step(action[2:]).observation.tobytes() == result.observation[2:].tobytes()
        if step == 30:
            copy = started(settings, 3, 100)
            copy.restore(batch.state())
        if step > 30:
            assert copy.step(action).observation.tobytes() == result.observation.tobytes()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"acts": "legs"}, "acts must be one of 'stiffness', 'person', 'both', got 'legs'"),
        ({"acts": "both", "decisions": "25hz"}, "acts 'both' needs steps of 20 ms"),
        (
            {"acts": "both", "person": "x"},
            "acts 'both': the policy itself moves the legs, so that person must be 'tuned'",
        ),
        ({"stiffness_by": "schedule"}, "stiffness_by 'schedule' needs acts 'person' or 'both'"),
        ({"person_range_deg": 40.0}, "person_range_deg must be"),
        ({"aim_rate": -1.0}, "aim_rate must be"),
    ],
)
def test_bad_settings_are_one_line(settings: dict, message: str) -> None:
    with pytest.raises(SpringfootError) as error:
        BipedSettings(**settings)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_a_standing_body_has_no_offsets() -> None:
    biped = started(BipedSettings(acts="both", start="standing"))
    biped.step(np.ones((1, 10)))
    assert not biped.subjects.rows["person"]["offset"].any()


def test_a_person_aims_at_the_speed_that_it_lacks_within_bounds() -> None:
    biped = started(BipedSettings(acts="both", aim_rate=2.0))
    unit = np.sqrt(9.81 * biped.body.leg_length)
    aims, expected = [], 0.0
    for _ in range(100):
        observation = biped.step(np.zeros((1, 10))).observation
        lacking = biped.settings.speed - biped.measurement.com_velocity[0, 0]
        expected = np.clip(expected + 2.0 * biped.dt * lacking, -FARTHEST_AIM, FARTHEST_AIM)
        aims.append(float(biped.subjects.rows["person"]["aim"][0]))
        assert aims[-1] == pytest.approx(expected, abs=1e-12)
        assert float(observation[0, NAMES.index("aim")]) * unit == pytest.approx(aims[-1], abs=1e-6)
        assert float(observation[0, NAMES.index("command_speed")]) * unit == pytest.approx(biped.settings.speed)
    assert np.ptp(aims) > 0.01


def test_a_person_is_told_how_far_its_mean_speed_is_from_the_commanded_one() -> None:
    biped = started(BipedSettings(acts="both"))
    unit = np.sqrt(9.81 * biped.body.leg_length)
    mean = biped.settings.speed
    for _ in range(60):
        seen = float(biped.step(np.zeros((1, 10))).observation[0, NAMES.index("held_speed_error")])
        mean += biped.dt / HELD_SECONDS * (biped.measurement.com_velocity[0, 0] - mean)
        assert seen * unit == pytest.approx(mean - biped.settings.speed, abs=1e-6)
    assert abs(mean - biped.settings.speed) > 0.01


def test_the_aim_rests_on_the_commanded_speed_while_a_body_stands_and_at_a_reset() -> None:
    biped = started(BipedSettings(acts="both", aim_rate=2.0, start="standing"))
    for _ in range(20):
        biped.step(np.zeros((1, 10)))
    assert biped.subjects.rows["person"]["aim"][0] == 0.0
    walking = started(BipedSettings(acts="both", aim_rate=2.0))
    walking.step(np.zeros((1, 10)))
    assert walking.subjects.rows["person"]["aim"][0] != 0.0
    walking.reset(np.arange(1), [1])
    assert walking.subjects.rows["person"]["aim"][0] == 0.0


def test_the_aim_of_a_body_left_out_stays_and_that_of_the_other_moves() -> None:
    biped = started(BipedSettings(acts="both", aim_rate=2.0), 2)
    biped.step(np.zeros((2, 10)))
    before = biped.subjects.rows["person"]["aim"].copy()
    biped.step(np.zeros((2, 10)), np.array([True, False]))
    after = biped.subjects.rows["person"]["aim"]
    lacking = biped.settings.speed - biped.measurement.com_velocity[0, 0]
    assert after[0] == pytest.approx(before[0] + 2.0 * biped.dt * lacking, abs=1e-12)
    assert after[1] == before[1] != 0.0


@pytest.mark.parametrize("slope_deg", [-5.0, 0.0, 5.0])
def test_a_person_starts_on_a_foot_at_rest_and_tuned_legs_with_the_commanded_speed(slope_deg: float) -> None:
    drawn = {"slope_deg": slope_deg, "speed_range": (0.8, 1.6), "height_range": (1.5, 1.9)}
    biped = started(BipedSettings(acts="both", **drawn), 20)
    stance = np.where(biped.leg_phase[:, 0] < 0.5, 0, 1)
    before, after = (moved_contacts(biped, moment)[np.arange(20), stance] for moment in (-1e-6, 1e-6))
    lowest = np.argmin(before[..., 1] - np.tan(np.radians(slope_deg)) * before[..., 0], axis=-1)
    velocity = (after - before)[np.arange(20), lowest] / 2e-6
    np.testing.assert_allclose(velocity, 0.0, atol=1e-4)
    tuned = started(BipedSettings(**drawn), 20)
    assert np.array_equal(tuned.measurement.base_velocity[:, 0], tuned.subjects.speed)
    assert np.ptp(biped.measurement.base_velocity[:, 0] - biped.subjects.speed) > 0.05


def moved_contacts(biped: Biped, moment: float) -> np.ndarray:
    """Return the lowest points (N, side, contact, 2) of the contacts in the world after a time of steady motion."""
    data = [biped.data(index) for index in range(biped.num_envs)]
    points = []
    for index, state in enumerate(data):
        model = biped.model_of(index)
        state.qpos[:] += moment * state.qvel
        mujoco.mj_forward(model, state)
        points.append([[lowest_point(model, state, f"{contact}_{side}") for contact in CONTACTS] for side in SIDES])
    return np.array(points)


def lowest_point(model, data, name: str) -> np.ndarray:
    """Return the lowest point (x, z) of a contact sphere [m]."""
    geom = model.geom(name).id
    return data.geom_xpos[geom, [0, 2]] - [0.0, model.geom_size[geom, 0]]
