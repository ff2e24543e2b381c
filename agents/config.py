"""What a training is told: its configuration, the presets, and the command-line flags made from them."""

import ast
import dataclasses
import inspect
import json
import textwrap
from dataclasses import dataclass, field, replace
from itertools import pairwise
from numbers import Integral
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import tyro

from springfoot.envs.settings import BipedSettings, settings_from, settings_to_json
from springfoot.gait.errors import SpringfootError, require_count, require_number
from springfoot.gait.own_data import read_gait

TRAINED_ON = BipedSettings(action_mode="residual", episode_seconds=10.0, push_newton=150.0)
"""The task that is trained on unless flags say otherwise: the fixed schedule's stiffness times the policy's factor."""


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
    update_steps: int = 8192
    """Environment steps collected for each update of the policy, all environments together."""
    minibatches: int = 8
    """Parts of an update's samples, each good for one gradient step."""
    epochs: int = 8
    """Passes over the samples in each update."""
    learning_rate: float = 3e-4
    """Step size of Adam at the start [-]."""
    learning_rate_end: float = 0.1
    """Step size at the end as a share of the start, linear in between [0..1]."""
    gamma: float = 0.98
    """Discount of reward per 20 ms (0..1)."""
    gae_lambda: float = 0.95
    """Lambda of the generalised advantage estimate, per 20 ms [0..1]."""
    clip_range: float = 0.2
    """Largest relative change of an action's probability that one update rewards."""
    log_std: float = -0.9
    """Logarithm of the standard deviation of the actions at the start."""
    hidden: tuple[int, ...] = (64, 64)
    """Widths of the hidden tanh layers, the same for actor and critic."""
    eval_interval: int = 131_072
    """Environment steps between two periodic evaluations (deterministic, the training's own settings)."""
    eval_episodes: int = 16
    """Episodes of each periodic evaluation, on the same fixed seeds every time."""
    environment: BipedSettings = field(default_factory=lambda: TRAINED_ON)
    """Settings of the walking task that is trained on."""

    def __post_init__(self) -> None:
        for name in ("timesteps", "num_envs", "minibatches", "epochs", "eval_interval", "eval_episodes"):
            require_count(name, getattr(self, name))
        require_count("seed", self.seed, 0, 2**31 - 1)
        require_count("threads", self.threads, 0)
        require_count("update_steps", self.update_steps, max(self.num_envs, 2 * self.minibatches))
        for name in ("learning_rate", "clip_range"):
            require_number(name, getattr(self, name), 0, above=True)
        require_number("gamma", self.gamma, 0, 1, above=True)
        for name in ("gae_lambda", "learning_rate_end"):
            require_number(name, getattr(self, name), 0, 1)
        require_number("log_std", self.log_std, -5, 2)
        if not self.hidden or any(type(width) is not int or width < 1 for width in self.hidden):
            raise SpringfootError(f"hidden must be one or more positive whole numbers, got {self.hidden!r}")


