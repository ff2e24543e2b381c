"""The measurement of a gait: people fed in as a recording come out as people."""

import json

import numpy as np
import pytest

from springfoot.envs.physics.contact import BALL_RADIUS, HEEL_RADIUS, TOE_RADIUS
from springfoot.envs.physics.energy import ledger_entries
from springfoot.envs.physics.model import KNEE, SIDES
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.reward import TERMS
from springfoot.evaluation.numbers.likeness import moment_numbers
from springfoot.evaluation.numbers.measured_effort import cost_of_transport, episode_effort
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.numbers.per_leg import leg_numbers
from springfoot.evaluation.numbers.series import GAIT_CYCLE_COLUMNS, foot_contacts, strides_within
from springfoot.evaluation.numbers.tally import StrideTally, add_episode, tally_strides
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import SERIES, Recording, load_recording, record, record_each
from springfoot.gait import GRAVITY, Body, human_gait
from springfoot.gait.body.tissue import passive_moments
from springfoot.gait.people.gait_events import CONTACT_THRESHOLD_BW, PERCENT
from springfoot.gait.plan.effort import effort_of_people

BODY = Body()
HUMAN = human_gait(1.2)
STRIDE_LENGTH = 2 * HUMAN.step_length
SPEED = STRIDE_LENGTH / HUMAN.stride_time
WEIGHT = BODY.mass * GRAVITY
PITCH = 0.05
CLEARANCE = 0.03


def people(episodes=2, seconds=10.0, fell=(), cut=None, **settings) -> Recording:
    """Episodes of people's mean curves walking over a flat plan; `cut` is the length of those that `fell` [ticks]."""
    count = round(seconds * 100)
    time = (np.arange(count) + 1) * 0.01
    strides = time[:, None] / HUMAN.stride_time + np.array([0.3, 0.8])
    phase = strides % 1
    middle = (strides - 0.005 / HUMAN.stride_time) % 1

    def joints(curve):
        return np.stack([curve(name) for name in ("thigh", "knee", "ankle", "toe")], -1)

    angle = joints(lambda name: HUMAN.mean(name, phase))
    velocity = joints(lambda name: HUMAN.rate(name, phase) / HUMAN.stride_time)
    angle[..., 0] += PITCH  # hip = thigh + trunk pitch
    torque = np.zeros((count, 2, 4))
    for joint, name in enumerate(("hip", "knee", "ankle")):
        torque[..., joint] = -HUMAN.mean(f"{name}_moment", phase) * BODY.mass
    mean_torque = np.zeros_like(torque)
    for joint, name in enumerate(("hip", "knee", "ankle")):
        mean_torque[..., joint] = -HUMAN.mean(f"{name}_moment", middle) * BODY.mass
    rate = joints(lambda name: HUMAN.rate(name, middle) / HUMAN.stride_time)
    work = mean_torque * rate * 0.01
    tissue = passive_moments(BODY, joints(lambda name: HUMAN.mean(name, middle)))
    tissue[..., 3] = 0.0  # people's toe is not measured, and costs nothing
    energy = np.zeros((count, len(ledger_entries())))
    energy[:, [ledger_entries().index(name) for name in ("actuators", "contact")]] = 0.3, -0.1  # J a tick
    energy[:, ledger_entries().index("mechanical")] = 600.0 + 0.25 * np.arange(count)
    force = np.zeros((count, 2, 3, 2))
    force[:, :, 1, 0] = HUMAN.mean("grf_forward", middle) * WEIGHT
    force[:, :, 1, 1] = HUMAN.mean("grf_vertical", middle) * WEIGHT
    # A foot stands where it landed and moves evenly through its swing; a third of a step behind the CoM on landing.
    swing = np.clip((phase - HUMAN.toe_off) / (1 - HUMAN.toe_off), 0, 1)
    com = np.stack([SPEED * time, 0.97 - 0.02 * np.cos(4 * np.pi * phase[:, 0])], -1)
    landed = (np.floor(strides) - [0.3, 0.8]) * STRIDE_LENGTH + 0.2
    ankle = np.stack([landed + swing * STRIDE_LENGTH, np.full_like(phase, 0.07)], -1)
    contact = np.zeros((count, 2, 3, 2))
    # Spheres that roll: their lowest points move against the turn of foot and toe, the sole's material stays.
    foot = angle[..., 0] - PITCH - angle[..., 1] + angle[..., 2]
    turn = np.stack([foot, foot + angle[..., 3], foot + angle[..., 3]], -1)
    contact[..., 0] = ankle[..., None, 0] - turn * [HEEL_RADIUS, BALL_RADIUS, TOE_RADIUS]
    contact[..., 1] = np.where(swing > 0, CLEARANCE, 0.0)[..., None]
    step = PERCENT / 100
    plan = np.stack([-0.2 + HUMAN.step_length * step, 0.97 - 0.02 * np.cos(2 * np.pi * step)], -1)
    series = {
        "base": np.tile([0.0, 0.88, PITCH], (count, 1)),
        "angle": angle,
        "velocity": velocity,
        "torque": torque,
        "joint_torque": mean_torque,
        "joint_work": np.stack([np.maximum(work, 0.0), np.minimum(work, 0.0)], -1),
        "fibre_moment": -mean_torque - tissue,
        "muscle_work": np.stack([(work + tissue * rate * 0.01) / 2] * 2, -1),
        "energy": energy,
        "com": com,
        "com_velocity": np.gradient(com, 0.01, axis=0),
        "com_reference": com,
        "ankle": ankle,
        "contact": contact,
        "force": force,
        "phase": phase,
        "stiffness": np.broadcast_to([300.0, 40.0], (count, 2, 2)),
        "equilibrium": np.zeros((count, 2, 2)),
        "reward": np.broadcast_to(np.arange(len(TERMS)) / 10, (count, len(TERMS))),
    }
    stacked = {name: np.stack([values] * episodes).astype(np.float32) for name, values in series.items()}
    ticks = np.full(episodes, count)
    for episode in fell:
        ticks[episode] = cut
        for values in stacked.values():
            values[episode, cut:] = np.nan
    return Recording(
        policy="people",
        settings=BipedSettings(episode_seconds=seconds, **settings),
        seed=0,
        ticks=ticks,
        returns=np.arange(episodes, dtype=float),
        fall_reason=np.array(["fell: hip too low" if i in fell else "" for i in range(episodes)]),
        plan_com=plan,
        plan_zmp=plan[:, 0],
        series=stacked,
    )


