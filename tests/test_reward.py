"""The task: observation within bounds, reward against closed forms, falls at limits, same bits for any N."""

import numpy as np
import pytest
from numpy.typing import NDArray

from springfoot.envs.control.reference_walk import reference_walks, rows
from springfoot.envs.control.subjects import Subjects
from springfoot.envs.physics.measurement import BODY_ROW, Measurement
from springfoot.envs.physics.model import ACTIONS, ANKLE, HIP, KNEE, LEFT, RIGHT, TOE
from springfoot.envs.settings import DEFAULT_WEIGHTS, BipedSettings, settings_from
from springfoot.envs.task.episode_end import TOO_LOW, TOO_TILTED
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.envs.task.reward import (
    EXCESS_SHARE,
    FORCE_TOLERANCE,
    TERMS,
    Task,
    judge,
    total,
)
from springfoot.gait.body import GRAVITY, Body
from springfoot.gait.com_plan import over_peoples_zmp
from springfoot.gait.errors import SpringfootError
from springfoot.gait.human import human_gait
from springfoot.gait.plan import plan_walk


class Setup:
    """A task with the body, plan and people's curves it was made from."""

    def __init__(self, **settings):
        self.settings = settings_from(**settings)
        self.body = Body(self.settings.height, self.settings.mass)
        self.human = human_gait(self.settings.speed, self.settings.height)
        self.plan = over_peoples_zmp(plan_walk(self.body, self.settings.speed))
        self.walks = reference_walks(self.settings)

    def task(self, num) -> Task:
        """For so many environments."""
        return self.at(np.zeros(num))[0]

    def at(self, left_phase, measurement=None) -> tuple[Task, NDArray, NDArray]:
        """Task, rows of the control, and rows of the bodies, at these phases and as measured."""
        legs = leg_phases(np.atleast_1d(left_phase))
        subjects = Subjects(self.settings, np.array([self.settings.speed]), len(legs))
        subjects.rows["legs"]["phase"] = legs
        bodies = np.zeros(len(legs), BODY_ROW)
        for name, values in vars(measurement or self.measurement(legs[:, LEFT])).items():
            bodies["measured"][name] = values
        return Task(self.settings, list(rows(self.walks)), subjects), subjects.rows, bodies

    def tracking(self, measurement, left_phase) -> NDArray:
        task, _, bodies = self.at(left_phase, measurement)
        return task.tracking(bodies)

    def measurement(self, left_phase, **other) -> Measurement:
        """The body on its plan with people's joint angles, trunk upright, the leading ankle at x = 10 m."""
        phase = np.atleast_1d(np.asarray(left_phase, float))
        n, legs = len(phase), leg_phases(phase)
        step = 2 * np.minimum(legs[:, LEFT], legs[:, RIGHT])
        x, z = self.plan.com(step)
        angle = np.stack([self.human.mean(name, legs) for name in ("thigh", "knee", "ankle", "toe")], -1)
        values = {
            "time": np.zeros(n),
            "base": np.tile([10.0, self.body.leg_length, 0.0], (n, 1)),
            "base_velocity": np.zeros((n, 3)),
            "angle": angle,
            "velocity": np.zeros((n, 2, 4)),
            "torque": np.zeros((n, 2, 4)),
            "com": np.stack([10 + x, z], -1),
            "com_velocity": np.tile([self.settings.speed, 0.0], (n, 1)),
            "ankle": np.stack([np.where(legs < 0.5, 10.0, 9.0), np.full((n, 2), 0.1)], -1),
            "contact": np.zeros((n, 2, 3, 2)),
            "force": np.zeros((n, 2, 3, 2)),
            "diverged": np.full(n, -1),
        }
        return Measurement(**(values | other))

    def people_force(self, left_phase, windows=2):
        """People's forces (W, N, 2, 3, 2) [N] amid the step that ends at `left_phase`, all on the ball."""
        legs = leg_phases(np.atleast_1d(left_phase)) - 0.01 / self.plan.stride_time
        force = np.zeros((windows, len(legs), 2, 3, 2))
        for axis, name in enumerate(("grf_forward", "grf_vertical")):
            force[..., 1, axis] = self.human.mean(name, legs) * self.body.mass * GRAVITY
        return force

    def terms(self, measurement, left_phase, **other):
        n = len(np.atleast_1d(left_phase))
        values = {
            "action": np.zeros((n, 4)),
            "last_action": np.zeros((n, 4)),
            "stiffness": np.tile([300.0, 60.0], (n, 2, 1)) * self.body.mass_scale * self.body.length_scale,
            "force_windows": self.people_force(left_phase),
        }
        values |= other
        task, controls, bodies = self.at(left_phase, measurement)
        controls["decision"]["action"], controls["decision"]["last_action"] = values["action"], values["last_action"]
        controls["springs"]["stiffness"] = values["stiffness"]
        terms = np.empty((n, len(TERMS)))
        judge(task.rows, controls, bodies, task.table, task.options, values["force_windows"], terms)
        return dict(zip(TERMS, terms.T, strict=True))

    def reward(self, terms) -> NDArray:
        total_of = np.empty(len(terms["alive"]))
        total(np.stack([*terms.values()], -1), self.task(len(total_of)).options, total_of)
        return total_of


