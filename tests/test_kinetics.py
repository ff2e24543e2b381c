"""Forces and moments: against closed forms, MuJoCo's own torques, and people's measured moments."""

import csv
from pathlib import Path

import mujoco
import numpy as np
import pytest

from springfoot.envs.biped import Biped
from springfoot.envs.model import SIDES
from springfoot.envs.settings import BipedSettings
from springfoot.gait import GRAVITY, Body, SpringfootError, human_gait, plan_walk
from springfoot.gait.feet import turned
from springfoot.gait.human import human_cop
from springfoot.gait.kinetics import (
    foot_force,
    ground_reaction,
    people_leg,
    planned_leg,
    planned_moments,
    projection_table,
    share_forces,
)
from springfoot.gait.leg import (
    JOINTS,
    FootLoad,
    LegMotion,
    inverse_dynamics,
    joint_positions,
    leg_motion,
    load_at,
    projection_moments,
    resultant,
)

REFERENCE = Path(__file__).resolve().parents[2] / "shared" / "reference"
needs_data = pytest.mark.skipif(
    not (REFERENCE / "human_cop.csv").is_file(),
    reason="the measured data are not ours to give away: ../shared/reference",
)
PHASE = np.arange(400) / 400
PLANS = [("people", 1.2, 0.0), ("thesis", 1.2, 0.0), ("people", 0.5, 0.0), ("people", 1.8, 0.0), ("people", 1.0, 0.05)]
SLOPES = pytest.mark.parametrize(("cadence", "speed", "slope"), PLANS)
UNLOADED = FootLoad(force=np.zeros((2, 2)), point=np.zeros((2, 2)))


def still(turn, hip=(0.0, 0.0)):
    zero = np.zeros(4)
    return LegMotion(
        turn=np.array(turn, float), rate=zero, acceleration=zero, hip=np.array(hip, float), hip_acceleration=zero[:2]
    )


# Forces


def test_ground_reaction_is_weight_at_rest_and_leans_with_the_ground():
    np.testing.assert_allclose(ground_reaction(63.0, 0.0, 0.0), [0.0, 63.0 * GRAVITY])
    np.testing.assert_allclose(ground_reaction(63.0, [1.0], [-GRAVITY]), [[63.0, 0.0]], atol=1e-12)
    on_slope = ground_reaction(63.0, 0.0, 0.0, slope=0.1)
    np.testing.assert_allclose(on_slope, 63.0 * GRAVITY * np.array([np.sin(0.1), np.cos(0.1)]))


@SLOPES
def test_feet_share_the_force_and_neither_ever_jumps(cadence, speed, slope):
    plan = plan_walk(Body(), speed, cadence, slope=slope)
    body, feet = plan.body, plan.feet
    phase = np.concatenate([PHASE / 2, feet.toe_off - 0.5 + np.array([-1e-9, 0.0, 1e-9])])
    own, cop = foot_force(plan, phase)
    other, other_cop = foot_force(plan, phase + 0.5)
    other_cop = other_cop - plan.step_length
    total = ground_reaction(body.mass, *plan.com_acceleration(2 * phase), slope)
    np.testing.assert_allclose(own + other, total, rtol=1e-12, atol=1e-9)
    centre = (own[:, 1] * cop + other[:, 1] * other_cop) / total[:, 1]
    np.testing.assert_allclose(centre, plan.zmp(2 * phase), atol=1e-9)
    x, z = plan.com(2 * phase)
    for force, point in ((own, cop), (other, other_cop)):
        assert np.abs((x - point) * force[:, 1] - z * force[:, 0]).max() < 1e-8  # points through the CoM
    # Over its stride one foot starts and ends at zero, is never pulled, and stands on what is on the ground.
    fine = np.linspace(0, 1, 4001)[:-1]
    force, cop = foot_force(plan, fine)
    assert np.all(force[:, 1] >= 0)
    assert np.all(force[fine > feet.toe_off] == 0)
    assert np.abs(foot_force(plan, [0.0, feet.toe_off])[0]).max() < 1e-6
    assert np.abs(np.diff(force, axis=0)).max() < 0.1 * body.mass * GRAVITY
    rear, front = feet.on_ground(fine)
    stance = fine < feet.toe_off
    assert np.all(((rear - 1e-9 <= cop) & (cop <= front + 1e-9))[stance])
    assert np.abs(np.diff(cop[stance])).max() < 0.05  # from heel to sole within a hundredth of a stride
    if slope == 0.0:
        np.testing.assert_allclose(force.mean(0), [0.0, body.mass * GRAVITY / 2], atol=0.3)


