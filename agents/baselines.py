"""Baselines: policies that need no learning, against which a learned one is judged.

Each is, like a trained policy, a function of observations (N, D) that returns actions (N, 4) in [-1, 1]. They turn a
stiffness in N m/rad into an action by the inverse of the environment's log scale, so they need
`action_mode="absolute"`.
"""

from collections.abc import Callable
from math import inf, nan, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from springfoot.envs.control.equilibrium import fixed_stiffness
from springfoot.envs.control.foot_springs import action_of
from springfoot.envs.control.leg_constants import leg_constants
from springfoot.envs.control.phase_table import GRID, PLACE, PhaseTable, leg_phases
from springfoot.envs.control.reference_walk import tabulated_speeds
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings import BipedSettings, body_of
from springfoot.envs.task.reward import OBSERVATION
from springfoot.gait.body import Body
from springfoot.gait.errors import SpringfootError
from springfoot.gait.stiffness import StiffnessSchedule, thesis_schedule

PolicyFunction = Callable[[NDArray], NDArray]
"""Observations (N, D) -> actions (N, 4) in [-1, 1]."""

CONSTANT_STIFFNESS = (300.0, 40.0)
"""Ankle and toe of `constant` [N m/rad] for 1.70 m and 63 kg: round numbers that walk, not the best ones, which
`springfoot study best-constant` finds."""

_SIN, _COS, _SPEED = (
    [entry.name for entry in OBSERVATION].index(name) for name in ("phase_sin", "phase_cos", "command_speed")
)


def leg_phase(observation: NDArray) -> NDArray:
    """(N, side) stride phase of each leg in [0, 1), 0 at its heel strike, read from observations (N, D)."""
    left = np.arctan2(observation[:, _SIN], observation[:, _COS], dtype=float) / (2 * np.pi) % 1.0
    return leg_phases(left)


def constant(settings: BipedSettings, stiffness: ArrayLike = CONSTANT_STIFFNESS) -> PolicyFunction:
    """Hold one `stiffness` (ankle, toe) [N m/rad], given for 1.70 m and 63 kg and scaled with the body."""
    body = body_of(settings)
    _require_absolute(settings)
    scaled = np.asarray(stiffness, float) * body.stiffness_scale
    action = np.tile(action_of(scaled, settings, body).astype(np.float32), 2)
    return lambda observation: np.tile(action, (len(observation), 1))


def untrained(settings: BipedSettings) -> PolicyFunction:
    """Always action 0: the middle of the stiffness range on its log scale."""
    return lambda observation: np.zeros((len(observation), len(ACTIONS)), np.float32)


def uniform(settings: BipedSettings, seed: int = 0) -> PolicyFunction:
    """Draw every action from the whole range; one generator, seeded with `seed`, serves all calls."""
    generator = np.random.default_rng(seed)
    return lambda observation: generator.uniform(-1, 1, (len(observation), len(ACTIONS))).astype(np.float32)


def schedule(settings: BipedSettings) -> PolicyFunction:
    """Follow a fixed stiffness over the stride: that of `settings.schedule`, or else the one tuned with the legs.

    The tuned one goes with the speed that is commanded at each moment. Both scale with the body.
    """
    body, speeds = body_of(settings), tabulated_speeds(settings)
    if settings.schedule is not None:
        stiffness = StiffnessSchedule.from_json(settings.schedule).at(GRID)[0]
        return _follow(stiffness[None], speeds[:1], settings, body)
    time_scale = sqrt(body.length_scale)
    tuned = [leg_constants(settings.equilibrium, settings.cadence, speed / time_scale) for speed in speeds]
    return _follow(np.stack([fixed_stiffness(constants, body) for constants in tuned]), speeds, settings, body)


def _follow(stiffness: NDArray, speeds: NDArray, settings: BipedSettings, body: Body) -> PolicyFunction:
    """The policy that sets `stiffness` (speeds, samples, (ankle, toe)) [N m/rad] by each leg's phase.

    It reads phase and Froude speed from the observation; between two of `speeds` [m/s, of `body`] it is linear.
    """
    _require_absolute(settings)
    table, froude = PhaseTable(stiffness), np.array([body.froude_speed(speed) for speed in speeds])

    def policy(observation: NDArray) -> NDArray:
        spot = np.interp(observation[:, _SPEED], froude, np.arange(len(froude)))
        place = np.zeros(len(spot), PLACE)
        place["row"], place["weight"] = spot, spot % 1.0
        action = action_of(table.at(leg_phase(observation), place), settings, body)
        return action.reshape(len(observation), -1).astype(np.float32)

    return policy


def _require_absolute(settings: BipedSettings) -> None:
    if settings.action_mode != "absolute":
        raise SpringfootError("a stiffness schedule or constant needs action_mode 'absolute', got 'residual'")


BASELINES = ("untrained", "random", "constant", "schedule", "thesis")
"""Names of the baselines; `constant:ANKLE,TOE` is a constant of other stiffness [N m/rad]."""


def baseline(name: str, settings: BipedSettings, seed: int = 0) -> PolicyFunction:
    """A baseline by name, in the environment of `settings`; `seed` is that of `random`."""
    kind, colon, numbers = name.partition(":")
    if colon and kind != "constant":
        raise SpringfootError(f"only constant takes numbers, as in constant:300,40, got {name!r}")
    if kind == "constant":
        return constant(settings, _stiffness_from(numbers) if colon else CONSTANT_STIFFNESS)
    if kind == "random":
        return uniform(settings, seed)
    if kind in BASELINES:
        return {"untrained": untrained, "schedule": schedule, "thesis": schedule}[kind](settings)
    raise SpringfootError(f"no baseline {name!r}; there are {', '.join(BASELINES)}")


def own_settings(name: str, settings: BipedSettings) -> dict[str, Any]:
    """The environment settings that a baseline needs, for the body and speed of `settings`.

    Baselines set stiffness in N m/rad, so their actions are absolute. `thesis` brings the thesis's straight lines
    between gait events, and their equilibrium angles.
    """
    absolute = {"action_mode": "absolute"}
    if name != "thesis":
        return absolute
    return absolute | {"equilibrium": "phase", "schedule": thesis_schedule(body_of(settings), settings.speed).to_json()}


def _stiffness_from(text: str) -> tuple[float, float]:
    try:
        ankle, toe = map(float, text.split(","))
    except ValueError:
        ankle = toe = nan
    if not (0 < ankle < inf and 0 < toe < inf):
        raise SpringfootError(f"constant takes two positive stiffnesses, as in constant:300,40, got {text!r}")
    return ankle, toe
