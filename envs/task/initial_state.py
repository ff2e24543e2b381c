"""Start episodes: in the target's posture in single support, or standing, with the lowest point on the floor."""

from collections.abc import Iterable

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import ANGLES

from ..control.constants import LegConstants
from ..control.phase_table import GRID, PhaseTable, leg_phases
from ..control.reference_walk import ReferenceWalk
from ..control.subjects import Subjects
from ..physics.contact import CONTACTS
from ..physics.model import ANKLE, HIP, JOINTS, LEFT, RIGHT
from ..physics.simulation import Simulation

START_PHASES = (0.08, 0.38)
"""Range of stride phases of both legs at a random start; chosen: near double support bodies fall."""
_MOMENT = 1e-5
"""Time over which the motion of the stance foot at a start is measured [s]; chosen, its square is lost in rounding."""
_SWINGS_FROM = 0.6
"""Stride phase from which a leg swings, about that of toe-off."""
START_DEPTH = 0.001
"""Initial depth of the lowest contact point in the floor [m at 1.70 m]; chosen, about the depth under body weight."""


def start_table(rows: Iterable[tuple[LegConstants, ReferenceWalk]]) -> PhaseTable:
    """Return a table of the posture at a start over the stride, a row for each of `rows`, curves as `_start_curves`."""
    return PhaseTable(np.stack([_start_curves(walk) for _, walk in rows]))


def random_phase(random: np.random.Generator) -> float:
    """Draw a stride phase of the left leg [0, 1) in the single support of either leg, each with the same chance."""
    return (random.uniform(*START_PHASES) + 0.5 * random.integers(2)) % 1.0


def walking_posture(
    table: PhaseTable, subjects: Subjects, ids: NDArray, left_phase: NDArray
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Return the posture in which environments `ids` (K,) start to walk, at the phases `left_phase` (K,) of the left
    leg.

    `table` comes from `start_table`. Returns joint angles, those of the hips to the vertical, and their rates, (K,
    side, joint) each [rad, rad/s]; trunk pitch (K,) [rad]; commanded speed (K,) [m/s]. A device with a rest angle hangs
    at it on the leg that swings: let go elsewhere, a stiff and light foot would strike back.
    """
    phase = leg_phases(left_phase)
    curves = table.at(phase, subjects.place[ids])  # (K, side, 9) as `_start_curves`; the last, pitch
    angle = curves[..., : len(JOINTS)]
    velocity = curves[..., len(JOINTS) : -1] / subjects.scale["time"][ids, None, None]
    feet = subjects.rows["feet"]
    hangs = (feet["rests"][ids] > 0) & (phase > _SWINGS_FROM)[..., None]
    angle[..., ANKLE:] = np.where(hangs, feet["rest"][ids], angle[..., ANKLE:])
    velocity[..., ANKLE:] = np.where(hangs, 0.0, velocity[..., ANKLE:])
    return angle, velocity, curves[:, 0, -1], subjects.speed[ids]


def place(
    simulation: Simulation,
    subjects: Subjects,
    ids: NDArray,
    posture: tuple[NDArray, NDArray, NDArray, NDArray],
    noise: NDArray,
    left_phase: NDArray | None = None,
) -> None:
    """Put simulations into a posture, with the lowest contact point of each `START_DEPTH` in the floor.

    Locked joints start at their rest angle. The hips move forward at the speed of the posture, or so that the foot in
    stance rests.

    Args:
        simulation: the N simulations.
        subjects: their bodies and feet.
        ids: (K,) indices of the simulations that start.
        posture: angles (K, side, joint) [rad] and their rates [rad/s], pitch of the trunk (K,) [rad] and forward speed
            (K,) [m/s], of `walking_posture` or `Standing.reset`.
        noise: (K, 2, side, joint) relative error of angles ([:, 0]) and rates ([:, 1]) [-].
        left_phase: (K,) stride phase of the left leg, to let the foot in stance rest; None for the posture's speed.
    """
    angle, velocity, pitch, speed = posture
    angle = angle * (1.0 + noise[:, 0])
    velocity = velocity * (1.0 + noise[:, 1])
    angle[..., HIP] += pitch[:, None]  # from the thigh's angle to the vertical to that to the trunk
    feet = subjects.rows["feet"]
    locked = feet["locked"][ids] > 0
    angle[..., ANKLE:] = np.where(locked, feet["rest"][ids], angle[..., ANKLE:])
    velocity[..., ANKLE:] = np.where(locked, 0.0, velocity[..., ANKLE:])
    base, rate = np.zeros((2, len(ids), 3))  # of the hips: x [m], z [m], pitch [rad], and their rates
    base[:, 2] = pitch
    rate[:, 0] = speed
    if left_phase is not None:
        rate[:, :2] = -_foot_velocity(simulation, ids, base, angle, velocity, np.where(left_phase < 0.5, LEFT, RIGHT))
    simulation.reset(ids, base, rate, angle, velocity)
    # With the hips at height 0 the height of the lowest point says how far to lift the body.
    lowest = simulation.contact_points(ids)[..., 1].min(axis=(1, 2))  # over sides and contacts
    simulation.lift(ids, -lowest - START_DEPTH * simulation.body.length_scale * subjects.scale["length"][ids])


def _foot_velocity(
    simulation: Simulation, ids: NDArray, base: NDArray, angle: NDArray, velocity: NDArray, side: NDArray
) -> NDArray:
    """Return the velocity (K, 2) of the lowest contact of the foot on the given side (K,) while the hips rest: forward,
    and up from the ground [m/s]; `base`, `angle` and `velocity` as for `Simulation.reset`, which is called."""
    before, after = np.empty((2, len(ids), len(CONTACTS), 2))
    for points, moment in ((before, -_MOMENT), (after, _MOMENT)):
        simulation.reset(ids, base, np.zeros_like(base), angle + moment * velocity, velocity)
        points[:] = simulation.contact_points(ids)[np.arange(len(ids)), side]
    lowest = (before + after)[..., 1].argmin(axis=1)
    return ((after - before) / (2.0 * _MOMENT))[np.arange(len(ids)), lowest]


def _start_curves(walk: ReferenceWalk) -> NDArray:
    """Return (SAMPLES, 9): the target's joint angles, the thigh's to the vertical, their rates, and the trunk's pitch.

    Angles in rad, rates in rad/s. All variants of the leg constants start like the first one.
    """
    first = walk.constants[0]
    period = first.period_factor * walk.plan.stride_time
    angles = [walk.target.mean(name, GRID) for name in ANGLES]
    rates = [walk.target.rate(name, GRID) / period for name in ANGLES]
    pitch = np.deg2rad(first.trunk_pitch_deg) + walk.body.trunk_lean + walk.plan.lean
    return np.stack([*angles, *rates, np.full(len(GRID), pitch)], axis=-1)
