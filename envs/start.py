"""How a walk starts: at people's posture in single support, the lowest contact point just in the floor."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from springfoot.gait.human import ANGLES

from .constants import LegConstants
from .model import HIP
from .phase import GRID, PhaseTable, leg_phases
from .simulation import Simulation
from .walkers import Walkers
from .walks import Walk

START_PHASES = (0.08, 0.38)
"""A random start lies in this part of either leg's stance: near double support a planned state falls."""
START_DEPTH = 0.001
"""The lowest contact point starts this far in the floor [m at 1.70 m]: about its rest under body weight."""


def start_table(rows: Iterable[tuple[LegConstants, Walk]]) -> PhaseTable:
    """People's posture over the stride for each row of the walkers' tables (`envs.walks.rows`)."""
    return PhaseTable(np.stack([_start_curves(walk) for _, walk in rows]))


def random_phase(random: np.random.Generator) -> float:
    """A stride phase of the left leg in either leg's single support."""
    return (random.uniform(*START_PHASES) + 0.5 * random.integers(2)) % 1.0


def place(
    simulation: Simulation, table: PhaseTable, walkers: Walkers, ids: NDArray, left_phase: NDArray, noise: NDArray
) -> None:
    """Put `ids` (K,) in people's posture at `left_phase` (K,) of `table`, at the commanded speed; `noise`
    (K, 2, side, joint) is the relative error of angles and velocities."""
    row, scale = walkers.place[ids], walkers.scale[ids]
    curves = table.at(leg_phases(left_phase), row)
    (angle, velocity), pitch = np.split(curves[..., :-1], 2, axis=-1), curves[:, 0, -1]
    angle = angle * (1.0 + noise[:, 0])
    velocity = velocity / scale["root"][:, None, None] * (1.0 + noise[:, 1])
    angle[..., HIP] += pitch[:, None]
    root, rate = np.zeros((2, len(ids), 3))
    root[:, 2], rate[:, 0] = pitch, walkers.speed[ids]
    simulation.reset(ids, root, rate, angle, velocity)
    lowest = simulation.measure().contact[ids, ..., 1].min(axis=(1, 2))
    root[:, 1] = -lowest - START_DEPTH * simulation.body.length_scale * scale["length"]
    simulation.reset(ids, root, rate, angle, velocity)


def _start_curves(walk: Walk) -> NDArray:
    """(SAMPLES, 9) people's joint angles, hip as thigh to the vertical [rad], their rates [rad/s], trunk pitch [rad].

    Variants of the leg constants start alike, as the first.
    """
    first = walk.constants[0]
    period = first.period_factor * walk.plan.stride_time
    angles = [walk.human.mean(name, GRID) for name in ANGLES]
    rates = [walk.human.rate(name, GRID) / period for name in ANGLES]
    pitch = np.deg2rad(first.trunk_pitch_deg) + walk.body.trunk_lean
    return np.stack([*angles, *rates, np.full(len(GRID), pitch)], axis=-1)
