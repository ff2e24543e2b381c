"""Compute motion, load and joint moments of one leg as a chain of rigid segments.

Thigh, shank, foot and toe hang below the hip. The frame is fixed to the ground: x forward along it, z up at right
angles to it. A *turn* is a segment's angle in that frame, positive where its front goes up; the thigh's is its flexion.
A *moment* is the internal joint moment [N m] of muscles and springs: extension of hip and knee, plantarflexion of ankle
and toe positive, so that moment = -torque where torque is positive as the angle. Segment masses, centres and inertias
are `Body`'s. All arrays share their leading axes, written "..." below.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_number

from .body import ANGLES, Body, gravity
from .rockers import turned

JOINTS = ("hip", "knee", "ankle", "toe")
"""Joints of a leg from the top; joint i holds segment i of `LEG_SEGMENTS`."""
LEG_SEGMENTS = ("thigh", "shank", "foot", "toe")
FOOT_SEGMENT = LEG_SEGMENTS.index("foot")
TOE_SEGMENT = LEG_SEGMENTS.index("toe")

_FOOT_SEGMENTS = 2
"""Segments of a foot: foot and toe."""
_IN_PLANE = 2
"""Components of a vector in the plane: x and z."""
_MOMENT_SIGN = (-1.0, 1.0, -1.0, -1.0)
"""Internal moment over the turning moment on the segment below, in the order of `JOINTS`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LegMotion:
    """Motion of one leg; from `leg_motion`, or filled in exactly. Segments in the order of `LEG_SEGMENTS`."""

    turn: NDArray
    """(..., 4) segment turns [rad], positive with the front up."""
    rate: NDArray
    """(..., 4) rates of the turns [rad/s]."""
    acceleration: NDArray
    """(..., 4) accelerations of the turns [rad/s^2]."""
    hip: NDArray
    """(..., 2) hip (x, z) [m]; only its place relative to the load's points matters."""
    hip_acceleration: NDArray
    """(..., 2) acceleration of the hip [m/s^2]."""

    def __post_init__(self) -> None:
        leading = self.hip.shape[:-1]
        segments = len(LEG_SEGMENTS)
        of_segments = {"turn": segments, "rate": segments, "acceleration": segments}
        _require_shapes(self, {**of_segments, "hip": _IN_PLANE, "hip_acceleration": _IN_PLANE}, leading)


@dataclass(frozen=True, kw_only=True, eq=False)
class FootLoad:
    """Load of the ground on the two segments of a foot: foot (first), toe (second)."""

    force: NDArray
    """(..., 2, 2) force (forward, up) [N]."""
    point: NDArray
    """(..., 2, 2) a point (x, z) [m] of the force's line of action; irrelevant for a force of 0."""

    def __post_init__(self) -> None:
        leading = self.force.shape[:-2]
        _require_shapes(self, {"force": _IN_PLANE, "point": _IN_PLANE}, (*leading, _FOOT_SEGMENTS))


@dataclass(frozen=True, kw_only=True, eq=False)
class JointLoads:
    """Moments and forces in the joints, by joint."""

    moment: dict[str, NDArray]
    """(...) internal joint moments [N m], signs as in the module's head."""
    force: dict[str, NDArray]
    """(..., 2) net joint force (forward, up) [N] on the segment below, without that of muscles across the joint."""


# Motion and load ------------------------------------------------------------------------------------------


def segment_turns(angles: Mapping[str, ArrayLike], slope: float = 0.0) -> NDArray:
    """Return segment turns (..., 4) [rad] from the angles thigh (to the true vertical), knee, ankle, toe [rad].

    On a `slope` [rad], uphill positive, the frame leans with the ground.
    """
    thigh, knee, ankle, toe = np.broadcast_arrays(*(np.asarray(angles[name], float) for name in ANGLES))
    shank = thigh - slope - knee
    return np.stack([thigh - slope, shank, shank + ankle, shank + ankle + toe], -1)


def leg_motion(angles: Mapping[str, ArrayLike], hip: ArrayLike, tick: float, slope: float = 0.0) -> LegMotion:
    """Return the motion of a leg from samples every `tick` [s]: angles (T,) as in `segment_turns`, hip (x, z) (T, 2)
    [m].

    Rates and accelerations are those of the cubic splines through the samples: exact for cubics, else with an error of
    the order of tick^2, and larger in the first and last few samples. Nothing is smoothed: noise of e in the samples is
    noise of about 3 e / tick^2 in the accelerations, so filter measured data first. Raises `SpringfootError` for fewer
    than 4 samples or values that are not finite.
    """
    turns = segment_turns(angles, slope)
    hips = np.asarray(hip, float)
    if hips.shape != (len(turns), 2) or turns.ndim != 2:
        raise SpringfootError(
            f"angles and hip must have shapes (T,) and (T, 2), got {turns.shape[:-1]} and {hips.shape}"
        )
    samples = np.concatenate([turns, hips], -1)
    require_number("tick", tick, 0.0, unit="s", above=True)
    if len(samples) < 4 or not np.isfinite(samples).all():
        raise SpringfootError(f"angles and hip must be at least 4 finite samples, got {len(samples)}")
    spline = CubicSpline(tick * np.arange(len(samples)), samples)
    return motion_of(*(spline(spline.x, derivative) for derivative in range(3)))


