"""Define baselines: policies that need no learning, to compare learned policies with.

Each is, like a trained policy, a function of observations (N, D) that returns actions (N, 4) in [-1, 1]. Baselines turn
a stiffness in N m/rad into an action by the inverse of the environment's log scale, so they need
`action_mode="absolute"`.
"""

from collections.abc import Callable
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.envs.control.equilibrium import REFERENCE_STIFFNESS, fixed_stiffness, plateau_curve
from springfoot.envs.control.phase_table import GRID, PLACE, PhaseTable, leg_phases
from springfoot.envs.control.reference_walk import reference_walks, tabulated_speeds
from springfoot.envs.control.stiffness_control import action_of
from springfoot.envs.physics.model import ACTIONS, SIDES
from springfoot.envs.settings.settings import BipedSettings, body_of
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import Body
from springfoot.gait.body.tissue import TOE_STIFFNESS
from springfoot.gait.springs.stiffness import PRINTED_SWING, THESIS_SWING, thesis_schedule

PolicyFunction = Callable[[NDArray], NDArray]
"""Observations (N, D) -> actions (N, 4) in [-1, 1]."""

CONSTANT_STIFFNESS = (300.0, 40.0)
"""Ankle and toe stiffness of `constant` [N m/rad] for 1.70 m and 63 kg: round numbers that walk, not the best ones."""

_SIN, _COS, _SPEED = (
    [entry.name for entry in OBSERVATION].index(name) for name in ("phase_sin", "phase_cos", "command_speed")
)
"""Columns of the observation: sine and cosine of the left leg's phase, and the commanded speed as a Froude number."""


def leg_phase(observation: NDArray) -> NDArray:
    """Return (N, side) stride phase of each leg in [0, 1), 0 at its heel strike, read from observations (N, D)."""
    left = np.arctan2(observation[:, _SIN], observation[:, _COS], dtype=float) / (2 * np.pi) % 1.0
    return leg_phases(left)


def constant(settings: BipedSettings, stiffness: ArrayLike = CONSTANT_STIFFNESS) -> PolicyFunction:
    """Return the policy that always sets the same K of ankle and toe, at every phase.

    `stiffness` [N m/rad], (ankle, toe) of both legs or (side, (ankle, toe)), is that of a body of 1.70 m and 63 kg, and
    is scaled to the body of `settings`.
    """
    body = body_of(settings)
    require_absolute(settings)
    scaled = np.broadcast_to(np.asarray(stiffness, float) * body.stiffness_scale, (len(SIDES), 2))
    action = action_of(scaled, settings, body).astype(np.float32).ravel()
    return lambda observation: np.tile(action, (len(observation), 1))


def untrained(settings: BipedSettings) -> PolicyFunction:
    """Return the policy with which training starts: action 0, the middle of the stiffness range on its log scale, or
    in residual mode the K of the schedule that an action multiplies."""
    return lambda observation: np.zeros((len(observation), len(ACTIONS)), np.float32)


def uniform(settings: BipedSettings, seed: int = 0) -> PolicyFunction:
    """Return the policy that draws every action uniformly from [-1, 1]; one generator, seeded with `seed`, serves all
    calls."""
    generator = np.random.default_rng(seed)
    return lambda observation: generator.uniform(-1, 1, (len(observation), len(ACTIONS))).astype(np.float32)


def schedule(settings: BipedSettings, factor: float = 1.0) -> PolicyFunction:
    """Return the policy that sets `factor` times the K of a schedule over the stride: of `settings.schedule`, else of
    the schedule that was tuned with the leg constants.

    The tuned schedule depends on the momentary commanded speed, linear between the tabulated speeds. Both schedules
    scale with the body.
    """
    body = body_of(settings)
    speeds = tabulated_speeds(settings)
    if settings.schedule is not None:
        stiffness, _ = settings.schedule.at(GRID)  # without the rest angles, which are the environment's
        return follow(factor * stiffness[None], speeds[:1], settings, body)  # one speed: the same at all
    walks = reference_walks(settings)  # one for each speed
    tuned = [fixed_stiffness(walk.constants[0], walk.body, walk.target.foot.plateaus) for walk in walks]
    return follow(factor * np.stack(tuned), speeds, settings, body)


