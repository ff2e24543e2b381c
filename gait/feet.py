"""Where a foot is over its stride: heel, ankle and toe rockers on the ground, then the swing.

The toe rocker has two parts: the foot turns about the toe joint over a flat toe, and late in a long double support the
toe rolls over its tip and lifts the joint.

All positions are in the foot's own frame: x [m] forward of where its ankle is while the foot is flat, z [m] up from
the floor. Pitch [rad] is positive toes up. Stride phase 0 is this foot's heel strike, 1 its next, two steps further on.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline

from .arrays import NDArray
from .body import Body
from .errors import SpringfootError, require_within

ROCKER_MARGIN = 0.005
"""The foot comes flat, and stays flat, this far of the ZMP's way before and after it needs to [m at 1.70 m]; chosen."""
QUICKEST_FOOT_FLAT = 0.02
"""Earliest stride phase of foot flat; chosen: in very short steps the ZMP starts ahead of the landing heel."""
HEEL_ROCKER_RATE = 4.5
"""Largest heel-strike pitch over duration of the heel rocker [rad/stride]; chosen: a quick foot flat needs a flat
landing."""
HEEL_ROCKER_POWER = 2
"""Power with which the pitch falls with what is left of the heel rocker; chosen: it ends without a jump of its rate."""

# Pairs of constants: over a flat toe (roll 0), and with people's roll over the tip (roll 1); in between along the
# straight line. Pitches of the latter are people's; the rest was found by least squares against people's thigh, knee
# and, weighing less, ankle curves at 0.8 to 1.7 m/s; at roll 1 by `python -m springfoot.gait.fit_feet`.
HEEL_STRIKE_PITCH = ((0.293, 2), (0.336, 1))
"""Foot to ground at heel strike: a [rad] and n of a (step length / leg length)^n; the thesis's q_f = 0.13 at its 0.6 m,
and people's 0.24 at 1.2 m/s."""
TOE_OFF_PITCH = ((1.32, 1.5), (1.39, 0.5))
"""Foot to ground at toe-off: a [rad] and n of a (step length / leg length)^n; people's is 68 deg at 1.2 m/s."""
ROLL_PITCH = ((0.0, 0.5), (0.78, 0.5))
"""Toe to ground at toe-off: a [rad] and n of a (step length / leg length)^n; people's is 37 deg at 1.2 m/s."""
TOE_ROCKER_POWER = (2.12, 3.08)
"""The heel rises with this power of the time since heel-off."""
ROLL_POWER = 2.22
"""The toe joint rises with this power of the time since the ZMP left the toe tip."""
QUICKEST_ROLL = 12.0
"""Largest toe to ground at toe-off over duration of the roll [rad/stride]; chosen, above people's 6."""

# The swing passes two via points, a third and two thirds through it, and leaves and lands at the rockers' position,
# velocity and acceleration.
VIA = (1 / 3, 2 / 3)
"""Parts of the swing at which the via points lie; chosen."""
VIA_FORWARD = ((0.237, 0.693), (0.319, 0.633))
"""Place of the ankle at the via points, as parts of its way from toe-off to heel strike."""
VIA_UP = ((0.225, 0.104), (0.175, 0.090))
"""Height of the ankle above the floor at the via points [m at 1.70 m]."""
VIA_PITCH = ((-1.0, -0.183), (-0.746, -0.039))
"""Pitch of the foot at the via points [rad]."""
MID_SWING = (0.3, 0.7)
"""Parts of the swing between which ball and heel must clear the floor: they leave and land on either side of it."""
FLOOR_TOLERANCE = 0.003
"""Largest depth of a swing foot in the floor [m]; chosen: a landing heel slides in at a shallow angle."""