def joint_positions(body: Body, turn: NDArray, hip: NDArray) -> dict[str, NDArray]:
    """Return joints (..., 2) (x, z) [m] by name, from segment turns (..., 4) [rad] and the hip (..., 2) [m]."""
    joints = [hip]
    # Each joint hangs on the joint above it.
    for index, offset in enumerate(_far_ends(body)):
        joints.append(joints[-1] + np.stack(turned(turn[..., index], *offset), -1))
    return dict(zip(JOINTS, joints, strict=True))


def motion_of(value: NDArray, rate: NDArray, acceleration: NDArray) -> LegMotion:
    """Return a leg's motion from arrays (..., 6) of values and of their first and second time derivatives.

    Columns are the turns of thigh, shank, foot and toe [rad], then x and z of the hip [m].
    """
    return LegMotion(
        turn=value[..., :4],
        rate=rate[..., :4],
        acceleration=acceleration[..., :4],
        hip=value[..., 4:],
        hip_acceleration=acceleration[..., 4:],
    )


def spin_rate(body: Body, motion: LegMotion, centre: NDArray) -> NDArray:
    """Return the rate of change (...) [N m] of a leg's angular momentum about `centre` (..., 2) [m], positive the way
    that `LegMotion.turn` is.

    `centre` is the CoM of the whole body, so that its own acceleration does not count in the sum over all parts.
    """
    _, coms, accelerations = _chain(body, motion)
    moments = _cross(coms - centre, accelerations)
    rate = np.zeros(motion.hip.shape[:-1])
    for index, (mass, inertia) in enumerate(_masses_and_inertias(body)):
        rate = rate + mass * moments[index] + inertia * motion.acceleration[..., index]
    return rate


def load_at(force: NDArray, cop: NDArray, toe_joint_x: ArrayLike) -> FootLoad:
    """Return the load of a force (..., 2) [N] at `cop` (..., 2) (x, z) [m]: on the toe if `cop` is ahead of the toe
    joint.

    `toe_joint_x` is the x of the toe joint [m]. As the centre of pressure passes the joint, the toe's moment starts
    with that of the forward force about the joint: its lever is the height of the joint.
    """
    ahead = (cop[..., 0] > np.asarray(toe_joint_x))[..., None]
    return FootLoad(
        force=np.stack([np.where(ahead, 0.0, force), np.where(ahead, force, 0.0)], -2),
        point=np.stack([cop, cop], -2),
    )


# Moments ----------------------------------------------------------------------------------------------------


def projection_moments(body: Body, motion: LegMotion, load: FootLoad) -> dict[str, NDArray]:
    """Return joint moments (...) [N m] by name from the ground reaction alone, r x F from each joint: equation (3).

    Wells 1981 (Bulletin of Prosthetics Research 18, 15-19): weight and inertia of the segments are left out. The toe
    joint carries the toe's load, the joints above both segments'. In the thesis's Equation (3) r runs from the ZMP to
    the joint, which is the torque with which the joint holds the load: the internal moment.
    """
    moments = {}
    for index, (name, joint) in enumerate(joint_positions(body, motion.turn, motion.hip).items()):
        turning = -_cross(load.point - joint[..., None, :], load.force)  # (..., 2): by the foot's load and the toe's
        # The toe joint carries the toe's load alone.
        moments[name] = _MOMENT_SIGN[index] * (turning[..., 1] if index == TOE_SEGMENT else turning.sum(-1))
    return moments


def inverse_dynamics(body: Body, motion: LegMotion, load: FootLoad, slope: float = 0.0) -> JointLoads:
    """Compute joint moments and forces by planar Newton-Euler inverse dynamics of toe, foot, shank, thigh, from the toe
    up.

    `motion` and `load` are of one leg, signs as in the module's head; `slope` of the ground [rad], uphill positive.
    Exact for the given turns, rates and accelerations. At the upper joint of each segment F = m (a - g) less the other
    forces on it, and the moment is I times the turn's acceleration less the other moments about the CoM, that of F
    included (Winter 2009, section 5.1).
    """
    joints, coms, accelerations = _chain(body, motion)
    # Loads at the upper joint of the segment below; nothing hangs on the toe.
    force = np.zeros(motion.hip.shape)
    turning = np.zeros(motion.hip.shape[:-1])
    moments = {}
    forces = {}
    for index in reversed(range(len(LEG_SEGMENTS))):
        mass, inertia = _masses_and_inertias(body)[index]
        com = coms[index]
        # Newton, and Euler about the segment's CoM, less the ground's push and the loads at the joint below. Of these
        # `force_below` is on the segment below: its reaction, on this one, is negative.
        force_below = force
        force = mass * (accelerations[index] - gravity(slope)) + force_below
        turning = inertia * motion.acceleration[..., index] + turning
        if index >= FOOT_SEGMENT:  # the ground pushes on foot and toe alone
            push = load.force[..., index - FOOT_SEGMENT, :]
            point = load.point[..., index - FOOT_SEGMENT, :]
            force = force - push
            turning = turning - _cross(point - com, push)
        if index < TOE_SEGMENT:
            turning = turning + _cross(joints[index + 1] - com, force_below)
        turning = turning - _cross(joints[index] - com, force)
        moments[JOINTS[index]] = _MOMENT_SIGN[index] * turning
        forces[JOINTS[index]] = force
    return JointLoads(moment={name: moments[name] for name in JOINTS}, force={name: forces[name] for name in JOINTS})


