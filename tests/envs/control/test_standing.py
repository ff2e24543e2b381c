"""Standing, setting off and stopping."""

from typing import Any

import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.reference_walk import tabulated_speeds
from springfoot.envs.control.standing import (
    LANDED,
    OFF_PHASE,
    SLOW_SPEED,
    STAND_COM,
    STAND_SECONDS,
    STANDING,
    STARTING,
    STOP_KNEE,
    STOP_PITCH,
    STOPPED,
    STOPPING,
    TRUNK_STIFFNESS,
    WALKING,
    Standing,
    standing_posture,
    steady_walk,
)
from springfoot.envs.control.subjects import Subjects
from springfoot.envs.env import SegmentedFootBiped
from springfoot.envs.physics.model import ACTIONS, ANKLE, HIP, KNEE, TOE
from springfoot.envs.physics.simulation import Simulation
from springfoot.envs.settings.settings import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import WARM_UP, record
from springfoot.gait.body.body import GRAVITY, Body
from springfoot.gait.people import scores as score


def standing(num: int = 2, **settings: Any) -> Biped:
    biped = Biped(BipedSettings(start="standing", **settings), num)
    biped.reset(np.arange(num), range(num))
    return biped


def waiting(biped: Biped, until: float = STAND_SECONDS[0]) -> int:
    """Steps before anyone sets off."""
    return round(until / biped.dt) - 1


@pytest.mark.parametrize(
    "body", [Body(), Body(1.5, 45.0), Body(1.95, 110.0, leg_ratio=1.05, foot_ratio=0.95, carried_ratio=0.2)]
)
@pytest.mark.parametrize("knee", [0.0, 0.05, 0.12])
def test_posture_has_flat_feet_and_the_com_at_its_place(body, knee):
    simulation = Simulation(body, 1)
    angle = np.tile(standing_posture(body, knee), (1, 2, 1))
    assert angle[0, 0, KNEE] == knee
    angle[..., HIP] += body.trunk_lean
    simulation.reset(np.array([0]), np.array([[0.0, 0.0, body.trunk_lean]]), np.zeros((1, 3)), angle, 0 * angle)
    m = simulation.measure()
    np.testing.assert_allclose(m.com[0, 0] - m.ankle[0, :, 0], STAND_COM * body.length_scale, atol=1e-9)
    np.testing.assert_allclose(np.ptp(m.contact[0, ..., 1]), 0.0, atol=1e-9)


@pytest.mark.parametrize("slope_deg", [-5.0, 5.0])
def test_who_begins_to_stand_on_a_slope_has_both_feet_flat_on_it(slope_deg):
    biped = standing(slope_deg=slope_deg)
    heights = biped.measurement.contact[..., 1]  # of heel, ball and toe tip above the ground below them
    np.testing.assert_allclose(heights, heights.min(), atol=5e-4)


def test_a_standing_body_bears_its_weight_under_its_com_and_moves_little():
    biped = standing(mass=80.0, height=1.8)
    actions = np.random.default_rng(0).uniform(-1, 1, (2, 4))
    for _ in range(waiting(biped)):
        result = biped.step(actions)
        m = biped.measurement
        actions = -actions  # which change nothing
    weight = 80.0 * GRAVITY
    vertical = m.force[..., 1]
    np.testing.assert_allclose(vertical.sum(axis=(1, 2)), weight, rtol=0.02)
    np.testing.assert_allclose(m.force[..., 0].sum(axis=(1, 2)), 0.0, atol=0.02 * weight)
    cop = (vertical * m.contact[..., 0]).sum(axis=(1, 2)) / vertical.sum(axis=(1, 2))
    np.testing.assert_allclose(cop, m.com[:, 0], atol=0.01)
    assert (cop > m.contact[:, :, 0, 0].max(axis=1)).all() and (cop < m.contact[:, :, 2, 0].min(axis=1)).all()
    assert np.abs(m.com_velocity).max() < 0.03
    np.testing.assert_allclose(result.info["phase/left"] % 0.5, OFF_PHASE)
    assert (biped.standing_mode == STANDING).all()


def test_stiffness_while_standing_is_the_springs_own_and_info_tells_it():
    biped = standing(1)
    soft, stiff = (biped.step(np.full((1, 4), value)) for value in (-1.0, 1.0))
    names = [f"{what}/{name}" for what in ("stiffness", "equilibrium", "torque") for name in ACTIONS]
    k, rest, torque = np.array([stiff.info[name] for name in names]).reshape(3, 2, 2)
    np.testing.assert_array_equal(k, np.array([soft.info[name] for name in names]).reshape(3, 2, 2)[0])
    m = biped.measurement
    lag = m.angle[0, :, ANKLE:] + 0.02 * m.velocity[0, :, ANKLE:]
    np.testing.assert_allclose(torque, k * (rest - lag), atol=1e-9)
    assert all(stiff.info[f"work/stiffness/{name}"][0] == 0.0 for name in ACTIONS)


def test_it_sets_off_walks_steadily_and_comes_to_rest():
    policy, settings = policy_and_settings("schedule", {"start": "standing", "stop_at": 9.0, "episode_seconds": 15.0})
    recording = record(policy, settings, name="schedule", episodes=4, threads=1)
    metrics = measure(recording).metrics
    assert metrics["falls"] == 0 and metrics["came_to_rest"] == 4
    begin, end = steady_walk(settings)
    assert STAND_SECONDS[1] < begin < 5.0 and end == 9.0
    first = np.isclose(recording.series["phase"] % 0.5, OFF_PHASE).argmin(axis=1)[:, 0] * 0.01
    assert (first > STAND_SECONDS[0]).all() and (first < STAND_SECONDS[1] + 1.0).all()
    assert np.ptp(first) > 0.0  # not all at the same time
    assert 0 < metrics["strides"]["count"] < 4 * 2 * (end - begin - WARM_UP)
    assert metrics["speed_m_s"]["mean"] == pytest.approx(settings.speed, abs=0.1)
    still = recording.series["com"][:, -100:]
    assert (np.ptp(still, axis=1) < score.REST_TRAVEL).all()
    both = recording.series["force"][:, -100:, :, :, 1].sum(axis=3).mean(axis=1)
    weight = settings.mass * GRAVITY
    np.testing.assert_allclose(both.sum(axis=1), weight, rtol=0.02)
    assert (both > 0.1 * weight).all()  # it stands on both feet


