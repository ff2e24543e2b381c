"""The walking body as a whole: physics of a walk, mirror symmetry, work, pushes, frozen environments."""

import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.control.stiffness_control import FEET, action_of
from springfoot.envs.physics.model import DAMPING_TIME, SIDES, torque_limits
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import GRAVITY
from springfoot.gait.people.gait_events import CONTACT_THRESHOLD_BW, find_contacts


def scheduled(biped: Biped) -> np.ndarray:
    action = action_of(biped.scheduled_stiffness(), biped.settings, biped.body)
    return action.reshape(biped.num_envs, -1)


def walk(biped: Biped, seconds: float) -> list[Tick]:
    """Walk with the fixed schedule; the ticks of every control window."""
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    biped.reset(np.arange(biped.num_envs), range(biped.num_envs))
    for _ in range(round(seconds / biped.dt)):
        assert not biped.step(scheduled(biped)).terminated.any()
    return ticks


def test_under_a_load_the_floor_carries_body_and_load():
    biped = Biped(BipedSettings(carried_ratio=0.3, leg_ratio=1.06, foot_ratio=0.93), 1)
    ticks = walk(biped, 6.0)[200:]
    up = np.mean([tick.measurement.force[0, :, :, 1].sum() for tick in ticks])
    rate = [tick.measurement.com_velocity[0, 1] for tick in (ticks[0], ticks[-1])]
    mass = 1.3 * 63.0
    assert up == pytest.approx(mass * (GRAVITY + np.subtract(*rate[::-1]) / (0.01 * len(ticks))), rel=0.01)


def test_bodies_of_a_batch_have_the_settings_proportions_and_scale_exactly():
    built = {"leg_ratio": 1.05, "foot_ratio": 0.95, "carried_ratio": 0.2}
    drawn, alone = Biped(settings_from(mass_range=(40, 120), **built), 1), Biped(settings_from(mass=100, **built), 1)
    drawn.reset(np.arange(1), [3], given={"mass": np.array([100.0])})
    alone.reset(np.arange(1), [3])
    assert drawn.subjects.bodies == [alone.body] and alone.body.total_mass == pytest.approx(120.0)
    for _ in range(50):
        result = drawn.step(np.zeros((1, 4)))
        np.testing.assert_allclose(result.observation, alone.step(np.zeros((1, 4))).observation, atol=1e-5)
    assert not result.terminated.any()


@pytest.fixture(scope="module")
def walked() -> tuple[Biped, list[Tick]]:
    biped = Biped(BipedSettings(), 2)
    return biped, walk(biped, 12.0)


def test_over_whole_strides_the_floor_carries_the_weight(walked):
    biped, ticks = walked
    weight = biped.body.mass * GRAVITY
    force = np.stack([tick.measurement.force[:, :, :, 1].sum(2) for tick in ticks])  # (T, N, side)
    for index in range(biped.num_envs):
        contacts = find_contacts(force[:, index, 0], biped.tick_dt, CONTACT_THRESHOLD_BW * weight)
        strikes = contacts.heel_strikes[contacts.heel_strikes > 3.0]
        first, last = (round(time / biped.tick_dt) for time in (strikes[0], strikes[-1]))
        assert len(strikes) > 5
        assert force[first:last, index].sum(1).mean() == pytest.approx(weight, rel=0.01)


def test_over_whole_strides_braking_and_propulsion_cancel(walked):
    biped, ticks = walked
    forward = np.stack([tick.measurement.force[..., 0].sum((1, 2)) for tick in ticks])[300:]
    speed = np.stack([tick.measurement.com_velocity[:, 0] for tick in ticks])[300:]
    # impulse = change of momentum, whatever the stride: drift in speed is what does not cancel
    change = biped.body.mass * (speed[-1] - speed[0])
    np.testing.assert_allclose(forward[1:].sum(0) * biped.tick_dt, change, atol=0.02 * biped.body.mass)
    assert (np.abs(forward).max(0) > 0.1 * biped.body.mass * GRAVITY).all()