def quasi_stiffness(settings: BipedSettings) -> PolicyFunction:
    """Return the policy with people's ankle quasi-stiffness over the stride as its K (`REFERENCE_STIFFNESS`), and
    `TOE_STIFFNESS` at the toes; the same at every speed, scaled with the body."""
    body = body_of(settings)
    ankle = plateau_curve(REFERENCE_STIFFNESS)
    stiffness = np.stack([ankle, np.full_like(ankle, TOE_STIFFNESS)], -1) * body.stiffness_scale
    return follow(stiffness[None], tabulated_speeds(settings)[:1], settings, body)


def follow(stiffness: NDArray, speeds: NDArray, settings: BipedSettings, body: Body) -> PolicyFunction:
    """Return the policy that looks K of ankle and toe up in schedules, at each leg's phase and the commanded speed.

    Args:
        stiffness: schedules on `GRID` for each speed, (speeds, samples, (ankle, toe)) [N m/rad] for both legs, or
            (speeds, samples, side, (ankle, toe)) with one for each leg.
        speeds: (speeds,) ascending speeds of the schedules [m/s], of `body`; K is linear between two, and constant
            beyond. With a single one the speed makes no difference.
        settings: of the environment in which the policy acts.
        body: of these settings.

    Phase and commanded speed are read from the observation.
    """
    require_absolute(settings)
    froude = np.array([body.froude_speed(speed) for speed in speeds])
    legs = np.arange(len(SIDES))
    # (speeds, samples, side, joint)
    of_legs = stiffness if stiffness.ndim == 4 else np.stack([stiffness] * len(SIDES), 2)
    joints = of_legs.shape[-1]
    table = PhaseTable(of_legs.reshape(*of_legs.shape[:2], -1))  # one row for each speed

    def policy(observation: NDArray) -> NDArray:
        """Return the actions (N, 4) at phase and speed of the observations (N, D)."""
        # The commanded speed's position among the tabulated ones: 1.25 is a quarter of the way from row 1 to row 2.
        position = np.interp(observation[:, _SPEED], froude, np.arange(len(froude)))
        table_rows = np.zeros(len(position), PLACE)
        table_rows["row"] = position  # cut to a whole number
        table_rows["weight"] = position % 1.0  # of the next row
        # (N, leg of the phase, leg of the stiffness, joint): each leg takes its own stiffness at its own phase.
        curves = table.at(leg_phase(observation), table_rows).reshape(-1, len(SIDES), len(SIDES), joints)
        action = action_of(curves[:, legs, legs], settings, body)
        return action.reshape(len(observation), -1).astype(np.float32)

    return policy


def require_absolute(settings: BipedSettings) -> None:
    """Raise `SpringfootError` for settings in which an action does not set a stiffness by itself."""
    if settings.action_mode != "absolute":
        raise SpringfootError("a stiffness schedule or constant needs action_mode 'absolute', got 'residual'")


BASELINES = ("untrained", "random", "constant", "schedule", "quasi_stiffness", "thesis", "thesis_printed")
"""Names of the baselines. `constant:ANKLE,TOE` is a constant of other stiffness [N m/rad],
`constant:ANKLE,TOE,ANKLE,TOE` one of the left leg and one of the right, `schedule:FACTOR` the schedule times a
factor."""
FROZEN = "frozen"
"""`frozen:POLICY` is the mean stiffness of a trained policy over the stride, played open loop
(`springfoot.evaluation.recording.open_loop`)."""
SCHEDULE_SUFFIXES = (".csv", ".json")
"""Endings of the names of schedule files."""
SWINGS = {"thesis": THESIS_SWING, "thesis_printed": PRINTED_SWING}
"""Springs of the thesis's lines in swing: completed, and as printed."""