@pytest.fixture(scope="module")
def gait():
    return measure(people())


def test_people_recorded_are_people_measured(gait):
    metrics = gait.metrics
    for name, joint in metrics["joints"].items():
        assert joint["rmse_deg"] < 0.3, name
        assert joint["r"] > 0.999
        assert joint["within_1sd_percent"] == 100
    grf = metrics["grf"]
    assert grf["vertical_peak1_bw"] == pytest.approx(HUMAN.mean("grf_vertical", PERCENT / 100)[3:26].max(), abs=0.01)
    assert grf["vertical_r"] > 0.99 and grf["forward_r"] > 0.99
    for name in ("hip", "knee", "ankle"):
        assert metrics["moments"][name]["r"] > 0.99
    ankle = HUMAN.mean("ankle_moment", PERCENT / 100)
    assert metrics["moments"]["ankle"]["peak_Nm_kg"] == pytest.approx(ankle.max(), abs=0.01)
    assert metrics["moments"]["ankle"]["peak_percent"] == pytest.approx(ankle.argmax(), abs=1)
    assert metrics["moments"]["toe"] == {
        "peak_Nm_kg": 0.0,
        "peak_percent": 0,
        "late_swing_peak_Nm_kg": 0.0,
        "r": None,
        "within_2sd_percent": None,
    }
    hip = HUMAN.mean("hip_moment", PERCENT / 100)
    assert metrics["moments"]["hip"]["late_swing_peak_Nm_kg"] == pytest.approx(hip[80:].max(), abs=0.01)
    assert all(metrics["moments"][name]["within_2sd_percent"] > 95 for name in ("hip", "knee", "ankle"))


