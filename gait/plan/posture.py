"""Compute the posture under a planned CoM: leg inverse kinematics, and the hip that puts the body's CoM on the plan."""

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
from .cart_table import Bob, ComMotion
from .foot import FootPath

POSTURE_SAMPLES = 600
"""Samples of a stride; chosen."""
STRIDE_PHASES = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
"""Phases of these samples."""
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
    """Return thigh (to the vertical) and knee angle [rad], flexion positive, by leg inverse kinematics.

    The ankle is `forward` of and `down` from the hip [m]. An ankle out of reach gets a straight knee, one too near a
    knee flexed by pi.
    """
    square = np.square(forward) + np.square(down)
    # The knee by the law of cosines; the flexed knee puts the thigh ahead of the line from hip to ankle, by `lead`.
    cosine = square - thigh_length**2
    cosine -= shank_length**2
    cosine /= 2 * thigh_length * shank_length
    knee = np.arccos(np.minimum(np.maximum(cosine, -1.0), 1.0))  # `np.clip` takes several times as long
    lead = np.arctan2(shank_length * np.sin(knee), thigh_length + shank_length * np.cos(knee))
    return np.arctan2(forward, down) + lead, knee


@dataclass(frozen=True, kw_only=True, eq=False)
class LegPostures:
    """One leg's postures; `legs_under_com` samples them over the stride. Flexion, dorsiflexion, toe up positive."""

    hip: NDArray
    """(..., 2) hip (x, z) [m]."""
    thigh: NDArray
    """(...) thigh to the vertical [rad]."""
    knee: NDArray
    """(...) [rad]."""
    ankle: NDArray
    """(...) [rad]."""
    toe: NDArray
    """(...) [rad]."""
    reach: NDArray
    """(...) distance from hip to ankle [m]."""


def legs_under_com(
    body: Body,
    motion: ComMotion,
    feet: FootPath,
    human: HumanGait,
    near: LegPostures | None = None,
    lean: float = 0.0,
) -> LegPostures:
    """Find one leg's postures over the stride that put the whole-body CoM on the planned CoM.

    The trunk is upright, or leans under a load, and by `lean` [rad] forward besides. The search starts at the postures
    `near`; None: at a hip a tenth of the leg's length below the CoM. Positions are in the frame of the ground; trunk
    and thigh angles are to the true vertical, on slopes too.
    """
    com = com_over_stride(motion) + np.outer([feet.step_length, 0.0], STRIDE_PHASES >= 0.5)
    ankle, pitch, toe, foot_and_toe = _feet_over_stride(feet, human)
    # First guess: the hip is a tenth of the leg's length below the CoM.
    hip = com - np.array([[0.0], [0.1 * body.leg_length]]) if near is None else near.hip.T
    upright = motion.slope + lean
    # Shift of the body's CoM from the hip by trunk and load [m].
    trunk = hypot(*body.upper_moment) / body.total_mass * np.array([[sin(upright)], [cos(upright)]])
    thigh_length = body.thigh_length
    shank_length = body.shank_length
    shank_com = body.shank_com
    shank_mass = body.shank_mass
    of_thigh = body.thigh_mass * body.thigh_com / thigh_length
    of_foot = body.foot_mass + body.toe_mass
    total_mass = body.total_mass
    turns = np.empty((2, POSTURE_SAMPLES))  # of thigh and shank
    directions = np.empty((2, *turns.shape))  # x and z of each
    to_ankle, knee_joint, leg, part = np.empty((4, *turns.shape))
    half = POSTURE_SAMPLES // 2
    com = com.reshape(2, 2, half)  # coordinate, half of the stride, phase
    # Fixed point: place the legs below the hip, then move the hip so that the CoM is right. A shift of the hip moves
    # the legs' masses, which shift the hip by a third as much the next time: the search converges quickly.
    for _ in range(60):  # some 25 are enough
        np.subtract(ankle, hip, out=to_ankle)
        thigh, knee = leg_angles(to_ankle[0], -to_ankle[1], thigh_length, shank_length)
        turns[0] = thigh
        np.subtract(thigh, knee, out=turns[1])
        np.sin(turns, out=directions[0])
        np.negative(np.cos(turns, out=directions[1]), out=directions[1])
        # First mass moment of one leg about the hip [kg m]: thigh, shank, foot with toe; in place, for arrays of
        # this size half of the time goes into new memory.
        np.multiply(thigh_length, directions[:, 0], out=knee_joint)
        np.multiply(of_thigh, knee_joint, out=leg)
        np.multiply(shank_com, directions[:, 1], out=part)
        part += knee_joint
        part *= shank_mass
        leg += part
        leg += np.multiply(of_foot, to_ankle, out=part)
        leg += foot_and_toe
        # The other leg is half a stride later, so that the CoM is at the same place from the hip in both halves.
        com_from_hip = leg[:, :half] + leg[:, half:]
        com_from_hip /= total_mass
        com_from_hip += trunk
        before = hip
        hip = (com - com_from_hip[:, None]).reshape(before.shape)
        np.subtract(hip, before, out=part)
        if np.abs(part, out=part).max() < 1e-12:
            break
    return LegPostures(
        hip=hip.T,
        thigh=np.asarray(thigh + motion.slope),
        knee=knee,
        ankle=pitch - thigh + knee,
        toe=toe,
        reach=np.hypot(*to_ankle),
    )


@lru_cache(maxsize=2)
def com_over_stride(motion: ComMotion) -> NDArray:
    """Return the CoM (x, z) (2, samples) [m] at `STRIDE_PHASES`, in the frame of each step; cached."""
    return np.stack([motion.path(_step_times(motion.step_time)), motion.height + _bob_over_stride(motion.bob)])