def leg_phases(left):
    left = np.asarray(left, float)
    return np.stack([left, (left + 0.5) % 1], -1)


@pytest.fixture(scope="module")
def thesis_body():
    return Setup()


PHASES = np.linspace(0.005, 0.995, 37)


def test_a_body_on_plan_that_moves_like_people_gets_full_marks(thesis_body):
    terms = thesis_body.terms(thesis_body.measurement(PHASES), PHASES)
    for name in ("alive", "com_x", "com_z", "pose", "grf"):
        np.testing.assert_allclose(terms[name], 1.0, atol=2e-2 if name == "grf" else 1e-4, err_msg=name)
    np.testing.assert_allclose(terms["stiffness"], 1.0, rtol=1e-12)
    np.testing.assert_array_equal(terms["stiffness_rate"], 0.0)


def test_planned_speed_is_the_derivative_of_the_planned_com(thesis_body):
    step = thesis_body.plan.step_time
    phase = np.linspace(0.02, 0.48, 50)
    ahead, behind = (thesis_body.plan.com(2 * (phase + sign * 1e-4))[0] for sign in (1, -1))
    speed = (ahead - behind) / (4e-4 * step)
    measured = thesis_body.measurement(phase, com_velocity=np.stack([speed, 0 * speed], -1))
    np.testing.assert_allclose(thesis_body.tracking(measured, phase), 0.0, atol=2e-4)


@pytest.mark.parametrize("height", [1.7, 1.3])
def test_the_zmp_term_is_of_the_cop_of_both_feet_amid_the_step(height):
    setup, heavy = Setup(height=height, mass=45, speed=1.0), 3.0
    measured, loads = setup.measurement(PHASES), setup.people_force(PHASES)
    phase = leg_phases(PHASES)
    leader = np.where(phase[:, LEFT] < 0.5, LEFT, RIGHT)
    earlier = 2 * phase[np.arange(len(PHASES)), leader] - 0.01 / setup.plan.step_time
    planned = 10.0 + setup.plan.zmp(earlier) + setup.plan.step_length * np.floor(earlier)
    loads[...] = 0.0
    loads[0, :, LEFT, 0, 1], loads[1, :, RIGHT, 2, 1] = 100.0, 100.0 * heavy
    for away, mark in ((0.0, 1.0), (0.04 * height / 1.7, np.exp(-1))):
        contact = np.zeros_like(measured.contact)
        contact[:, LEFT, 0, 0] = planned + away - heavy * 0.2
        contact[:, RIGHT, 2, 0] = planned + away + 0.2
        moved = setup.measurement(PHASES, contact=contact)
        np.testing.assert_allclose(setup.terms(moved, PHASES, force_windows=loads)["zmp"], mark, atol=2e-2)
    np.testing.assert_array_equal(setup.terms(measured, PHASES, force_windows=0.0 * loads)["zmp"], 0.0)


