"""Bodies and speeds of each environment: scaling, the same bits alone and together, draws, changes of speed."""

from typing import Any

import numpy as np
import pytest
from parts import drive, move

from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import INFO, Tick
from springfoot.envs.control.constants import slope_constants
from springfoot.envs.control.equilibrium import foot_curves
from springfoot.envs.control.legs import LegController, slope_table
from springfoot.envs.control.reference_walk import rows as rows_of
from springfoot.envs.control.reference_walk import tabulated_speeds
from springfoot.envs.control.stiffness_control import FootSprings, action_of
from springfoot.envs.control.subjects import Subjects
from springfoot.envs.env import SegmentedFootBiped
from springfoot.envs.physics.model import JOINTS, SIDES
from springfoot.envs.physics.simulation import Simulation
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.envs.task.reward import Task
from springfoot.envs.vector_env import SegmentedFootBipedVector
from springfoot.gait.body.body import Body

ANYBODY: dict[str, Any] = {"height_range": (1.45, 2.0), "mass_range": (40.0, 120.0), "speed_range": (0.8, 1.6)}
COMMAND = [entry.name for entry in OBSERVATION].index("command_speed")
HEIGHT = COMMAND + 1


def scheduled(biped: Biped) -> np.ndarray:
    """The fixed schedule as actions, the same for every body."""
    own = biped.scheduled_stiffness() / biped.subjects.scale["torque"][:, None, None]
    return action_of(own, biped.settings, biped.body).reshape(biped.num_envs, -1)


def given(**values) -> dict[str, np.ndarray]:
    return {name: np.atleast_1d(np.array(value, float)) for name, value in values.items()}


# Tables -------------------------------------------------------------------------------------------------------


def test_one_body_at_one_speed_has_a_table_of_one_speed():
    np.testing.assert_array_equal(tabulated_speeds(BipedSettings(height=1.85, speed=1.37)), [1.37])


@pytest.mark.parametrize("own", [{}, {"height": 1.9, "speed": 1.11}])
def test_tables_reach_all_that_may_be_asked_for_and_hold_the_own_speed(own):
    settings = BipedSettings(**ANYBODY, **own)
    speeds = tabulated_speeds(settings)
    assert settings.speed in speeds
    assert (np.diff(speeds) > 0).all() and np.diff(speeds).max() <= 0.1 * np.sqrt(settings.height / 1.7) + 1e-9
    subjects = Subjects(settings, speeds, 4)
    corners = [(height, speed) for height in settings.height_range for speed in settings.speed_range]  # type: ignore
    height, speed = np.array(corners).T
    subjects.reset(np.arange(4), [np.random.default_rng(0)] * 4, given(height=height, mass=[70.0] * 4, speed=speed))
    np.testing.assert_array_equal(subjects.speed, speed)
    assert ((subjects.place["row"] >= 0) & (subjects.place["row"] < len(speeds))).all()
    step = np.diff(speeds, append=speeds[-1])[subjects.place["row"]]
    equal = speeds[subjects.place["row"]] + subjects.place["weight"] * step
    np.testing.assert_allclose(equal * np.sqrt(height / settings.height), speed, rtol=1e-12)


def test_the_own_body_at_the_own_speed_has_the_bits_of_the_fixed_one():
    fixed, any_body = Biped(BipedSettings(), 1), Biped(BipedSettings(**ANYBODY), 3)
    fixed.reset(np.arange(1), [7])
    any_body.reset(np.arange(3), [5, 7, 9], given=given(height=[1.5, 1.7, 1.9], mass=[50, 63, 99], speed=[1, 1.2, 1.4]))
    for action in np.random.default_rng(0).uniform(-0.3, 0.3, (60, 4)):
        one, many = fixed.step(action[None]), any_body.step(np.tile(action, (3, 1)))
        np.testing.assert_array_equal(many.observation[1], one.observation[0])
        np.testing.assert_array_equal(many.values[1], one.values[0])
        assert many.reward[1] == one.reward[0]


