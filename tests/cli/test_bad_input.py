# ruff: noqa: E501  (a message a line)
"""Bad input of every kind: one printable line that says what was wrong and what is allowed, the same every time."""

import sys
from datetime import date
from decimal import Decimal

import numpy as np
import pytest

from springfoot.agents.training.config import TrainingConfig
from springfoot.cli.main import main
from springfoot.envs import SegmentedFootBiped, SegmentedFootBipedVector
from springfoot.envs.settings.settings import settings_from
from springfoot.gait import SpringfootError

# fmt: off
SETTINGS = [
    ({"height": "1"}, "height must be in [1, 2.3] m, got '1'"),
    ({"height": 10**400}, 'height must be in [1, 2.3] m, got inf'),
    ({"height": np.ones(2)}, 'height must be in [1, 2.3] m, got array([1., 1.])'),
    ({"height": 1j}, 'height must be in [1, 2.3] m, got 1j'),
    ({"mass": "1"}, "mass must be in [20, 250] kg, got '1'"),
    ({"mass": 10**400}, 'mass must be in [20, 250] kg, got inf'),
    ({"mass": np.ones(2)}, 'mass must be in [20, 250] kg, got array([1., 1.])'),
    ({"mass": 1j}, 'mass must be in [20, 250] kg, got 1j'),
    ({"speed": "1"}, "speed must be in [0.4, 2] m/s, got '1'"),
    ({"speed": 10**400}, 'speed must be in [0.4, 2] m/s, got inf'),
    ({"speed": np.ones(2)}, 'speed must be in [0.4, 2] m/s, got array([1., 1.])'),
    ({"speed": 1j}, 'speed must be in [0.4, 2] m/s, got 1j'),
    ({"friction": "1"}, "friction must be a finite number >= 0.4 and <= 1.2, got '1'"),
    ({"friction": 10**400}, 'friction must be a finite number >= 0.4 and <= 1.2, got infinity'),
    ({"friction": np.ones(2)}, 'friction must be a finite number >= 0.4 and <= 1.2, got array([1., 1.])'),
    ({"friction": 1j}, 'friction must be a finite number >= 0.4 and <= 1.2, got 1j'),
    ({"push_newton": "1"}, "push_newton must be a finite number >= 0 N, got '1'"),
    ({"push_newton": 10**400}, 'push_newton must be a finite number >= 0 N, got infinity'),
    ({"push_newton": np.ones(2)}, 'push_newton must be a finite number >= 0 N, got array([1., 1.])'),
    ({"push_newton": 1j}, 'push_newton must be a finite number >= 0 N, got 1j'),
    ({"episode_seconds": "1"}, "episode_seconds must be a finite number >= 0.02 s, got '1'"),
    ({"episode_seconds": 10**400}, 'episode_seconds must be a finite number >= 0.02 s, got infinity'),
    ({"episode_seconds": np.ones(2)}, 'episode_seconds must be a finite number >= 0.02 s, got array([1., 1.])'),
    ({"episode_seconds": 1j}, 'episode_seconds must be a finite number >= 0.02 s, got 1j'),
    ({"sensor_noise": "1"}, "sensor_noise must be a finite number >= 0 and <= 0.1 (observation units), got '1'"),
    ({"sensor_noise": 10**400}, 'sensor_noise must be a finite number >= 0 and <= 0.1 (observation units), got infinity'),
    ({"sensor_noise": np.ones(2)}, 'sensor_noise must be a finite number >= 0 and <= 0.1 (observation units), got array([1., 1.])'),
    ({"sensor_noise": 1j}, 'sensor_noise must be a finite number >= 0 and <= 0.1 (observation units), got 1j'),
    ({"stiffness_delay_s": "1"}, "stiffness_delay_s must be a finite number >= 0 and <= 0.04 s, got '1'"),
    ({"stiffness_delay_s": 10**400}, 'stiffness_delay_s must be a finite number >= 0 and <= 0.04 s, got infinity'),
    ({"stiffness_delay_s": np.ones(2)}, 'stiffness_delay_s must be a finite number >= 0 and <= 0.04 s, got array([1., 1.])'),
    ({"stiffness_delay_s": 1j}, 'stiffness_delay_s must be a finite number >= 0 and <= 0.04 s, got 1j'),
    ({"start": np.ones(2)}, "start must be 'random', 'standing' or a stride phase in [0, 1), got array([1., 1.])"),
    ({"start": "x" * 400}, "start must be 'random', 'standing' or a stride phase in [0, 1), got 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."),
    ({"start": "a\nb\x1b[31m"}, "start must be 'random', 'standing' or a stride phase in [0, 1), got 'a\\nb\\x1b[31m'"),
    ({"start": [[1, 2], [3]]}, "start must be 'random', 'standing' or a stride phase in [0, 1), got ((1.0, 2.0), (3.0,))"),
    ({"start": 10**400}, "start must be 'random', 'standing' or a stride phase in [0, 1), got inf"),
    ({"equilibrium": np.ones(2)}, "equilibrium must be one of 'planned', 'angle', 'neutral', 'phase', got array([1., 1.])"),
    ({"equilibrium": "x" * 400}, "equilibrium must be one of 'planned', 'angle', 'neutral', 'phase', got 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."),
    ({"equilibrium": "a\nb\x1b[31m"}, "equilibrium must be one of 'planned', 'angle', 'neutral', 'phase', got 'a\\nb\\x1b[31m'"),
    ({"equilibrium": [[1, 2], [3]]}, "equilibrium must be one of 'planned', 'angle', 'neutral', 'phase', got ((1.0, 2.0), (3.0,))"),
    ({"equilibrium": 10**400}, "equilibrium must be one of 'planned', 'angle', 'neutral', 'phase', got inf"),
    ({"decisions": np.ones(2)}, "decisions must be one of '100hz', '50hz', '25hz', 'event', got array([1., 1.])"),
    ({"decisions": "x" * 400}, "decisions must be one of '100hz', '50hz', '25hz', 'event', got 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."),
    ({"decisions": "a\nb\x1b[31m"}, "decisions must be one of '100hz', '50hz', '25hz', 'event', got 'a\\nb\\x1b[31m'"),
    ({"decisions": [[1, 2], [3]]}, "decisions must be one of '100hz', '50hz', '25hz', 'event', got ((1.0, 2.0), (3.0,))"),
    ({"decisions": 10**400}, "decisions must be one of '100hz', '50hz', '25hz', 'event', got inf"),
    ({"ankle_stiffness_range": (1e-300, 1e300)}, 'ankle_stiffness_range must be within [0.001, 100000] N m/rad, got (1e-300, 1e+300)'),
    ({"ankle_stiffness_range": (1e299, 1e300)}, 'ankle_stiffness_range must be within [0.001, 100000] N m/rad, got (1e+299, 1e+300)'),
    ({"ankle_stiffness_range": (1e-4, 800.0)}, 'ankle_stiffness_range must be within [0.001, 100000] N m/rad, got (0.0001, 800.0)'),
    ({"ankle_stiffness_range": (20.0, 1e6)}, 'ankle_stiffness_range must be within [0.001, 100000] N m/rad, got (20.0, 1000000.0)'),
    ({"ankle_stiffness_range": [[1, 2], [3]]}, 'ankle_stiffness_range must be (low, high) with 0 < low < high N m/rad, got ((1.0, 2.0), (3.0,))'),
    ({"ankle_stiffness_range": np.ones(2)}, 'ankle_stiffness_range must be (low, high) with 0 < low < high N m/rad, got array([1., 1.])'),
    ({"ankle_stiffness_range": ("20", "800")}, "ankle_stiffness_range must be (low, high) with 0 < low < high N m/rad, got ('20', '800')"),
    ({"ankle_stiffness_range": (10**400, 1)}, 'ankle_stiffness_range must be (low, high) with 0 < low < high N m/rad, got (inf, 1.0)'),
    ({"toe_stiffness_range": (1e-300, 1e300)}, 'toe_stiffness_range must be within [0.001, 100000] N m/rad, got (1e-300, 1e+300)'),
    ({"toe_stiffness_range": (1e299, 1e300)}, 'toe_stiffness_range must be within [0.001, 100000] N m/rad, got (1e+299, 1e+300)'),
    ({"toe_stiffness_range": (1e-4, 800.0)}, 'toe_stiffness_range must be within [0.001, 100000] N m/rad, got (0.0001, 800.0)'),
    ({"toe_stiffness_range": (20.0, 1e6)}, 'toe_stiffness_range must be within [0.001, 100000] N m/rad, got (20.0, 1000000.0)'),
    ({"toe_stiffness_range": [[1, 2], [3]]}, 'toe_stiffness_range must be (low, high) with 0 < low < high N m/rad, got ((1.0, 2.0), (3.0,))'),
    ({"toe_stiffness_range": np.ones(2)}, 'toe_stiffness_range must be (low, high) with 0 < low < high N m/rad, got array([1., 1.])'),
    ({"toe_stiffness_range": ("20", "800")}, "toe_stiffness_range must be (low, high) with 0 < low < high N m/rad, got ('20', '800')"),
    ({"toe_stiffness_range": (10**400, 1)}, 'toe_stiffness_range must be (low, high) with 0 < low < high N m/rad, got (inf, 1.0)'),
    ({"speed_range": np.ones(2)}, 'speed_range must be (low, high) with 0 < low < high m/s, got array([1., 1.])'),
    ({"speed_range": (1j, 2)}, 'speed_range must be (low, high) with 0 < low < high m/s, got (1j, 2.0)'),
    ({"speed_range": (None, 1)}, 'speed_range must be (low, high) with 0 < low < high m/s, got (None, 1.0)'),
    ({"speed_range": [[1, 2], [3]]}, 'speed_range must be (low, high) with 0 < low < high m/s, got ((1.0, 2.0), (3.0,))'),
    ({"speed_range": "x" * 400}, "speed_range must be (low, high) with 0 < low < high m/s, got 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."),
    ({"speed_range": (1.0, 10**400)}, 'speed_range must be (low, high) with 0 < low < high m/s, got (1.0, inf)'),
    ({"slope_range_deg": np.ones(2)}, 'slope_range_deg must be (low, high) with low < high in [-5, 5] deg, got array([1., 1.])'),
    ({"slope_range_deg": (1j, 2)}, 'slope_range_deg must be (low, high) with low < high in [-5, 5] deg, got (1j, 2.0)'),
    ({"slope_range_deg": (None, 1)}, 'slope_range_deg must be (low, high) with low < high in [-5, 5] deg, got (None, 1.0)'),
    ({"slope_range_deg": [[1, 2], [3]]}, 'slope_range_deg must be (low, high) with low < high in [-5, 5] deg, got ((1.0, 2.0), (3.0,))'),
    ({"slope_range_deg": "x" * 400}, "slope_range_deg must be (low, high) with low < high in [-5, 5] deg, got 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."),
    ({"slope_range_deg": (1.0, 10**400)}, 'slope_range_deg must be (low, high) with low < high in [-5, 5] deg, got (1.0, inf)'),
    ({"height_range": np.ones(2)}, 'height_range must be (low, high) with 0 < low < high m, got array([1., 1.])'),
    ({"height_range": (1j, 2)}, 'height_range must be (low, high) with 0 < low < high m, got (1j, 2.0)'),
    ({"height_range": (None, 1)}, 'height_range must be (low, high) with 0 < low < high m, got (None, 1.0)'),
    ({"height_range": [[1, 2], [3]]}, 'height_range must be (low, high) with 0 < low < high m, got ((1.0, 2.0), (3.0,))'),
    ({"height_range": "x" * 400}, "height_range must be (low, high) with 0 < low < high m, got 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."),
    ({"height_range": (1.0, 10**400)}, 'height_range must be (low, high) with 0 < low < high m, got (1.0, inf)'),
    ({"reward_weights": {"alive": 1e308}}, "reward_weights['alive'] must be a finite number >= -1e+06 and <= 1e+06, got 1e+308"),
    ({"reward_weights": {"stiffness": -1e308}}, "reward_weights['stiffness'] must be a finite number >= -1e+06 and <= 1e+06, got -1e+308"),
    ({"reward_weights": {"alive": np.ones(2)}}, "reward_weights['alive'] must be a finite number >= 0 (a reward), got array([1., 1.])"),
    ({"reward_weights": {"alive": 10**400}}, "reward_weights['alive'] must be a finite number >= 0 (a reward), got 100000000000000000000000000000000000000000000000000000000..."),
    ({"reward_weights": {"alive": "1"}}, "reward_weights['alive'] must be a finite number >= 0 (a reward), got '1'"),
    ({"reward_weights": {"alive": 1j}}, "reward_weights['alive'] must be a finite number >= 0 (a reward), got 1j"),
    ({"reward_weights": "a\nb\x1b[31m"}, "reward_weights must map names of reward terms to numbers, got 'a\\nb\\x1b[31m'"),
    ({"reward_weights": {"a\x1b[31m": 1.0}}, "reward_weights has no term 'a\\x1b[31m'; valid: alive, speed, com_x, com_z, zmp, pose, grf, stiffness_rate, stiffness, effort, fibre_work, activation, impact, speed_held, person_rate, acceleration, step_length, activation_rate"),
    ({"episode_seconds": 1e308}, 'episode_seconds must be a finite number >= 0 and <= 1e+09 s, got 1e+308'),
    ({"push_newton": 1e308}, 'push_newton must be a finite number >= 0 and <= 1e+05 N, got 1e+308'),
    ({"push_interval": 1e-300}, 'push_seconds must be a finite number > 0 and <= 1e-300 s (push_interval), got 0.1'),
    ({"push_seconds": 1e-300, "push_interval": 0.0}, 'push_interval must be a finite number > 0 s, got 0.0'),
    ({"speed_rate": 10**400}, 'speed_rate must be a finite number > 0 m/s^2, got infinity'),
    ({"stop_at": "1"}, "stop_at must be a finite number >= 0 s, got '1'"),
    ({"start_noise": 1e308}, 'start_noise must be a finite number >= 0 and <= 1 (relative), got 1e+308'),
    ({"slope_deg": 1j}, 'slope_deg must be a finite number >= -5 and <= 5 deg, got 1j'),
    ({"schedule": "a\nb\x1b[31m"}, "a stiffness schedule must be an object with keys ankle and toe, got 'a\\nb\\x1b[31m'"),
    ({"schedule": {"ankle": [[0, 1e300, 0]], "toe": [[0, 28, 0]]}}, 'ankle stiffness must be in [0, 100000] N m/rad, got 1e+300'),
    ({"human": 10**400}, 'human must be what springfoot.gait.read_gait(FILE).to_json() gives (mean, name, sd, speed, step_length, stride_time, strides, toe_off), got inf'),
    ({"unevenness_m": date(2020, 1, 1)}, 'unevenness_m must be a finite number >= 0 and <= 0.03 m, got datetime.date(2020, 1, 1)'),
    ({"height": Decimal("1.7")}, "height must be in [1, 2.3] m, got Decimal('1.7')"),
    ({"leg_ratio": "1"}, "leg_ratio must be in [0.94, 1.06] (relative), got '1'"),
    ({"carried_ratio": 1e300}, 'carried_ratio must be in [0, 0.4] (relative), got 1e+300'),
]
ACTIONS = [
    (["1", "0", "0", "0"], 'action must be real numbers, got text'),
    ([b"1", b"0", b"0", b"0"], 'action must be real numbers, got bytes'),
    (np.array(["1", 0, 0, 0], object), "action must be real numbers, got array(['1', 0, 0, 0], dtype=object)"),
    ([1j, 0, 0, 0], 'action must be real numbers, got complex numbers'),
    (np.zeros(4, complex), 'action must be real numbers, got complex numbers'),
    (np.zeros(4, "M8[s]"), 'action must be real numbers, got dates'),
    (np.zeros(4, "m8[s]"), 'action must be real numbers, got spans of time'),
    ([date(2020, 1, 1)] * 4, 'action must be real numbers, got [datetime.date(2020, 1, 1), datetime.date(2020, 1, 1), da...'),
    ([[1, 2], [3]], 'action must be real numbers, got rows of unequal length'),
    ([10**400, 0, 0, 0], 'action must be real numbers, got [10000000000000000000000000000000000000000000000000000000...'),
    ([-(10**400), 0, 0, 0], 'action must be real numbers, got [-1000000000000000000000000000000000000000000000000000000...'),
    ("abcd", 'action must be real numbers, got text'),
    ({}, 'action must be real numbers, got {}'),
    (None, 'action must have shape (4,), got ()'),
    (len, 'action must be real numbers, got <built-in function len>'),
    (np.zeros(4, [("a", float)]), 'action must be real numbers, got records'),
    ([None] * 4, 'actions must be finite numbers in [-1, 1], got NaN or infinity'),
    ([np.nan, 0, 0, 0], 'actions must be finite numbers in [-1, 1], got NaN or infinity'),
    ([0, np.inf, 0, 0], 'actions must be finite numbers in [-1, 1], got NaN or infinity'),
    (np.zeros(5), 'action must have shape (4,), got (5,)'),
    (np.zeros((1, 4)), 'action must have shape (4,), got (1, 4)'),
    (1.0, 'action must have shape (4,), got ()'),
    ([{}] * 4, 'action must be real numbers, got [{}, {}, {}, {}]'),
    ([[]] * 4, 'action must have shape (4,), got (4, 0)'),
]
OPTIONS = [
    (3, 'reset options must be a dictionary, got 3'),
    ([1], 'reset options must be a dictionary, got [1]'),
    ("x", "reset options must be a dictionary, got 'x'"),
    ({"reset": 1}, "unknown reset option 'reset'; valid: start, height, mass, speed, body, left_foot, right_foot"),
    ({"start": np.ones(2)}, "start must be 'random', 'standing' or a stride phase in [0, 1), got array([1., 1.])"),
    ({"start": "lying"}, "start must be 'random', 'standing' or a stride phase in [0, 1), got 'lying'"),
    ({"start": 10**400}, "start must be 'random', 'standing' or a stride phase in [0, 1), got 100000000000000000000000000000000000000000000000000000000..."),
    ({"height": [[1], [2, 3]]}, "reset option 'height' must be a number, or one for each of 1 environments, got [[1], [2, 3]]"),
    ({"height": 10**400}, "reset option 'height' must be a number, or one for each of 1 environments, got 100000000000000000000000000000000000000000000000000000000..."),
    ({"height": 1j}, "reset option 'height' must be a number, or one for each of 1 environments, got 1j"),
    ({"speed": "1.2"}, "reset option 'speed' must be a number, or one for each of 1 environments, got '1.2'"),
    ({"mass": np.array("2020", "M8[Y]")}, "reset option 'mass' must be a number, or one for each of 1 environments, got array('2020', dtype='datetime64[Y]')"),
    ({"mass": [60, 70]}, "reset option 'mass' must be a number, or one for each of 1 environments, got [60, 70]"),
    ({"height": np.nan}, 'height must be in [1, 2.3] m, got nan'),
    ({"a\x1b[31m": 1}, "unknown reset option 'a\\x1b[31m'; valid: start, height, mass, speed, body, left_foot, right_foot"),
]
SEEDS = [
    ("1", "seed must be a whole number >= 0 and <= 9223372036854775807, got '1'"),
    (1.5, 'seed must be a whole number >= 0 and <= 9223372036854775807, got 1.5'),
    (-1, 'seed must be a whole number >= 0 and <= 9223372036854775807, got -1'),
    (1j, 'seed must be a whole number >= 0 and <= 9223372036854775807, got 1j'),
    ([1, 2], 'seed must be a whole number >= 0 and <= 9223372036854775807, got [1, 2]'),
    (np.array([1]), 'seed must be a whole number >= 0 and <= 9223372036854775807, got array([1])'),
    (True, 'seed must be a whole number >= 0 and <= 9223372036854775807, got True'),
    (10**400, 'seed must be a whole number >= 0 and <= 9223372036854775807, got infinity'),
]
VECTORS = [
    ({"render_mode": np.ones(2)}, 'render_mode must be None or one of human, rgb_array, got array([1., 1.])'),
    ({"num_envs": 0}, 'num_envs must be a whole number >= 1 and <= 1000000, got 0'),
    ({"num_envs": 10**20}, 'num_envs must be a whole number >= 1 and <= 1000000, got 100000000000000000000'),
    ({"num_envs": "3"}, "num_envs must be a whole number >= 1 and <= 1000000, got '3'"),
    ({"num_envs": 2.5}, 'num_envs must be a whole number >= 1 and <= 1000000, got 2.5'),
    ({"num_threads": 99999999999}, 'num_threads must be a whole number >= 1 and <= 1024, got 99999999999'),
    ({"num_threads": 10**20}, 'num_threads must be a whole number >= 1 and <= 1024, got 100000000000000000000'),
    ({"num_threads": 0}, 'num_threads must be a whole number >= 1 and <= 1024, got 0'),
    ({"num_threads": "2"}, "num_threads must be a whole number >= 1 and <= 1024, got '2'"),
    ({"max_episode_steps": 10**20}, 'max_episode_steps must be a whole number >= 1 and <= 1000000000000, got 100000000000000000000'),
    ({"max_episode_steps": 1.5}, 'max_episode_steps must be a whole number >= 1, got 1.5'),
    ({"autoreset_mode": 1j}, "autoreset_mode must be one of 'NextStep', 'SameStep', 'Disabled', got 1j"),
]
TRAININGS = [
    ({"timesteps": 10**20}, 'timesteps must be a whole number >= 1 and <= 1000000000000, got 100000000000000000000'),
    ({"threads": 99999999999}, 'threads must be a whole number >= 0 and <= 1024, got 99999999999'),
    ({"num_envs": 10**20}, 'num_envs must be a whole number >= 1 and <= 1000000, got 100000000000000000000'),
    ({"eval_episodes": 10**20}, 'eval_episodes must be a whole number >= 1 and <= 1000000, got 100000000000000000000'),
    ({"hidden": (10**20,)}, 'hidden must be at most 32 layers of at most 8192 units, got (100000000000000000000,)'),
    ({"hidden": (8,) * 100}, 'hidden must be at most 32 layers of at most 8192 units, got (8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8,...'),
    ({"seed": 10**20}, 'seed must be a whole number >= 0 and <= 2147483647, got 100000000000000000000'),
    ({"learning_rate": 1e308}, 'learning_rate must be a finite number > 0 and <= 1000, got 1e+308'),
    ({"clip_range": 10**400}, 'clip_range must be a finite number > 0 and <= 1000, got infinity'),
    ({"gamma": "1"}, "gamma must be a finite number > 0 and <= 1, got '1'"),
    ({"update_steps": 10**20}, 'update_steps must be a whole number >= 64 and <= 1000000000000, got 100000000000000000000'),
    ({"log_std": 1e308}, 'log_std must be a finite number >= -5 and <= 2, got 1e+308'),
    ({"mirrored": 1}, 'mirrored must be True or False, got 1'),
    ({"epochs": 1j}, 'epochs must be a whole number >= 1, got 1j'),
    ({"hidden": (8192, 8192)}, 'hidden must have at most 2,097,152 weights between its layers, has 67,108,864'),
    ({"hidden": "64"}, "hidden must be one or more positive whole numbers, got '64'"),
    ({"hidden": 64}, 'hidden must be one or more positive whole numbers, got 64'),
    ({"hidden": None}, 'hidden must be one or more positive whole numbers, got None'),
]
COMMANDS = [
    (["evaluate", "schedule", "--threads", "99999999999"], 'springfoot evaluate: error: threads must be a whole number >= 1 and <= 1024, got 99999999999'),
    (["evaluate", "schedule", "--episodes", str(10**20)], 'springfoot evaluate: error: episodes must be a whole number >= 1 and <= 1000000000000, got 100000000000000000000'),
    (["evaluate", "schedule", "--seed", str(10**20)], 'springfoot evaluate: error: seed must be a whole number >= 0 and <= 1000000000000, got 100000000000000000000'),
    (["evaluate", "schedule", "--seconds", "1e308"], 'springfoot evaluate: error: episode_seconds must be a finite number >= 0 and <= 1e+09 s, got 1e+308'),
    (["evaluate", "schedule", "--seconds", "1e6"], 'springfoot evaluate: error: a recording must be of at most 100,000 s in all, got 20 episodes of 1e+06 s'),
    (["evaluate", *["schedule"] * 9], 'springfoot evaluate: error: report.html shows up to 8 policies, got 9; give --no-report'),
    (["evaluate", "schedule", "--height", "1e308"], 'springfoot evaluate: error: height must be in [1, 2.3] m, got 1e+308'),
    (["evaluate", "x\x1b[31m"], "springfoot evaluate: error: no policy 'x\\x1b[31m': give a .safetensors or .onnx file, a run folder, a schedule in a .csv or .json file, module:function, frozen:POLICY, or one of pretrained, expert, medium, learned, learned-2, learned-3, learned-4, learned-5, predicted, untrained, random, constant, schedule, quasi_stiffness, thesis, thesis_printed"),
    (["evaluate", "schedule", "--human", "a\x1b[31m.csv"], 'springfoot evaluate: error: no file a\\x1b[31m.csv'),
    (["evaluate", "schedule", "--ankle-stiffness-range", "1e-300", "1e300"], 'springfoot evaluate: error: ankle_stiffness_range must be within [0.001, 100000] N m/rad, got (1e-300, 1e+300)'),
    (["evaluate", "schedule", "--schedule", '{"ankle": "' + "x" * 400 + '"}'], "springfoot evaluate: error: a stiffness schedule must be an object with keys ankle and toe, got {'ankle': 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"),
    (["evaluate", "schedule", "--reward-weights", '{"alive": 1e308}'], "springfoot evaluate: error: reward_weights['alive'] must be a finite number >= -1e+06 and <= 1e+06, got 1e+308"),
    (["train", "--out", "x", "--timesteps", str(10**20)], 'springfoot train: error: timesteps must be a whole number >= 1 and <= 1000000000000, got 100000000000000000000'),
    (["train", "--out", "x", "--threads", "99999999999"], 'springfoot train: error: threads must be a whole number >= 0 and <= 1024, got 99999999999'),
    (["train", "--out", "x", "--hidden", str(10**12)], 'springfoot train: error: hidden must be at most 32 layers of at most 8192 units, got (1000000000000,)'),
    (["train", "--out", "x", "--seeds", str(10**20)], 'springfoot train: error: seeds must be a whole number >= 1 and <= 1000000000000, got 100000000000000000000'),
    (["train"], 'springfoot train: error: give either --out NEW_FOLDER or --resume FOLDER'),
    (["study", "bodies", "schedule", "--pairs", str(10**20)], 'springfoot study bodies: error: pairs must be a whole number >= 1 and <= 1000000000000, got 100000000000000000000'),
    (["study", "compare", "schedule", "--threads", "99999999999"], 'springfoot study compare: error: threads must be a whole number >= 1 and <= 1024, got 99999999999'),
    (["study", "compare", "schedule", "--seconds", "1e308"], 'springfoot study compare: error: seconds must be a finite number > 0 and <= 1e+09 s, got 1e+308'),
    (["study", "a\x1b[31m"], "springfoot study: error: no study 'a\\x1b[31m'; there are compare, bodies, ablations, agreement, any-stiffness, identify, influence, learning-curves, leg-tuning, plan-tuning, predict, controls, joint-prices, price, persons, foot-map, specialists, landscape, effects, changes, toe, when, orthosis, prosthesis, drop-foot, walks"),
    (["a\x1b[31m"], "springfoot: error: no command 'a\\x1b[31m'; there are train, evaluate, live, feet, person, score, export, submit, judge, study, datasets, examples and completion"),
    (["export", "schedule", "--out", "a\x1b[31m"], 'springfoot export: error: out must end in .onnx, got a\\x1b[31m'),
]
# fmt: on