@pytest.mark.parametrize(
    ("term", "field", "offset"),
    [("com_x", "com", (0.03, 0)), ("com_z", "com", (0, -0.015)), ("speed", "com_velocity", (-0.05, 0))],
)
@pytest.mark.parametrize("height", [1.7, 1.3])
def test_tracking_falls_to_one_over_e_at_its_tolerance(term, field, offset, height):
    setup = Setup(height=height, mass=45, speed=1.0)
    ratio = height / 1.7
    exact = setup.measurement(PHASES)
    error = setup.tracking(exact, PHASES)
    exact = setup.measurement(
        PHASES,
        com=exact.com - error[:, :2],
        com_velocity=exact.com_velocity - np.stack([error[:, 2], 0 * PHASES], -1),
    )
    scale = np.sqrt(ratio) if field == "com_velocity" else ratio
    moved = setup.measurement(
        PHASES,
        **(
            {"com": exact.com, "com_velocity": exact.com_velocity}
            | {field: getattr(exact, field) + scale * np.array(offset)}
        ),
    )
    np.testing.assert_allclose(setup.terms(exact, PHASES)[term], 1.0, rtol=1e-12)
    np.testing.assert_allclose(setup.terms(moved, PHASES)[term], np.exp(-1), rtol=1e-9)


@pytest.mark.parametrize(("joint", "weight"), [(HIP, 3.0), (KNEE, 2.5), (ANKLE, 3.0), (TOE, 0.1)])
@pytest.mark.parametrize("side", [LEFT, RIGHT])
def test_pose_is_the_exponential_of_the_weighted_squared_error(thesis_body, joint, weight, side):
    on_plan = thesis_body.measurement(PHASES)
    angle = on_plan.angle.copy()
    angle[:, side, joint] += 0.1
    pose = thesis_body.terms(thesis_body.measurement(PHASES, angle=angle), PHASES)["pose"]
    np.testing.assert_allclose(pose, np.exp(-0.5 * weight * 0.1**2 / 0.02), rtol=3e-3)


def test_pose_takes_the_thigh_to_the_vertical(thesis_body):
    leaning = thesis_body.measurement(PHASES)
    leaning.base[:, 2] = 0.2
    leaning.angle[:, :, HIP] += 0.2
    np.testing.assert_allclose(thesis_body.terms(leaning, PHASES)["pose"], 1.0, atol=1e-4)


def test_costs_count_what_they_say(thesis_body):
    measured = thesis_body.measurement(PHASES)
    action = np.tile([0.1, -0.2, 0.3, 0.0], (len(PHASES), 1))
    stiffness = np.tile([[600.0, 60.0], [300.0, 120.0]], (len(PHASES), 1, 1))
    terms = thesis_body.terms(measured, PHASES, action=action, stiffness=stiffness)
    np.testing.assert_allclose(terms["stiffness_rate"], 0.14)
    np.testing.assert_allclose(terms["stiffness"], 0.5 * ((4 + 0.25) + (1 + 1)) / 1.25)


def test_force_is_rewarded_within_people_and_less_with_each_body_weight_beyond(thesis_body):
    phase = np.array([0.15])
    measured, force = thesis_body.measurement(phase), thesis_body.people_force(phase)
    weight = thesis_body.body.mass * GRAVITY
    middle = phase - 0.01 / thesis_body.plan.stride_time
    mean, sd = (getattr(thesis_body.human, kind)("grf_vertical", middle) for kind in ("mean", "sd"))
    band = 0.5 * sd

    def away(vertical_bw):
        pushed = force.copy()
        pushed[:, :, LEFT, 1, 1] = vertical_bw * weight
        return -FORCE_TOLERANCE * np.log(thesis_body.terms(measured, phase, force_windows=pushed)["grf"])

    np.testing.assert_allclose(away(mean + 0.99 * band), 0.0, atol=2e-3)
    np.testing.assert_allclose(away(mean - band - 0.1), 0.1, atol=2e-3)
    np.testing.assert_allclose(away(1.5), (1.5 - mean - band) + EXCESS_SHARE * 0.3, atol=2e-3)


def test_the_excess_of_a_single_window_is_not_averaged_away(thesis_body):
    phase = np.array([0.15])
    force = thesis_body.people_force(phase)
    force[0, :, LEFT, 1, 1] += 0.8 * thesis_body.body.mass * GRAVITY
    force[1, :, LEFT, 1, 1] -= 0.8 * thesis_body.body.mass * GRAVITY
    assert thesis_body.terms(thesis_body.measurement(phase), phase, force_windows=force)["grf"] < 0.3