def test_distances_and_times_of_the_gait(gait):
    metrics = gait.metrics
    assert metrics["speed_m_s"]["mean"] == pytest.approx(SPEED, rel=1e-4)
    assert metrics["step_length_m"] == pytest.approx(HUMAN.step_length, abs=0.005)
    assert metrics["cadence_steps_min"] == pytest.approx(120 / HUMAN.stride_time, rel=1e-3)
    assert metrics["double_support_s"] == pytest.approx((HUMAN.toe_off - 0.5) * HUMAN.stride_time, abs=0.015)
    assert metrics["toe_off_percent"] == pytest.approx(100 * HUMAN.toe_off, abs=1.5)
    assert metrics["contact_travel_m"] == pytest.approx(0.0, abs=1e-3)
    assert metrics["toe_clearance_m"] == pytest.approx(CLEARANCE, abs=1e-6)


def test_a_step_is_as_long_as_from_where_one_foot_landed_to_where_the_other_lands():
    recording = people(1)
    phase = recording.series["phase"]
    recording.series["ankle"][..., 0] += 0.1 * np.sin(np.pi * phase)  # creeps forward after landing, and back
    assert measure(recording).metrics["step_length_m"] == pytest.approx(HUMAN.step_length, abs=0.006)


def test_steps_outside_the_steady_walk_do_not_count():
    recording = people(1)
    tally = StrideTally()
    add_episode(tally, recording.episode(0), recording.settings, (1.0, 5.0))
    landings = HUMAN.stride_time * (0.2 + 0.5 * np.arange(20))  # left and right in turn
    inside = (landings[:-1] > 1.0) & (landings[1:] < 5.0)
    assert len(tally.step_length) == len(tally.step_time) == inside.sum()
    strides = (landings[:-2] > 1.0) & (landings[2:] < 5.0)
    assert len(tally.stride_time) == len(tally.vertical_max) == strides.sum()


def test_a_step_is_that_of_the_foot_which_swings_and_lands_at_its_end():
    recording = people(1)
    recording.series["ankle"][..., 0, 0] += 0.1  # left foot ahead
    tally = tally_strides(recording)
    length = np.array(tally.step_length)
    left = np.array(tally.step_sides) == SIDES.index("left")
    assert length[left].mean() == pytest.approx(HUMAN.step_length + 0.1, abs=0.006)
    assert length[~left].mean() == pytest.approx(HUMAN.step_length - 0.1, abs=0.006)


def test_the_rewards_terms_keep_time_with_the_com():
    recording = people(1)
    ramp = 0.01 * np.arange(recording.series["com"].shape[1])
    recording.series["com_velocity"][..., 0] = ramp
    recording.series["reward"] = np.broadcast_to(ramp[:, None], recording.series["reward"].shape).astype(np.float32)
    tally = tally_strides(recording)
    np.testing.assert_allclose(tally.reward.mean(TERMS[0]), tally.com.mean("vx"), atol=1e-6)


def test_the_way_walked_lasts_to_the_end_of_the_last_tick():
    recording = people(1)
    recording.series["com"][0, -1, 0] += 1.0
    tally = tally_strides(recording)
    steady = 10.0 - recording.measured_span[0]
    assert tally.distance == pytest.approx(SPEED * steady + 1.0, abs=1e-3)
    assert tally.speed == pytest.approx([tally.distance / steady])


def test_a_cop_below_a_moving_ankle_stays_below_it():
    recording = people(1)
    com = recording.series["com"][..., None, 0]
    recording.series["ankle"][..., 0] = com - 0.1
    recording.series["contact"][..., 0] = com[..., None] - 0.1
    np.testing.assert_allclose(tally_strides(recording).cop.mean("x"), 0.0, atol=5e-4)  # half a tick is 6 mm


def test_centre_of_mass_on_its_plan_has_no_error(gait):
    com = gait.metrics["com"]
    # Heel strike is seen at 0.05 BW, a few ms after it: 1.2 m/s makes that a few mm.
    assert com["x_rmse_m"] < 0.008
    assert com["z_rmse_m"] < 0.001
    assert com["z_r"] > 0.995
    assert com["rise_m"] == pytest.approx(0.04, abs=5e-4)