PRESETS: dict[str, TrainingConfig] = {
    "walk": TrainingConfig(),
    "any-body": TrainingConfig(
        timesteps=8_000_000,
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
}
"""Trainings that are known to work, by name."""


def config_to_json(config: TrainingConfig) -> dict[str, Any]:
    """A configuration as a dictionary of plain JSON values; `config_from_json` is its inverse."""
    values = {item.name: getattr(config, item.name) for item in dataclasses.fields(config)}
    values = {name: int(value) if isinstance(value, Integral) else value for name, value in values.items()}
    return values | {"hidden": list(config.hidden), "environment": settings_to_json(config.environment)}


def config_from_json(values: dict[str, Any]) -> TrainingConfig:
    """The configuration that `config_to_json` wrote; raises `SpringfootError` for anything else."""
    names = [item.name for item in dataclasses.fields(TrainingConfig)]
    if unknown := sorted(set(values) - set(names)):
        raise SpringfootError(f"unknown training setting {unknown[0]!r}; valid: {', '.join(names)}")
    plain = dict(values)
    if "hidden" in plain:
        plain["hidden"] = tuple(plain["hidden"])
    if "environment" in plain:
        plain["environment"] = settings_from(**plain["environment"])
    return TrainingConfig(**plain)


def _field_help(settings: type) -> dict[str, str]:
    """The docstring below each field of a dataclass, on one line."""
    body = ast.parse(textwrap.dedent(inspect.getsource(settings))).body[0].body  # type: ignore[attr-defined]
    return {
        item.target.id: " ".join(str(doc.value.value).split())
        for item, doc in pairwise(body)
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and isinstance(doc, ast.Expr)
        and isinstance(doc.value, ast.Constant)
    }


def _read_json(words: list[str]) -> dict[str, Any]:
    """A dictionary from JSON text, or from the JSON file of that name."""
    text = words[0]
    if not text.lstrip().startswith("{"):
        path = Path(text)
        if not path.is_file():
            raise ValueError(f"{text!r} is neither JSON text in braces nor the name of a JSON file")
        text = path.read_text(encoding="utf-8")
    value = json.loads(text)
    if not isinstance(value, dict):
        raise ValueError("the JSON must be an object in braces")
    return value


def read_own_gait(words: str) -> dict[str, Any]:
    """The setting `human` from what `--human` is given.

    A file of `read_gait`; FILE:CONDITION for one of several in a CSV; several files of one walk with commas between.
    Raises `SpringfootError` for a file that cannot be read.
    """
    if Path(words).is_file():
        return read_gait(words).to_json()
    if "," in words:
        return read_gait(*words.split(",")).to_json()
    file, _, condition = words.rpartition(":")
    if Path(file).is_file():
        return read_gait(file, condition=condition).to_json()
    return read_gait(words).to_json()


FILE_FLAGS = {"human": read_own_gait}
"""Settings whose flag is the name of a file, and what makes the setting of it."""

_JSON_FLAG = tyro.constructors.PrimitiveConstructorSpec(
    nargs=1,
    metavar="JSON|FILE",
    instance_from_str=_read_json,
    is_instance=lambda value: value is None or isinstance(value, dict),
    str_from_instance=lambda value: [json.dumps(value)],
)


def _metavar(kind: Any) -> str:
    """How a value of this type is written on the command line."""
    parts = get_args(kind)
    if get_origin(kind) is Literal:
        return "|".join(map(str, parts))
    if get_origin(kind) is tuple:
        return f"{_metavar(parts[0])} ..." if parts[1:] == (...,) else " ".join(map(_metavar, parts))
    parts = [part for part in parts if part is not type(None)]
    return "|".join(map(_metavar, parts)) if parts else kind.__name__.upper()


def optional_flags(name: str, settings: type, defaults: Any, leave_out: tuple[str, ...] = ()) -> type:
    """A dataclass with every field of `settings` as an optional flag: None, its default, means "not given".

    The help of each flag is the field's own docstring, with its value in `defaults` (an instance).
    """
    help_of, flags = _field_help(settings), []
    for item_name, kind in get_type_hints(settings).items():
        if item_name in leave_out:
            continue
        default = getattr(defaults, item_name)
        shown = " ".join(map(str, default)) if isinstance(default, tuple) else default
        hint = f"(default: {shown})"
        is_json = dict in (get_origin(kind), *map(get_origin, get_args(kind)))
        if item_name in FILE_FLAGS:
            annotation = Annotated[
                str | None, tyro.conf.arg(help=help_of[item_name], help_behavior_hint=hint, metavar="FILE")
            ]
        elif is_json:
            annotation = Annotated[
                dict | None, _JSON_FLAG, tyro.conf.arg(help=help_of[item_name], help_behavior_hint=hint)
            ]
        else:
            annotation = Annotated[
                kind | None,
                tyro.conf.arg(help=help_of[item_name], help_behavior_hint=hint, metavar=_metavar(kind)),
            ]
        flags.append((item_name, annotation, None))
    return dataclasses.make_dataclass(
        name,
        flags,
        frozen=True,
        kw_only=True,
        namespace={"__doc__": settings.__doc__, "__module__": __name__},
    )


def given(flags: Any) -> dict[str, Any]:
    """The flags that were given, by name, files read; raises `SpringfootError` for a bad file."""
    values = {item.name: getattr(flags, item.name) for item in dataclasses.fields(flags)}
    given_ones = {name: value for name, value in values.items() if value is not None}
    return given_ones | {name: read(given_ones[name]) for name, read in FILE_FLAGS.items() if name in given_ones}


SettingsFlags = optional_flags("SettingsFlags", BipedSettings, BipedSettings())
"""Every environment setting as an optional flag (dataclass for `tyro`)."""