def test_a_body_is_the_same_drawn_or_set():
    """Tables are of one body, the settings'; another one's are its own to rounding where a speed is tabulated."""
    speed = 1.3 * np.sqrt(1.9 / 1.7)
    fixed, drawn = Biped(BipedSettings(height=1.9, mass=60.0, speed=speed), 1), Biped(BipedSettings(**ANYBODY), 1)
    for biped in (fixed, drawn):
        biped.reset(np.arange(1), [3], given=given(height=1.9, mass=60.0, speed=speed))
        for _ in range(10):
            result = biped.step(np.zeros((1, 4)))
    np.testing.assert_allclose(drawn.observe(), fixed.observe(), atol=1e-5)
    rows = [biped.step(np.zeros((1, 4))).values[0] for biped in (drawn, fixed)]
    # people's forces and the ZMP are taken at the middle of a step of 20 ms, which is another share of the stride
    off = np.abs(rows[0] - rows[1])
    within = np.where(np.array(INFO) == "reward/zmp", 4e-3, 2e-3)  # of a ZMP that moves 3 m/s in double support
    assert (off <= within + 2e-3 * np.abs(rows[1])).all()
    assert not result.terminated.any()


# Scaling ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("height", "mass"), [(1.45, 110.0), (2.0, 45.0), (1.7, 120.0)])
def test_at_froude_equal_speed_another_body_does_the_same(height, mass):
    """Start exactly alike; then the same gait at the same dimensionless time, but for the fixed 10 ms and 2 ms."""
    time_scale = np.sqrt(height / 1.7)
    biped = Biped(BipedSettings(**ANYBODY), 2)
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    biped.reset(
        np.arange(2),
        [0, 0],
        start=0.2,
        given=given(height=[1.7, height], mass=[63, mass], speed=[1.2, 1.2 * time_scale]),
    )
    own, other = biped.observe().astype(float)
    np.testing.assert_allclose(own[:HEIGHT], other[:HEIGHT], atol=1e-6)
    np.testing.assert_allclose(other[HEIGHT], height / 1.7, rtol=1e-6)
    for _ in range(60):
        assert not biped.step(scheduled(biped)).terminated.any()
    if height == 1.7:  # mass is not to be seen
        np.testing.assert_allclose(*biped.observe(), atol=1e-6)
    time = 0.01 * (1 + np.arange(len(ticks)))
    angle = np.stack([tick.measurement.angle.reshape(2, -1) for tick in ticks])
    same = time * time_scale < time[-1]
    later = np.stack([np.interp(time[same] * time_scale, time, column) for column in angle[:, 1].T], -1)
    difference = np.degrees(later - angle[same, 0])
    assert np.sqrt(np.square(difference).mean(0)).max() < (1e-9 if height == 1.7 else 1.5)
    force = [tick.measurement.force[..., 1].sum((1, 2)) / [63 * 9.81, mass * 9.81] for tick in ticks]
    np.testing.assert_allclose(*np.mean(force, 0), rtol=0.03)


@pytest.mark.parametrize("own", [63.0, 90.0])
def test_a_push_is_as_hard_on_every_body(own):
    """150 N for 63 kg, in proportion to the mass: the same acceleration, whoever the settings' own body is."""
    biped = Biped(BipedSettings(mass=own, mass_range=(40.0, 120.0), push_newton=150.0, push_interval=0.5), 3)
    trunk, forces = biped.model.body("trunk").id, []
    biped.on_tick = lambda tick: forces.append([biped.data(i).xfrc_applied[trunk, 0] for i in range(3)])
    mass = np.array([40.0, 63.0, 120.0])
    biped.reset(np.arange(3), [0, 1, 2], given=given(mass=mass))
    for _ in range(25):
        biped.step(scheduled(biped))
    np.testing.assert_allclose(np.abs(forces).max(axis=0), 150.0 * mass / 63.0, rtol=1e-12)