def test_effort_is_the_plans_price_of_peoples_curves(gait):
    effort = gait.metrics["effort"]
    own = effort_of_people(HUMAN, BODY)
    assert effort["fibre_J_kg_m"] == pytest.approx(own.work * GRAVITY, rel=0.02)
    assert effort["activation"] == pytest.approx(own.activation, rel=0.03)
    assert effort["rate"] == pytest.approx(own.rate, rel=0.02)
    assert effort["acceleration"] == pytest.approx(own.acceleration, rel=0.03)
    assert effort["total"] == pytest.approx(own.total, rel=0.02)
    wholes = [(effort, effort["per_joint"]), (effort, effort["per_leg"])]
    wholes += [(leg, leg["per_joint"]) for leg in effort["per_leg"].values()]
    for whole, parts in wholes:
        for name in ("fibre_J_kg_m", "net_joint_J_kg_m", "activation"):
            assert sum(part[name] for part in parts.values()) == pytest.approx(whole[name])


def test_net_joint_energy_is_the_price_of_peoples_joint_work(gait):
    phase = np.arange(1000) / 1000
    energy = 0.0  # of one leg in a stride [J/kg]
    for joint, curve in (("hip", "thigh"), ("knee", "knee"), ("ankle", "ankle")):
        power = -HUMAN.mean(f"{joint}_moment", phase) * HUMAN.rate(curve, phase)
        energy += np.maximum(power, 0.0).mean() / 0.25 - np.minimum(power, 0.0).mean() / 1.2  # MUSCLE_EFFICIENCY
    assert gait.metrics["effort"]["net_joint_J_kg_m"] == pytest.approx(2 * energy / STRIDE_LENGTH, rel=0.03)


def test_effort_of_an_episode_leaves_out_the_first_and_the_last_tick():
    recording = people(1)
    recording.series["joint_work"][...] = [1.0, 0.0]  # J a tick, of each joint
    effort = episode_effort(recording.episode(0), BODY, recording.settings.feet, 100, 110)
    assert effort is not None
    assert effort.seconds == pytest.approx(0.08)
    assert effort.distance == pytest.approx(SPEED * 0.08, rel=1e-3)
    np.testing.assert_allclose(effort.net_energy, 8 / 0.25)


@pytest.mark.parametrize("slope_deg", [0.0, 4.0])
def test_work_on_the_com_is_that_of_each_legs_force_in_double_support(slope_deg):
    metrics = measure(people(slope_deg=slope_deg)).metrics
    phase = np.linspace(0.0, metrics["double_support_s"] / HUMAN.stride_time, 1000)  # of the leading leg
    velocity = np.stack([np.full_like(phase, SPEED), 0.08 * np.pi / HUMAN.stride_time * np.sin(4 * np.pi * phase)])
    velocity[1] += np.tan(np.radians(slope_deg)) * SPEED  # recorded heights are above the ground, which rises

    def power(leg_phase):
        force = np.stack([HUMAN.mean(name, leg_phase) for name in ("grf_forward", "grf_vertical")])
        return GRAVITY * (force * velocity).sum(0)

    seconds = metrics["double_support_s"]
    push_off = np.maximum(power(phase + 0.5), 0.0).mean() * seconds
    collision = -np.minimum(power(phase), 0.0).mean() * seconds
    assert metrics["com_work_J_kg"]["push_off"] == pytest.approx(push_off, rel=0.03)
    assert metrics["com_work_J_kg"]["collision"] == pytest.approx(collision, rel=0.03)


def test_each_stride_has_the_largest_force_of_its_own_leg():
    recording = people()
    recording.series["force"][:, :, 0] *= 0.8
    tally = tally_strides(recording)
    largest, sides = np.array(tally.vertical_max), np.array(tally.stride_sides)
    highest = HUMAN.mean("grf_vertical", PERCENT / 100).max()
    assert largest[sides == 0] == pytest.approx(0.8 * highest, abs=0.01)
    assert largest[sides == 1] == pytest.approx(highest, abs=0.01)


def test_push_off_and_collision_are_of_the_leg_whose_force_does_them():
    recording = people(1)
    recording.series["force"][:, :, 0] *= 1.5  # of the left leg
    left, right = (leg["com_work_J_kg"] for leg in leg_numbers(tally_strides(recording)).values())
    for name in ("push_off", "collision"):
        assert left[name] == pytest.approx(1.5 * right[name], rel=0.1), name


