"""Define the configuration of a training, and presets."""

import dataclasses
import os
from dataclasses import dataclass, field, replace
from itertools import pairwise
from numbers import Integral
from typing import Any, Literal, get_args

from springfoot.envs.settings.checks import MOST_ENVIRONMENTS, refusing_unknown
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json
from springfoot.errors import (
    MOST_COUNT,
    MOST_THREADS,
    SpringfootError,
    quoted,
    require_choice,
    require_count,
    require_number,
)
from springfoot.tasks import PLAN_RANGE_DEG, TASKS

WIDEST, DEEPEST, MOST_WEIGHTS = 8192, 32, 2**21
"""Units of the widest hidden layer, number of hidden layers, and number of weights between them at most; chosen: a
training state is then at most half as large as the largest file that is read."""
_LARGEST = 1e3  # rate of learning or clip range; chosen
_SIDE_BY_SIDE = ("num_envs", "eval_episodes")
"""Settings that count environments simulated side by side, and so have their limit."""

Device = Literal["cpu", "cuda"]
DEVICES = get_args(Device)
TRAINED_ON = BipedSettings(episode_seconds=10.0, push_newton=150.0)
"""Default task: pushes of 150 N, and an action that sets the stiffness itself, mid-range at 0."""


@refusing_unknown
@dataclass(frozen=True, kw_only=True)
class TrainingConfig:
    """One training by proximal policy optimisation (PPO); raises `SpringfootError` for a bad value."""

    timesteps: int = 1_500_000
    """Environment steps to learn from, of 20 ms unless `decisions` says otherwise, rounded up to whole updates."""
    seed: int = 0
    """Seed of weights, action noise and environments."""
    num_envs: int = 64
    """Environments stepped together in one batch."""
    threads: int = 0
    """Threads of the physics, 0 for one per available processor; results are the same with any number."""
    device: Device = "cpu"
    """Processor of the network: `cuda` is a GPU, which is faster for many environments and has other last bits."""
    update_steps: int = 8192
    """Environment steps collected for each update of the policy, all environments together."""
    minibatches: int = 8
    """Parts into which the samples of an update are split, one gradient step each."""
    epochs: int = 8
    """Passes over the samples in each update."""
    learning_rate: float = 3e-4
    """Step size of Adam at the start [-]."""
    learning_rate_end: float = 0.1
    """Step size at the end as a fraction of the start, linear in between [0..1]."""
    gamma: float = 0.98
    """Discount of reward per 20 ms (0..1)."""
    gae_lambda: float = 0.95
    """Lambda of the generalised advantage estimate, per 20 ms [0..1]."""
    clip_range: float = 0.2
    """Largest relative change of an action's probability that one update rewards."""
    critic_steps: int = 0
    """Environment steps at the start in which the critic alone learns, so that a good policy to begin from is not led
    astray by an untrained critic."""
    log_std: float = -0.9
    """Logarithm of the standard deviation of the actions at the start."""
    hidden: tuple[int, ...] = (64, 64)
    """Widths of the hidden tanh layers, the same for actor and critic."""
    mirrored: bool = False
    """One network for both legs; the right leg uses it on the mirrored world, so that left and right act alike to the
    last bit."""
    eval_interval: int = 131_072
    """Environment steps between two periodic evaluations (deterministic, the training's own settings)."""
    eval_episodes: int = 16
    """Episodes of each periodic evaluation, on the same fixed seeds every time."""
    environment: BipedSettings = field(default_factory=lambda: TRAINED_ON)
    """Settings of the training's environment."""

    def __post_init__(self) -> None:
        for name in ("timesteps", "num_envs", "minibatches", "epochs", "eval_interval", "eval_episodes"):
            require_count(name, getattr(self, name), 1, MOST_ENVIRONMENTS if name in _SIDE_BY_SIDE else MOST_COUNT)
        require_count("seed", self.seed, 0, 2**31 - 1)
        require_count("critic_steps", self.critic_steps, 0)
        require_count("threads", self.threads, 0, MOST_THREADS)
        if self.device not in DEVICES:
            raise SpringfootError(f"device must be {' or '.join(DEVICES)}, got {quoted(self.device)}")
        # A step of each environment, and two samples in a minibatch: advantages are divided by their deviation in it.
        require_count("update_steps", self.update_steps, max(self.num_envs, 2 * self.minibatches))
        for name in ("learning_rate", "clip_range"):
            require_number(name, getattr(self, name), 0, _LARGEST, above=True)
        require_number("gamma", self.gamma, 0, 1, above=True)
        for name in ("gae_lambda", "learning_rate_end"):
            require_number(name, getattr(self, name), 0, 1)
        require_number("log_std", self.log_std, -5, 2)
        if not isinstance(self.mirrored, bool):
            raise SpringfootError(f"mirrored must be True or False, got {quoted(self.mirrored)}")
        layers = self.hidden if isinstance(self.hidden, tuple) else ()
        if not layers or any(type(width) is not int or width < 1 for width in layers):
            raise SpringfootError(f"hidden must be one or more positive whole numbers, got {quoted(self.hidden)}")
        if max(layers) > WIDEST or len(layers) > DEEPEST:
            raise SpringfootError(
                f"hidden must be at most {DEEPEST} layers of at most {WIDEST} units, got {quoted(self.hidden)}"
            )
        if (between := sum(below * above for below, above in pairwise(layers))) > MOST_WEIGHTS:
            raise SpringfootError(
                f"hidden must have at most {MOST_WEIGHTS:,} weights between its layers, has {between:,}"
            )