# The same bits --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("mode", ["absolute", "residual"])
def test_a_mixed_batch_gives_the_bits_of_its_members_alone(threads, mode):
    settings = BipedSettings(
        **ANYBODY, speed_interval=0.3, action_mode=mode, push_newton=80.0, push_interval=0.4, start_noise=0.02
    )
    together, alone = Biped(settings, 5, threads), [Biped(settings, 1) for _ in range(5)]
    seeds = [4, 8, 15, 16, 23]
    for _ in range(2):  # a second episode, of other bodies
        together.reset(np.arange(5), seeds)
        for seed, one in zip(seeds, alone, strict=True):
            one.reset(np.arange(1), [seed])
        for actions in np.random.default_rng(0).uniform(-0.4, 0.4, (50, 5, 4)):
            result, singles = (
                together.step(actions),
                [one.step(a[None]) for a, one in zip(actions, alone, strict=True)],
            )
            for name in ("observation", "reward", "values", "terminated"):
                single = np.concatenate([getattr(each, name) for each in singles])
                np.testing.assert_array_equal(getattr(result, name), single, err_msg=name)
        seeds = [None] * 5
    assert len({body.height for body in together.subjects.bodies}) == 5


def test_a_reset_leaves_the_others_alone():
    settings = BipedSettings(**ANYBODY)
    disturbed, quiet = Biped(settings, 2), Biped(settings, 2)
    for biped in (disturbed, quiet):
        biped.reset(np.arange(2), [0, 1])
    for step in range(20):
        if step == 7:
            disturbed.reset(np.array([0]), [5])
        rows = [biped.step(np.zeros((2, 4))).observation[1] for biped in (disturbed, quiet)]
        np.testing.assert_array_equal(*rows)


def test_every_face_has_the_same_bits():
    settings: dict[str, Any] = ANYBODY | {"speed_interval": 0.2, "episode_seconds": 0.4}
    singles = [SegmentedFootBiped(**settings) for _ in range(3)]
    vector = SegmentedFootBipedVector(3, autoreset_mode="SameStep", **settings)
    sb3 = SegmentedFootBipedVecEnv(3, **settings)
    sb3.seed(6)
    rows = np.stack([env.reset(seed=6 + index)[0] for index, env in enumerate(singles)])
    np.testing.assert_array_equal(vector.reset(seed=6)[0], rows)
    np.testing.assert_array_equal(sb3.reset(), rows)
    for _ in range(30):
        results = [env.step(np.zeros(4)) for env in singles]
        rows = np.stack([env.reset()[0] if r[3] else r[0] for env, r in zip(singles, results, strict=True)])
        np.testing.assert_array_equal(vector.step(np.zeros((3, 4)))[0], rows)
        np.testing.assert_array_equal(sb3.step(np.zeros((3, 4)))[0], rows)


def test_every_face_takes_bodies_and_speeds_of_one_episode():
    asked = [{"height": 1.5, "mass": 50, "speed": 0.9}, {"height": 1.9, "mass": 100, "speed": 1.5}]
    columns = {name: np.array([each[name] for each in asked]) for name in asked[0]}
    singles = [SegmentedFootBiped(**ANYBODY) for _ in asked]
    rows = np.stack([env.reset(seed=i, options=asked[i])[0] for i, env in enumerate(singles)])
    np.testing.assert_allclose(rows[:, HEIGHT], columns["height"] / 1.7, rtol=1e-6)
    froude = [Body(each["height"], each["mass"]).froude_speed(each["speed"]) for each in asked]
    np.testing.assert_allclose(rows[:, COMMAND], froude, rtol=1e-6)
    vector = SegmentedFootBipedVector(2, **ANYBODY)
    np.testing.assert_array_equal(vector.reset(seed=0, options=columns)[0], rows)
    assert [body.mass for body in vector.biped.subjects.bodies] == [50.0, 100.0]
    sb3 = SegmentedFootBipedVecEnv(2, **ANYBODY)
    sb3.seed(0)
    sb3.set_options(asked)
    np.testing.assert_array_equal(sb3.reset(), rows)
    assert not np.array_equal(sb3.reset(), rows)


# Speeds within an episode ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("decisions", "step"), [("100hz", 0.01), ("50hz", 0.02), ("25hz", 0.04), ("event", 0.02)])
def test_the_commanded_speed_goes_to_a_new_one_at_its_rate(decisions, step):
    biped = Biped(BipedSettings(**ANYBODY, speed_rate=0.5, decisions=decisions), 2)
    biped.reset(np.arange(2), [0, 1], given=given(height=[1.7, 1.9], mass=[63, 63], speed=[1.2, 1.2]))
    biped.command(np.array([1]), np.array([1.305]))
    seen = []
    for _ in range(15):
        biped.step(scheduled(biped))
        seen.append(biped.subjects.speed.copy())
    first, second = np.array(seen).T
    np.testing.assert_array_equal(first, 1.2)
    np.testing.assert_allclose(second, np.minimum(1.2 + 0.5 * step * np.arange(1, 16), 1.305), rtol=1e-12)
    froude = Body(1.9, 63.0).froude_speed(second[-1])
    assert biped.observe()[1, COMMAND] == pytest.approx(froude, rel=1e-6)