@dataclass(frozen=True, kw_only=True)
class FootPath:
    """One foot's path over its stride."""

    body: Body
    step_length: float
    """Heel strike to heel strike of the other foot [m]."""
    foot_flat: float
    """Stride phase at which the heel rocker ends."""
    heel_off: float
    """Stride phase at which the toe rocker begins."""
    tip_off: float
    """Stride phase at which the toe begins to roll over its tip; `toe_off` where it does not."""
    toe_off: float
    """Stride phase at which the toe leaves the ground."""
    heel_strike_pitch: float
    """Foot to ground at heel strike [rad] (thesis q_f)."""
    roll: float
    """How far the toe rolls over its tip late in stance: 0 not at all, 1 as people's; it weighs the pairs of constants.
    """
    toe_off_pitch: float
    """Foot to ground at toe-off, as a positive number [rad] (thesis q_b)."""
    roll_pitch: float
    """Toe to ground at toe-off, as a positive number [rad]."""
    lift: float = 0.0
    """The via points of the swing lie this much [m] higher than `VIA_UP`."""

    def pitch(self, stride_phase: ArrayLike) -> NDArray:
        """Foot to ground [rad], toes up positive, 0 from foot flat to heel-off."""
        return self._jet(stride_phase)[2]

    def toe_pitch(self, stride_phase: ArrayLike) -> NDArray:
        """Toe to ground [rad] from foot flat to toe-off: 0, and negative as it rolls over its tip."""
        return self._roll(np.clip(np.mod(np.asarray(stride_phase, float), 1.0), self.tip_off, self.toe_off))[0]

    def ankle(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Ankle axis (x, z) [m]."""
        x, z, _ = self._jet(stride_phase)
        return x, z

    def toe_joint(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Toe joint (x, z) [m]; exactly at its standing place from foot flat until the toe rolls over its tip."""
        phase = np.mod(np.asarray(stride_phase, float), 1.0)
        x, z, pitch = self._jet(phase)
        forward, up = turned(pitch, self.body.ankle_to_toe_joint, -self._drop)
        planted = (phase >= self.foot_flat) & (phase <= self.tip_off)
        return (
            np.where(planted, self.body.ankle_to_toe_joint, x + forward),
            np.where(planted, self.body.toe_joint_height, z + up),
        )

    def heel(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Back of the heel at the sole (x, z) [m]; on the floor from heel strike to heel-off."""
        x, z, pitch = self._jet(stride_phase)
        back, down = turned(pitch, -self.body.heel_to_ankle, -self.body.ankle_height)
        return x + back, z + down

    def ball_clearance(self, stride_phase: ArrayLike) -> NDArray:
        """Ball of the foot above the floor [m]: the toe joint above its standing height."""
        return self.toe_joint(stride_phase)[1] - self.body.toe_joint_height

    @property
    def clearance(self) -> float:
        """Least height [m] of ball and heel above the floor in `MID_SWING`."""
        return float(self.swing_heights(MID_SWING).min())

    def on_ground(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Rear and front end (x, x) [m] of what is on the ground in stance: heel, sole, toe joint to tip, then tip."""
        phase = np.mod(np.asarray(stride_phase, float), 1.0)
        heel, joint = -self.body.heel_to_ankle, self.body.ankle_to_toe_joint
        tip = joint + self.body.toe_length
        rear = np.select([phase <= self.heel_off, phase <= self.tip_off], [heel, joint], tip)
        return rear, np.where(phase >= self.foot_flat, tip, heel)

    def swing_heights(self, part: tuple[float, float]) -> NDArray:
        """(2, 200) ball and heel above the floor [m] over a part of the swing."""
        phase = self.toe_off + np.linspace(*part, 200) * (1 - self.toe_off)
        return np.stack([self.ball_clearance(phase), self.heel(phase)[1]])

    @property
    def _drop(self) -> float:
        """Toe joint below the ankle in a flat foot [m]."""
        return self.body.ankle_height - self.body.toe_joint_height

    def _jet(self, stride_phase: ArrayLike) -> NDArray:
        """(x, z, pitch) of the ankle at any phases."""
        phase = np.mod(np.asarray(stride_phase, float), 1.0)
        heel = self._heel_rocker(np.minimum(phase, self.foot_flat))[0]
        toe = self._toe_rocker(np.clip(phase, self.heel_off, self.toe_off))[0]
        swing = np.moveaxis(self._swing(np.maximum(phase, self.toe_off)), -1, 0)
        return np.where(phase < self.foot_flat, heel, np.where(phase <= self.toe_off, toe, swing))

    def _heel_rocker(self, phase: ArrayLike) -> NDArray:
        left, power = 1 - np.asarray(phase) / self.foot_flat, HEEL_ROCKER_POWER
        pitch = self.heel_strike_pitch * left**power
        rate = -self.heel_strike_pitch * power / self.foot_flat * left ** (power - 1)
        curvature = self.heel_strike_pitch * power * (power - 1) / self.foot_flat**2 * left ** (power - 2)
        return _rolling(np.stack([pitch, rate, curvature]), (-self.body.heel_to_ankle, 0.0), self.body)

    def _toe_rocker(self, phase: ArrayLike) -> NDArray:
        body = self.body
        power = float(between(TOE_ROCKER_POWER, self.roll))
        pitch = _rising(-self.toe_off_pitch, phase, self.heel_off, self.toe_off, power)
        jet = _rolling(pitch, (body.ankle_to_toe_joint, body.toe_joint_height), body)
        about_tip = _turning(self._roll(phase), -body.toe_length, body.toe_joint_height)
        about_tip[0, 0] += body.toe_length
        about_tip[0, 1] -= body.toe_joint_height
        jet[:, :2] += about_tip
        return jet

    def _roll(self, phase: ArrayLike) -> NDArray:
        """(3, ...): toe to ground over its tip [rad] and two phase derivatives."""
        if self.roll_pitch == 0:
            return np.zeros((3, *np.shape(phase)))
        return _rising(-self.roll_pitch, phase, self.tip_off, self.toe_off, ROLL_POWER)

    @cached_property
    def _swing(self) -> BSpline:
        """(x, z, pitch) of the ankle over swing phases: a quintic spline, four times continuously differentiable."""
        start, end = self._toe_rocker(self.toe_off), self._heel_rocker(0.0)
        end[0, 0] += 2 * self.step_length
        way, up, pitch = (between(pair, self.roll) for pair in (VIA_FORWARD, VIA_UP, VIA_PITCH))
        forward = start[0, 0] + way * (end[0, 0] - start[0, 0])
        via = np.stack([forward, up * self.body.length_scale + self.lift, pitch], -1)
        knots = self.toe_off + np.array([0.0, *VIA, 1.0]) * (1 - self.toe_off)
        ends = ([(1, start[1]), (2, start[2])], [(1, end[1]), (2, end[2])])
        return make_interp_spline(knots, np.stack([start[0], *via, end[0]]), k=5, bc_type=ends)


def feet_under_zmp(
    body: Body,
    step_length: float,
    zmp_times: NDArray,
    zmp_points: NDArray,
    roll: float = 0.0,
    clearance: float | None = None,
) -> FootPath:
    """Feet whose rockers follow the ZMP, so that it stays on what is on the ground.

    The ZMP runs straight between three points [m from the stance ankle] at three times [s]: heel strike, the other
    foot's toe-off, the next heel strike. `roll` is that of `FootPath`. `clearance` [m]: as in `plan_walk`. Raises
    `SpringfootError` for a ZMP off the feet and for a step shorter than its travel.
    """
    margin = ROCKER_MARGIN * body.length_scale
    heel, ball, toe_tip = -body.heel_to_ankle, body.ankle_to_toe_joint, body.ankle_to_toe_joint + body.toe_length
    first, zmp_from, zmp_to = zmp_points
    for name, value, low, high in (("start", zmp_from, heel, ball), ("end", zmp_to, ball + margin, toe_tip)):
        beyond = max(low - value, value - high)
        if not beyond < 0:
            raise SpringfootError(
                f"ZMP at the {name} of single support must be in ({low:.3f}, {high:.3f}) m from the ankle, "
                f"got {value:.3f}: outside by {beyond:.3f} m"
            )
    if first >= zmp_from:
        raise SpringfootError(
            f"step of {step_length:.3f} m must be longer than the ZMP travel, {zmp_to - zmp_from:.3f} m, "
            f"is {first - zmp_from:.3f} m too short"
        )
    stride_time = 2 * zmp_times[-1]
    flat, heel_off = np.interp([heel - margin, ball + margin], zmp_points, zmp_times) / stride_time
    flat = max(float(flat), QUICKEST_FOOT_FLAT)
    toe_off = float(0.5 + zmp_times[1] / stride_time)
    zmp_leaves_tip = float(np.interp(toe_tip + margin - step_length, zmp_points, zmp_times))
    tip_off = min(float(0.5 + zmp_leaves_tip / stride_time), toe_off) if roll > 0 else toe_off
    stride = step_length / body.leg_length
    feet = FootPath(
        body=body,
        step_length=step_length,
        foot_flat=flat,
        heel_off=float(heel_off),
        tip_off=tip_off,
        toe_off=toe_off,
        heel_strike_pitch=min(pitch_at(HEEL_STRIKE_PITCH, stride, roll), HEEL_ROCKER_RATE * flat),
        toe_off_pitch=pitch_at(TOE_OFF_PITCH, stride, roll),
        roll_pitch=min(pitch_at(ROLL_PITCH, stride, roll), QUICKEST_ROLL * (toe_off - tip_off)),
        roll=roll,
    )
    if clearance is not None:
        clearance = require_within("clearance", clearance, (0.0, body.leg_length), "m")
        flattest = feet.swing_heights(MID_SWING)
        # The swing is linear in its via points: what each of its points gains by a lift of 1 m.
        gain = replace(feet, lift=1.0).swing_heights(MID_SWING) - flattest
        feet = replace(feet, lift=float(((clearance - flattest) / gain).max()))
    return feet


def refuse_swing_in_ground(feet: FootPath) -> None:
    """Raises `SpringfootError` for a swing foot deeper in the floor than `FLOOR_TOLERANCE`: its ball or heel.

    The tip of the toe is not checked: early in swing the toe bends back to people's posture, which at 1.2 m/s would
    take its tip 20 mm into the floor; a sprung toe gives way.
    """
    lowest = float(feet.swing_heights((0.005, 0.995)).min())
    if lowest < -FLOOR_TOLERANCE:
        raise SpringfootError(
            f"swing foot {-lowest:.3f} m in the ground, {-lowest - FLOOR_TOLERANCE:.4f} m more than allowed: "
            "a longer step, a longer double support or more clearance helps"
        )


def between(pair: tuple, roll: float) -> NDArray:
    """A constant given at a roll of 0 and of 1."""
    return (1 - roll) * np.array(pair[0]) + roll * np.array(pair[1])


def pitch_at(pair: tuple, stride: float, roll: float) -> float:
    """A pitch at an event [rad], positive, for a step length over leg length."""
    return float(between(tuple(a * stride**n for a, n in pair), roll))


def turned(pitch: ArrayLike, forward: float, up: float) -> tuple[NDArray, NDArray]:
    """The vector (forward, up) of a flat foot, in a foot at `pitch`."""
    return forward * np.cos(pitch) - up * np.sin(pitch), forward * np.sin(pitch) + up * np.cos(pitch)


def _rising(top: float, phase: ArrayLike, start: float, end: float, power: float) -> NDArray:
    """(3, ...): 0 until `start`, then with a power to `top` at `end`, with two phase derivatives."""
    lasts = end - start
    done = np.maximum((np.asarray(phase) - start) / lasts, 0.0)
    rate = top * power / lasts * done ** (power - 1)
    return np.stack([top * done**power, rate, top * power * (power - 1) / lasts**2 * done ** (power - 2)])


def _rolling(pitch: NDArray, pivot: tuple[float, float], body: Body) -> NDArray:
    """(3, 3, ...): x, z, pitch of an ankle whose foot turns about a point of its flat place, two phase derivatives."""
    ankle = _turning(pitch, -pivot[0], body.ankle_height - pivot[1])
    ankle[0, 0] += pivot[0]
    ankle[0, 1] += pivot[1]
    return np.concatenate([ankle, pitch[:, None]], axis=1)


def _turning(pitch: NDArray, forward: float, up: float) -> NDArray:
    """(3, 2, ...): the vector (forward, up) of a flat foot and its two phase derivatives; `pitch` (3, ...) with its."""
    angle, rate, curvature = pitch
    x, z = turned(angle, forward, up)
    return np.stack([[x, z], [-z * rate, x * rate], [-z * curvature - x * rate**2, x * curvature - z * rate**2]])