_BRACE = {"ankle_stiffness": [20, 520], "ankle_deg": [-8, 4]}
_ONE_WAY = _BRACE | {"engages": "dorsiflexion"}
_HEAVIER = {"shank_mass_ratio": [1.0, 1.3], "foot_mass_ratio": [1.0, 2.0]}
_WEAK = {"kind": "weak", "strength": [0.15, 0.6]}
PASSIVE_RANGES = ((150, 1500), (15, 200))
"""Stiffness of ankle and toe of the passive feet that a person learns to walk on [N m/rad]."""
_PASSIVE = {
    "kind": "passive",
    "ankle_stiffness": list(PASSIVE_RANGES[0]),
    "ankle_deg": [0, 8],
    "toe_stiffness": list(PASSIVE_RANGES[1]),
    "shank_mass_ratio": [0.6, 1.1],
}
DRAWN_FEET: list[dict[str, Any]] = [
    {"foot": "intact", "on": "both", "weight": 38},
    {"foot": {"kind": "intact", "orthosis": _BRACE}, "on": "both", "weight": 14},
    {"foot": {"kind": "intact", "orthosis": _BRACE} | _HEAVIER, "on": "both", "weight": 4},
    {"foot": {"kind": "intact", "orthosis": _BRACE}, "weight": 8},
    {"foot": {"kind": "intact", "orthosis": _ONE_WAY}, "on": "both", "weight": 4},
    {"foot": {"kind": "intact", "orthosis": _ONE_WAY} | _HEAVIER, "on": "both", "weight": 3},
    {"foot": {"kind": "intact", "orthosis": {"toe_stiffness": [10, 180]}}, "on": "both", "weight": 3},
    {"foot": {"kind": "intact"} | _HEAVIER, "on": "both", "weight": 4},
    {"foot": _WEAK, "weight": 3},
    {"foot": _WEAK, "on": "both", "weight": 5},
    {"foot": _WEAK | {"orthosis": _BRACE}, "on": "both", "weight": 8},
    {"foot": _WEAK | {"orthosis": _BRACE}, "weight": 6},
    {"foot": _PASSIVE, "weight": 16},
    {"foot": {"kind": "adaptive", "ankle_deg": [0, 8]}, "weight": 5},
    {"foot": "rigid", "weight": 8},
    {"foot": "rigid_toe", "weight": 2},
    {"foot": "no_toe", "weight": 2},
    {"foot": "drop", "weight": 9},
    {"foot": {"kind": "drop", "orthosis": {"ankle_stiffness": [0.3, 60], "ankle_deg": [0, 10]}}, "weight": 14},
    {"foot": _PASSIVE, "on": "both", "weight": 4},
    {"foot": "rigid_toe", "on": "both", "weight": 2},
    {"foot": "no_toe", "on": "both", "weight": 2},
    {"foot": {"kind": "intact", "foot_mass_ratio": [2.0, 5.5]}, "on": "both", "weight": 3},
]
"""Feet that a person learns to walk on; sound ones come often enough, as the person's walk on them is the measure."""
DRAWN_BODIES = [
    {"weight": 6},
    {"carried_ratio": 0.1},
    {"carried_ratio": 0.2},
    {"carried_ratio": 0.4, "weight": 0.5},
    {"leg_ratio": 0.95, "foot_ratio": 0.95},
    {"leg_ratio": 1.05, "foot_ratio": 1.05},
    *({"step_time_ratio": ratio, "weight": 0.75} for ratio in (0.82, 0.91, 1.08, 1.15)),
]
"""Proportions, loads and step times that a person learns to walk with."""
PERSON_TASK = replace(
    TRAINED_ON,
    episode_seconds=5.0,  # bodies fall soon after the start or not at all, so starts are the thing to learn
    drawn_feet=DRAWN_FEET,
    drawn_bodies=DRAWN_BODIES,
    acts="both",
    action_mode="residual",
    stiffness_by="drawn",
    aim_rate=1.0,
    ankle_tendon=400.0,
    push_newton=100.0,
    height_range=(1.45, 1.95),
    mass_range=(45.0, 97.0),
    speed_range=(0.75, 1.66),  # faster walks at 1.15 of people's step time need longer legs
    speed_interval=5.0,
    slope_range_deg=(-5.0, 5.0),
    unevenness_m=0.005,
    reward_weights={
        "alive": 58.0,  # about as much as all prices take at first: with less it learns to fall
        "speed": 0.5,
        "com_x": 0.2,
        "com_z": 0.0,
        "zmp": 0.0,
        "pose": 18.0,
        "grf": 34.0,
        "stiffness_rate": -0.2,
        "fibre_work": -45.0,
        "activation": -2.3,
        "impact": -4.5,
        "speed_held": -160.0,
        "person_rate": -0.15,
        "step_length": -45.0,
    },
    forward_force_weight=3.0,
    knee_weight=3.0,
)
"""Task of a person: rest angles of hips, knees and ankles, and the stiffness where no other sets it, on drawn bodies,
speeds and slopes. The reward pays for a held speed and for people's angles and forces, and charges the muscles'
energy."""

