"""Compute the posture under a planned CoM: leg inverse kinematics, and the hip that puts the body's CoM in its
place.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import cos, degrees, hypot, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..body.body import Body
from ..body.rockers import turned
from ..people.human import HumanGait
from .cart_table import ComMotion
from .foot import FootPath

POSTURE_SAMPLES = 600
"""Samples of a stride; chosen."""
STRAIGHTEST_KNEE = 0.06
"""Least knee flexion of the stride [rad], which sets the height of the CoM; chosen: people's is 0.085 at 1.2 m/s."""
LOWEST_HIP = 0.12
"""Largest mean depth of the hip below standing [leg lengths]; chosen."""
LOWEST_COM = 0.8
"""Lowest CoM to try [leg lengths]; chosen."""
DEEPEST_KNEE_DEG = 135.0
"""Largest knee flexion [deg]: the range of motion of the American Academy of Orthopaedic Surgeons (1965)."""


def leg_angles(
    forward: ArrayLike, down: ArrayLike, thigh_length: float, shank_length: float
) -> tuple[NDArray, NDArray]:
    """Return (thigh to the vertical, knee) [rad], flexion positive, by leg inverse kinematics.

    `forward`, `down` [m]: the ankle from the hip. An ankle out of reach gets a straight knee.
    """
    square = np.square(forward) + np.square(down)
    cosine = (square - thigh_length**2 - shank_length**2) / (2 * thigh_length * shank_length)
    knee = np.arccos(np.clip(cosine, -1.0, 1.0))
    lead = np.arctan2(shank_length * np.sin(knee), thigh_length + shank_length * np.cos(knee))
    return np.arctan2(forward, down) + lead, knee


@dataclass(frozen=True, kw_only=True, eq=False)
class LegPostures:
    """One leg over its stride, sampled: hip (x, z) and hip to ankle [m], joint angles [rad]."""

    hip: NDArray
    thigh: NDArray
    knee: NDArray
    ankle: NDArray
    toe: NDArray
    reach: NDArray


def legs_under_com(
    body: Body,
    motion: ComMotion,
    feet: FootPath,
    human: HumanGait,
    near: LegPostures | None = None,
    lean: float = 0.0,
) -> LegPostures:
    """Return the postures whose whole-body CoM is the planned one, the trunk upright, or leaning under a load.

    The search starts at the postures `near`, if given. `lean` [rad] is that of `ComPlan`. Positions are in the frame of
    the ground; trunk and thigh angles are to the true vertical, whatever the slope.
    """
    phase = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    x, z = motion.position(np.mod(2 * phase, 1.0) * motion.step_time)
    com = np.stack([x + feet.step_length * (phase >= 0.5), z])
    ankle, pitch, toe = _feet_over_stride(feet, human)
    half = POSTURE_SAMPLES // 2
    return legs_under(
        body,
        com,
        ankle,
        pitch,
        toe,
        lambda leg: leg + np.roll(leg, half, axis=-1),
        motion.slope,
        near and near.hip.T,
        lean,
    )


@lru_cache(maxsize=2)
def _feet_over_stride(feet: FootPath, human: HumanGait) -> tuple[NDArray, NDArray, NDArray]:
    """Return ankle (2, samples), foot pitch and toe angle (samples,); cached, as one plan asks for them a dozen
    times."""
    phase = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    return np.stack(feet.ankle(phase)), feet.pitch(phase), toe_angle(feet, human, phase)


def legs_under(
    body: Body,
    com: NDArray,
    ankle: NDArray,
    pitch: NDArray,
    toe: NDArray,
    both: Callable[[NDArray], NDArray],
    slope: float = 0.0,
    near: NDArray | None = None,
    lean: float = 0.0,
) -> LegPostures:
    """Return the posture whose whole-body CoM is `com` (2, ...) [m].

    Args:
        body: of the posture.
        com: (2, ...) CoM (x, z) [m].
        ankle: (2, ...) [m]; with `pitch` and `toe` it may have an axis of legs where `com` has one of length 1.
        pitch: (...) of the foot [rad].
        toe: (...) angle of the toe [rad].
        both: sums a leg's values over both legs, in the shape of `com`.
        slope: of the ground [rad].
        near: (2, ...) hip at which the search starts [m].
        lean: pitch of the trunk off the posture with its CoM, and that of a load, upright over the hip [rad].

    The hip of the result is (..., 2).
    """
    foot_and_toe = _foot_moment(body, pitch, toe)
    hip = com - np.array([0.0, 0.1 * body.leg_length])[:, *[None] * (com.ndim - 1)] if near is None else near
    trunk = hypot(*body.upper_moment) / body.total_mass
    # The legs' masses move the hip by a third of what the hip moves them: this contracts quickly.
    for _ in range(60):
        forward = ankle[0] - hip[0]
        down = hip[1] - ankle[1]
        thigh, knee = leg_angles(forward, down, body.thigh_length, body.shank_length)
        knee_joint = body.thigh_length * np.stack([np.sin(thigh), -np.cos(thigh)])
        shank = np.stack([np.sin(thigh - knee), -np.cos(thigh - knee)])
        leg = (
            body.thigh_mass * body.thigh_com / body.thigh_length * knee_joint
            + body.shank_mass * (knee_joint + body.shank_com * shank)
            + (body.foot_mass + body.toe_mass) * np.stack([forward, -down])
            + foot_and_toe
        )
        com_from_hip = both(leg) / body.total_mass
        com_from_hip[0] += trunk * sin(slope + lean)
        com_from_hip[1] += trunk * cos(slope + lean)
        moved = np.abs(com - com_from_hip - hip).max()
        hip = com - com_from_hip
        if moved < 1e-12:
            break
    return LegPostures(
        hip=np.moveaxis(hip, 0, -1),
        thigh=np.asarray(thigh + slope),
        knee=knee,
        ankle=pitch - thigh + knee,
        toe=toe,
        reach=np.hypot(forward, down),
    )


