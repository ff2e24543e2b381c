"""When stiffness is decided, and of which joints."""

from typing import Any

import numpy as np
import pytest

from springfoot.agents.training.config import TrainingConfig
from springfoot.agents.training.ppo import Learner
from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.decision_times import planned_events
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.stiffness_control import stiffness_of
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json
from springfoot.evaluation.recording.recording import record
from springfoot.gait.body.body import Body
from springfoot.gait.springs.stiffness import StiffnessSchedule, thesis_schedule

RATES: dict[str, int] = {"100hz": 100, "50hz": 50, "25hz": 25}


def settings(**values: Any) -> BipedSettings:
    return settings_from(**values)


def begun(num: int = 3, **values: Any) -> Biped:
    biped = Biped(settings(**values), num)
    biped.reset(np.arange(num), range(num))
    return biped


def test_a_stiffness_that_never_changes_is_the_same_walk_however_often_it_is_decided():
    action, walks = np.tile([0.4, 0.1, 0.4, 0.1], (3, 1)), []
    for rate, steps in RATES.items():
        biped = begun(decisions=rate)
        assert biped.dt == pytest.approx(1 / steps)
        for _ in range(steps):
            result = biped.step(action)
        assert result.info["time"] == pytest.approx(1.0)
        walks.append(np.stack([biped.data(index).qpos for index in range(3)]))
    np.testing.assert_array_equal(walks[0], walks[1])
    np.testing.assert_array_equal(walks[0], walks[2])


def test_returns_are_of_time_and_not_of_steps():
    returns = []
    no_forces = {"grf": 0.0, "zmp": 0.0}  # they are of means over a step, which differ with its length
    for rate, steps in RATES.items():
        biped = begun(decisions=rate, episode_seconds=1.0, reward_weights=no_forces)
        results = [biped.step(np.full((3, 4), 0.3)) for _ in range(steps)]
        assert results[-1].truncated.all()
        returns.append(np.sum([result.reward for result in results], axis=0))
    np.testing.assert_allclose(returns[0], returns[1], rtol=0.01)
    np.testing.assert_allclose(returns[2], returns[1], rtol=0.02)


@pytest.mark.parametrize("rate", RATES)
def test_the_cost_of_changing_stiffness_is_of_time_and_not_of_steps(rate):
    biped, steps, costs = begun(decisions=rate), RATES[rate], []
    for step in range(steps):
        result = biped.step(np.full((3, 4), 0.3 + 0.2 * (step + 1) / steps))
        costs.append(result.info["reward/stiffness_rate"])
    np.testing.assert_allclose(costs[1:], 4 * (0.2 * 0.02) ** 2, rtol=1e-9)  # 0.2 a second, four actions, per 20 ms


@pytest.mark.parametrize("rate", RATES)
def test_a_recording_has_the_same_ticks_at_every_rate(rate):
    walk = record(
        lambda seen: np.zeros((len(seen), 4)), settings(decisions=rate, episode_seconds=0.36), name="x", episodes=2
    )
    assert (walk.ticks == 36).all()
    assert np.isfinite(walk.series["angle"]).all()


def test_training_discounts_by_time():
    for rate, steps in (("100hz", 0.5), ("25hz", 2.0)):
        config = TrainingConfig(num_envs=2, update_steps=64, environment=settings(decisions=rate))
        environments = SegmentedFootBipedVecEnv(2, **settings_to_json(config.environment))
        ppo = Learner(config, environments, 0).ppo
        assert ppo.gamma == pytest.approx(0.98**steps) and ppo.gae_lambda == pytest.approx(0.95**steps)
        environments.close()