def test_a_step_over_a_flight_has_no_double_support_and_no_work_in_it():
    recording = people()
    recording.series["force"][recording.series["phase"] > 0.47] = 0.0  # the other foot lands at half of the stride
    tally = tally_strides(recording)
    assert len(tally.double_support) > 10
    assert not np.any(tally.double_support)
    assert not np.any(tally.push_off)
    assert not np.any(tally.collision)


def test_clearance_is_that_of_the_middle_half_of_swing():
    recording = people()
    phase = recording.series["phase"]
    swing = (phase - HUMAN.toe_off) / (1 - HUMAN.toe_off)
    recording.series["contact"][..., 1] = np.where(np.abs(swing - 0.5) < 0.3, CLEARANCE, 0.001)[..., None]
    clearance = tally_strides(recording).clearance
    assert clearance == pytest.approx([CLEARANCE] * len(clearance))


def test_energies_of_a_stride_are_the_sums_of_its_ticks(gait):
    energy, ticks = gait.metrics["energy_J_kg"], HUMAN.stride_time / 0.01
    assert energy["actuators"] == pytest.approx(0.3 * ticks / BODY.mass, rel=1e-3)
    assert energy["mechanical_change"] == pytest.approx(0.25 * ticks / BODY.mass, rel=1e-3)
    assert energy["residual"] == pytest.approx((0.25 - 0.3 + 0.1) * ticks / BODY.mass, rel=1e-3)
    assert energy["pushes"] == 0.0


def test_mechanical_energy_changes_from_one_heel_strike_to_the_next():
    recording = people(1)
    time = 0.01 * (1 + np.arange(recording.series["energy"].shape[1]))  # at the ends of ticks
    recording.series["energy"] = recording.series["energy"].astype(float)
    recording.series["energy"][0, :, ledger_entries().index("mechanical")] = 100.0 * time**2
    series = recording.episode(0)
    vertical = series["force"][..., 1].sum(axis=2)
    strides = np.concatenate([strides_within(foot, recording.measured_span) for foot in foot_contacts(vertical, BODY)])
    gained = 100.0 * (strides[:, 2] ** 2 - strides[:, 0] ** 2).mean() / BODY.mass
    assert measure(recording).metrics["energy_J_kg"]["mechanical_change"] == pytest.approx(gained, rel=1e-4)


def test_each_leg_has_half_of_what_the_springs_of_both_got():
    recording = people(1)
    recording.series["energy"][..., ledger_entries().index("stiffness_changes/ankle")] = 0.2  # J a tick
    springs = measure(recording).metrics["springs_J_kg"]
    assert springs["ankle"]["stiffness_changes"] == pytest.approx(0.1 * HUMAN.stride_time / 0.01 / BODY.mass, rel=1e-3)
    assert springs["toe"]["stiffness_changes"] == 0.0


@pytest.mark.parametrize(("apart", "percent"), [(1.9, 100.0), (2.1, 0.0)])
def test_moments_are_counted_within_two_standard_deviations(apart, percent):
    phase = PERCENT / 100
    curve = HUMAN.mean("ankle_moment", phase) + apart * HUMAN.sd("ankle_moment", phase)
    assert moment_numbers(curve, HUMAN, "ankle")["within_2sd_percent"] == pytest.approx(percent, abs=1.0)


def test_joint_work_is_that_of_peoples_moments_and_rates(gait):
    phase = np.arange(1000) / 1000
    for joint, curve in (("hip", "thigh"), ("knee", "knee"), ("ankle", "ankle")):
        power = -HUMAN.mean(f"{joint}_moment", phase) * HUMAN.rate(curve, phase)  # of a stride
        work = gait.metrics["joint_work_J_kg"][joint]
        assert work["positive"] == pytest.approx(np.maximum(power, 0.0).mean(), rel=0.03)
        assert work["negative"] == pytest.approx(-np.minimum(power, 0.0).mean(), rel=0.03)
    assert gait.metrics["ankle_work_J_kg"] == gait.metrics["joint_work_J_kg"]["ankle"]