PREDICTED = replace(
    TRAINED_ON,
    episode_seconds=5.0,
    guide="plan",
    acts="both",
    action_mode="residual",
    stiffness_by="drawn",
    aim_rate=1.0,
    ankle_tendon=400.0,
    person_range_deg=PLAN_RANGE_DEG,  # with the generic constants alone it falls within a second
    push_newton=100.0,
    speed_range=(0.75, 1.66),
    speed_interval=5.0,
    slope_range_deg=(-5.0, 5.0),
    unevenness_m=0.01,
    reward_weights={
        "alive": 180.0,  # about as much as all prices take at first: with less it learns to fall
        "speed": 10.0,
        "com_x": 10.0,
        "com_z": 6.0,
        "zmp": 6.0,
        "pose": 0.0,
        "grf": 0.0,
        "stiffness_rate": -0.2,
        "fibre_work": -40.0,
        "activation": -6.0,
        "activation_rate": -6.0,
        "acceleration": -12.0,
        "impact": -6.0,
        "speed_held": -120.0,
        "step_length": -200.0,  # at -45 steps still come out an eighth longer than planned
        "person_rate": -0.3,
    },
)
"""Task of a person that follows the plan, and begins at generic constants. The reward pays for CoM and ZMP of the plan,
and charges for speed and steps other than planned and for the muscles: their energy above all, activation and its rate,
accelerations and impact. Angles and forces do not count."""

