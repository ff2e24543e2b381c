"""A step of stiffness: its torque in closed form, Newton's law for the CoM, and walks that differ by it alone."""

from copy import copy
from itertools import product
from typing import Any

import mujoco
import numpy as np
import pytest

from springfoot.agents.policies.baselines import leg_phase
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.stiffness_control import FEET, action_of, stiffness_of
from springfoot.envs.physics.model import JOINTS, SIDES, damping_times
from springfoot.envs.settings.settings import BipedSettings
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.gait import Body, SpringfootError
from springfoot.studies.springs.stiffness_steps import (
    CELLS,
    DURATIONS,
    FIXED,
    MOVEMENT,
    PHASES,
    SPRINGS,
    _Changes,
    action_step,
    paired_walks,
    step_at,
)

CHANGE = 0.1


@pytest.fixture(scope="module")
def states():
    """Model, leg phases and data of a level walk, a state each 60 ms over more than a stride."""
    policy, settings = policy_and_settings("schedule", {})
    biped = Biped(settings, 1, 1)
    biped.reset(np.zeros(1, int), [0])
    observation, found = biped.observe(), []
    for step in range(220):
        observation = biped.step(policy(observation)).observation
        if step >= 160 and step % 3 == 0:
            found.append((leg_phase(observation)[0], biped.data(0)))
    return biped.model, found


@pytest.fixture(scope="module")
def pairs():
    return {
        change: paired_walks(*policy_and_settings("schedule", {}), change, range(2), strides=4, threads=1)
        for change in (0.0, CHANGE)
    }


def control(data):
    """(side, (ankle, toe), (K, K theta_eq))."""
    return data.ctrl.reshape(len(SIDES), len(JOINTS), 2)[:, FEET]


def test_the_torque_changes_by_the_spring_law_with_theta_eq_kept(states):
    model, found = states
    beta = damping_times(Body())[FEET]
    for _, data in found:
        angle, velocity = (each[3:].reshape(len(SIDES), len(JOINTS))[:, FEET] for each in (data.qpos, data.qvel))
        stiffness, drive = np.moveaxis(control(data), -1, 0)
        expected = CHANGE * stiffness * (drive / stiffness - angle - beta * velocity)
        assert step_at(model, data, CHANGE)[0] == pytest.approx(expected, abs=1e-10)


def test_mass_times_the_coms_acceleration_is_the_ground_reaction_force(states):
    model, found = states
    for _, data in found:
        acceleration = step_at(model, data, CHANGE)[1]
        force = data.sensordata.reshape(-1, 3).sum(0)[[0, 2]]
        for spring in np.ndindex(len(SIDES), len(SPRINGS)):
            other = copy(data)
            control(other)[spring] *= 1.0 + CHANGE
            mujoco.mj_forward(model, other)
            change = other.sensordata.reshape(-1, 3).sum(0)[[0, 2]] - force
            assert Body().mass * acceleration[spring] == pytest.approx(change, abs=1e-7)


@pytest.mark.parametrize(("step", "tolerance"), [(0.002, 0.03), (1e-6, 1e-3)])
def test_the_coms_acceleration_is_what_one_physics_step_shows(states, step, tolerance):
    model, found = states
    short = copy(model)
    short.opt.timestep = step

    def velocity(start):
        data = copy(start)
        mujoco.mj_step(short, data)
        mujoco.mj_forward(short, data)
        mujoco.mj_subtreeVel(short, data)
        return data.subtree_linvel[model.body("trunk").id][[0, 2]]

    for _, data in found:
        acceleration = step_at(model, data, CHANGE)[1]
        for spring in np.ndindex(len(SIDES), len(SPRINGS)):
            other = copy(data)
            control(other)[spring] *= 1.0 + CHANGE
            shown = (velocity(other) - velocity(data)) / step
            assert shown == pytest.approx(acceleration[spring], rel=tolerance, abs=2e-3)


def test_no_change_at_a_fixed_state_gives_exactly_nothing_and_leaves_it_as_it_was(states):
    model, found = states
    for _, data in found:
        before = data.ctrl.copy(), data.qpos.copy(), data.qvel.copy()
        torque, acceleration = step_at(model, data, 0.0)
        assert not torque.any() and not acceleration.any()
        step_at(model, data, CHANGE)
        for was, now in zip(before, (data.ctrl, data.qpos, data.qvel), strict=True):
            assert np.array_equal(was, now)


def test_a_mirrored_state_has_the_mirrored_change(states):
    model, found = states
    for _, data in found:
        mirrored = copy(data)
        for values in (mirrored.qpos[3:], mirrored.qvel[3:], mirrored.ctrl):
            values[:] = values.reshape(len(SIDES), -1)[::-1].ravel()
        for own, other in zip(step_at(model, data, CHANGE), step_at(model, mirrored, CHANGE), strict=True):
            assert other[::-1] == pytest.approx(own, rel=1e-6, abs=1e-7)


def test_a_step_of_the_action_multiplies_stiffness():
    body = Body(1.9, 95.0)
    settings = BipedSettings(height=1.9, mass=95.0)
    stiffness = np.array([200.0, 30.0])
    action = action_of(stiffness, settings, body) + action_step(settings, body, 0.25)
    assert stiffness_of(action, settings, body) == pytest.approx(1.25 * stiffness)
    assert np.exp(action_step(BipedSettings(action_mode="residual"), body, 0.25)) == pytest.approx([1.25, 1.25])