def test_terms_do_not_depend_on_body_size_at_equal_froude_speed():
    small, large = Setup(height=1.36, mass=40, speed=1.2 * np.sqrt(0.8)), Setup()
    for left in (0.1, 0.3, 0.8):
        terms = []
        for setup in (small, large):
            ratio, mass_ratio = setup.body.length_scale, setup.body.mass_scale
            measured = setup.measurement([left])
            measured.com[:] += 0.02 * ratio
            measured.com_velocity[:] *= 0.9
            measured.angle[:] += 0.05
            force = setup.people_force([left]) * 1.3
            stiffness = np.full((1, 2, 2), 100.0) * ratio * mass_ratio
            terms.append(setup.terms(measured, [left], stiffness=stiffness, force_windows=force))
        for name in DEFAULT_WEIGHTS:
            # 20 ms, not scaled with the body, are another share of the stride for the forces' middle
            tolerance = 1e-2 if name == "grf" else 1e-6
            np.testing.assert_allclose(terms[0][name], terms[1][name], atol=tolerance, err_msg=name)


def test_reward_is_the_weighted_sum_and_nothing_after_a_fall(thesis_body):
    setup = Setup(reward_weights={"pose": 2.0, "grf": 0.5})
    weights = DEFAULT_WEIGHTS | {"pose": 2.0, "grf": 0.5}
    measured = setup.measurement(PHASES)
    measured.angle[:] += 0.03
    measured.base[0, 1] = 0.5
    terms = setup.terms(measured, PHASES, action=np.full((len(PHASES), 4), 0.1))
    assert set(terms) == set(weights)
    expected = np.sum([weights[name] * terms[name] for name in weights], axis=0)
    expected[0] = 0.0
    np.testing.assert_allclose(setup.reward(terms), expected, rtol=1e-12)


@pytest.mark.parametrize("height", [1.7, 1.2])
def test_a_fall_is_a_low_hip_or_a_tilted_trunk(height):
    setup = Setup(height=height, mass=50, speed=1.0)
    limit = 0.65 * height / 1.7
    measured = setup.measurement(np.full(6, 0.2))
    measured.base[:, 1] = [limit * 1.001, limit * 0.999, 1.0, 1.0, np.nan, 1.0]
    measured.base[:, 2] = [0.0, 0.0, 0.799, -0.801, 0.0, np.nan]
    expected = [0, TOO_LOW, 0, TOO_TILTED, TOO_LOW, TOO_TILTED]
    assert list(setup.task(6).fallen(measured)) == expected
    alive = setup.terms(measured, np.full(6, 0.2))["alive"]
    np.testing.assert_array_equal(alive, [code == 0 for code in expected])


def test_a_diverged_simulation_is_not_alive(thesis_body):
    measured = thesis_body.measurement([0.2, 0.2], diverged=np.array([-1, 2]))
    np.testing.assert_array_equal(thesis_body.terms(measured, [0.2, 0.2])["alive"], [1.0, 0.0])


def observe(setup, measured, left_phase, **other):
    n = len(left_phase)
    values = {
        "last_action": np.zeros((n, 4)),
        "force": np.zeros((n, 2, 3, 2)),
    }
    values |= other
    task, controls, bodies = setup.at(left_phase, measured)
    controls["decision"]["last_action"], task.rows["force"] = values["last_action"], values["force"]
    return task.observe(bodies)