# Parts ------------------------------------------------------------------------------------------------------


def _require_shapes(holder: object, last: Mapping[str, int], leading: tuple[int, ...]) -> None:
    """Raise `SpringfootError` unless the arrays of the dataclass `holder` share their `leading` axes.

    `last` is name -> length of that array's last axis.
    """
    for name, size in last.items():
        shape = getattr(holder, name).shape
        if shape != (*leading, size):
            raise SpringfootError(f"{name} must have shape {(*leading, size)} as its companions, got {shape}")


def _cross(r: NDArray, force: NDArray) -> NDArray:
    """Return r x F in the plane, positive from x towards z: the sense of a turn."""
    return r[..., 0] * force[..., 1] - r[..., 1] * force[..., 0]


def _far_ends(body: Body) -> tuple[tuple[float, float], ...]:
    """Return the vectors (forward, up) [m] from the upper to the lower joint of thigh, shank and foot, at turn 0."""
    drop = body.ankle_height - body.toe_joint_height
    return (0.0, -body.thigh_length), (0.0, -body.shank_length), (body.ankle_to_toe_joint, -drop)


def _masses_and_inertias(body: Body) -> tuple[tuple[float, float], ...]:
    """Return mass [kg] and sagittal inertia about the CoM [kg m^2] of each segment."""
    return (
        (body.thigh_mass, body.thigh_inertia),
        (body.shank_mass, body.shank_inertia),
        (body.foot_mass, body.foot_inertia),
        (body.toe_mass, body.toe_inertia),
    )


def _chain(body: Body, motion: LegMotion) -> tuple[NDArray, NDArray, NDArray]:
    """Return of each segment, (4, ..., 2), its upper joint and its CoM [m], and the acceleration of its CoM [m/s^2]."""
    # Segments and coordinates in front, so that the values of each lie together in memory.
    turn, acceleration, hip, hip_acceleration = (
        np.ascontiguousarray(np.moveaxis(values, -1, 0))
        for values in (motion.turn, motion.acceleration, motion.hip, motion.hip_acceleration)
    )
    squared_rate = np.moveaxis(motion.rate, -1, 0) ** 2
    cosine = np.cos(turn)
    sine = np.sin(turn)
    forward, below = body.foot_com
    com_from_joint = (0.0, -body.thigh_com), (0.0, -body.shank_com), (forward, -below), (body.toe_com, 0.0)
    # Vectors (forward, up) from each segment's upper joint: of the first three to the joint below, of all to the CoM.
    ahead, up = np.array([*_far_ends(body), *com_from_joint]).T.reshape(2, -1, *[1] * (turn.ndim - 1))
    segment = [*range(TOE_SEGMENT), *range(len(LEG_SEGMENTS))]
    cosine, sine = cosine[segment], sine[segment]
    vector = np.stack([ahead * cosine - up * sine, ahead * sine + up * cosine], 1)
    # Each joint hangs on the joint above it.
    joints = np.stack(list(accumulate(vector[:TOE_SEGMENT], initial=hip)))
    coms = joints + vector[TOE_SEGMENT:]
    offset = np.concatenate([joints[1:] - joints[:-1], coms - joints])
    # From the hip down, each segment adds its tangential acceleration, along its offset turned by a quarter, and its
    # centripetal one. The last offset is from the segment's upper joint to its CoM.
    tangential = acceleration[segment][:, None] * np.stack([-offset[:, 1], offset[:, 0]], 1)
    centripetal = squared_rate[segment][:, None] * offset
    of_joint = np.empty_like(joints)
    of_joint[0] = hip_acceleration
    for index in range(TOE_SEGMENT):
        of_joint[index + 1] = of_joint[index] + tangential[index] - centripetal[index]
    of_com = of_joint + tangential[TOE_SEGMENT:] - centripetal[TOE_SEGMENT:]
    joints, coms, of_com = (np.moveaxis(values, 1, -1) for values in (joints, coms, of_com))
    return joints, coms, of_com
