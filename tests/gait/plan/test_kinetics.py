"""Forces and moments of plans and of people: sums, shares, equilibrium, and people's measured moments."""

import csv
from pathlib import Path

import numpy as np
import pytest

from springfoot.gait import GRAVITY, Body, SpringfootError, human_gait, plan_walk
from springfoot.gait.body.body import ANGLES, gravity
from springfoot.gait.body.leg_dynamics import (
    FOOT_SEGMENT,
    JOINTS,
    FootLoad,
    LegMotion,
    inverse_dynamics,
    joint_positions,
    leg_motion,
    load_at,
    segment_turns,
)
from springfoot.gait.body.rockers import turned
from springfoot.gait.people.fourier import fourier_jet
from springfoot.gait.people.human import human_cop
from springfoot.gait.plan.kinetics import (
    foot_force,
    ground_reaction,
    planned_leg,
    planned_moments,
    projection_table,
    share_forces,
)

REFERENCE = Path(__file__).resolve().parents[4] / "shared" / "reference"
needs_data = pytest.mark.skipif(
    not (REFERENCE / "human_cop.csv").is_file(),
    reason="the measured data are not ours to give away: ../shared/reference",
)
PHASE = np.arange(400) / 400
PEOPLE_SAMPLES = 100
"""Samples of a stride for people's curves; chosen, as these have 12 harmonics."""
PLANS = [("people", 1.2, 0.0), ("thesis", 1.2, 0.0), ("people", 0.5, 0.0), ("people", 1.8, 0.0), ("people", 1.0, 0.05)]
SLOPES = pytest.mark.parametrize(("cadence", "speed", "slope"), PLANS)


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


@pytest.mark.parametrize("speed", [0.4, 0.45, 0.5])
def test_in_steps_of_a_foots_length_the_load_passes_over_once_the_foot_is_flat(speed):
    plan = plan_walk(Body(), speed, "thesis")
    fine = np.linspace(0, 1, 8001)[:-1]
    force, cop = foot_force(plan, fine)
    rear, front = plan.feet.on_ground(fine)
    loaded = force[:, 1] > 1e-6
    assert np.all(force[:, 1] > -1e-9) and np.all(loaded[(fine > 1.01 * plan.feet.foot_flat) & (fine < 0.5)])
    assert np.all(((rear - 1e-9 <= cop) & (cop <= front + 1e-9))[loaded])
    assert np.abs(np.diff(force, axis=0)).max() < 0.1 * plan.body.mass * GRAVITY
    np.testing.assert_allclose(force.mean(0), [0.0, plan.body.mass * GRAVITY / 2], atol=0.3)


def test_a_foot_that_would_have_to_pull_is_refused():
    com, weight = np.array([0.0, 1.0]), np.array([0.0, 600.0])
    rear, front = share_forces(weight, com, -0.1, 0.3)
    np.testing.assert_allclose([rear[1], front[1]], [450.0, 150.0])
    rear, front = share_forces(weight, com, 0.3, -0.1)  # feet side by side: the rear one's toes lie ahead
    np.testing.assert_allclose([rear[1], front[1]], [150.0, 450.0])
    with pytest.raises(SpringfootError, match=r"outside by 0\.1000 m"):
        share_forces(weight, com, 0.1, 0.3)
    with pytest.raises(SpringfootError, match="only push"):
        share_forces(-weight, com, -0.1, 0.3)
    with pytest.raises(SpringfootError, match="between"):
        share_forces(weight, com, np.nan, 0.3)


@pytest.mark.parametrize("carried", [0.0, 0.3])
@SLOPES
def test_legs_of_a_plan_carry_its_trunk_and_load(cadence, speed, slope, carried):
    """Both hips' forces are what their mass needs: the plan, its forces and the segments agree."""
    plan = plan_walk(Body(carried_ratio=carried), speed, cadence, slope=slope)
    body = plan.body
    hips, (motion, _) = 0.0, planned_leg(plan, PHASE)
    for shift in (0.0, 0.5):
        hips = hips + inverse_dynamics(body, *planned_leg(plan, PHASE + shift), slope).force["hip"]
    forward, up = np.moveaxis(motion.hip_acceleration, -1, 0)
    needed = ground_reaction(body.trunk_mass + body.carried_mass, forward, up, slope)
    error = np.abs(hips + needed) / (body.mass * GRAVITY)
    assert np.sqrt(np.mean(error**2)) < 0.02
    # The leg stands where the plan has it.
    ankle = joint_positions(body, motion.turn, motion.hip)["ankle"]
    np.testing.assert_allclose(ankle, np.stack(plan.feet.ankle(PHASE), -1), atol=3e-3)


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


