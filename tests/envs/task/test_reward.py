"""The reward against closed forms, the same bits for any N."""

from dataclasses import replace

import numpy as np
import pytest
from planned_body import Setup, leg_phases

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.walk import walked_steps
from springfoot.envs.physics.measurement import Measurement
from springfoot.envs.physics.model import ANKLE, HIP, KNEE, LEFT, RIGHT, TOE
from springfoot.envs.settings.settings import DEFAULT_WEIGHTS, BipedSettings
from springfoot.envs.task.reward import (
    EXCESS_SHARE,
    FORCE_TOLERANCE,
)
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import GRAVITY
from springfoot.gait.plan import plan_walk


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


def test_the_planned_com_is_that_of_the_plan_wherever_the_body_is(thesis_body):
    planned = thesis_body.measurement(PHASES).com
    moved = planned + np.array([0.03, -0.015])
    task, _, bodies = thesis_body.at(PHASES, thesis_body.measurement(PHASES, com=moved))
    np.testing.assert_allclose(task.planned_com(bodies), planned, atol=2e-4)


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


def test_the_knee_s_error_counts_by_its_weight():
    setup = Setup(knee_weight=7.0)
    angle = setup.measurement(PHASES).angle.copy()
    angle[:, LEFT, KNEE] += 0.1
    pose = setup.terms(setup.measurement(PHASES, angle=angle), PHASES)["pose"]
    np.testing.assert_allclose(pose, np.exp(-0.5 * 7.0 * 0.1**2 / 0.02), rtol=3e-3)


def test_pose_takes_the_thigh_to_the_vertical(thesis_body):
    leaning = thesis_body.measurement(PHASES)
    leaning.base[:, 2] = 0.2
    leaning.angle[:, :, HIP] += 0.2
    np.testing.assert_allclose(thesis_body.terms(leaning, PHASES)["pose"], 1.0, atol=1e-4)


def test_costs_count_what_they_say(thesis_body):
    measured = thesis_body.measurement(PHASES)
    action = np.tile([0.1, -0.2, 0.3, 0.0], (len(PHASES), 1))
    stiffness = np.tile([[600.0, 60.0], [300.0, 180.0]], (len(PHASES), 1, 1))
    terms = thesis_body.terms(measured, PHASES, action=action, stiffness=stiffness)
    np.testing.assert_allclose(terms["stiffness_rate"], 0.14)
    np.testing.assert_allclose(terms["stiffness"], 0.5 * ((4 + 1 / 4) + (1 + 9 / 4)) / 1.25)


@pytest.mark.parametrize("height", [1.7, 1.3])
def test_what_muscles_did_is_paid_over_weight_and_commanded_way(height):
    setup, random = Setup(height=height, mass=45, speed=1.0), np.random.default_rng(0)
    energy = random.uniform(0.0, 1.0, (len(PHASES), 2, 4))
    work, activation, rate = random.uniform(0.0, 1.0, (3, len(PHASES)))
    did = {"energy": energy, "positive_work": work, "activation": activation, "activation_rate": rate}
    terms = setup.terms(setup.measurement(PHASES), PHASES, muscles=did)
    carried = 45 * GRAVITY * 1.0 * 0.02
    np.testing.assert_allclose(terms["effort"], work / carried, rtol=1e-12)
    np.testing.assert_allclose(terms["fibre_work"], energy.sum((1, 2)) / carried, rtol=1e-12)
    np.testing.assert_allclose(terms["activation"], activation / 0.02, rtol=1e-12)
    np.testing.assert_allclose(terms["activation_rate"], rate / 0.02, rtol=1e-12)