def test_the_joint_torque_is_the_spring_equation_while_walking(walked):
    biped, ticks = walked
    limit = torque_limits(biped.body)[FEET]
    for tick in ticks[-50:]:
        m = tick.measurement
        angle, velocity = m.angle[..., FEET], m.velocity[..., FEET]
        deflection = tick.equilibrium[..., FEET] - angle - np.array(DAMPING_TIME)[FEET] * velocity
        spring = tick.stiffness[..., FEET] * deflection
        below = np.abs(spring) < limit
        np.testing.assert_allclose(m.torque[..., FEET][below], spring[below], rtol=0, atol=1e-9)
    joints = biped.data(0).qfrc_actuator[3:].reshape(2, 4)
    np.testing.assert_allclose(joints, m.torque[0], rtol=0, atol=1e-9)


def test_left_and_right_are_mirror_images():
    biped = Biped(BipedSettings(), 2)
    biped.reset(np.array([0]), [0], start=0.2)
    biped.reset(np.array([1]), [0], start=0.7)
    for _ in range(50):
        action = scheduled(biped)
        action[:, 0] = 0.3  # left ankle of the one, right ankle of the other
        action[1] = action[0][[2, 3, 0, 1]]
        result = biped.step(action)
    left, right = biped.measurement.angle[0], biped.measurement.angle[1][::-1]
    np.testing.assert_allclose(left, right, atol=1e-6)
    assert result.reward[0] == pytest.approx(result.reward[1], abs=1e-6)


def test_the_start_stands_on_the_floor_at_the_phase_asked_for():
    biped = Biped(BipedSettings(), 3)
    biped.reset(np.arange(3), [1, 2, 3], start=0.25)
    lowest = biped.measurement.contact[..., 1].min((1, 2))
    np.testing.assert_allclose(lowest, -0.001, atol=1e-12)
    np.testing.assert_allclose(biped.measurement.com_velocity[:, 0], 1.2, atol=0.6)
    names = list(biped.observation_names)
    observation = biped.observe()
    np.testing.assert_allclose(observation[:, names.index("phase_sin")], 1.0, atol=1e-6)


def test_pushes_come_once_in_each_interval_in_both_directions():
    biped = Biped(BipedSettings(push_newton=10.0, push_interval=1.0, episode_seconds=30.0), 8)
    trunk, forces = biped.model.body("trunk").id, []
    biped.on_tick = lambda tick: forces.append([biped.data(i).xfrc_applied[trunk, 0] for i in range(8)])
    biped.reset(np.arange(8), range(8))
    for _ in range(200):
        biped.step(scheduled(biped))
    force = np.array(forces)
    assert set(np.unique(force)) == {-10.0, 0.0, 10.0}
    for second in range(4):
        window = force[100 * second : 100 * (second + 1)]
        np.testing.assert_allclose((window != 0).sum(0), 10, atol=1)


@pytest.mark.parametrize("mode", ["absolute", "residual"])
@pytest.mark.parametrize("begun", [0, 5])
def test_an_environment_left_out_does_not_notice(mode, begun):
    settings = BipedSettings(action_mode=mode, push_newton=100.0, push_interval=0.2)
    paused, straight = Biped(settings, 2), Biped(settings, 2)
    actions = np.random.default_rng(0).uniform(-1, 1, (30, 2, 4))
    for biped in (paused, straight):
        biped.reset(np.arange(2), [4, 5])
    for action in actions[:begun]:
        paused.step(action)
        before = straight.step(action)
    seen = paused.observe()[1]
    for _ in range(7):
        result = paused.step(np.ones((2, 4)), active=np.array([True, False]))
        np.testing.assert_array_equal(result.observation[1], seen)
        assert result.reward[1] == 0.0
        if begun:
            assert result.info["stiffness/toe_right"][1] == before.info["stiffness/toe_right"][1]
        for name in ("ankle_left", "toe_left", "ankle_right", "toe_right"):
            assert result.info[f"work/stiffness/{name}"][1] == result.info[f"work/equilibrium/{name}"][1] == 0.0
    for action in actions[begun:]:
        a, b = paused.step(action), straight.step(action)
        np.testing.assert_array_equal(a.observation[1], b.observation[1])
        assert a.reward[1] == b.reward[1]
        for name, value in a.info.items():
            assert value[1] == b.info[name][1], name


def test_a_fall_ends_the_episode_with_its_reason():
    biped = Biped(BipedSettings(), 4)
    biped.reset(np.arange(4), range(4))
    reasons = set()
    active = np.ones(4, bool)
    for _ in range(400):
        result = biped.step(np.tile([-1.0, 1.0, -1.0, 1.0], (4, 1)), active)  # limp ankles
        reasons |= set(result.reasons[result.terminated])
        assert not result.reward[result.terminated].any()
        active &= ~result.terminated
        if not active.any():
            break
    assert not active.any()
    assert reasons <= {"fell: hip too low", "fell: trunk too tilted"}


