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
    """Return thigh (to the vertical) and knee angle [rad], flexion positive, by leg inverse kinematics.

    The ankle is `forward` of and `down` from the hip [m]. An ankle out of reach gets a straight knee, one too near a
    knee flexed by pi.
    """
    square = np.square(forward) + np.square(down)
    # The knee by the law of cosines; the flexed knee puts the thigh ahead of the line from hip to ankle, by `lead`.
    cosine = (square - thigh_length**2 - shank_length**2) / (2 * thigh_length * shank_length)
    knee = np.arccos(np.clip(cosine, -1.0, 1.0))
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
    phase = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    x, z = motion.position(np.mod(2 * phase, 1.0) * motion.step_time)
    # The foot's frame stays for the whole stride, the CoM's frame moves on with each step.
    com = np.stack([x + feet.step_length * (phase >= 0.5), z])
    ankle, pitch, toe = _feet_over_stride(feet, human)
    half = POSTURE_SAMPLES // 2
    return legs_under(
        body,
        com,
        ankle,
        pitch,
        toe,
        lambda leg: leg + np.roll(leg, half, axis=-1),  # the other leg is half a stride later
        motion.slope,
        None if near is None else near.hip.T,
        lean,
    )


@lru_cache(maxsize=2)
def _feet_over_stride(feet: FootPath, human: HumanGait) -> tuple[NDArray, NDArray, NDArray]:
    """Return ankle (x, z) (2, samples) [m], foot pitch and toe angle (samples,) [rad] over the stride.

    Cached: one plan needs the same arrays a dozen times.
    """
    phase = np.arange(POSTURE_SAMPLES) / POSTURE_SAMPLES
    return np.stack(feet.ankle(phase)), feet.pitch(phase), toe_angle(feet, human, phase)


def legs_under(
    body: Body,
    com: NDArray,
    ankle: NDArray,
    pitch: NDArray,
    toe: NDArray,
    sum_over_legs: Callable[[NDArray], NDArray],
    slope: float = 0.0,
    near: NDArray | None = None,
    lean: float = 0.0,
) -> LegPostures:
    """Find the hip, and so the legs, that put the whole-body CoM at `com`, over given ankles and feet.

    Args:
        body: lengths and masses.
        com: (2, ...) CoM (x, z) [m].
        ankle: (2, ...) ankle (x, z) [m]. `ankle`, `pitch` and `toe` may have an axis of legs where `com` has length 1.
        pitch: (...) pitch of the foot [rad].
        toe: (...) angle of the toe [rad].
        sum_over_legs: adds up a leg's values (2, ...) over both legs, in the shape of `com`.
        slope: of the ground [rad].
        near: (2, ...) hip (x, z) at which the search starts [m].
        lean: pitch of the trunk off the posture with its CoM, and that of a load, upright over the hip [rad].

    The hip of the result is (..., 2).
    """
    foot_and_toe = _foot_moment(body, pitch, toe)
    # First guess: the hip is a tenth of the leg's length below the CoM.
    hip = com - np.array([0.0, 0.1 * body.leg_length])[:, *[None] * (com.ndim - 1)] if near is None else near
    trunk = hypot(*body.upper_moment) / body.total_mass  # shift of the body's CoM from the hip by trunk and load [m]
    # Fixed point: place the legs below the hip, then move the hip so that the CoM is right. A shift of the hip moves
    # the legs' masses, which shift the hip by a third as much the next time: the search converges quickly.
    for _ in range(60):  # some 25 are enough
        forward = ankle[0] - hip[0]
        down = hip[1] - ankle[1]
        thigh, knee = leg_angles(forward, down, body.thigh_length, body.shank_length)
        knee_joint = body.thigh_length * np.stack([np.sin(thigh), -np.cos(thigh)])
        shank = np.stack([np.sin(thigh - knee), -np.cos(thigh - knee)])
        # first mass moment of one leg about the hip [kg m]
        leg = (
            body.thigh_mass * body.thigh_com / body.thigh_length * knee_joint
            + body.shank_mass * (knee_joint + body.shank_com * shank)
            + (body.foot_mass + body.toe_mass) * np.stack([forward, -down])
            + foot_and_toe
        )
        com_from_hip = sum_over_legs(leg) / body.total_mass
        com_from_hip[0] += trunk * sin(slope + lean)
        com_from_hip[1] += trunk * cos(slope + lean)
        hip_change = np.abs(com - com_from_hip - hip).max()
        hip = com - com_from_hip
        if hip_change < 1e-12:
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
    """Return the toe joint's angle (samples,) [rad]: flat on the ground in stance, then on the tip, then in swing.

    The swing angle is the style's, or people's curve. From heel strike to foot flat the toe goes down in proportion to
    the foot's pitch.
    """
    style_angle = feet.style.toe_swing
    at_toe_off = human.mean("toe", feet.toe_off) if style_angle is None else style_angle
    in_air = human.mean("toe", phase) if style_angle is None else np.full(phase.shape, style_angle)
    landing = in_air * feet.pitch(phase) / feet.heel_strike_pitch
    rolling = feet.toe_pitch(phase) - feet.pitch(phase)
    # The bend at toe-off fades within the first third of swing.
    remaining = np.clip(1 - 3 * (phase - feet.toe_off) / (1 - feet.toe_off), 0.0, 1.0)
    swinging = in_air + remaining**2 * (feet.toe_off_pitch - feet.roll_pitch - at_toe_off)
    # Early in swing people's angle would take the tip into the floor: bend the toe up until its tip is at floor level.
    lifted = feet.ball_clearance(phase) + feet.body.toe_joint_height * (1 - cos(feet.roll_pitch))
    level = np.arcsin(np.clip(lifted / feet.body.toe_length, 0.0, 1.0))
    swinging = np.maximum(swinging, -feet.pitch(phase) - level)
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
