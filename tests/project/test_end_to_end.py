"""The road of one number from the policy to the report, and the same bits on every way in."""

import csv
import inspect
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from springfoot.agents.policies.baselines import baseline, leg_phase
from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs import Biped, BipedSettings, SegmentedFootBiped, SegmentedFootBipedVector
from springfoot.envs.batch.biped_batch import Tick
from springfoot.envs.physics.model import ANKLE, LEFT
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.report import write_gait_cycle

SETTINGS = BipedSettings(episode_seconds=7.0)
STANCE, SWING, TOE_OFF = 0.45, -0.1, 0.65
"""Action of the left ankle before and after this phase of its stride."""


def n_m_per_rad(action):
    """What an ankle's action stands for, written out: from 20 to 800 N m/rad on a log scale."""
    return 20.0 * 40.0 ** ((action + 1) / 2)


class TwoLevels:
    """The fixed schedule, but for the left ankle; remembers what it asked that one for."""

    def __init__(self):
        self._schedule = baseline("schedule", SETTINGS)
        self.asked: list[float] = []

    def __call__(self, observation):
        actions = self._schedule(observation)
        actions[:, 0] = np.where(leg_phase(observation)[:, LEFT] < TOE_OFF, STANCE, SWING)
        self.asked.append(float(actions[0, 0]))
        return actions


def test_one_number_is_the_same_at_every_station(tmp_path):
    """Policy -> N m/rad -> ctrl -> tick and joint torque -> info -> recording -> percent of the stride -> csv."""
    biped, policy = Biped(SETTINGS, 1), TwoLevels()
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    biped.reset(np.array([0]), [0])
    spring, drive = (biped.model.actuator(f"{half}_ankle_left").id for half in ("stiffness", "drive"))
    stiffness = []
    for _ in range(350):
        result = biped.step(policy(biped.observe()))
        assert not result.terminated[0]
        k = n_m_per_rad(policy.asked[-1])
        stiffness += [k, k]
        assert result.info["stiffness/ankle_left"][0] == pytest.approx(k, rel=1e-6)  # actions are float32
        k = result.info["stiffness/ankle_left"][0]
        data, now, before = biped.data(0), ticks[-1], ticks[-2]
        assert data.ctrl[spring] == now.stiffness[0, LEFT, ANKLE] == before.stiffness[0, LEFT, ANKLE] == k
        assert data.ctrl[drive] == pytest.approx(k * now.equilibrium[0, LEFT, ANKLE], rel=1e-12)
        m = now.measurement
        deflection = now.equilibrium[0, LEFT, ANKLE] - m.angle[0, LEFT, ANKLE] - 0.02 * m.velocity[0, LEFT, ANKLE]
        assert np.abs(deflection * k) < 200.0
        assert m.torque[0, LEFT, ANKLE] == pytest.approx(k * deflection, abs=1e-9)
        assert result.info["torque/ankle_left"][0] == m.torque[0, LEFT, ANKLE]
        assert data.joint("ankle_left").qfrc_actuator[0] == pytest.approx(k * deflection, abs=1e-9)

    recording = record(TwoLevels(), SETTINGS, name="two levels", episodes=1)
    assert recording.ticks[0] == len(stiffness)
    np.testing.assert_allclose(recording.series["stiffness"][0, :, LEFT, 0], stiffness, rtol=1e-6)

    gait = measure(recording)
    write_gait_cycle(tmp_path / "gait_cycle_left.csv", gait.feet[LEFT], gait.metrics)
    with (tmp_path / "gait_cycle_left.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert int(rows[0]["n"]) >= 2
    column = np.array([float(row["ankle_stiffness_Nm_per_rad"]) for row in rows])
    np.testing.assert_allclose(column[10:55], n_m_per_rad(STANCE), rtol=1e-5)
    np.testing.assert_allclose(column[75:95], n_m_per_rad(SWING), rtol=1e-5)


# The same bits ------------------------------------------------------------------------------------------------

ROUGH: dict[str, Any] = {"episode_seconds": 1.6, "push_newton": 500.0, "push_interval": 1.0, "start_noise": 0.02}
"""Episodes that end both by falls and out of time."""
NUM, SEED, STEPS = 3, 20, 1000


def actions_of(step: int) -> np.ndarray:
    """Actions of a step (NUM, 4), the same for every way in."""
    return np.random.default_rng(step).uniform(-1, 1, (NUM, 4)).astype(np.float32)


@pytest.fixture(scope="module")
def alone() -> dict[str, np.ndarray]:
    """Each environment by itself, environment i seeded with SEED + i: what came of every step."""
    observation, reward = np.empty((STEPS, NUM, len(OBSERVATION)), np.float32), np.empty((STEPS, NUM))
    terminated, truncated = np.empty((2, STEPS, NUM), bool)
    for i in range(NUM):
        env = SegmentedFootBiped(**ROUGH)
        env.reset(seed=SEED + i)
        for step in range(STEPS):
            seen, reward[step, i], terminated[step, i], truncated[step, i], _ = env.step(actions_of(step)[i])
            observation[step, i] = env.reset()[0] if terminated[step, i] or truncated[step, i] else seen
    assert terminated.sum() > NUM and truncated.sum() > NUM
    return {"observation": observation, "reward": reward, "terminated": terminated, "truncated": truncated}


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_gives_the_bits_of_its_environments_alone(alone, threads):
    env = SegmentedFootBipedVector(NUM, autoreset_mode="SameStep", num_threads=threads, **ROUGH)
    env.reset(seed=SEED)
    for step in range(STEPS):
        results = env.step(actions_of(step))
        for name, result in zip(alone, results, strict=False):
            np.testing.assert_array_equal(result, alone[name][step], err_msg=f"{name}, step {step}")


def test_stable_baselines3_gets_the_same_bits(alone):
    env = SegmentedFootBipedVecEnv(NUM, num_threads=2, **ROUGH)
    env.seed(SEED)
    env.reset()
    for step in range(STEPS):
        observation, reward, done, _ = env.step(actions_of(step))
        np.testing.assert_array_equal(np.asarray(observation), alone["observation"][step])
        np.testing.assert_array_equal(reward, alone["reward"][step])
        np.testing.assert_array_equal(done, alone["terminated"][step] | alone["truncated"][step])
    env.close()


def digest(threads: int) -> str:
    """SHA-256 of what a batch sees and is rewarded with in 150 steps; a program by itself, for another process."""
    import hashlib

    import gymnasium as gym

    environments = gym.make_vec(
        "springfoot.envs:SegmentedFootBiped-v0", num_envs=3, num_threads=threads, push_newton=300.0
    )
    found, (seen, _) = hashlib.sha256(), environments.reset(seed=5)
    environments.action_space.seed(5)
    for _ in range(150):
        found.update(seen.tobytes())
        seen, reward, *_ = environments.step(environments.action_space.sample())
        found.update(reward.tobytes())
    return found.hexdigest()


def test_the_same_seed_gives_the_same_bits_in_another_process():
    """Which orders its sets by another hash."""
    other_hash = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    done = subprocess.run(
        [sys.executable, "-c", f"{inspect.getsource(digest)}\nprint(digest(2))"],
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONHASHSEED": other_hash},
        text=True,
    )
    digests = [digest(1), done.stdout.strip()]
    assert len(digests[0]) == 64
    assert digests[0] == digests[1]