@pytest.mark.parametrize("off", [0.0, 0.03])
def test_a_cop_beside_the_planned_zmp_is_as_far_off_as_it_is(off):
    recording = people(1)  # whose planned ZMP runs below the planned CoM
    recording.series["contact"][..., 0] = recording.series["com"][..., None, None, 0] + off
    zmp = measure(recording).metrics["zmp"]
    # Heel strike is seen at 0.05 BW, a few ms after it: 1.2 m/s makes that a few mm.
    assert zmp["cop_rmse_single_support_m"] == pytest.approx(off, abs=0.008)
    assert zmp["cop_rmse_m"] == pytest.approx(off, abs=0.008)
    assert zmp["r"] > 0.999
    tally = tally_strides(recording)
    ahead = (tally.cop.mean("x") - tally.com.mean("x"))[2:]  # beyond the tick in which the ankle lands
    np.testing.assert_allclose(ahead, off, atol=5e-4)  # half a tick is 6 mm


def test_moments_are_actuator_and_passive_torque_with_extension_positive(gait):
    moment = gait.both.mean("ankle_moment_Nm_per_kg")
    assert moment[48] == pytest.approx(HUMAN.mean("ankle_moment", 0.48), abs=0.02)
    power = gait.both.mean("ankle_power_W_per_kg")
    assert power.argmax() == pytest.approx(HUMAN.mean("ankle_power", PERCENT / 100).argmax(), abs=1)
    assert power.max() > 2


def test_a_load_on_the_back_leaves_moments_per_kg_of_body(gait):
    carrying = measure(people(carried_ratio=0.25))
    for name in ("hip_moment_Nm_per_kg", "knee_moment_Nm_per_kg", "ankle_moment_Nm_per_kg"):
        np.testing.assert_array_equal(carrying.both.mean(name), gait.both.mean(name), err_msg=name)
    fibre, net = (carrying.metrics["effort"][name] for name in ("fibre_J_kg_m", "net_joint_J_kg_m"))
    assert (fibre, net) == tuple(gait.metrics["effort"][name] for name in ("fibre_J_kg_m", "net_joint_J_kg_m"))


@pytest.mark.parametrize("side", range(len(SIDES)))
def test_angles_beyond_peoples_are_those_of_the_worse_leg(side):
    recording = people(1)
    recording.series["angle"][:, :, side, KNEE] += 1.5
    series = recording.episode(0)
    effort = episode_effort(series, BODY, recording.settings.feet, 100, 900)
    assert effort is not None and effort.beyond_range > 10.0


def test_curves_of_states_and_of_means_begin_together_as_the_foot_lands(gait):
    """States are known at the end of a tick, means belong to its middle: 0.0045 of a stride between them."""
    fine = np.arange(5000) / 1e5
    landed = fine[(HUMAN.mean("grf_vertical", fine) >= CONTACT_THRESHOLD_BW).argmax()]
    phase = PERCENT[:-1] / 100 + landed

    def late(name, curve):
        slope = (HUMAN.mean(name, phase + 1e-4) - HUMAN.mean(name, phase - 1e-4)) / 2e-4
        return (curve[:-1] - HUMAN.mean(name, phase)) @ slope / (slope @ slope)

    mean = gait.both.mean
    state = late("knee", np.radians(mean("knee_flexion_deg")))
    assert state == pytest.approx(0.0, abs=0.0025)  # a straight line between two samples meets the threshold early
    for name, column in (("grf_vertical", "grf_vertical_bw"), ("ankle_moment", "ankle_moment_Nm_per_kg")):
        assert late(name, mean(column)) == pytest.approx(state, abs=0.001), name


def test_segment_angles_follow_from_joint_angles(gait):
    mean = gait.both.mean
    assert mean("pelvis_anterior_tilt_deg") == pytest.approx(np.degrees(PITCH), abs=1e-4)
    assert mean("hip_flexion_deg") == pytest.approx(mean("thigh_flexion_deg") + mean("pelvis_anterior_tilt_deg"))
    assert mean("shank_pitch_deg") == pytest.approx(mean("thigh_flexion_deg") - mean("knee_flexion_deg"))
    assert mean("foot_pitch_deg") == pytest.approx(mean("shank_pitch_deg") + mean("ankle_dorsiflexion_deg"))


def test_cost_of_transport_is_work_per_weight_and_distance():
    assert cost_of_transport(63.0 * GRAVITY * 10.0, 63.0, 10.0) == pytest.approx(1.0)
    assert cost_of_transport(10.0, 63.0, 0.0) is None