def people_leg(gait, body, phase):
    """Return one leg of people on level ground, as a `body`: motion and load.

    Angles and forces are the gait's, the centre of pressure is `human_cop` times the foot's length. The foot stands on
    its heel while its toes point up, on its ball while they point down, x from where its ankle is when flat. The hip
    follows from the forces: the whole body, trunk upright and legs half a stride apart, has the CoM acceleration of
    equation (2). In swing, where no force acts, the foot's place means nothing.
    """
    grid = np.arange(PEOPLE_SAMPLES) / PEOPLE_SAMPLES

    def forces(at):
        return np.stack([gait.mean("grf_forward", at), gait.mean("grf_vertical", at)], -1)

    def legs(at):
        turns = segment_turns({name: gait.mean(name, grid) for name in ANGLES})
        jet = fourier_jet(turns, PEOPLE_SAMPLES // 2 - 1, at, gait.stride_time)
        still = np.zeros((*at.shape, 2))
        return LegMotion(turn=jet[0], rate=jet[1], acceleration=jet[2], hip=still, hip_acceleration=still)

    leg = legs(phase)
    both_feet = forces(phase) + forces(phase + 0.5)
    # People's mean forces do not quite add up to their weight: only what differs from the mean accelerates.
    com_acceleration = GRAVITY * (both_feet - 2 * forces(grid).mean(0))
    swinging = (mass_acceleration(body, leg) + mass_acceleration(body, legs(phase + 0.5))) / body.total_mass
    pitch = leg.turn[..., FOOT_SEGMENT]
    on_heel = ankle_over(body, pitch, -body.heel_to_ankle, 0.0)
    on_ball = ankle_over(body, pitch, body.ankle_to_toe_joint, body.toe_joint_height)
    ankle = np.where(pitch[..., None] > 0, on_heel, on_ball)
    motion = LegMotion(
        turn=leg.turn,
        rate=leg.rate,
        acceleration=leg.acceleration,
        hip=ankle - joint_positions(body, leg.turn, leg.hip)["ankle"],
        hip_acceleration=com_acceleration - swinging,
    )
    cop = body.foot_length * human_cop(phase / gait.toe_off)
    force = body.total_mass * GRAVITY * forces(phase)
    toe_joint = joint_positions(body, motion.turn, motion.hip)["toe"]
    return motion, load_at(force, np.stack([cop, np.zeros(cop.shape)], -1), toe_joint[..., 0])


def ankle_over(body, pitch, x, z):
    """Return the ankle (..., 2) [m] of a foot at `pitch` turned about (x, z) [m], x from the flat foot's ankle."""
    return np.array([x, z]) + np.stack(turned(pitch, -x, body.ankle_height - z), -1)


def mass_acceleration(body, motion):
    """Return the sum of mass times acceleration (..., 2) [N] over the segments of a leg, by the force at its hip."""
    none = np.zeros((*motion.hip.shape[:-1], 2, 2))
    hip_force = inverse_dynamics(body, motion, FootLoad(force=none, point=none)).force["hip"]
    leg_mass = body.thigh_mass + body.shank_mass + body.foot_mass + body.toe_mass
    return hip_force + leg_mass * gravity(0.0)


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
    pitch, ankle = motion.turn[:, 2], joint_positions(body, motion.turn, motion.hip)["ankle"]
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
    from springfoot.gait.people import fit_human
    from springfoot.gait.people.human import harmonics

    fitted = fit_human.fit(REFERENCE)["cop"]["coefficients"]
    np.testing.assert_allclose(harmonics()["cop"]["coefficients"], fitted, atol=2e-6)
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
        assert (rows[joint, "stance"].r or 0.0) > 0.99
    assert 0.08 < rows["hip", "stance"].rms < 0.2
    assert rows["hip", "swing"].r is None and rows["hip", "swing"].rms > 0.15
    assert all(row.peak >= row.rms > 0 for row in rows.values())
    assert rows["ankle", "stance"].peak < 10 * rows["ankle", "stance"].rms  # of the same difference, not of a sum
    motion = leg_motion({name: np.zeros(4) for name in ANGLES}, np.zeros((4, 2)), 0.01)
    hanging = FootLoad(force=np.zeros((4, 2, 2)), point=np.zeros((4, 2, 2)))
    assert [row.part for row in projection_table(body, motion, hanging)] == ["swing"] * 4