_PERSON = TrainingConfig(
    timesteps=7_680_000,
    num_envs=120,
    update_steps=15_360,
    minibatches=12,
    epochs=5,
    learning_rate_end=0.02,  # when the spread of actions is small a high rate undoes earlier learning
    gamma=0.99,
    log_std=-1.2,
    hidden=(256, 256),
    mirrored=True,
    eval_interval=384_000,
    environment=PERSON_TASK,
)

PRESETS: dict[str, TrainingConfig] = {
    "walk": TrainingConfig(),
    "any-body": TrainingConfig(
        timesteps=12_000_000,
        eval_interval=262_144,
        environment=replace(
            TRAINED_ON,
            height_range=(1.45, 2.0),
            mass_range=(40.0, 120.0),
            speed_range=(0.8, 1.6),
            speed_interval=4.0,
            slope_range_deg=(-5.0, 5.0),
            unevenness_m=0.01,
            stiffness_delay_range_s=(0.0, 0.02),
        ),
    ),
    "person": _PERSON,
    "predict": replace(_PERSON, timesteps=6_912_000, log_std=-1.5, environment=PREDICTED),
}
"""Name -> training that is known to work."""


def task_training(task: str) -> TrainingConfig:
    """Return the training of a frozen task, such as "Walk-v0": preset `walk`, or where the action moves the person the
    network and action mode of preset `person`.

    Raises `SpringfootError` for an unknown task.
    """
    require_choice("task", task, tuple(TASKS))
    environment = settings_from(**TASKS[task])
    if environment.acts == "stiffness":
        return replace(PRESETS["walk"], environment=environment)
    person = PRESETS["person"]
    return replace(
        PRESETS["walk"],
        log_std=person.log_std,
        hidden=person.hidden,
        mirrored=person.mirrored,
        environment=replace(environment, action_mode=person.environment.action_mode),
    )


def config_to_json(config: TrainingConfig) -> dict[str, Any]:
    """Return a configuration as a dictionary of plain JSON values; `config_from_json` is its inverse."""
    values = {item.name: getattr(config, item.name) for item in dataclasses.fields(config)}
    values = {name: int(value) if _is_count(value) else value for name, value in values.items()}
    return values | {"hidden": list(config.hidden), "environment": settings_to_json(config.environment)}


def _is_count(value: Any) -> bool:
    """Return True for a whole number, also NumPy's, that is neither True nor False."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def config_from_json(values: dict[str, Any]) -> TrainingConfig:
    """Return the configuration in a dictionary as from `config_to_json`; settings that it leaves out have defaults.

    Raises `SpringfootError` for an unknown name or a bad value.
    """
    names = [item.name for item in dataclasses.fields(TrainingConfig)]
    if unknown := sorted(set(values) - set(names)):
        raise SpringfootError(f"unknown training setting {unknown[0]!r}; valid: {', '.join(names)}")
    plain = dict(values)
    if "hidden" in plain:
        plain["hidden"] = tuple(plain["hidden"])
    if "environment" in plain:
        plain["environment"] = settings_from(**plain["environment"])
    return TrainingConfig(**plain)


def require_of_rllib(config: TrainingConfig) -> None:
    """Raise `SpringfootError` for settings that the engine RLlib does not support: a GPU, and steps of the critic
    alone."""
    if config.device != "cpu":
        raise SpringfootError(f"--engine rllib learns on the CPU; drop --device {config.device}, or --engine")
    if config.critic_steps:
        raise SpringfootError("--engine rllib trains actor and critic together; drop --critic-steps, or --engine")


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
