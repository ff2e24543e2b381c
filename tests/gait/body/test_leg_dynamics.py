"""Mechanics of one leg: against closed forms and MuJoCo's own joint torques."""

import mujoco
import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.model import SIDES
from springfoot.envs.settings.settings import BipedSettings
from springfoot.gait import GRAVITY, Body, SpringfootError
from springfoot.gait.body.leg_dynamics import (
    JOINTS,
    FootLoad,
    LegMotion,
    inverse_dynamics,
    leg_motion,
    load_at,
    projection_moments,
)
from springfoot.gait.body.rockers import turned

UNLOADED = FootLoad(force=np.zeros((2, 2)), point=np.zeros((2, 2)))


def still(turn, hip=(0.0, 0.0)):
    zero = np.zeros(4)
    return LegMotion(
        turn=np.array(turn, float), rate=zero, acceleration=zero, hip=np.array(hip, float), hip_acceleration=zero[:2]
    )


def resultant(force, point):
    """Return one force (..., 2) [N] and its point (..., 2) [m] in place of several, (..., K, 2) each, on one segment.

    Same force, same moment: the centre of pressure, at the mean height weighted by upward force. Without load 0, at
    the mean of the points.
    """
    total = force.sum(-2)
    up = total[..., 1]
    loaded = up != 0.0
    divisor = np.where(loaded, up, 1.0)
    height = (point[..., 1] * force[..., 1]).sum(-1) / divisor
    moment = (point[..., 0] * force[..., 1] - point[..., 1] * force[..., 0]).sum(-1)
    centre = np.stack([(moment + height * total[..., 0]) / divisor, height], -1)
    return total, np.where(loaded[..., None], centre, point.mean(-2))


def test_resultant_has_the_moment_of_its_parts_about_any_point():
    random = np.random.default_rng(1)
    force, point = random.normal(size=(5, 3, 2)) + np.array([0.0, 5.0]), random.normal(size=(5, 3, 2))
    total, centre = resultant(force, point)
    about = np.array([0.7, -0.3])
    arm, arms = centre - about, point - about
    parts = (arms[..., 0] * force[..., 1] - arms[..., 1] * force[..., 0]).sum(-1)
    np.testing.assert_allclose(arm[:, 0] * total[:, 1] - arm[:, 1] * total[:, 0], parts, atol=1e-12)
    np.testing.assert_array_equal(resultant(0 * force, point)[1], point.mean(1))


def test_standing_still_the_ankle_bears_half_the_weight_at_its_lever():
    body, lever = Body(), 0.07
    motion = still(np.zeros(4), hip=(0.0, body.leg_length))
    half = np.array([0.0, body.mass * GRAVITY / 2])
    load = load_at(half, np.array([lever, 0.0]), body.ankle_to_toe_joint)
    projection, dynamics = projection_moments(body, motion, load), inverse_dynamics(body, motion, load)
    assert projection["ankle"] == pytest.approx(half[1] * lever)
    assert projection["knee"] == pytest.approx(-half[1] * lever)  # the force passes in front of the knee: flexors
    assert projection["hip"] == pytest.approx(half[1] * lever)
    assert projection["toe"] == 0.0
    feet = body.foot_mass * body.foot_com[0] + body.toe_mass * (body.ankle_to_toe_joint + body.toe_com)
    assert dynamics.moment["ankle"] == pytest.approx(half[1] * lever - GRAVITY * feet)
    trunk = body.trunk_mass * GRAVITY / 2
    np.testing.assert_allclose(dynamics.force["hip"], [0.0, -trunk], atol=1e-9)
    # On tiptoe the same force is the toe's.
    on_toe = load_at(half, np.array([0.15, 0.0]), body.ankle_to_toe_joint)
    assert projection_moments(body, motion, on_toe)["toe"] == pytest.approx(half[1] * (0.15 - body.ankle_to_toe_joint))


def test_a_stiff_leg_is_a_compound_pendulum():
    body = Body(1.8, 80.0)
    angle, acceleration = 0.4, -3.0
    turn = np.full(4, angle)
    motion = LegMotion(
        turn=turn,
        rate=np.full(4, 2.0),
        acceleration=np.full(4, acceleration),
        hip=np.zeros(2),
        hip_acceleration=np.zeros(2),
    )
    forward, below = body.foot_com
    toe_joint = np.array([body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height])
    down = np.array([0.0, -1.0])
    ankle = (body.thigh_length + body.shank_length) * down
    parts = [
        (body.thigh_mass, body.thigh_inertia, body.thigh_com * down),
        (body.shank_mass, body.shank_inertia, (body.thigh_length + body.shank_com) * down),
        (body.foot_mass, body.foot_inertia, ankle + np.array([forward, -below])),
        (body.toe_mass, body.toe_inertia, ankle + toe_joint + np.array([body.toe_com, 0.0])),
    ]
    inertia = sum(i + m * (r @ r) for m, i, r in parts)
    lever = sum(m * turned(angle, *r)[0] for m, _, r in parts)
    flexion_torque = inertia * acceleration + GRAVITY * lever
    moments = inverse_dynamics(body, motion, UNLOADED).moment
    assert moments["hip"] == pytest.approx(-flexion_torque, rel=1e-12)


