"""A policy's stiffness without the policy: its mean K over the phase, played open loop."""

from dataclasses import replace
from typing import Any

import numpy as np

from springfoot.agents.baselines import PolicyFunction, schedule
from springfoot.envs.control.foot_springs import stiffness_ranges
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.settings import BipedSettings
from springfoot.evaluation.recording import prepare, record
from springfoot.gait.stiffness import SPRINGS, Segment, StiffnessSchedule

from .identifiability import PHASE_SEGMENTS, MeanSprings, mean_springs

FROZEN = "frozen"
"""`frozen:POLICY` is what the copy of a policy is called."""
COPIED_PHASES = 50
"""Of a copy's K over the stride: each its mean over 2 % of the stride around the knot, and linear between them."""
EPISODES, SECONDS = 20, 12.0
"""Undisturbed walking whose mean K is taken."""
WALKED_IN = ("height", "mass", "leg_ratio", "foot_ratio", "carried_ratio", "speed", "slope_deg", "friction")
"""Settings of that walking which are those asked for: a policy's K goes with body, speed and ground."""


def frozen_schedule(springs: MeanSprings, settings: BipedSettings) -> StiffnessSchedule:
    """Mean K of ankle and toe at `COPIED_PHASES` phases, linear between; the settings' equilibrium where they have one.

    A residual action can leave the range of absolute ones, a copy cannot: K beyond it is the nearer end's.
    """
    each = PHASE_SEGMENTS // COPIED_PHASES
    stiffness = np.clip(springs.stiffness, *stiffness_ranges(settings, springs.body))
    around = np.roll(stiffness, each // 2, axis=0).reshape(COPIED_PHASES, each, len(SPRINGS)).mean(1)
    rest = np.zeros((len(GRID), len(SPRINGS)))
    if settings.equilibrium == "phase":
        rest = StiffnessSchedule.from_json(settings.schedule).at(GRID)[1]
    at = np.arange(COPIED_PHASES) / COPIED_PHASES
    curves = [np.interp(GRID, at, knots, period=1.0) for knots in around.T]
    columns = zip(SPRINGS, curves, rest.T, strict=True)
    return StiffnessSchedule(**{joint: tuple(map(Segment, GRID, k, theta)) for joint, k, theta in columns})


def frozen(name: str, given: dict[str, Any], seed: int = 0, threads: int = 2) -> tuple[PolicyFunction, BipedSettings]:
    """The open-loop copy of the policy `name` and its environment, that of the policy in all but the action's mode.

    `given`: settings asked for, as in `prepare`. K is the mean over `EPISODES` undisturbed walks of that body at that
    speed on that slope. The equilibrium stays the policy's own.
    """
    where = {key: value for key, value in given.items() if key in WALKED_IN}
    policy, alone = prepare(name, where | {"episode_seconds": SECONDS}, seed)
    springs = mean_springs(record(policy, alone, name=name, episodes=EPISODES, threads=threads))
    _, settings = prepare(name, given, seed)
    copy = frozen_schedule(springs, settings).to_json()
    settings = replace(settings, action_mode="absolute", schedule=copy)
    return schedule(settings), settings