def test_every_entry_of_the_observation_is_what_its_name_says(thesis_body):
    setup = Setup(height=1.5, mass=80, speed=0.9)
    measured = setup.measurement([0.1, 0.7])
    measured.base[:, 1:] = [0.7, 0.1]
    measured.base_velocity[:] = [0.9, -0.1, 0.5]
    measured.angle[:] = np.arange(8).reshape(2, 4) / 10
    measured.velocity[:] = -np.arange(8).reshape(2, 4)
    force = np.zeros((2, 2, 3, 2))
    force[..., 1] = np.arange(6).reshape(2, 3) * 100.0
    action = np.tile([0.1, 0.2, 0.3, 0.4], (2, 1))
    planned = setup.human.mean("ankle", np.array([0.1, 0.6]))
    seen = observe(setup, measured, [0.1, 0.7], last_action=action, force=force)
    row, other = (dict(zip(setup.task(2).names, values, strict=True)) for values in seen)

    leg = setup.body.leg_length
    froude, rate = np.sqrt(GRAVITY * leg), np.sqrt(leg / GRAVITY)
    expected = {
        "hip_height": 0.7 / leg,
        "pitch": 0.1,
        "hip_left": 0.0,
        "toe_left": 0.3,
        "hip_right": 0.4,
        "ankle_right": 0.6,
        "hip_velocity_x": 0.9 / froude,
        "hip_velocity_z": -0.1 / froude,
        "pitch_rate": 0.5 * rate,
        "knee_rate_left": -1 * rate,
        "toe_rate_right": -7 * rate,
        "phase_sin": np.sin(0.2 * np.pi),
        "phase_cos": np.cos(0.2 * np.pi),
        "phase_sin_2": np.sin(0.4 * np.pi),
        "phase_cos_2": np.cos(0.4 * np.pi),
        "load_heel_left": 0.0,
        "load_toe_left": 200 / (80 * GRAVITY),
        "load_heel_right": 300 / (80 * GRAVITY),
        "com_x_error": 0.0,
        "com_z_error": 0.0,
        "last_action_ankle_left": 0.1,
        "last_action_toe_right": 0.4,
        "planned_ankle_left": planned[LEFT],
        "planned_ankle_right": planned[RIGHT],
        "leading_leg": 1.0,
        "command_speed": setup.body.froude_speed(0.9),
        "height_ratio": 1.5 / 1.7,
    }
    for name, value in expected.items():
        assert row[name] == pytest.approx(value, rel=1e-6, abs=1e-4), name
    assert other["leading_leg"] == -1.0
    assert other["com_x_error"] == pytest.approx(0.0, abs=1e-4)


def test_observation_is_finite_and_within_bounds_whatever_happens(thesis_body):
    task = thesis_body.task(3)
    measured = thesis_body.measurement([0.2, 0.3, 0.4])
    for values, wild in ((measured.angle, 1e9), (measured.velocity, -1e9), (measured.base_velocity, np.nan)):
        values[:] = wild
    measured.com[:] = np.inf
    seen = observe(thesis_body, measured, [0.2, 0.3, 0.4])
    assert seen.dtype == np.float32
    assert seen.shape == (3, len(OBSERVATION)) == (3, len(task.low))
    assert np.isfinite(seen).all()
    assert ((seen >= task.low) & (seen <= task.high)).all()
    assert np.isfinite(task.low).all() and np.isfinite(task.high).all()
    assert (task.low < task.high).all()


def test_names_are_unique_and_name_the_actions():
    names = [entry.name for entry in OBSERVATION]
    assert len(set(names)) == len(names)
    assert [name.removeprefix("last_action_") for name in names if name.startswith("last_action_")] == list(ACTIONS)


def test_a_batch_gives_the_same_bits_as_its_members_alone(thesis_body):
    rng = np.random.default_rng(0)
    n, setup = 64, thesis_body
    left = rng.uniform(0, 1, n)

    def noisy(values):
        return values + rng.normal(0, 0.3, values.shape)

    base = setup.measurement(left)
    numbers = {name: noisy(value) for name, value in vars(base).items() if name != "diverged"}
    action, last = rng.uniform(-1, 1, (2, n, 4))
    stiffness = rng.uniform(5, 800, (n, 2, 2))
    force = rng.uniform(-500, 1000, (2, n, 2, 3, 2))

    def results(rows):
        measured = Measurement(diverged=base.diverged[rows], **{name: value[rows] for name, value in numbers.items()})
        seen = observe(setup, measured, left[rows], last_action=last[rows], force=force[0, rows])
        own = {"action": action[rows], "last_action": last[rows], "stiffness": stiffness[rows]}
        terms = setup.terms(measured, left[rows], **own, force_windows=force[:, rows])
        return np.column_stack([seen, setup.reward(terms), *terms.values()])

    together = results(slice(None))
    alone = np.concatenate([results(slice(i, i + 1)) for i in range(n)])
    np.testing.assert_array_equal(together, alone)


def test_an_unknown_reward_term_is_refused():
    with pytest.raises(SpringfootError, match="valid: alive, speed"):
        BipedSettings(reward_weights={"walk": 1.0})