def test_impact_is_the_squared_change_of_the_feets_forces_but_in_the_first_step(thesis_body):
    weight = thesis_body.body.mass * GRAVITY
    forces, before = np.zeros((2, len(PHASES), 2, 3, 2)), np.zeros((len(PHASES), 2, 3, 2))
    forces[:, :, LEFT, 0, 1], before[:, LEFT, 2, 1] = 0.7 * weight, 0.4 * weight
    forces[0, :, RIGHT, 1, 0] = 0.2 * weight  # in one of two windows
    measured = thesis_body.measurement(PHASES)
    terms = thesis_body.terms(measured, PHASES, force_windows=forces, last_force=before)
    np.testing.assert_allclose(terms["impact"], (0.3**2 + 0.1**2) * (0.05 / 0.02) ** 2, rtol=1e-9)
    first = thesis_body.terms(measured, PHASES, force_windows=forces)
    np.testing.assert_array_equal(first["impact"], 0.0)


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


@pytest.mark.parametrize("weight", [0.0, 1.0, 3.0])
def test_the_forward_force_counts_by_its_weight(weight):
    setup = Setup(forward_force_weight=weight)
    phase = np.array([0.15])
    force = setup.people_force(phase)
    force[:, :, LEFT, 1, 0] += 0.1 * setup.body.mass * GRAVITY
    measured = setup.measurement(phase)
    away = -FORCE_TOLERANCE * np.log(setup.terms(measured, phase, force_windows=force)["grf"])
    middle = phase - 0.01 / setup.plan.stride_time
    band = 0.5 * setup.human.sd("grf_forward", middle)
    np.testing.assert_allclose(away, weight * (0.1 - band), atol=3e-3 * max(weight, 1.0))


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
        seen = setup.observe(measured, left[rows], last_action=last[rows], force=force[0, rows])
        own = {"action": action[rows], "last_action": last[rows], "stiffness": stiffness[rows]}
        terms = setup.terms(measured, left[rows], **own, force_windows=force[:, rows])
        return np.column_stack([seen, setup.reward(terms), *terms.values()])

    together = results(slice(None))
    alone = np.concatenate([results(slice(i, i + 1)) for i in range(n)])
    np.testing.assert_array_equal(together, alone)


def test_an_unknown_reward_term_is_refused():
    with pytest.raises(SpringfootError, match="valid: alive, speed"):
        BipedSettings(reward_weights={"walk": 1.0})


def test_held_speed_and_step_length_are_those_of_the_walk():
    """Of two bodies at tabulated speeds, from what is measured at each step's end."""
    height = np.array([1.5, 1.9])
    commanded = np.array([0.9, 1.3]) * np.sqrt(height / 1.7)
    ranges = BipedSettings(height_range=(1.5, 1.9), speed_range=(0.8, 1.5), action_mode="residual")
    biped = Biped(replace(ranges, episode_seconds=4.0), 2)
    biped.reset(np.arange(2), [0, 1], given={"height": height, "speed": commanded})
    leads, ankles, speeds, told = [], [], [], []
    for _, result in walked_steps(biped, lambda _: np.zeros((2, 4))):
        leads.append((biped.leg_phase >= 0.5).argmin(-1))
        ankles.append(biped.measurement.ankle[..., 0].copy())
        speeds.append(biped.measurement.com_velocity[:, 0].copy())
        told.append([result.info[f"reward/{name}"].copy() for name in ("speed_held", "step_length")])
    for body in range(2):
        lead = np.array(leads)[:, body]
        landed = np.flatnonzero(np.diff(lead)) + 1
        length = np.diff([ankles[step][body, lead[step]] for step in landed])
        planned = plan_walk(biped.subjects.bodies[body], commanded[body]).step_length
        expected = np.zeros(len(lead))
        for begins, error in zip(landed[1:], np.abs(length / planned - 1.0), strict=True):
            expected[begins + 1 :] = error  # a step is judged before its touchdown is remembered
        assert len(length) > 4
        np.testing.assert_allclose(np.array(told)[:, 1, body], expected, rtol=1e-9)
        mean, held = commanded[body], []
        for speed in np.array(speeds)[:, body]:
            mean += 0.02 / 0.7 * (speed - mean)
            held.append(abs(mean / commanded[body] - 1.0))
        np.testing.assert_allclose(np.array(told)[:, 0, body], held, rtol=1e-9)