def _foot_moment(body: Body, pitch: NDArray, toe: NDArray) -> NDArray:
    """Return the first mass moment (x, z) [kg m] of foot and toe about the ankle."""
    forward, below = body.foot_com
    toe_joint = np.stack(turned(pitch, body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height))
    foot_com = np.stack(turned(pitch, forward, -below))
    toe_com = toe_joint + np.stack(turned(pitch + toe, body.toe_com, 0.0))
    return body.foot_mass * foot_com + body.toe_mass * toe_com


def toe_angle(feet: FootPath, human: HumanGait, phase: NDArray) -> NDArray:
    """Return the toe joint's angle [rad]: flat on the ground in stance, then on its tip; in swing the style's, else
    people's.

    As the foot goes flat, the toe is laid down with it.
    """
    swing = feet.style.toe_swing
    at_toe_off = human.mean("toe", feet.toe_off) if swing is None else swing
    people = human.mean("toe", phase) if swing is None else np.full(phase.shape, swing)
    landing = people * feet.pitch(phase) / feet.heel_strike_pitch
    rolling = feet.toe_pitch(phase) - feet.pitch(phase)
    # The toe is back in its posture a third of swing after toe-off.
    left = np.clip(1 - 3 * (phase - feet.toe_off) / (1 - feet.toe_off), 0.0, 1.0)
    swinging = people + left**2 * (feet.toe_off_pitch - feet.roll_pitch - at_toe_off)
    # The tip stays above the floor, under which people's posture would take it early in swing.
    lifted = feet.ball_clearance(phase) + feet.body.toe_joint_height * (1 - cos(feet.roll_pitch))
    level = np.arcsin(np.clip(lifted / feet.body.toe_length, 0.0, 1.0))
    swinging = np.maximum(swinging, -feet.pitch(phase) - level)
    return np.select(
        [phase < feet.foot_flat, phase <= feet.heel_off, phase <= feet.toe_off], [landing, 0.0, rolling], swinging
    )


def full_reach(body: Body, knee: float) -> float:
    """Return the distance of hip and ankle [m] at a knee flexion [rad]."""
    a = body.thigh_length
    b = body.shank_length
    return sqrt(a**2 + b**2 + 2 * a * b * cos(knee))


def highest_legs(
    body: Body, legs_at: Callable[[float], tuple[ComMotion, LegPostures]]
) -> tuple[ComMotion, LegPostures]:
    """Return the highest CoM, and its legs, at which no knee is straighter than `STRAIGHTEST_KNEE`."""
    reach = full_reach(body, STRAIGHTEST_KNEE)
    height = 1.08 * body.leg_length
    for _ in range(50):
        motion, legs = legs_at(height)
        lacking = float(legs.reach.max()) - reach
        if abs(lacking) < 1e-6:
            return motion, legs
        # A leg leans little, so lowering the CoM by what it lacks leaves it a tenth of that.
        height -= lacking
        if height < LOWEST_COM * body.leg_length:
            break
    raise SpringfootError(
        f"legs too short for this step: the CoM would come down to {height:.3f} m, "
        f"{LOWEST_COM * body.leg_length - height:.3f} m lower than allowed; walk slower"
    )


def refuse_impossible_legs(body: Body, legs: LegPostures) -> None:
    """Raise `SpringfootError` for legs that would have to be longer, or bend further, than is possible."""
    too_far = float(legs.reach.max()) - full_reach(body, 0.0)
    if too_far > 0:
        phase = int(legs.reach.argmax()) / POSTURE_SAMPLES
        raise SpringfootError(f"legs too short by {too_far:.3f} m at {phase:.0%} of the stride: lower com_height")
    below = body.leg_length - float(legs.hip[:, 1].mean())
    if below > LOWEST_HIP * body.leg_length:
        raise SpringfootError(
            f"legs too short for this step: the hip would be {below:.3f} m below standing on average, "
            f"{below - LOWEST_HIP * body.leg_length:.3f} m more than allowed"
        )
    bent = degrees(float(legs.knee.max()))
    if bent > DEEPEST_KNEE_DEG:
        raise SpringfootError(
            f"knee bent by {bent:.0f} deg at {int(legs.knee.argmax()) / POSTURE_SAMPLES:.0%} of the stride, "
            f"{bent - DEEPEST_KNEE_DEG:.1f} deg more than it can: less clearance helps"
        )