def test_per_event_each_leg_takes_a_new_action_at_its_events_alone():
    biped, random, names = begun(num=4, decisions="event"), np.random.default_rng(0), ("left", "right")
    events = planned_events(biped.target)
    assert (np.diff(events) > 0.03).all() and events[0] == 0.0 and events[-1] == biped.target.toe_off
    before: Any = None
    changes, running = np.zeros((2, 4), int), np.ones(4, bool)
    for _ in range(100):
        phase = biped.leg_phase
        action = random.uniform(0.2, 0.6, (4, 4))
        result = biped.step(action, running)
        k = np.stack([[result.info[f"stiffness/{joint}_{side}"] for joint in ("ankle", "toe")] for side in names])
        wanted = np.moveaxis(stiffness_of(action.reshape(4, 2, 2), biped.settings, biped.body), 0, -1)
        if before is not None:
            passed = (np.searchsorted(events, phase, "right") != np.searchsorted(events, before[0], "right")).T
            expected = np.where((passed & running)[:, None], wanted, before[1])
            np.testing.assert_allclose(k, expected, rtol=1e-12)
            changes += passed & running
        else:
            np.testing.assert_allclose(k, wanted, rtol=1e-12)
        before = np.where(running[:, None], phase, before[0] if before else phase), k
        running = running & ~result.terminated
    assert (changes[:, running] >= 6).all() and running.any()  # 2 s: nearly two strides of four events


def test_an_action_that_is_not_taken_is_still_checked():
    biped = begun(decisions="event")
    biped.step(np.zeros((3, 4)))
    with pytest.raises(Exception, match="NaN"):
        biped.step(np.full((3, 4), np.nan))


@pytest.mark.parametrize("mode", ["absolute", "residual"])
@pytest.mark.parametrize(("joint", "other"), [("ankle", "toe"), ("toe", "ankle")])
def test_the_joint_that_is_not_decided_follows_the_fixed_schedule(mode, joint, other):
    biped, twin = (begun(action_mode=mode, stiffness_joints=joint) for _ in range(2))
    free = begun(action_mode=mode)
    action, column = np.full((3, 4), 0.4), ("ankle", "toe").index(other)
    other_action = action.copy()
    other_action[:, [column, column + 2]] = -1.0
    for _ in range(20):
        fixed = biped.scheduled_stiffness()[:, 0, column]
        result, same = biped.step(action), twin.step(other_action)
        np.testing.assert_allclose(result.info[f"stiffness/{other}_left"], fixed, rtol=1e-12)
        np.testing.assert_array_equal(result.observation, same.observation)
        np.testing.assert_array_equal(result.reward, same.reward)
    ours = begun(action_mode=mode, stiffness_joints=joint).step(action).info[f"stiffness/{joint}_left"]
    np.testing.assert_array_equal(ours, free.step(action).info[f"stiffness/{joint}_left"])


@pytest.mark.parametrize("rate", RATES)
def test_a_schedules_rest_angle_changes_with_its_stiffness(rate):
    schedule = thesis_schedule(Body())
    biped = begun(decisions=rate, equilibrium="phase", action_mode="residual", schedule=schedule.to_json())
    (stiffness,), (rest,) = (np.split(each, 1) for each in StiffnessSchedule.from_json(schedule.to_json()).at(GRID))
    inside = np.ones(len(GRID), bool)  # where the table is not on its way from one segment to the next
    for curve in (stiffness, rest):
        inside &= (np.roll(curve, -1, axis=0) == curve).all(1)
    held: list[tuple[np.ndarray, np.ndarray]] = []
    biped.on_tick = lambda tick: held.append((tick.stiffness[0, 0, 2:].copy(), tick.equilibrium[0, 0, 2:].copy()))
    for _ in range(RATES[rate] // 2):
        spot = int(biped.leg_phase[0, 0] * len(GRID))
        held.clear()
        biped.step(np.zeros((3, 4)))
        if inside[spot]:
            for k, theta in held:
                np.testing.assert_allclose(k, stiffness[spot], rtol=1e-9)
                np.testing.assert_allclose(theta, rest[spot], rtol=1e-9, atol=1e-12)