def test_a_foot_that_would_have_to_pull_is_refused():
    com, weight = np.array([0.0, 1.0]), np.array([0.0, 600.0])
    rear, front = share_forces(weight, com, -0.1, 0.3)
    np.testing.assert_allclose([rear[1], front[1]], [450.0, 150.0])
    with pytest.raises(SpringfootError, match=r"outside by 0\.1000 m"):
        share_forces(weight, com, 0.1, 0.3)
    with pytest.raises(SpringfootError, match="only push"):
        share_forces(-weight, com, -0.1, 0.3)
    with pytest.raises(SpringfootError, match="between"):
        share_forces(weight, com, np.nan, 0.3)


def test_resultant_has_the_moment_of_its_parts_about_any_point():
    random = np.random.default_rng(1)
    force, point = random.normal(size=(5, 3, 2)) + np.array([0.0, 5.0]), random.normal(size=(5, 3, 2))
    total, centre = resultant(force, point)
    about = np.array([0.7, -0.3])
    arm, arms = centre - about, point - about
    parts = (arms[..., 0] * force[..., 1] - arms[..., 1] * force[..., 0]).sum(-1)
    np.testing.assert_allclose(arm[:, 0] * total[:, 1] - arm[:, 1] * total[:, 0], parts, atol=1e-12)
    np.testing.assert_array_equal(resultant(0 * force, point)[1], point.mean(1))


# Closed forms


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


# MuJoCo


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


# Plans and people


@SLOPES
def test_legs_of_a_plan_carry_its_trunk(cadence, speed, slope):
    """Both hips' forces are what the trunk's mass needs: the plan, its forces and the segments agree."""
    plan = plan_walk(Body(), speed, cadence, slope=slope)
    body = plan.body
    hips, (motion, _) = 0.0, planned_leg(plan, PHASE)
    for shift in (0.0, 0.5):
        hips = hips + inverse_dynamics(body, *planned_leg(plan, PHASE + shift), slope).force["hip"]
    needed = ground_reaction(body.trunk_mass, *np.moveaxis(motion.hip_acceleration, -1, 0), slope)
    error = np.abs(hips + needed) / (body.mass * GRAVITY)
    assert np.sqrt(np.mean(error**2)) < 0.02
    # The leg stands where the plan has it.
    ankle = joint_positions(body, motion)["ankle"]
    np.testing.assert_allclose(ankle, np.stack(plan.ankle_position(PHASE), -1), atol=3e-3)


def test_planned_moments_push_off_like_people_and_scale_with_the_body():
    plan = plan_walk(Body(), 1.2)
    moments = planned_moments(plan, PHASE)
    assert list(moments) == list(JOINTS)
    people = plan.human.mean("ankle_moment", PHASE)
    assert np.corrcoef(moments["ankle"], people)[0, 1] > 0.9
    assert 0.4 < PHASE[moments["ankle"].argmax()] < 0.52
    assert moments["toe"].max() > 10.0
    _, cop = foot_force(plan, PHASE)
    assert np.abs(moments["toe"][cop < plan.body.ankle_to_toe_joint]).max() < 1.0
    heavy = planned_moments(plan_walk(Body(1.7, 126.0), 1.2), PHASE)
    np.testing.assert_allclose(heavy["knee"], 2 * moments["knee"], rtol=1e-9)
    assert planned_moments(plan, np.zeros((2, 3)))["hip"].shape == (2, 3)


@pytest.mark.parametrize(("speed", "ankle", "knee", "hip"), [(0.85, 0.98, 0.87, 0.87), (1.2, 0.97, 0.94, 0.9)])
def test_peoples_motion_and_forces_give_peoples_moments(speed, ankle, knee, hip):
    """From the committed series alone; sagittal peaks come out a fifth too large with one subject's CoP."""
    gait, body = human_gait(speed, 1.71), Body(1.71, 68.5)
    moments = inverse_dynamics(body, *people_leg(gait, body, PHASE)).moment
    for joint, least in (("ankle", ankle), ("knee", knee), ("hip", hip)):
        assert np.corrcoef(moments[joint], gait.mean(f"{joint}_moment", PHASE))[0, 1] >= least
    assert moments["ankle"].max() / body.mass == pytest.approx(gait.mean("ankle_moment", PHASE).max(), rel=0.25)