def test_moments_do_not_depend_on_the_frame():
    """Turned with the ground and moved anywhere, a leg needs the same moments."""
    random, tilt = np.random.default_rng(2), 0.08
    body = Body()
    turn, rate, acceleration = random.normal(size=(3, 6, 4))
    hip, pull, away = random.normal(size=(6, 2)), random.normal(size=(6, 2)), np.array([3.0, -2.0])
    force, point = 100 * random.normal(size=(6, 2, 2)), random.normal(size=(6, 2, 2))

    def leaning(v):
        return np.stack(turned(-tilt, v[..., 0], v[..., 1]), -1)

    level = inverse_dynamics(
        body,
        LegMotion(turn=turn, rate=rate, acceleration=acceleration, hip=hip, hip_acceleration=pull),
        FootLoad(force=force, point=point),
    )
    leant = inverse_dynamics(
        body,
        LegMotion(
            turn=turn - tilt,
            rate=rate,
            acceleration=acceleration,
            hip=leaning(hip) + away,
            hip_acceleration=leaning(pull),
        ),
        FootLoad(force=leaning(force), point=leaning(point) + away),
        slope=tilt,
    )
    for joint in JOINTS:
        np.testing.assert_allclose(leant.moment[joint], level.moment[joint], rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(leant.force[joint], leaning(level.force[joint]), rtol=1e-10, atol=1e-10)


def test_differentiated_samples_give_the_motion_they_were_taken_from():
    tick = 0.005
    t = tick * np.arange(200)
    angles = {
        "thigh": 0.3 * np.sin(6 * t),
        "knee": 0.4 + 0.3 * np.cos(5 * t),
        "ankle": 0.1 * np.sin(9 * t),
        "toe": 0 * t,
    }
    motion = leg_motion(angles, np.stack([1.2 * t, 0.9 + 0.02 * np.cos(11 * t)], -1), tick)
    shank = -0.3 * 36 * np.sin(6 * t) + 0.3 * 25 * np.cos(5 * t)
    inner = slice(5, -5)
    np.testing.assert_allclose(motion.acceleration[inner, 1], shank[inner], atol=1e-2)
    np.testing.assert_allclose(motion.rate[inner, 0], 1.8 * np.cos(6 * t)[inner], atol=1e-5)
    np.testing.assert_allclose(motion.hip_acceleration[inner, 1], -2.42 * np.cos(11 * t)[inner], atol=1e-2)
    np.testing.assert_allclose(motion.turn[:, 3], motion.turn[:, 2])
    with pytest.raises(SpringfootError, match="tick"):
        leg_motion(angles, np.zeros((200, 2)), 0.0)
    with pytest.raises(SpringfootError, match=r"got \(200,\) and \(199, 2\)"):
        leg_motion(angles, np.zeros((199, 2)), tick)
    with pytest.raises(SpringfootError, match="finite"):
        leg_motion(angles | {"toe": np.full(200, np.nan)}, np.zeros((200, 2)), tick)


def test_shapes_that_do_not_belong_together_are_refused():
    with pytest.raises(SpringfootError, match="rate must have shape"):
        LegMotion(
            turn=np.zeros((5, 4)),
            rate=np.zeros((4, 4)),
            acceleration=np.zeros((5, 4)),
            hip=np.zeros((5, 2)),
            hip_acceleration=np.zeros((5, 2)),
        )
    with pytest.raises(SpringfootError, match="point must have shape"):
        FootLoad(force=np.zeros((5, 2, 2)), point=np.zeros((5, 2)))


def contact_forces(model, data, side):
    """Force and point (2, 2) on the foot and the toe of one side, from every contact."""
    force, point = [], []
    for segment in ("foot", "toe"):
        forces, points = [np.zeros(2)], [np.zeros(2)]
        for index in range(data.ncon):
            contact = data.contact[index]
            if model.geom_bodyid[contact.geom2] != model.body(f"{segment}_{side}").id:
                continue
            wrench = np.zeros(6)
            mujoco.mj_contactForce(model, data, index, wrench)
            forces.append((contact.frame.reshape(3, 3).T @ wrench[:3])[[0, 2]])  # on the second geom
            points.append(contact.pos[[0, 2]])
        both = resultant(np.array(forces), np.array(points))
        force.append(both[0])
        point.append(both[1])
    return FootLoad(force=np.array(force), point=np.array(point))


def test_inverse_dynamics_finds_mujocos_joint_torques_in_a_walk():
    biped = Biped(BipedSettings(), 1)
    model = biped.model
    biped.reset(np.arange(1), [0])
    found, expected, loaded = [], [], 0
    model.opt.tolerance, model.opt.iterations = 0.0, 200  # solve the contacts to rounding, for mj_forward here
    for _ in range(60):
        biped.step(np.zeros((1, 4)))
        data = biped.data(0)
        assert not np.any(data.efc_type == mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
        for side in SIDES:
            columns = [model.joint(f"{joint}_{side}").dofadr[0] for joint in JOINTS]

            def turn(values, columns=columns):
                hip, knee, ankle, toe = values[columns]
                return np.cumsum([hip - values[2], -knee, ankle, toe])

            motion = LegMotion(
                turn=turn(data.qpos),
                rate=turn(data.qvel),
                acceleration=turn(data.qacc),
                hip=data.qpos[:2].copy(),
                hip_acceleration=data.qacc[:2].copy(),
            )
            load = contact_forces(model, data, side)
            loaded += np.count_nonzero(load.force[:, 1])
            moments = inverse_dynamics(biped.body, motion, load).moment
            found.append([-moments["hip"], -moments["knee"], -moments["ankle"], -moments["toe"]])
            torque = data.qfrc_actuator + data.qfrc_passive - model.dof_armature * data.qacc
            expected.append(torque[columns])
    found, expected = np.array(found), np.array(expected)
    assert loaded > 60
    largest = np.abs(expected).max(0)
    assert np.all(largest > [20, 20, 20, 2])
    assert np.all(np.abs(found - expected).max(0) <= 1e-6 * largest)
