"""The world of the walk: slope, friction, uneven ground, sensor noise, and a delay of stiffness."""

import mujoco
import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.control.stiffness_control import FEET, action_of
from springfoot.envs.physics.contact import FRICTION
from springfoot.envs.physics.measurement import Measurement, measure_bodies
from springfoot.envs.physics.model import ANKLE, SIDES, build_spec
from springfoot.envs.physics.simulation import Simulation
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.envs.task.ground import NEXT_FOOTFALL_PHASE
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.gait.body.body import GRAVITY, Body


def standing(slope_deg: float, friction: float = FRICTION) -> Simulation:
    """A stiff body, trunk held upright, that stands at rest with its feet flat on a slope."""
    slope, spec = np.radians(slope_deg), build_spec(Body(), friction)
    held = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1="pitch")  # or it falls over its ankles
    held.objtype = mujoco.mjtObj.mjOBJ_JOINT
    simulation = Simulation(Body(), 1, model=spec.compile())
    angle, rate, base = np.zeros((1, len(SIDES), 4)), np.zeros((1, len(SIDES), 4)), np.zeros((1, 3))
    angle[..., ANKLE] = slope
    base[0, :2] = 2.0, Body().leg_length
    simulation.lay(np.arange(1), np.array([slope]), np.zeros((1, len(SIDES))))
    simulation.reset(np.arange(1), base, np.zeros((1, 3)), angle, rate)
    for _ in range(100):
        simulation.advance(stiff_posture(slope))
    return simulation


def stiff_posture(slope: float) -> np.ndarray:
    """Return the control of stiff springs around straight legs with flat feet."""
    rest = np.zeros((1, len(SIDES), 4))
    rest[..., ANKLE] = slope
    return np.stack([np.full_like(rest, 3000.0), 3000.0 * rest], -1)


def window(simulation: Simulation, slope_deg: float) -> Measurement:
    """Run one control window in that posture and measure it."""
    simulation.advance(stiff_posture(np.radians(slope_deg)))
    measure_bodies(*simulation.arrays)
    return simulation.now


@pytest.mark.parametrize("slope_deg", [-5.0, 0.0, 5.0])
def test_a_body_at_rest_on_a_slope_is_carried_straight_up_and_heights_are_above_the_ground(slope_deg):
    simulation = standing(slope_deg)
    m = window(simulation, slope_deg)
    forward, up = m.force[0].sum(axis=(0, 1))
    assert up == pytest.approx(Body().mass * GRAVITY, rel=5e-3)
    assert abs(forward) < 0.02 * up  # at right angles to the slope it would be 0.087
    assert (m.force[0, ..., 1] > 1.0).all() and np.abs(m.contact[0, ..., 1]).max() < 0.008
    data, tangent = simulation.data(0), np.tan(np.radians(slope_deg))
    assert m.base[0, 1] == pytest.approx(data.qpos[1] - tangent * data.qpos[0], abs=1e-9)
    com = data.subtree_com[0]
    assert m.com[0, 1] == pytest.approx(com[2] - tangent * com[0], abs=1e-9)


@pytest.mark.parametrize("friction", [0.4, 0.5])
@pytest.mark.parametrize("slope_deg", [-5.0, 0.0, 5.0])
def test_feet_slide_when_pushed_harder_than_mu_times_the_normal_force_and_no_sooner(friction, slope_deg):
    slope, weight = np.radians(slope_deg), Body().mass * GRAVITY
    along, normal = np.array([np.cos(slope), np.sin(slope)]), np.array([-np.sin(slope), np.cos(slope)])
    for share, slides in ((0.3, False), (1.3, True)):
        simulation = standing(slope_deg, friction)
        grip = np.tan(np.arctan(friction) + slope) * weight  # level push that just makes it slide uphill
        simulation.push(np.array([share * grip]))
        grips = []
        for _ in range(30):
            m = window(simulation, slope_deg)
            force = m.force[0].sum(axis=(0, 1))
            assert abs(force @ along) <= friction * (force @ normal) * (1 + 1e-9)
            grips.append(-(force @ along) / max(force @ normal, 1.0) / friction)
        assert (m.base_velocity[0, 0] > 0.2) == slides
        assert max(grips) > 0.98 or not slides


def scheduled(biped: Biped) -> np.ndarray:
    return action_of(biped.scheduled_stiffness(), biped.settings, biped.body).reshape(biped.num_envs, -1)


EVERYTHING = BipedSettings(
    friction=0.7,
    slope_range_deg=(-2.0, 1.0),
    unevenness_m=0.01,
    sensor_noise=0.02,
    stiffness_delay_range_s=(0.0, 0.04),
    push_newton=50.0,
)