@needs_data
def test_peoples_measured_curves_give_their_measured_ankle_moment():
    """The CSV's own angle, forces and CoP, with no series between, in stance; segment inertia adds little there."""
    with (REFERENCE / "human_gait.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["condition"] == "slow"][:61]
    with (REFERENCE / "human_cop.csv").open(newline="") as file:
        cops = [row for row in csv.DictReader(file) if row["cop_forward_from_ankle_m"]]

    def column(name):
        return np.array([float(row[name]) for row in rows])

    body = Body(1.71, 68.5)
    forward = np.array([float(row["cop_forward_from_ankle_m"]) for row in cops])
    percent = column("percent") / 63.3 * 60
    cop = body.foot_length / np.ptp(forward) * np.interp(percent, np.arange(len(forward)), forward)
    angles = {
        "thigh": np.radians(column("thigh_flexion_deg")),
        "knee": np.radians(column("knee_flexion_deg")),
        "ankle": np.radians(column("ankle_dorsiflexion_deg")),
        "toe": np.zeros(len(rows)),
    }
    motion = leg_motion(angles, np.zeros((len(rows), 2)), 0.01 * 1.098)
    pitch, ankle = motion.turn[:, 2], joint_positions(body, motion)["ankle"]
    # The foot turns about the heel while its toes point up, about the ball of the foot while they point down.
    pivot = np.where(pitch > 0, -body.heel_to_ankle, body.ankle_to_toe_joint)
    x, z = turned(pitch, 0.0, body.ankle_height)
    x, z = x + pivot * (1 - np.cos(pitch)), z - pivot * np.sin(pitch)
    force = 68.5 * GRAVITY * np.stack([column("grf_forward_bw"), column("grf_vertical_bw")], -1)
    load = load_at(force, ankle + np.stack([cop - x, -z], -1), np.inf)
    moment = inverse_dynamics(body, motion, load).moment["ankle"]
    assert np.corrcoef(moment, column("ankle_moment_Nm_per_kg"))[0, 1] >= 0.95


@needs_data
def test_committed_cop_is_what_the_command_makes_and_close_to_the_measured_one():
    from springfoot.gait import fit_human
    from springfoot.gait.human import _harmonics

    fitted = fit_human.fit(REFERENCE)["cop"]["coefficients"]
    np.testing.assert_allclose(_harmonics()["cop"]["coefficients"], fitted, atol=2e-6)
    with (REFERENCE / "human_cop.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["cop_forward_from_ankle_m"]]
    measured = np.array([float(row["cop_forward_from_ankle_m"]) for row in rows])
    ours = np.ptp(measured) * human_cop(np.arange(len(rows)) / 60)
    assert np.sqrt(np.mean((ours - measured) ** 2)) < 0.003


def test_cop_runs_forward_over_stance_and_rests_at_its_ends():
    share = np.linspace(0, 1, 300)
    assert np.all(np.diff(human_cop(share)) > 0)
    np.testing.assert_array_equal(human_cop([-1.0, 2.0]), human_cop([0.0, 1.0]))


def test_projection_is_almost_inverse_dynamics_below_the_hip_in_stance_and_nothing_in_swing():
    """Wells's claim in numbers, for people at 1.2 m/s: N m/kg against moments of about 1."""
    gait, body = human_gait(1.2, 1.71), Body(1.71, 68.5)
    rows = {(row.joint, row.part): row for row in projection_table(body, *people_leg(gait, body, PHASE))}
    assert set(rows) == {(joint, part) for joint in JOINTS for part in ("stance", "swing")}
    for joint, rms in (("toe", 0.005), ("ankle", 0.01), ("knee", 0.04)):
        assert rows[joint, "stance"].rms < rms
        assert rows[joint, "stance"].r > 0.99
    assert 0.08 < rows["hip", "stance"].rms < 0.2
    assert rows["hip", "swing"].r is None and rows["hip", "swing"].rms > 0.15
    assert all(row.peak >= row.rms > 0 for row in rows.values())
    assert [row.part for row in projection_table(body, still(np.zeros(4)), UNLOADED)] == ["swing"] * 4