@lru_cache(maxsize=2)
def _bob_over_stride(bob: Bob) -> NDArray:
    """Return the rise and fall of the CoM (samples,) [m] at `STRIDE_PHASES`; cached."""
    return bob(_step_times(bob.step_time))


def _step_times(step_time: float) -> NDArray:
    """Return the time in a step (samples,) [s] at `STRIDE_PHASES`."""
    return np.mod(2 * STRIDE_PHASES, 1.0) * step_time


@lru_cache(maxsize=2)
def _feet_over_stride(feet: FootPath, human: HumanGait) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Return ankle (x, z) (2, samples) [m], foot pitch and toe angle (samples,) [rad] over the stride, and the first
    mass moment (x, z) (2, samples) [kg m] of foot and toe about the ankle.

    Cached: one plan needs the same arrays a dozen times.
    """
    pose = feet.pose(STRIDE_PHASES)
    pitch = pose[2]
    toe = toe_angle(feet, human, STRIDE_PHASES)
    return pose[:2], pitch, toe, _foot_moment(feet.body, pitch, toe)


def _foot_moment(body: Body, pitch: NDArray, toe: NDArray) -> NDArray:
    """Return the first mass moment (x, z) [kg m] of foot and toe about the ankle."""
    forward, below = body.foot_com
    toe_joint = np.stack(turned(pitch, body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height))
    foot_com = np.stack(turned(pitch, forward, -below))
    toe_com = toe_joint + np.stack(turned(pitch + toe, body.toe_com, 0.0))
    return body.foot_mass * foot_com + body.toe_mass * toe_com


def toe_angle(feet: FootPath, human: HumanGait, phase: NDArray) -> NDArray:
    """Return the toe joint's angle (samples,) [rad]: flat on the ground in stance, then on the tip, then in swing.

    The swing angle is the style's, or people's curve. From heel strike to foot flat the toe goes down in proportion to
    the foot's pitch.
    """
    style_angle = feet.style.toe_swing
    at_toe_off = human.mean("toe", feet.toe_off) if style_angle is None else style_angle
    in_air = human.mean("toe", phase) if style_angle is None else np.full(phase.shape, style_angle)
    pitch = feet.pitch(phase)
    landing = in_air * pitch / feet.heel_strike_pitch
    rolling = feet.toe_pitch(phase) - pitch
    # The bend at toe-off fades within the first third of swing.
    remaining = np.clip(1 - 3 * (phase - feet.toe_off) / (1 - feet.toe_off), 0.0, 1.0)
    swinging = in_air + remaining**2 * (feet.toe_off_pitch - feet.roll_pitch - at_toe_off)
    # Early in swing people's angle would take the tip into the floor: bend the toe up until its tip is at floor level.
    lifted = feet.ball_clearance(phase) + feet.body.toe_joint_height * (1 - cos(feet.roll_pitch))
    level = np.arcsin(np.clip(lifted / feet.body.toe_length, 0.0, 1.0))
    swinging = np.maximum(swinging, -pitch - level)
    return np.select(
        [phase < feet.foot_flat, phase <= feet.heel_off, phase <= feet.toe_off], [landing, 0.0, rolling], swinging
    )


def full_reach(body: Body, knee: float) -> float:
    """Return the distance from hip to ankle [m] at the flexion `knee` [rad], by the law of cosines."""
    a = body.thigh_length
    b = body.shank_length
    return sqrt(a**2 + b**2 + 2 * a * b * cos(knee))


def highest_legs(
    body: Body, legs_at: Callable[[float], tuple[ComMotion, LegPostures]]
) -> tuple[ComMotion, LegPostures]:
    """Find the highest CoM at which no knee is straighter than `STRAIGHTEST_KNEE`: return its motion, and the legs.

    `legs_at` plans for a mean CoM height [m]. Raises `SpringfootError` for a CoM lower than `LOWEST_COM`.
    """
    reach = full_reach(body, STRAIGHTEST_KNEE)
    height = 1.08 * body.leg_length  # a first guess
    for _ in range(50):
        motion, legs = legs_at(height)
        lacking = float(legs.reach.max()) - reach
        if abs(lacking) < 1e-6:
            return motion, legs
        # Legs are nearly vertical: lowering the CoM by the lacking length leaves a tenth of that length lacking.
        height -= lacking
        if height < LOWEST_COM * body.leg_length:
            break
    raise SpringfootError(
        f"legs too short for this step: the CoM would come down to {height:.3f} m, "
        f"{LOWEST_COM * body.leg_length - height:.3f} m lower than allowed; walk slower"
    )


def refuse_impossible_legs(body: Body, legs: LegPostures) -> None:
    """Raise `SpringfootError` for legs too short, a hip lower than `LOWEST_HIP`, a knee beyond `DEEPEST_KNEE_DEG`."""
    too_far = float(legs.reach.max()) - full_reach(body, 0.0)
    if too_far > 0:
        phase = int(legs.reach.argmax()) / POSTURE_SAMPLES
        raise SpringfootError(f"legs too short by {too_far:.3f} m at {phase:.0%} of the stride: lower com_height")
    below = body.leg_length - float(legs.hip[:, 1].mean())
    if below > LOWEST_HIP * body.leg_length:
        raise SpringfootError(
            f"legs too short for this step: the hip would be {below:.3f} m below standing on average, "
            f"{1000 * (below - LOWEST_HIP * body.leg_length):.1f} mm more than allowed"
        )
    bent = degrees(float(legs.knee.max()))
    if bent > DEEPEST_KNEE_DEG:
        raise SpringfootError(
            f"knee bent by {bent:.0f} deg at {int(legs.knee.argmax()) / POSTURE_SAMPLES:.0%} of the stride, "
            f"{bent - DEEPEST_KNEE_DEG:.1f} deg more than it can: less clearance helps"
        )
