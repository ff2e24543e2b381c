"""Training to time: our recipe and that of the first throw-away study, end to end; and the gain of planning."""

from dataclasses import replace
from functools import partial
from time import perf_counter

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from springfoot.agents.training.config import PRESETS
from springfoot.agents.training.ppo import Learner
from springfoot.agents.training.sb3_vec_env import SegmentedFootBipedVecEnv
from springfoot.envs.settings.settings import body_of, settings_to_json
from springfoot.gait.body.body import Body
from springfoot.gait.plan.plan import plan_walk
from springfoot.gait.plan.posture import leg_angles

from .environments import OURS
from .timing import Case
from .walking import STEP

PLANS_PER_TRAINING = 2
"""Batches that a training makes, and each plans once: one to train on, one for the periodic evaluations."""


def our_training(threads: int, update_steps: int | None = None) -> Case:
    """Return one update of the default training: rollout, normalisation, PPO's epochs."""
    config = PRESETS["walk"]
    config = replace(config, update_steps=update_steps or config.update_steps)
    settings = settings_to_json(config.environment)
    environments = SegmentedFootBipedVecEnv(config.num_envs, num_threads=threads, **settings)
    learner = Learner(config, environments, config.seed)
    samples = learner.rollout_steps * config.num_envs
    run = partial(learner.ppo.learn, samples, reset_num_timesteps=False)
    return Case(name="PPO, ours", samples=samples, seconds=STEP, run=run, close=environments.close)


def study_training(steps: int = 512) -> Case:
    """Return one update of the study's recipe: 8 environments in a DummyVecEnv, `steps` each, batch 512, 8 epochs.

    Its other numbers: discount .98, lambda .95, clip .2, step size 3e-4, 64 x 64 tanh, log_std -.7, one torch thread.
    """
    torch.set_num_threads(1)
    settings = settings_to_json(PRESETS["walk"].environment)
    environments = VecNormalize(DummyVecEnv([partial(gym.make, OURS, **settings)] * 8), gamma=0.98)
    ppo = PPO(
        "MlpPolicy",
        environments,
        n_steps=steps,
        batch_size=min(512, 8 * steps),
        n_epochs=8,
        gamma=0.98,
        gae_lambda=0.95,
        policy_kwargs={"net_arch": [64, 64], "activation_fn": torch.nn.Tanh, "log_std_init": -0.7},
        seed=0,
        device="cpu",
    )
    run = partial(ppo.learn, 8 * steps, reset_num_timesteps=False)
    return Case(name="PPO, the study's recipe", samples=8 * steps, seconds=STEP, run=run, close=environments.close)


def planning_seconds(repeats: int) -> float:
    """Median time [s] of planning a walk."""
    settings = PRESETS["walk"].environment
    taken = []
    for _ in range(repeats):
        begin = perf_counter()
        plan_walk(body_of(settings), settings.speed, settings.cadence)
        taken.append(perf_counter() - begin)
    return float(np.median(taken))


def kinematics_over_sine(repeats: int, legs: int = 64_000) -> float:
    """Time of the inverse kinematics of `legs` legs over that of `np.sin` of as many numbers: median of pairs."""
    body = Body()
    random = np.random.default_rng(0)
    forward = random.uniform(-0.4, 0.4, legs)
    down = random.uniform(0.6, 0.78, legs)
    ratios = []
    for _ in range(repeats):
        begin = perf_counter()
        leg_angles(forward, down, body.thigh_length, body.shank_length)
        middle = perf_counter()
        np.sin(forward)
        ratios.append((middle - begin) / (perf_counter() - middle))
    return float(np.median(ratios))
