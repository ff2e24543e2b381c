"""Plan the path of a foot over its stride: heel, ankle and toe rockers on the ground, then the swing.

The toe rocker has two parts: the foot turns about the toe joint over a flat toe, and late in a long double support the
toe rolls over its tip and lifts the joint.

All positions are in the foot's own frame: x [m] forward of its ankle when flat, z [m] up from the floor. Pitch [rad] is
positive toes up. Stride phase 0 is this foot's heel strike, 1 its next, two steps further on.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_within

from ..body.body import Body
from ..body.rockers import ankle_about_pivot, pitch_rise, turned, turned_jet
from .foot_style import FootStyle, peoples_style

ROCKER_MARGIN = 0.005
"""Travel of the ZMP by which foot flat is earlier, and heel-off later, than necessary [m at 1.70 m]; chosen."""
QUICKEST_FOOT_FLAT = 0.02
"""Earliest stride phase of foot flat; chosen: in very short steps the ZMP starts ahead of the landing heel."""
HEEL_ROCKER_POWER = 2
"""Power with which the pitch falls over the rest of the heel rocker; chosen: the rate ends without a jump."""

MID_SWING = (0.3, 0.7)
"""Fractions of the swing between which ball and heel must clear the floor."""
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
    """Stride phase at which the toe begins to roll over its tip; `toe_off` without a roll."""
    toe_off: float
    """Stride phase at which the toe leaves the ground."""
    roll: float
    """Roll of the toe over its tip late in stance: 0 for none, 1 for people's; it weighs the pairs of constants in
    `foot_style`."""
    style: FootStyle
    """Pitches at the events, and the shape of the path between them."""
    lift: float = 0.0
    """Height of the swing's via points above the style's [m]."""

    def pitch(self, stride_phase: ArrayLike) -> NDArray:
        """Return the foot's pitch to the ground [rad], toes up positive, 0 from foot flat to heel-off."""
        return self.pose(stride_phase)[2]

    def toe_pitch(self, stride_phase: ArrayLike) -> NDArray:
        """Return the toe's pitch to the ground [rad] from foot flat to toe-off: 0, then negative as the toe rolls
        over its tip."""
        return self._toe_roll(np.clip(np.mod(np.asarray(stride_phase, float), 1.0), self.tip_off, self.toe_off))[0]

    def ankle(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return the ankle axis (x, z) [m]."""
        x, z, _ = self.pose(stride_phase)
        return x, z

    def toe_joint(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return the toe joint (x, z) [m]; exactly at its standing place from foot flat until the toe rolls over its
        tip."""
        return self._toe_joint_of(stride_phase, self.pose(stride_phase))

    def _toe_joint_of(self, stride_phase: ArrayLike, pose: NDArray) -> tuple[NDArray, NDArray]:
        """Return the toe joint (x, z) [m] of the foot's `pose` at these phases."""
        phase = np.mod(np.asarray(stride_phase, float), 1.0)
        x, z, pitch = pose
        forward, up = turned(pitch, self.body.ankle_to_toe_joint, -self._ankle_above_toe_joint)
        planted = (phase >= self.foot_flat) & (phase <= self.tip_off)
        return (
            np.where(planted, self.body.ankle_to_toe_joint, x + forward),
            np.where(planted, self.body.toe_joint_height, z + up),
        )

    def heel(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return the lowest point of the heel (x, z) [m]: the back of the sole, or a point of a round heel; on the
        floor until heel-off."""
        return self._heel_of(self.pose(stride_phase))

    def _heel_of(self, pose: NDArray) -> tuple[NDArray, NDArray]:
        """Return the lowest point of the heel (x, z) [m] of the foot's `pose`."""
        x, z, pitch = pose
        back, down = turned(pitch, self.flat_heel, self._heel_radius - self.body.ankle_height)
        return x + back, z + down - self._heel_radius

    @property
    def flat_heel(self) -> float:
        """Return the x [m] at which the heel of a flat foot touches the floor."""
        return self._heel_radius - self.body.heel_to_ankle

    @property
    def _heel_radius(self) -> float:
        """Return the radius of the heel [m]."""
        return self.style.heel_radius * self.body.length_scale

    def ball_clearance(self, stride_phase: ArrayLike) -> NDArray:
        """Return the height of the ball of the foot above the floor [m]: the toe joint above its standing height."""
        _, z = self.toe_joint(stride_phase)
        return z - self.body.toe_joint_height

    @property
    def heel_strike_pitch(self) -> float:
        """Return the foot's pitch to the ground at heel strike [rad] (thesis q_f)."""
        return self.style.heel_strike_pitch

    @property
    def toe_off_pitch(self) -> float:
        """Return the foot's pitch to the ground at toe-off, as a positive number [rad] (thesis q_b)."""
        return self.style.toe_off_pitch

    @property
    def roll_pitch(self) -> float:
        """Return the toe's pitch to the ground at toe-off, as a positive number [rad]."""
        return self.style.roll_pitch

    @property
    def clearance(self) -> float:
        """Return the least height [m] of ball and heel above the floor in `MID_SWING`."""
        return float(self.swing_heights(MID_SWING).min())

    def on_ground(self, stride_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return x [m] of the rear and front ends of the part of the foot that touches the ground in stance.

        This part is in turn a point of the heel, the sole, the toe from joint to tip, and the tip alone.
        """
        phase = np.mod(np.asarray(stride_phase, float), 1.0)
        joint = self.body.ankle_to_toe_joint
        pitch = self._heel_pitch(np.minimum(phase, self.foot_flat))[0]  # without its derivatives
        # A round heel touches farther back by its radius times the pitch.
        heel = self.flat_heel - self._heel_radius * pitch
        tip = joint + self.body.toe_length
        rear = np.select([phase <= self.heel_off, phase <= self.tip_off], [heel, joint], tip)
        return rear, np.where(phase >= self.foot_flat, tip, heel)

    def swing_heights(self, part: tuple[float, float]) -> NDArray:
        """Return (2, 200) heights of ball and heel above the floor [m] over a part of the swing.

        `part` is its first and last time as fractions of the swing.
        """
        phase = self.toe_off + np.linspace(*part, 200) * (1 - self.toe_off)
        pose = self.pose(phase)
        _, ball = self._toe_joint_of(phase, pose)
        _, heel = self._heel_of(pose)
        return np.stack([ball - self.body.toe_joint_height, heel])

    @cached_property
    def lowest_swing(self) -> float:
        """Return the least height [m] of ball and heel above the floor in all but the ends of swing, which touch it."""
        return float(self.swing_heights((0.005, 0.995)).min())

    @property
    def _ankle_above_toe_joint(self) -> float:
        """Return the height of the ankle over the toe joint in a flat foot [m]."""
        return self.body.ankle_height - self.body.toe_joint_height

    def pose(self, stride_phase: ArrayLike) -> NDArray:
        """Return x, z [m] of the ankle and pitch [rad] of the foot at any phases of the stride, (3, ...)."""
        phase = np.mod(np.asarray(stride_phase, float), 1.0)
        # Each part of the path at all phases, held at its ends, and without its derivatives.
        heel = self._heel_rocker(np.minimum(phase, self.foot_flat))[0]
        toe = self._toe_rocker(np.clip(phase, self.heel_off, self.toe_off))[0]
        swing = np.moveaxis(self._swing(np.maximum(phase, self.toe_off)), -1, 0)
        return np.where(phase < self.foot_flat, heel, np.where(phase <= self.toe_off, toe, swing))

    def _heel_rocker(self, phase: ArrayLike) -> NDArray:
        """Return ankle x, z [m] and pitch [rad] while the foot turns about its heel, and two phase derivatives.

        The result is (derivative, coordinate, ...), (3, 3, ...).
        """
        jet = ankle_about_pivot(self._heel_pitch(phase), (self.flat_heel, self._heel_radius), self.body)
        # A round heel rolls along the floor as the pitch falls: x of the ankle, by radius times pitch.
        jet[:, 0] -= self._heel_radius * jet[:, 2]
        return jet

    def _heel_pitch(self, phase: ArrayLike) -> NDArray:
        """Return the pitch [rad] while the foot turns about its heel, and two phase derivatives, (3, ...)."""
        remaining = 1 - np.asarray(phase) / self.foot_flat
        power = HEEL_ROCKER_POWER
        pitch = self.heel_strike_pitch * remaining**power
        rate = -self.heel_strike_pitch * power / self.foot_flat * remaining ** (power - 1)
        curvature = self.heel_strike_pitch * power * (power - 1) / self.foot_flat**2 * remaining ** (power - 2)
        return np.stack([pitch, rate, curvature])

    def _toe_rocker(self, phase: ArrayLike) -> NDArray:
        """Return ankle x, z [m] and pitch [rad] while the foot turns about its toe joint, and two phase derivatives.

        The result is (derivative, coordinate, ...), (3, 3, ...).
        """
        body = self.body
        shape = self.style.heel_rise or self.style.toe_rocker_power  # a polynomial's pair, or else a power
        pitch = pitch_rise(-self.toe_off_pitch, phase, self.heel_off, self.toe_off, shape)
        jet = ankle_about_pivot(pitch, (body.ankle_to_toe_joint, body.toe_joint_height), body)
        # The toe's roll over its tip moves the toe joint, and with it the ankle: by the joint's turned place from the
        # tip, less its place before the roll.
        about_tip = turned_jet(self._toe_roll(phase), -body.toe_length, body.toe_joint_height)
        about_tip[0, 0] += body.toe_length
        about_tip[0, 1] -= body.toe_joint_height
        jet[:, :2] += about_tip
        return jet

    def _toe_roll(self, phase: ArrayLike) -> NDArray:
        """Return the pitch of the toe as it rolls over its tip [rad], negative, and two phase derivatives, (3, ...)."""
        if self.roll_pitch == 0:
            return np.zeros((3, *np.shape(phase)))
        return pitch_rise(-self.roll_pitch, phase, self.tip_off, self.toe_off, self.style.roll_power)

    @cached_property
    def _swing(self) -> BSpline:
        """Return the path of the swing over stride phase: ankle x, z [m] and pitch [rad].

        It is a quintic spline, four times continuously differentiable, through the style's via points.
        """
        start = self._toe_rocker(self.toe_off)
        end = self._heel_rocker(0.0)
        end[0, 0] += 2 * self.step_length  # x of the next landing: a stride further on
        travelled, up, pitch = map(np.array, (self.style.via_forward, self.style.via_up, self.style.via_pitch))
        forward = start[0, 0] + travelled * (end[0, 0] - start[0, 0])
        via = np.stack([forward, up * self.body.length_scale + self.lift, pitch], -1)
        knots = self.toe_off + np.linspace(0.0, 1.0, len(travelled) + 2) * (1 - self.toe_off)
        # Velocity and acceleration, derivatives 1 and 2, at both ends are those of the rockers.
        ends = ([(1, start[1]), (2, start[2])], [(1, end[1]), (2, end[2])])
        return make_interp_spline(knots, np.stack([start[0], *via, end[0]]), k=5, bc_type=ends)


def feet_under_zmp(
    body: Body,
    step_length: float,
    zmp_times: NDArray,
    zmp_points: NDArray,
    roll: float = 0.0,
    clearance: float | None = None,
    style: FootStyle | None = None,
) -> FootPath:
    """Plan feet with rockers that follow the ZMP, so that the ZMP stays within the feet's parts on the ground.

    Args:
        body: lengths of foot and leg.
        step_length: heel strike to heel strike of the other foot [m].
        zmp_times: corners of the ZMP's course over a step [s]: heel strike, the other foot's toe-off, perhaps more, the
            next heel strike.
        zmp_points: ZMP at these times [m from the stance ankle]; straight in between.
        roll: of the toe over its tip late in stance: 0 for none, 1 for people's.
        clearance: least height of the swing foot in mid-swing [m]; None: as the style gives it.
        style: pitches and shape of the path; None: people's (`peoples_style`).

    Raises `SpringfootError` for a ZMP off the feet, or a step shorter than the ZMP's travel.
    """
    margin = ROCKER_MARGIN * body.length_scale
    heel = -body.heel_to_ankle + (0.0 if style is None else style.heel_radius * body.length_scale)
    ball = body.ankle_to_toe_joint
    toe_tip = body.ankle_to_toe_joint + body.toe_length
    first, zmp_from, *_, zmp_to = zmp_points  # at heel strike, and at the start and end of single support
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
    # Foot flat before the ZMP passes the heel, heel-off after the ZMP has passed the toe joint: stride phases at which
    # the ascending ZMP is at these places.
    stride_time = 2 * zmp_times[-1]
    flat, heel_off = np.interp([heel - margin, ball + margin], zmp_points, zmp_times) / stride_time
    toe_off = float(0.5 + zmp_times[1] / stride_time)
    # A style can only delay heel-off and hasten foot flat: the ZMP stays on the sole.
    if style is not None and style.heel_off is not None:
        heel_off = max(heel_off, 0.5 - 0.5 * style.heel_off)  # the other foot lands at 0.5; a step is 0.5 of the stride
    if style is not None and style.flat is not None:
        flat = min(flat, style.flat * (toe_off - 0.5))  # double support is toe_off - 0.5 of the stride
    flat = max(float(flat), QUICKEST_FOOT_FLAT)
    # The ZMP leaves the tip of the rear foot in double support, more than half a stride after that foot's heel strike;
    # from the front foot the tip is a step behind.
    zmp_leaves_tip = float(np.interp(toe_tip + margin - step_length, zmp_points, zmp_times))
    rolls = roll > 0 if style is None else style.roll_pitch > 0
    roll_from = 0.5 + (0.0 if style is None else style.roll_from) * (toe_off - 0.5)
    tip_off = min(max(float(0.5 + zmp_leaves_tip / stride_time), roll_from), toe_off) if rolls else toe_off
    if style is None:
        style = peoples_style(step_length / body.leg_length, roll, flat, toe_off - tip_off)
    elif tip_off == toe_off:
        style = replace(style, roll_pitch=0.0)
    feet = FootPath(
        body=body,
        step_length=step_length,
        foot_flat=flat,
        heel_off=float(heel_off),
        tip_off=tip_off,
        toe_off=toe_off,
        roll=roll,
        style=style,
    )
    if clearance is not None:
        clearance = require_within("clearance", clearance, (0.0, body.leg_length), "m")
        # Heights are linear in the lift of the via points, with the gain at a lift of 1 m as slope. The lift is the
        # least with which all heights reach the clearance.
        without_lift = feet.swing_heights(MID_SWING)
        gain = replace(feet, lift=1.0).swing_heights(MID_SWING) - without_lift
        feet = replace(feet, lift=float(((clearance - without_lift) / gain).max()))
    return feet


def refuse_swing_in_ground(feet: FootPath) -> None:
    """Raise `SpringfootError` for a swing foot with ball or heel deeper in the floor than `FLOOR_TOLERANCE`.

    The tip of the toe is not checked: early in swing the toe bends back to people's posture, which at 1.2 m/s would
    take its tip 20 mm into the floor; a sprung toe gives way.
    """
    lowest = feet.lowest_swing
    if lowest < -FLOOR_TOLERANCE:
        raise SpringfootError(
            f"swing foot {-lowest:.3f} m in the ground, {-lowest - FLOOR_TOLERANCE:.4f} m more than allowed: "
            "a longer step, a longer double support or more clearance helps"
        )