def test_cost_of_transport_is_the_positive_work_of_all_joints(gait):
    phase = np.arange(1000) / 1000
    power = sum(
        np.maximum(-HUMAN.mean(f"{joint}_moment", phase) * HUMAN.rate(curve, phase), 0).mean()
        for joint, curve in (("hip", "thigh"), ("knee", "knee"), ("ankle", "ankle"))
    )
    # The rate is per stride, so the mean over phase is work per stride, body mass and leg.
    assert gait.metrics["cost_of_transport"] == pytest.approx(2 * power / (GRAVITY * STRIDE_LENGTH), rel=0.03)


def test_feet_and_both_are_consistent(gait):
    left, right = gait.feet
    assert left.count + right.count == gait.both.count == gait.metrics["strides"]["count"]
    for name in GAIT_CYCLE_COLUMNS:
        pooled = (left.mean(name) * left.count + right.mean(name) * right.count) / gait.both.count
        assert gait.both.mean(name) == pytest.approx(pooled, abs=1e-9)
    assert gait.both.sd("knee_flexion_deg").max() < 0.5


def test_falls_are_counted_and_their_strides_too():
    whole, cut = measure(people(3)), measure(people(3, fell=[1], cut=600))
    assert (cut.metrics["falls"], cut.metrics["fall_reasons"]) == (1, {"fell: hip too low": 1})
    assert cut.metrics["seconds_mean"] == pytest.approx((10 + 6 + 10) / 3)
    assert 0 < cut.metrics["strides"]["in_episodes_that_fell"] < whole.both.count / 3
    assert cut.both.count < whole.both.count
    alone = measure(people(1, fell=[0], cut=600))
    assert alone.metrics["strides"]["in_episodes_that_fell"] == alone.metrics["strides"]["count"] == alone.both.count
    assert cut.metrics["return"] == {"mean": 1.0, "sd": 1.0}


def test_a_gait_that_never_was_is_null_never_nan():
    gait = measure(people(2, fell=[0, 1], cut=150))
    text = json.dumps(gait.metrics, allow_nan=False)
    assert gait.metrics["falls"] == 2 and gait.metrics["strides"]["count"] == 0
    for path in (("speed_m_s", "mean"), ("joints", "knee", "rmse_deg"), ("grf", "vertical_max_bw"), ("com", "rise_m")):
        value = json.loads(text)
        for key in path:
            value = value[key]
        assert value is None, path


def test_numbers_can_be_recomputed_from_the_saved_series(tmp_path):
    recording = people(2, fell=[1], cut=700)
    recording.save(tmp_path / "strides.npz")
    with np.load(tmp_path / "strides.npz", allow_pickle=False) as file:
        assert not any(values.dtype.hasobject for values in file.values())
        assert set(SERIES) < set(file)
    assert measure(load_recording(tmp_path / "strides.npz")).metrics == measure(recording).metrics


def test_bodies_side_by_side_are_measured_each_in_its_own_units():
    ranges = {"height_range": (1.5, 1.9), "mass_range": (50.0, 100.0), "speed_range": (1.0, 1.3)}
    policy, settings = policy_and_settings("quasi_stiffness", ranges | {"episode_seconds": 5.0})
    who = {"height": [1.7, 1.9], "mass": [63.0, 100.0], "speed": [1.2, 1.2 * np.sqrt(1.9 / 1.7)]}
    own, other = record_each(policy, settings, who, name="quasi_stiffness", seed=3)
    alone = record(
        *policy_and_settings("quasi_stiffness", {"episode_seconds": 5.0}), name="quasi_stiffness", episodes=1, seed=3
    )
    for key, values in alone.series.items():
        np.testing.assert_array_equal(own.series[key], values, err_msg=key)
    assert measure(own).metrics == measure(alone).metrics
    assert (other.settings.height, other.settings.mass, other.settings.height_range) == (1.9, 100.0, None)
    assert other.fall_reason[0] == ""
    metrics = measure(other).metrics
    assert metrics["reference"]["speed_m_s"] == pytest.approx(who["speed"][1])
    ours = measure(own).metrics["grf"]["vertical_peak1_bw"]
    assert metrics["grf"]["vertical_peak1_bw"] == pytest.approx(ours, rel=0.3)  # in newtons it is 1.6 times as large
