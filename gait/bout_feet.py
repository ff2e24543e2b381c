"""The feet and legs of a walking bout: the walk's rockers and swing from standing to standing (see `bout`)."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray

from .body.body import Body
from .bout_com import BEFORE, STANDING_COM, zmp_of_walk
from .plan.com_plan import Point
from .plan.foot import FLOOR_TOLERANCE, FootPath, feet_under_zmp
from .plan.foot_style import HEEL_STRIKE_PITCH, ROLL_PITCH, TOE_OFF_PITCH, pitch_at
from .plan.plan import WalkPlan
from .plan.posture import STRAIGHTEST_KNEE, LegPostures, full_reach, legs_under, toe_angle


@dataclass(frozen=True, kw_only=True, eq=False)
class BoutFoot:
    """One foot through the bout: its strides, each from foot flat to foot flat, with their places and times."""

    strides: tuple[FootPath, ...]
    """Toe rocker and swing of one stride, and the heel rocker after it."""
    start: NDArray
    """(strides,) x of the ankle before each stride [m]."""
    landing: NDArray
    """(strides,) time of the heel strike that ends the swing of each stride [s]."""
    stride_time: float
    """Time of a stride whose phase is 0 to 1 [s]."""

    @property
    def events(self) -> NDArray:
        """Heel-offs, starts of rolling over the toe tip, toe-offs, heel strikes and foot flats [s]."""
        after_landing = [(f.heel_off - 1, f.tip_off - 1, f.toe_off - 1, 0.0, f.foot_flat) for f in self.strides]
        return (self.landing[:, None] + self.stride_time * np.array(after_landing)).ravel()

    def at(self, time: NDArray) -> Iterator[tuple[NDArray, FootPath, NDArray, NDArray]]:
        """For each stride that the times meet: mask of its times, the stride, phases and x [m] of its frame at each."""
        flat = self.landing + self.stride_time * np.array([stride.foot_flat for stride in self.strides])
        which = np.searchsorted(flat[:-1], time)
        for i in np.unique(which):
            mask, stride = which == i, self.strides[i]
            landed = np.minimum((time[mask] - self.landing[i]) / self.stride_time, stride.foot_flat)
            phase = np.where(landed < 0, np.maximum(landed + 1, stride.foot_flat), landed)
            yield mask, stride, phase, self.start[i] + 2 * stride.step_length * (landed >= 0)

    def points(self, time: ArrayLike, point: Literal["ankle", "toe_joint", "heel"]) -> Point:
        """A point of the foot (x, z) [m]."""
        time = np.asarray(time, float)
        x, z = np.empty(time.shape), np.empty(time.shape)
        for mask, stride, phase, frame in self.at(time):
            x[mask], z[mask] = getattr(stride, point)(phase)
            x[mask] += frame
        return x, z

    def pitch(self, time: ArrayLike) -> NDArray:
        """Foot to ground [rad], toes up positive."""
        time = np.asarray(time, float)
        pitch = np.empty(time.shape)
        for mask, stride, phase, _ in self.at(time):
            pitch[mask] = stride.pitch(phase)
        return pitch

    def on_ground(self, time: ArrayLike) -> Point:
        """Rear and front end [m] of what is on the ground; (inf, -inf) in swing."""
        time = np.asarray(time, float)
        rear, front = np.empty(time.shape), np.empty(time.shape)
        for mask, stride, phase, frame in self.at(time):
            swings = phase > stride.toe_off
            ends = stride.on_ground(phase)
            rear[mask] = np.where(swings, np.inf, ends[0] + frame)
            front[mask] = np.where(swings, -np.inf, ends[1] + frame)
        return rear, front


def bout_feet(plan: WalkPlan, step_lengths: NDArray, clearance: float | None) -> tuple[BoutFoot, BoutFoot]:
    """The foot that steps first, and the other one.

    Each step is rolled onto and off as in a walk of steps as long; `clearance` [m] is that of `plan_walk`,
    and more where a swing beside or past the other foot would be in the ground.
    """
    body, times, points = plan.body, *zmp_of_walk(plan)
    walks = [
        feet_under_zmp(body, s, times, np.array([points[2] - s, *points[1:]]), plan.feet.roll, clearance)
        for s in step_lengths
    ]
    holds = np.concatenate([[0.0, 0.0], np.cumsum(step_lengths), [step_lengths.sum()]])
    strides = []
    for k, travel in enumerate(holds[2:] - holds[:-2]):
        leaves, lands = walks[max(k - 1, 0)], walks[min(k, len(walks) - 1)]
        # A step that starts or ends beside the other foot rolls as in a walk whose swing travels as far.
        ratio, roll = travel / 2 / body.leg_length, plan.feet.roll
        toe_off, on_tip, heel_strike = leaves.toe_off_pitch, leaves.roll_pitch, lands.heel_strike_pitch
        if k == 0:
            toe_off = pitch_at(TOE_OFF_PITCH, ratio, roll)
            on_tip = min(on_tip, pitch_at(ROLL_PITCH, ratio, roll))
        if k == len(walks):
            heel_strike = pitch_at(HEEL_STRIKE_PITCH, ratio, roll)
        stride = replace(
            leaves,
            step_length=travel / 2,
            foot_flat=lands.foot_flat,
            style=replace(leaves.style, toe_off_pitch=toe_off, roll_pitch=on_tip, heel_strike_pitch=heel_strike),
        )
        strides.append(_out_of_ground(stride))
    landing = plan.step_time * (BEFORE + np.arange(len(strides)))
    first, other = (
        BoutFoot(
            strides=tuple(strides[i::2]), start=holds[:-2][i::2], landing=landing[i::2], stride_time=plan.stride_time
        )
        for i in (0, 1)
    )
    return first, other


def _out_of_ground(stride: FootPath) -> FootPath:
    """The stride with its swing raised, if need be, until it is no deeper in the ground than `FLOOR_TOLERANCE`."""
    before_landing = 0.005, 0.9
    heights = stride.swing_heights(before_landing)
    # The swing is linear in its via points: what each of its points gains by a lift of 1 m.
    gain = replace(stride, lift=stride.lift + 1).swing_heights(before_landing) - heights
    lacking = (-FLOOR_TOLERANCE - heights) / gain
    return replace(stride, lift=stride.lift + max(0.0, float(lacking.max())))


def foot_postures(plan: WalkPlan, feet: Collection[BoutFoot], time: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Of each foot at `time` (T,) [s]: ankle (2, feet, T) [m], pitch and toe angle (feet, T) [rad]."""
    ankle = np.stack([foot.points(time, "ankle") for foot in feet], 1)
    pitch = np.stack([foot.pitch(time) for foot in feet])
    toe = np.zeros_like(pitch)
    for row, foot in zip(toe, feet, strict=True):
        for mask, stride, phase, _ in foot.at(time):
            row[mask] = toe_angle(stride, plan.human, phase)
    return ankle, pitch, toe


def bout_legs(body: Body, com: NDArray, ankle: NDArray, pitch: NDArray, toe: NDArray) -> LegPostures:
    """The legs (2, T) under a `com` (2, T) [m] whose `foot_postures` are given; the hip is (1, T, 2)."""
    return legs_under(body, com[:, None], ankle, pitch, toe, lambda leg: leg.sum(axis=1, keepdims=True))


def standing_height(body: Body) -> float:
    """CoM height [m] with both knees at `STRAIGHTEST_KNEE`."""
    ankle = np.array([0.0, body.ankle_height])[:, None, None] + np.zeros((2, 2, 1))
    flat, height = np.zeros((2, 1)), 1.08 * body.leg_length
    for _ in range(50):
        com = np.array([STANDING_COM * body.length_scale, height])[:, None]
        lacking = float(bout_legs(body, com, ankle, flat, flat).reach.max()) - full_reach(body, STRAIGHTEST_KNEE)
        height -= lacking
        if abs(lacking) < 1e-9:
            break
    return height
