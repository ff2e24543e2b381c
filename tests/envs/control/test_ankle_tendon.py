"""The tendon bounds the ankle's K, in tables and in steps, and the reward charges the calf's own K."""

import numpy as np
import pytest

from springfoot.envs import Biped
from springfoot.envs.batch.step_result import INFO
from springfoot.envs.control.equilibrium import foot_tables
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.reference_walk import reference_walks, rows
from springfoot.envs.control.stiffness_control import stiffness_ranges
from springfoot.envs.physics.model import ANKLE, KNEE, LEFT, SIDES
from springfoot.envs.settings.settings import settings_from
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.gait.body.tissue import (
    RELAXED_STIFFNESS,
    STIFFNESS_PER_TORQUE,
    TENDON_SHARE,
    ankle_tissue_stiffness,
)


def tissue(biped):
    angle = biped.measurement.angle
    return biped.body.stiffness_scale * ankle_tissue_stiffness(angle[..., KNEE], angle[..., ANKLE])


@pytest.mark.parametrize("delay", [0.0, 0.02])
@pytest.mark.parametrize("mass", [63.0, 90.0])
def test_k_is_at_most_that_of_tendon_and_tissue_in_every_window_on_any_action(mass, delay):
    tendon = 300.0
    settings = settings_from(ankle_tendon=tendon, mass=mass, stiffness_delay_s=delay, episode_seconds=4.0)
    biped, random = Biped(settings, 5), np.random.default_rng(0)
    biped.reset(np.arange(5), list(range(5)))
    bounds, held = [tissue(biped)], []

    def keep(tick):
        held.append(tick.stiffness[..., ANKLE])
        bounds.append(tissue(biped))

    biped.on_tick = keep
    for _ in range(60):
        biped.step(random.uniform(0.0, 1.0, (5, 4)))
    most = biped.body.stiffness_scale * TENDON_SHARE * tendon + np.stack(bounds[:-1])
    assert (np.stack(held) <= most * (1 + 1e-12)).all()
    assert (np.stack(held) > 0.999 * most).sum() > 100


@pytest.mark.parametrize("name", ["pretrained", "predicted"])
def test_k_stays_below_tendon_and_tissue_at_every_step_of_five_walks(name):
    act, settings = policy_and_settings(name, {"ankle_tendon": 400.0, "episode_seconds": 5.0})
    biped = Biped(settings, 5)
    biped.reset(np.arange(5), list(range(5)))
    observation = biped.observe()
    for _ in range(200):
        result = biped.step(act(observation))
        observation = result.observation
        applied = np.stack([result.info[f"stiffness/ankle_{side}"] for side in SIDES], -1)
        assert (applied <= 400.0 + tissue(biped)).all()


def test_a_tendon_that_is_stiff_enough_changes_nothing():
    walked = []
    for tendon in (None, 2000.0):
        act, settings = policy_and_settings("schedule", {"ankle_tendon": tendon, "episode_seconds": 2.0})
        biped = Biped(settings, 1)
        biped.reset(np.array([0]), [0])
        observation = biped.observe()
        for _ in range(80):
            observation = biped.step(act(observation)).observation
        walked.append(observation)
    np.testing.assert_array_equal(*walked)


def test_fed_moments_give_the_same_torque_at_the_planned_angle_whatever_bounds_k():
    ticks = []
    for tendon in (None, 150.0):
        biped = Biped(settings_from(guide="plan", person="tuned", ankle_tendon=tendon, start=0.45), 1)
        biped.on_tick = ticks.append
        biped.reset(np.array([0]), [0])
        biped.step(np.ones((1, 4)))
    free, bound = ticks[0], ticks[2]  # the first window of each, from the same state
    stiffness, equilibrium = (
        np.array([getattr(tick, name)[0, 0, ANKLE] for tick in (free, bound)]) for name in ("stiffness", "equilibrium")
    )
    assert stiffness[1] < stiffness[0] - 50.0
    settings = settings_from(guide="plan")
    rest, _ = foot_tables(settings, rows(reference_walks(settings)))
    planned, torque = (np.interp(0.45, GRID, rest[0, :, column]) for column in (0, 2))
    np.testing.assert_allclose(stiffness * (equilibrium - planned), torque, rtol=1e-3)


def test_the_reward_charges_the_calfs_own_k_beyond_what_its_torque_brings():
    settings = settings_from(ankle_tendon=400.0, stiffness_joints="ankle", episode_seconds=4.0)
    biped = Biped(settings, 1)
    biped.reset(np.array([0]), [0])
    for _ in range(40):
        result = biped.step(np.array([[0.6, 0.0, 0.6, 0.0]]))
        info = {name: value[0] for name, value in result.info.items()}
        charged = 0.0
        for side, name in enumerate(SIDES):
            together = min(max(info[f"stiffness/ankle_{name}"] - tissue(biped)[0, side], 0.0), TENDON_SHARE * 400.0)
            torque = abs(biped._simulation.arrays.bodies["muscles"]["moment"][0, 0, side, ANKLE])
            in_series = together * 400.0 / (400.0 - together)
            own = in_series - RELAXED_STIFFNESS - STIFFNESS_PER_TORQUE * torque
            toe = info[f"stiffness/toe_{name}"]
            charged += 0.5 * ((max(own, 0.0) / 300.0) ** 2 + 0.25 * (toe / 60.0) ** 2) / 1.25
        assert info["reward/stiffness"] == pytest.approx(charged, rel=1e-12)


def test_a_tendon_neither_bounds_nor_prices_an_adaptive_prosthesis():
    charged = []
    for tendon in (None, 150.0):
        biped = Biped(settings_from(ankle_tendon=tendon, right_foot="adaptive", left_foot="adaptive"), 1)
        biped.reset(np.array([0]), [0])
        result = biped.step(np.ones((1, 4)))
        named = dict(zip(INFO, result.values[0], strict=True))
        assert named["stiffness/ankle_right"] == pytest.approx(stiffness_ranges(biped.settings, biped.body)[1][0])
        charged.append(named["reward/stiffness"])
    assert charged[0] == charged[1] > 1.0


def test_a_tendon_bounds_the_calf_beside_an_adaptive_prosthesis():
    biped = Biped(settings_from(ankle_tendon=150.0, right_foot="adaptive"), 1)
    biped.reset(np.array([0]), [0])
    most = biped.body.stiffness_scale * TENDON_SHARE * 150.0 + tissue(biped)[0, LEFT]
    info = biped.step(np.ones((1, 4))).info
    assert info["stiffness/ankle_left"][0] <= most < info["stiffness/ankle_right"][0]