def test_nothing_jumps_as_the_speed_changes():
    """Springs, legs and plan follow the speed without a jump where one tabulated speed takes over from another."""
    settings = BipedSettings(**ANYBODY)
    biped = Biped(settings, 1)
    biped.reset(np.arange(1), [0], start=0.3)
    table, incline = list(rows_of(biped.walks)), slope_table(slope_constants()).table
    subjects, simulation = Subjects(settings, tabulated_speeds(settings), 1), Simulation(biped.body, 1)
    legs, task = LegController(table, subjects), Task(settings, table, subjects, [settings.feet])
    legs.reset(np.arange(1), biped.leg_phase[:, 0])
    rest, stiffness = (np.stack(each) for each in zip(*(foot_curves(settings, *row) for row in table), strict=True))
    springs = FootSprings(settings, rest, stiffness, subjects)
    bodies = simulation.arrays.bodies
    control = np.zeros((1, len(SIDES), len(JOINTS), 2))
    for name, values in vars(biped.measurement).items():
        bodies["measured"][name] = values
    rows = []
    for speed in np.linspace(0.8, 1.6, 801):
        subjects.reset(np.arange(1), [np.random.default_rng(0)], given(height=1.7, mass=63.0, speed=speed))
        legs.follow()
        move(
            subjects.rows, bodies, control, springs.rest.table, incline, springs.feet, springs.options, np.ones(1, bool)
        )
        drive(subjects.rows, bodies, control, legs.table.table, incline)
        equilibrium = 100 * subjects.rows["springs"]["equilibrium"]
        plan = 100 * task.tracking(bodies)
        rows.append(np.concatenate([np.moveaxis(control, -1, 0).ravel(), equilibrium.ravel(), plan.ravel()]))
    change = np.abs(np.diff(rows, axis=0)).max()  # N m, N m/rad, 0.01 rad, cm or cm/s for 1 mm/s
    assert change < 1.0 and change < 0.6 * np.abs(np.diff(rows[::2], axis=0)).max()  # half as far, half the change
    assert (np.ptp(rows, axis=0) > 0.5).sum() >= 8


def test_the_body_follows_the_speed_up_and_down():
    biped = Biped(BipedSettings(speed_range=(0.9, 1.5)), 2)
    biped.reset(np.arange(2), [0, 1], given=given(speed=[0.9, 1.5]))
    mean = []
    for goal in ((0.9, 1.5), (1.5, 0.9)):
        biped.command(np.arange(2), np.array(goal))
        for step in range(350):
            assert not biped.step(scheduled(biped)).terminated.any()
            if step == 200:
                begin = biped.measurement.com[:, 0].copy()
        mean.append((biped.measurement.com[:, 0] - begin) / (149 * biped.dt))
    slow, fast = [mean[0][0], mean[1][1]], [mean[0][1], mean[1][0]]
    assert max(slow) + 0.2 < min(fast)


def test_new_speeds_come_about_once_in_an_interval():
    settings = BipedSettings(speed_range=(1.0, 1.4), speed_interval=0.5, speed_rate=100.0)
    biped = Biped(settings, 4)
    biped.reset(np.arange(4), range(4))
    seen = [biped.subjects.speed.copy()]
    for _ in range(250):
        biped.step(scheduled(biped))
        seen.append(biped.subjects.speed.copy())
    speed = np.array(seen)
    assert speed.min() >= 1.0 and speed.max() <= 1.4
    changes = (np.diff(speed, axis=0) != 0).sum(0)
    assert (changes >= 6).all() and (changes <= 19).all()  # 0.25 to 0.75 s apart in 5 s
    assert len(np.unique(changes)) > 1 or len(np.unique(speed)) == 4 + changes.sum()