def baseline(name: str, settings: BipedSettings, seed: int = 0) -> PolicyFunction:
    """Return the policy of a baseline for the environment of `settings`; `seed` is that of `random`.

    `name` is one of `BASELINES`, alone or with numbers, as they stand there. Raises `SpringfootError` for any other,
    and for settings in which a policy acts on more than stiffness.
    """
    kind, colon, numbers = name.partition(":")
    if kind not in BASELINES:
        raise SpringfootError(f"no baseline {name!r}; there are {', '.join(BASELINES)}")
    if settings.acts != "stiffness":
        raise SpringfootError(f"baselines set stiffness alone: acts must be stiffness for {name}, got {settings.acts}")
    if colon and kind not in ("constant", "schedule"):
        raise SpringfootError(f"only constant and schedule take numbers, as in constant:300,40, got {name!r}")
    match kind:
        case "constant":
            return constant(settings, _stiffness_from(numbers) if colon else CONSTANT_STIFFNESS)
        case "random":
            return uniform(settings, seed)
        case "untrained":
            return untrained(settings)
        case "quasi_stiffness":
            return quasi_stiffness(settings)
        case _:  # `schedule`; the thesis's lines too, which `own_settings` makes the schedule of the settings
            return schedule(settings, _factor_from(numbers) if colon else 1.0)


def has_feedback(name: str) -> bool:
    """Return True if the actions of the policy `name` may depend on more than phase and commanded speed.

    Baselines, open-loop copies and schedules in files have no feedback.
    """
    return name.partition(":")[0] not in (*BASELINES, FROZEN) and not is_schedule_file(name)


def is_schedule_file(name: str) -> bool:
    """Return True if the name is that of a schedule file (`springfoot.agents.policies.schedule_files`)."""
    return Path(name).suffix.lower() in SCHEDULE_SUFFIXES


def and_copy(name: str) -> tuple[str, ...]:
    """Return (name,) without feedback, else (name, name of its open-loop copy, see `FROZEN`)."""
    return (name, f"{FROZEN}:{name}") if has_feedback(name) else (name,)


def own_settings(name: str, settings: BipedSettings) -> dict[str, Any]:
    """Return the environment settings that a baseline needs, for the body and speed of `settings`.

    Baselines with a stiffness in N m/rad act absolutely; `untrained` and `random` act as `settings` say. The thesis's
    lines bring springs between gait events, with their rest angles.
    """
    if name in ("untrained", "random"):
        return {}
    absolute = {"action_mode": "absolute"}
    if name not in SWINGS:
        return absolute
    lines = thesis_schedule(body_of(settings), settings.speed, SWINGS[name])
    return absolute | {"equilibrium": "phase", "schedule": lines.to_json()}


def _factor_from(text: str) -> float:
    """Return the factor of `schedule:FACTOR` from its text; raise `SpringfootError` unless it is positive."""
    try:
        factor = float(text)
    except ValueError:
        factor = nan
    if not 0 < factor < inf:
        raise SpringfootError(f"schedule takes a positive factor, as in schedule:1.2, got {text!r}")
    return factor


def _stiffness_from(text: str) -> NDArray:
    """Return the stiffnesses (legs, (ankle, toe)) [N m/rad] of `constant:` from their text, of one leg for both or of
    left and right; raise `SpringfootError` unless all are positive."""
    try:
        values = np.array([float(word) for word in text.split(",")])
    except ValueError:
        values = np.array([])
    if len(values) not in (2, 4) or not np.all((values > 0) & (values < inf)):
        raise SpringfootError(
            f"constant takes two positive stiffnesses, as in constant:300,40, or four, left and right, got {text!r}"
        )
    return values.reshape(-1, 2)