def test_stiffness_changes_in_its_joint_phase_leg_and_strides_alone():
    _, settings = policy_and_settings("schedule", {"decisions": "100hz"})
    copies = 1 + len(CELLS) * len(DURATIONS)
    biped = Biped(settings, copies, 1)
    biped.reset(np.arange(copies), [0] * copies)
    changes, ticks = _Changes(action_step(settings, biped.body, CHANGE), 1), []
    biped.on_tick = ticks.append
    stride, phase = np.zeros(copies, int), leg_phase(biped.observe())
    for _ in range(260):
        scheduled = biped.scheduled_stiffness()
        action = action_of(scheduled, settings, biped.body).reshape(copies, -1) + changes.added(phase, stride)
        observation = biped.step(action).observation
        ratio = ticks[-1].stiffness[..., FEET] / scheduled
        expected = np.ones_like(ratio)
        for row, ((joint, name), duration) in enumerate(product(CELLS, DURATIONS), start=1):
            begin, end = PHASES[name]
            for side in range(len(SIDES)):
                due = stride[row] == 0 and side == 0 if duration == "one stride" else True
                if due and begin <= phase[row, side] < end:
                    expected[row, side, joint] = 1.0 + CHANGE
        assert ratio == pytest.approx(expected, rel=1e-9)
        before, phase = phase, leg_phase(observation)
        stride += phase[:, 0] < before[:, 0]
    assert stride.min() >= 1


@pytest.mark.slow
def test_no_change_of_stiffness_changes_nothing_to_the_last_bit(pairs):
    same = pairs[0.0]
    assert not same.fixed.any() and not same.velocity.any() and not same.movement.any()
    assert np.array_equal(same.unchanged, pairs[CHANGE].unchanged)


@pytest.mark.slow
def test_walks_move_where_springs_carry_load_and_not_in_swing(pairs):
    walks = pairs[CHANGE]
    speed = walks.movement[..., 0, MOVEMENT.index("speed_m_s")].mean(-1)  # (C, durations) of the first stride
    cell = {(SPRINGS[joint], name): speed[c] for c, (joint, name) in enumerate(CELLS)}
    assert (cell["ankle", "push-off"] > 5e-3).all() and (cell["ankle", "late mid-stance"] < -2e-3).all()
    assert (cell["toe", "push-off"] > 1e-3).all()
    for joint in SPRINGS:
        assert np.abs(cell[joint, "swing"]).max() < 3e-4
    torque = walks.fixed[..., FIXED.index("torque_Nm")].mean(-1)
    assert torque[CELLS.index((0, "heel-off"))] == pytest.approx(7.6, abs=0.5)  # N m, a tenth of the spring's own
    assert not walks.unfinished.any() and not walks.cut.any()


@pytest.mark.slow
def test_the_impulse_is_acceleration_times_the_phase_and_foretells_the_velocity_at_its_end(pairs):
    walks = pairs[CHANGE]
    fixed: dict[str, Any] = dict(zip(FIXED, np.moveaxis(walks.fixed.mean(1), -1, 0), strict=True))
    ahead = walks.unchanged[..., MOVEMENT.index("com_ahead_m")]
    period = np.diff(ahead).mean() / walks.unchanged[..., MOVEMENT.index("speed_m_s")].mean()
    seconds = period * np.array([end - begin for begin, end in (PHASES[name] for _, name in CELLS)])
    for direction in ("forward", "upward"):
        expected = fixed[f"{direction}_m_s2"] * seconds
        tick = 0.01 * np.abs(fixed[f"{direction}_m_s2"])  # a phase holds whole ticks, one more or less than its share
        assert (np.abs(fixed[f"{direction}_m_s"] - expected) < tick + 1e-4).all()
    assert 0.7 < np.corrcoef(fixed["forward_m_s"], walks.velocity.mean(1))[0, 1] < 0.95


@pytest.mark.slow
def test_the_coms_lead_after_a_stride_is_its_speed_times_the_strides_time(pairs):
    walks = pairs[CHANGE]
    speed, ahead = (walks.movement[:, 1, :, 0, MOVEMENT.index(name)] for name in ("speed_m_s", "com_ahead_m"))
    assert np.corrcoef(speed.ravel(), ahead.ravel())[0, 1] > 0.99
    assert np.polyfit(speed.ravel(), ahead.ravel(), 1)[0] == pytest.approx(1.09, abs=0.15)


@pytest.mark.slow
def test_steps_as_long_as_strides_are_fast(pairs):
    speed, length, ahead, height = np.moveaxis(pairs[CHANGE].unchanged, -1, 0)
    stride = np.diff(ahead, axis=1)
    assert 2 * length.mean() == pytest.approx(stride.mean(), rel=0.01)
    assert speed.mean() == pytest.approx(1.19, abs=0.03) and height.mean() == pytest.approx(0.973, abs=0.01)


@pytest.mark.slow
def test_walks_that_fall_cannot_be_compared():
    policy, settings = policy_and_settings("random", {})
    with pytest.raises(SpringfootError, match="of 2 unchanged walks fewer than two stay up"):
        paired_walks(policy, settings, CHANGE, range(2), strides=4, threads=1)