def test_footfalls_lie_within_their_bounds_and_change_in_mid_swing_alone():
    biped = Biped(settings_from(unevenness_m=0.01), 4)
    biped.reset(np.arange(4), range(4))
    heights, phases, clearance = [], [], []

    def keep(tick: Tick) -> None:
        heights.append([biped.data(index).mocap_pos[:, 2] for index in range(4)])  # of the ground below each foot
        phases.append(biped.leg_phase)
        clearance.append(biped.measurement.contact[..., 1].min(axis=-1))

    biped.on_tick = keep
    for _ in range(150):
        biped.step(scheduled(biped))
    height, phase = np.array(heights), np.array(phases)
    changed = np.diff(height, axis=0) != 0
    assert changed.sum() >= 4 * 4 and np.abs(height).max() <= 0.01
    assert height.min() < -0.005 and height.max() > 0.005
    assert (phase[1:][changed] >= NEXT_FOOTFALL_PHASE).all() and (phase[1:][changed] < NEXT_FOOTFALL_PHASE + 0.05).all()
    room = np.maximum(np.array(clearance)[1:], 0.0)  # above the ground of before; 0 where the foot scuffs it
    assert (np.diff(height, axis=0) <= room + 1e-12)[changed].all()  # the new ground is below the foot


def test_a_batch_in_any_world_gives_the_bits_of_its_members_alone():
    together = Biped(EVERYTHING, 3)
    together.reset(np.arange(3), [5, 6, 7])
    alone = [Biped(EVERYTHING, 1) for _ in range(3)]
    for index, single in enumerate(alone):
        single.reset(np.arange(1), [5 + index])
    assert len({float(slope) for slope in together.subjects.slope}) == 3
    for _ in range(60):
        actions = scheduled(together)
        result = together.step(actions)
        for index, single in enumerate(alone):
            one = single.step(actions[index : index + 1])
            np.testing.assert_array_equal(result.observation[index], one.observation[0])
            np.testing.assert_array_equal(result.values[index], one.values[0])


@pytest.mark.parametrize("windows", [0, 1, 2, 3, 4])
def test_stiffness_acts_exactly_so_many_windows_after_its_command(windows):
    biped = Biped(settings_from(stiffness_delay_s=windows * 0.01), 2)
    biped.reset(np.arange(2), [0, 1])
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    random, commands = np.random.default_rng(0), []
    for _ in range(12):
        action = random.uniform(-0.1, 0.1, (2, 4))
        biped.step(action)
        low, high = np.array([[20.0, 5.0], [800.0, 200.0]])
        commands += [np.sqrt(low * high) * np.sqrt(high / low) ** action.reshape(2, 2, 2)] * 2
    acted = np.array([tick.stiffness[..., FEET] for tick in ticks])
    np.testing.assert_allclose(acted[windows:], commands[: len(commands) - windows], rtol=1e-12)
    first = np.broadcast_to(commands[0], acted[:windows].shape)
    np.testing.assert_allclose(acted[:windows], first, rtol=1e-12)  # what was held before the start


def test_noise_is_on_what_is_measured_alone_new_at_every_step_and_of_its_size():
    clean, noisy = Biped(BipedSettings(start=0.2), 8), Biped(BipedSettings(start=0.2, sensor_noise=0.02), 8)
    for biped in (clean, noisy):
        biped.reset(np.arange(8), range(8))
    apart = [noisy.observe() - clean.observe()]
    np.testing.assert_array_equal(noisy.observe(), noisy.observe())
    for _ in range(40):
        actions = scheduled(clean)
        apart.append(noisy.step(actions).observation - clean.step(actions).observation)
    noise = np.array(apart)
    measured = np.array([entry.measured for entry in OBSERVATION])
    assert not noise[..., ~measured].any()
    free = measured & np.array([not entry.name.startswith("load") for entry in OBSERVATION])  # loads stop at 0
    np.testing.assert_allclose(noise[..., free].std(axis=(0, 1)), 0.02, rtol=0.2)
    assert np.abs(np.mean(noise[1:, :, free] * noise[:-1, :, free])) < 0.02**2 / 20


def test_the_controller_walks_up_and_down_a_slope_at_about_the_commanded_speed():
    for slope_deg in (-3.0, 3.0):
        biped = Biped(settings_from(slope_deg=slope_deg), 4)
        biped.reset(np.arange(4), range(4))
        way = []
        for _ in range(200):
            assert not biped.step(scheduled(biped)).terminated.any()
            way.append(biped.measurement.com[:, 0])
        speed = (way[-1] - way[50]) / (149 * biped.dt)
        np.testing.assert_allclose(speed, biped.settings.speed, rtol=0.15)


def test_constant_rest_angles_stay_constant_on_a_slope():
    level, sloping = (Biped(settings_from(equilibrium="neutral", slope_deg=slope), 1) for slope in (0.0, 4.0))
    rests = []
    for biped in (level, sloping):
        ticks: list[Tick] = []
        biped.on_tick = ticks.append
        biped.reset(np.arange(1), [0])
        biped.step(np.zeros((1, 4)))
        rests.append(ticks[0].equilibrium[..., FEET])
    np.testing.assert_array_equal(*rests)
