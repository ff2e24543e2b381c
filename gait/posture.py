"""The posture under a planned CoM: leg inverse kinematics, and the hip that makes the body's CoM the planned one."""

from dataclasses import dataclass
from math import cos, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .body import Body
from .cart_table import ComMotion
from .feet import FootPath, turned
from .human import HumanGait

GRID = 600
"""Samples a stride."""


def leg_angles(
    forward: ArrayLike, down: ArrayLike, thigh_length: float, shank_length: float
) -> tuple[NDArray, NDArray]:
    """Leg inverse kinematics: (thigh to the vertical, knee) [rad], flexion positive.

    `forward`, `down` [m]: the ankle from the hip. An ankle out of reach gets a straight knee.
    """
    square = np.square(forward) + np.square(down)
    cosine = (square - thigh_length**2 - shank_length**2) / (2 * thigh_length * shank_length)
    knee = np.arccos(np.clip(cosine, -1.0, 1.0))
    lead = np.arctan2(shank_length * np.sin(knee), thigh_length + shank_length * np.cos(knee))
    return np.arctan2(forward, down) + lead, knee


@dataclass(frozen=True, kw_only=True, eq=False)
class Legs:
    """One leg over its stride on the grid of phases: hip (x, z), joint angles, and hip to ankle [m]."""

    hip: NDArray
    thigh: NDArray
    knee: NDArray
    ankle: NDArray
    toe: NDArray
    reach: NDArray


def legs_under_com(body: Body, motion: ComMotion, feet: FootPath, human: HumanGait) -> Legs:
    """The posture, trunk upright, whose whole-body CoM is the planned one."""
    phase = np.arange(GRID) / GRID
    x, z = motion.position(np.mod(2 * phase, 1.0) * motion.step_time)
    com = np.stack([x + feet.step_length * (phase >= 0.5), z])
    ankle = np.stack(feet.ankle(phase))
    pitch = feet.pitch(phase)
    toe = _toe_angle(feet, human, phase)
    foot_and_toe = _foot_moment(body, pitch, toe)

    hip = com - np.array([[0.0], [0.1 * body.leg_length]])
    # The legs' masses move the hip by a third of what the hip moves them: this contracts quickly.
    for _ in range(60):
        forward, down = ankle[0] - hip[0], hip[1] - ankle[1]
        thigh, knee = leg_angles(forward, down, body.thigh_length, body.shank_length)
        knee_joint = body.thigh_length * np.stack([np.sin(thigh), -np.cos(thigh)])
        shank = np.stack([np.sin(thigh - knee), -np.cos(thigh - knee)])
        leg = (
            body.thigh_mass * body.thigh_com / body.thigh_length * knee_joint
            + body.shank_mass * (knee_joint + body.shank_com * shank)
            + (body.foot_mass + body.toe_mass) * np.stack([forward, -down])
            + foot_and_toe
        )
        com_from_hip = (leg + np.roll(leg, GRID // 2, axis=-1)) / body.mass
        com_from_hip[1] += body.trunk_mass * body.trunk_com_above_hip / body.mass
        moved = np.abs(com - com_from_hip - hip).max()
        hip = com - com_from_hip
        if moved < 1e-12:
            break
    reach = np.hypot(forward, down)
    return Legs(hip=hip.T, thigh=thigh, knee=knee, ankle=pitch - thigh + knee, toe=toe, reach=reach)


def _foot_moment(body: Body, pitch: NDArray, toe: NDArray) -> NDArray:
    """First mass moment (x, z) [kg m] of foot and toe about the ankle."""
    forward, below = body.foot_com
    toe_joint = np.stack(turned(pitch, body.ankle_to_toe_joint, body.toe_joint_height - body.ankle_height))
    foot_com = np.stack(turned(pitch, forward, -below))
    toe_com = toe_joint + np.stack(turned(pitch + toe, body.toe_com, 0.0))
    return body.foot_mass * foot_com + body.toe_mass * toe_com


def _toe_angle(feet: FootPath, human: HumanGait, phase: NDArray) -> NDArray:
    """Toe joint [rad]: flat on the ground in stance, people's posture in swing, laid down with the foot."""
    people = human.mean("toe", phase)
    landing = people * feet.pitch(phase) / feet.heel_strike_pitch
    rolling = -feet.pitch(phase)
    # The toe is back in people's posture a third of swing after toe-off.
    left = np.clip(1 - 3 * (phase - feet.toe_off) / (1 - feet.toe_off), 0.0, 1.0)
    swinging = people + left**2 * (feet.toe_off_pitch - human.mean("toe", feet.toe_off))
    return np.select(
        [phase < feet.foot_flat, phase <= feet.heel_off, phase <= feet.toe_off], [landing, 0.0, rolling], swinging
    )


def full_reach(body: Body, knee: float) -> float:
    """Hip to ankle [m] at a knee flexion [rad]."""
    a, b = body.thigh_length, body.shank_length
    return sqrt(a**2 + b**2 + 2 * a * b * cos(knee))
