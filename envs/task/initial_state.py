"""How an episode starts: at people's posture in single support, or standing, the lowest point just in the floor."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from springfoot.gait.human import ANGLES

from ..control.leg_constants import LegConstants
from ..control.phase_table import GRID, PhaseTable, leg_phases
from ..control.reference_walk import ReferenceWalk
from ..control.subjects import Subjects
from ..physics.model import HIP
from ..physics.simulation import Simulation

START_PHASES = (0.08, 0.38)
"""A random start lies in this part of either leg's stance: near double support a planned state falls."""
START_DEPTH = 0.001
"""The lowest contact point starts this far in the floor [m at 1.70 m]: about its rest under body weight."""


def start_table(rows: Iterable[tuple[LegConstants, ReferenceWalk]]) -> PhaseTable:
    """People's posture over the stride for each row of the subjects' tables (`envs.control.reference_walk.rows`)."""
    return PhaseTable(np.stack([_start_curves(walk) for _, walk in rows]))


def random_phase(random: np.random.Generator) -> float:
    """A stride phase of the left leg in either leg's single support."""
    return (random.uniform(*START_PHASES) + 0.5 * random.integers(2)) % 1.0


def walking_posture(
    table: PhaseTable, subjects: Subjects, ids: NDArray, left_phase: NDArray
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """People's joint angles and rates (K, side, joint) at `left_phase` (K,) of `table`, the hips' angles against the
    vertical, trunk pitch (K,) [rad] and the commanded speed (K,) [m/s] of `ids` (K,)."""
    curves = table.at(leg_phases(left_phase), subjects.place[ids])
    angle, velocity = np.split(curves[..., :-1], 2, axis=-1)
    return angle, velocity / subjects.scale[ids]["time"][:, None, None], curves[:, 0, -1], subjects.speed[ids]


def place(
    simulation: Simulation,
    subjects: Subjects,
    ids: NDArray,
    posture: tuple[NDArray, NDArray, NDArray, NDArray],
    noise: NDArray,
) -> None:
    """Put `ids` (K,) into a `posture` as of `walking_posture`.

    `noise` (K, 2, side, joint) is the relative error of its angles and rates.
    """
    (angle, velocity, pitch, speed), scale = posture, subjects.scale[ids]
    angle, velocity = angle * (1.0 + noise[:, 0]), velocity * (1.0 + noise[:, 1])
    angle[..., HIP] += pitch[:, None]
    base, rate = np.zeros((2, len(ids), 3))
    base[:, 2], rate[:, 0] = pitch, speed
    simulation.reset(ids, base, rate, angle, velocity)
    lowest = simulation.measure().contact[ids, ..., 1].min(axis=(1, 2))
    base[:, 1] = -lowest - START_DEPTH * simulation.body.length_scale * scale["length"]
    simulation.reset(ids, base, rate, angle, velocity)


def _start_curves(walk: ReferenceWalk) -> NDArray:
    """(SAMPLES, 9) people's joint angles, hip as thigh to the vertical [rad], their rates [rad/s], trunk pitch [rad].

    Variants of the leg constants start alike, as the first.
    """
    first = walk.constants[0]
    period = first.period_factor * walk.plan.stride_time
    angles = [walk.human.mean(name, GRID) for name in ANGLES]
    rates = [walk.human.rate(name, GRID) / period for name in ANGLES]
    pitch = np.deg2rad(first.trunk_pitch_deg) + walk.body.trunk_lean
    return np.stack([*angles, *rates, np.full(len(GRID), pitch)], axis=-1)