@pytest.fixture(scope="module")
def env():
    env = SegmentedFootBiped()
    env.reset(seed=0)
    return env


CASES = [
    *((lambda _, values: settings_from(**values), *case) for case in SETTINGS),
    *((lambda env, action: env.step(action), *case) for case in ACTIONS),
    *((lambda env, options: env.reset(options=options), *case) for case in OPTIONS),
    *((lambda env, seed: env.reset(seed=seed), *case) for case in SEEDS),
    *((lambda _, arguments: SegmentedFootBipedVector(**arguments), *case) for case in VECTORS),
    *((lambda _, values: TrainingConfig(**values), *case) for case in TRAININGS),
]


@pytest.mark.parametrize(
    ("attempt", "given", "message"), CASES, ids=[f"{k} {case[2][:60]}" for k, case in enumerate(CASES)]
)
def test_bad_input_of_the_interface_is_refused_in_one_printable_line(env, attempt, given, message):
    with pytest.raises(SpringfootError) as caught:
        attempt(env, given)
    assert str(caught.value) == message
    assert message.isprintable()


@pytest.mark.parametrize(("words", "message"), COMMANDS, ids=[str(k) for k in range(len(COMMANDS))])
def test_bad_input_of_a_command_is_one_printable_line_and_exit_code_2(monkeypatch, capsys, tmp_path, words, message):
    monkeypatch.chdir(tmp_path)
    for stream in (sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "reconfigure", lambda **_: None, raising=False)
    assert main(words) == 2
    assert capsys.readouterr() == ("", f"{message}\n")
    assert message.isprintable() and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "give POLICY and --task TASK; --help tells more"),
        (["schedule"], "give --task TASK; --help tells more"),
    ],
)
def test_missing_arguments_are_named(capsys, words, message):
    with pytest.raises(SystemExit, match=r"^2$"):
        main(["submit", *words])
    assert capsys.readouterr() == ("", f"springfoot submit: error: {message}\n")


# Where a setting ends, rewards are still numbers ---------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        {"ankle_stiffness_range": (1e-3, 1e5), "toe_stiffness_range": (1e-3, 1e5)},
        {"reward_weights": {"alive": 1e6, "grf": 1e6, "pose": 1e6, "stiffness": -1e6, "stiffness_rate": -1e6}},
        {"push_newton": 1e5, "push_interval": 0.01, "push_seconds": 0.01},
        {
            "episode_seconds": 1e9,
            "stop_at": 1e300,
            "speed_rate": 1e300,
            "speed_range": (1.0, 1.2),
            "speed_interval": 0.02,
        },
    ],
    ids=lambda settings: next(iter(settings)),
)
def test_the_widest_settings_give_finite_observations_and_rewards(settings):
    env = SegmentedFootBiped(**settings)
    env.reset(seed=0)
    for step in range(60):
        observation, reward, terminated, truncated, _ = env.step(np.full(4, (-1.0) ** step))
        assert observation in env.observation_space and np.isfinite(reward)
        if terminated or truncated:
            env.reset()