def test_a_diverged_simulation_ends_its_episode_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings to a file in the working directory
    biped = Biped(BipedSettings(push_newton=100.0, push_interval=1.0), 2)
    biped.reset(np.arange(2), [1, 0])
    biped._task.rows["push"]["force"][1] = 1e20  # harder than settings allow
    result = biped.step(np.zeros((2, 4)))
    while not result.terminated.any():
        result = biped.step(np.zeros((2, 4)))
    assert result.reasons[1].startswith("diverged: BAD")
    assert result.info["termination"][0] == 0 and result.reasons[0] == ""
    assert np.isfinite(result.observation).all()
    assert np.isfinite(result.reward).all()


def test_time_runs_out_after_episode_seconds():
    biped = Biped(BipedSettings(episode_seconds=0.1), 1)
    biped.reset(np.array([0]), [0])
    ends = [bool(biped.step(np.zeros((1, 4))).truncated[0]) for _ in range(5)]
    assert ends == [False] * 4 + [True]


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.full((1, 4), np.nan), "actions must be finite numbers in [-1, 1], got NaN or infinity"),
        (np.zeros((2, 4)), "actions must have shape (1, 4), got (2, 4)"),
    ],
)
@pytest.mark.parametrize("step", [Biped.step, Biped.step_checked])
def test_bad_actions_are_refused_and_nothing_moves(action, message, step):
    biped = Biped(BipedSettings(), 1)
    biped.reset(np.array([0]), [0])
    before = biped.observe()
    with pytest.raises(SpringfootError, match="actions must") as error:
        step(biped, action)
    assert str(error.value) == message
    np.testing.assert_array_equal(biped.observe(), before)


def test_info_carries_what_the_springs_do():
    biped = Biped(BipedSettings(), 1)
    biped.reset(np.array([0]), [0])
    biped.step(np.zeros((1, 4)))
    info = biped.step(np.array([[0.5, -0.5, 0.0, 1.0]])).info
    low, high = 20.0, 800.0
    assert info["stiffness/ankle_left"][0] == pytest.approx(low * (high / low) ** 0.75, rel=1e-9)
    assert info["stiffness/toe_right"][0] == pytest.approx(200.0)
    for side in SIDES:
        m = biped.measurement
        k = info[f"stiffness/ankle_{side}"][0]
        spring = k * (
            info[f"equilibrium/ankle_{side}"][0]
            - m.angle[0, SIDES.index(side), 2]
            - 0.02 * m.velocity[0, SIDES.index(side), 2]
        )
        assert info[f"torque/ankle_{side}"][0] == pytest.approx(spring, abs=1e-9)
    assert info["work/stiffness/toe_left"][0] < 0  # softer under load gives energy back
    assert np.isfinite([value[0] for value in info.values()]).all()


def test_the_walk_follows_own_data():
    """Own stride time and step length set the plan's step, at cadence `people`; the commanded speed stays."""
    own = {"name": "mine", "strides": 9, "speed": 1.0, "stride_time": 1.25, "step_length": 0.625, "toe_off": 0.65}
    own |= {"mean": {"ankle": [[0.1, 0.0]], "grf_vertical": [1.0]}, "sd": {}}
    plain, biped = Biped(BipedSettings(), 1), Biped(settings_from(human=own), 1)
    assert biped.plan.speed == pytest.approx(1.2) and biped.plan.human is biped.target
    # speed 1.2 for 1.0: step length and rate each take the square root of it
    assert biped.plan.stride_time == pytest.approx(1.25 / np.sqrt(1.2))
    assert biped.plan.step_length == pytest.approx(0.625 * np.sqrt(1.2))
    planned = [list(biped.observation_names).index(f"planned_ankle_{side}") for side in SIDES]
    for each in (plain, biped):
        each.reset(np.arange(1), [0], start=0.2)
    assert biped.observe()[0, planned] == pytest.approx(0.1, abs=1e-6)
    assert np.abs(plain.observe()[0, planned] - 0.1).max() > 0.01
    thesis = Biped(settings_from(human=own, cadence="thesis"), 1)
    assert thesis.plan.step_time == pytest.approx(0.5)