def test_springs_of_a_body_that_stops_hold_its_posture_and_right_its_trunk():
    settings = BipedSettings(start="standing", stop_at=3.0)
    subjects = Subjects(settings, np.array([SLOW_SPEED, 1.2]), 1)
    held = Standing(settings, subjects)
    simulation = Simulation(Body(), 1)
    pitch, everyone = 0.2, np.array([True])
    angle = np.array([[[0.3, 0.1, 0.05, 0.2], [-0.2, 0.4, -0.1, 0.0]]])
    simulation.reset(np.array([0]), np.array([[0.0, 1.5, pitch]]), np.zeros((1, 3)), angle, 0 * angle)
    simulation.measure()
    held.reset(np.array([0]), [np.random.default_rng(0)], np.zeros(1), standing=True)
    subjects.rows["held"]["mode"] = STOPPING
    subjects.rows["legs"]["phase"] = np.mean(LANDED)
    subjects.speed[:] = SLOW_SPEED
    held.switch(simulation.arrays, np.array([3.5]), everyone)
    assert held.mode.tolist() == [STOPPED]
    control = np.zeros((1, 2, 4, 2))
    held.drive(simulation.arrays.bodies, control, everyone)
    k, drive = control[0, ..., 0], control[0, ..., 1]
    torque = drive - k * angle[0]
    np.testing.assert_allclose(torque[:, HIP], -TRUNK_STIFFNESS * (pitch - Body().trunk_lean - STOP_PITCH), rtol=1e-9)
    np.testing.assert_allclose(torque[:, KNEE], k[:, KNEE] * STOP_KNEE, rtol=1e-9)
    np.testing.assert_allclose(torque[:, TOE], 0.0, atol=1e-9)


def test_a_policy_acts_in_the_steady_walk_only():
    biped = standing(2, speed=SLOW_SPEED, stop_at=5.5, episode_seconds=8.0)
    low, high = biped.settings.ankle_stiffness_range
    seen: dict[int, set[bool]] = {}
    for _ in range(375):
        result = biped.step(np.tile([0.5, 0.2], (2, 2)))
        k = np.sqrt(low * high) * np.sqrt(high / low) ** 0.5
        for mode, own in zip(
            biped.standing_mode.tolist(), np.isclose(result.info["stiffness/ankle_left"], k), strict=True
        ):
            seen.setdefault(mode, set()).add(bool(own))
        if result.terminated.any():
            break
    assert seen[WALKING] == {True}
    assert seen[STANDING] == seen[STARTING] == {False}


def test_who_stands_walks_and_stops_has_the_same_bits_alone_and_together():
    settings = BipedSettings(start="standing", stop_at=3.0, height_range=(1.5, 1.9), speed_range=(0.8, 1.0))
    together = Biped(settings, 3)
    together.reset(np.arange(3), range(3))
    alone = [Biped(settings, 1) for _ in range(3)]
    for seed, biped in enumerate(alone):
        biped.reset(np.array([0]), [seed])
    actions = np.random.default_rng(1).uniform(0.0, 0.6, (3, 4))
    seen: set[int] = set()
    for _ in range(260):
        result = together.step(actions)
        each = [biped.step(actions[i : i + 1]) for i, biped in enumerate(alone)]
        seen.update(together.standing_mode.tolist())
        for name in ("observation", "reward", "values"):
            np.testing.assert_array_equal(getattr(result, name), np.concatenate([getattr(one, name) for one in each]))
    assert {STANDING, STARTING, STOPPED} <= seen
    assert np.isfinite(result.values).all()


def test_rest_of_a_body_that_walks_on_or_falls_is_not_counted():
    tick = 0.01
    still = np.zeros((200, 2))
    moving = np.stack([np.linspace(0.0, 1.0, 200), np.zeros(200)], axis=-1)
    assert score.at_rest(still, still, tick=tick) and not score.at_rest(still, moving, tick=tick)
    assert not score.at_rest(still[:50], tick=tick)


def test_slow_speeds_are_prepared_only_for_who_starts_or_stops():
    assert tabulated_speeds(BipedSettings()).size == 1
    for settings in (BipedSettings(start="standing"), BipedSettings(stop_at=5.0)):
        assert tabulated_speeds(settings)[0] == pytest.approx(SLOW_SPEED)
    assert tabulated_speeds(BipedSettings(start="standing", speed=0.8))[0] == 0.8


def test_bad_starts_and_stops_are_refused():
    with pytest.raises(SpringfootError, match="stop_at must be"):
        BipedSettings(stop_at=-1.0)
    with pytest.raises(SpringfootError, match="stop_at must be"):
        BipedSettings(start="standing", stop_at=1.0)
    with pytest.raises(SpringfootError, match="'random', 'standing' or a stride phase"):
        BipedSettings(start="lying")  # type: ignore[arg-type]
    env = SegmentedFootBiped()
    with pytest.raises(SpringfootError, match="where the setting start is"):
        env.reset(options={"start": "standing"})
