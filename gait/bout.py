"""A walking bout: from quiet standing through a number of steps back to quiet standing, over time.

Its middle is the periodic walk of `plan_walk`; the first and last steps are shorter, at the same cadence. The ZMP runs
straight between knots, as in the walk. Before the first step it goes back by a shift (people's anticipatory postural
adjustment), which lets the CoM fall forward; after the last it stays ahead by another shift, which catches the CoM.
The cart-table x'' = (g + z'') / z (x - p) is linear in x and p at moving height too. So the CoM is the one over the
knots plus each shift times the response to a unit of it, and the two shifts make it start and end at rest.
"""

from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator, PPoly

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_count

from .body.body import ANGLES, Body
from .bout_com import AFTER, BEFORE, com_from_rest_to_rest, quintics, step_lengths_of, zmp_knots
from .bout_feet import BoutFoot, Point, bout_feet, bout_legs, foot_postures, standing_height
from .plan.cart_table import zmp
from .plan.foot import FLOOR_TOLERANCE
from .plan.plan import Cadence, WalkPlan, plan_walk
from .plan.posture import POSTURE_SAMPLES, full_reach

Side = Literal["left", "right"]

MOST_STEPS = 200
"""Largest number of steps planned; chosen."""
STRAIGHTEST = 0.03
"""Least knee flexion of a bout [rad]; chosen, half of the walk's: its first steps are not quite those of the walk."""
DEEPEST_DIP = 0.06
"""How far the CoM may come down for legs that do not reach [leg lengths]; chosen: at 1.2 m/s it is 0.013."""
BESIDE = 0.03
"""A ZMP knot nearer to a sample than this counts as on it [sample intervals]: shorter pieces lose digits."""
MOST_TRIES, CLOSE = 12, 2e-5
"""Most iterations for how far the CoM has to come down, and the accuracy [m] at which they end, a fifth of the reach
that `STRAIGHTEST` leaves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Bout:
    """A walking bout; made by `plan_bout`.

    Times [s] may have any shape; before 0 and after `duration` the body stands. x [m] is forward of the ankles at the
    start, z [m] up from the floor. `side` is "left" or "right".
    """

    plan: WalkPlan
    """The steady walk in the middle, with body, speed and cadence."""
    first: Side
    """The foot that steps first."""
    step_lengths: NDArray
    """(steps,) [m]; the closing foot comes beside the last one."""
    zmp_shifts: tuple[float, float]
    """Shifts of the ZMP before the first step, negative, and after the last [m], forward of its place in standing."""
    path: PPoly = field(repr=False)
    """CoM (x, z) [m] over time."""
    feet: dict[Side, BoutFoot] = field(repr=False)
    hip_table: PchipInterpolator = field(repr=False)
    """Hip (x, z) [m] over time."""
    joint_tables: dict[Side, PchipInterpolator] = field(repr=False)
    """thigh, knee, ankle, toe [rad] over time."""

    @property
    def duration(self) -> float:
        """Time from standing to standing [s]."""
        return float(self.path.x[-1])

    @property
    def heel_strikes(self) -> NDArray:
        """(steps + 1,) landings [s]: that of foot `first`, then alternating; the last is the closing foot's."""
        return self.plan.step_time * np.arange(BEFORE, BEFORE + len(self.step_lengths) + 1)

    def com(self, time: ArrayLike) -> Point:
        """CoM (x, z) [m]."""
        return self._com(time, 0)

    def com_velocity(self, time: ArrayLike) -> Point:
        """CoM velocity (forward, up) [m/s], continuous; 0 at both ends."""
        return self._com(time, 1)

    def com_acceleration(self, time: ArrayLike) -> Point:
        """CoM acceleration (forward, up) [m/s^2], continuous; 0 at both ends."""
        return self._com(time, 2)

    def zmp(self, time: ArrayLike) -> NDArray:
        """ZMP x [m] by equation (1) from the motion itself."""
        return zmp(*self.com(time), *self.com_acceleration(time))

    def support(self, time: ArrayLike) -> Point:
        """Rear and front end [m] of the hull of what is on the ground of both feet."""
        ends = [foot.on_ground(time) for foot in self.feet.values()]
        return np.minimum(*(rear for rear, _ in ends)), np.maximum(*(front for _, front in ends))

    def on_ground(self, side: Side, time: ArrayLike) -> Point:
        """Rear and front end [m] of what is on the ground of one foot; (inf, -inf) in swing."""
        return self.feet[side].on_ground(time)

    def foot_pitch(self, side: Side, time: ArrayLike) -> NDArray:
        """Foot to ground [rad], toes up positive."""
        return self.feet[side].pitch(time)

    def ankle_position(self, side: Side, time: ArrayLike) -> Point:
        """Ankle (x, z) [m]."""
        return self.feet[side].points(time, "ankle")

    def toe_joint_position(self, side: Side, time: ArrayLike) -> Point:
        """Toe joint (x, z) [m]; stands still from foot flat to toe-off."""
        return self.feet[side].points(time, "toe_joint")

    def heel_position(self, side: Side, time: ArrayLike) -> Point:
        """Back of the heel at the sole (x, z) [m]; on the floor from heel strike to heel-off."""
        return self.feet[side].points(time, "heel")

    def hip_position(self, time: ArrayLike) -> Point:
        """Hip (x, z) [m], that of both legs; the trunk above it is upright."""
        x, z = np.moveaxis(self.hip_table(self._within(time)), -1, 0)
        return x, z

    def joint_angles(self, side: Side, time: ArrayLike) -> dict[str, NDArray]:
        """thigh (to the vertical), knee, ankle, toe [rad]; flexion, dorsiflexion, toe up positive."""
        return self._joints(side, time, 0)

    def joint_rates(self, side: Side, time: ArrayLike) -> dict[str, NDArray]:
        """Time derivatives of `joint_angles` [rad/s]."""
        return self._joints(side, time, 1)

    def _within(self, time: ArrayLike) -> NDArray:
        return np.clip(np.asarray(time, float), 0.0, self.duration)

    def _com(self, time: ArrayLike, derivative: int) -> Point:
        x, z = np.moveaxis(self.path(self._within(time), derivative), -1, 0)
        return x, z

    def _joints(self, side: Side, time: ArrayLike, derivative: int) -> dict[str, NDArray]:
        columns = self.joint_tables[side](self._within(time), derivative)
        return dict(zip(ANGLES, np.moveaxis(columns, -1, 0), strict=True))


def plan_bout(
    body: Body,
    speed: float = 1.2,
    steps: int = 8,
    cadence: Cadence = "people",
    *,
    first: Side = "right",
    **settings: Any,
) -> Bout:
    """Plans a bout of `steps` steps, and one that brings the feet side by side, at `speed` [m/s] in its middle.

    `cadence` and `settings` are those of `plan_walk`, on level ground; `first` steps first. It takes `steps` + 4 step
    times: two until the first heel strike, two from the closing foot's landing until all is still. The first step has
    about 2/3 of the walk's length, the fourth all of it, and the last ones mirror them; the CoM comes down by up to
    1 cm where a leg would not reach (`DEEPEST_DIP`). At 1.2 m/s the CoM is within 1 mm of `plan_walk`'s from
    the fifth step to the sixth last, and a sixth of that, e^(-T sqrt(g/z)), every step further in.
    Raises `SpringfootError`, saying by how much, for a bout that cannot be: legs too short, ZMP outside the feet, a
    foot in the ground, and whatever `plan_walk` refuses.
    """
    steps = require_count("steps", steps, 1, MOST_STEPS)
    if first not in get_args(Side):
        raise SpringfootError(f"first must be 'left' or 'right', got {first!r}")
    if settings.get("slope"):
        raise SpringfootError("slope must be 0: a bout is planned on level ground only")
    plan = plan_walk(body, speed, cadence, **settings)
    step_lengths = step_lengths_of(plan, steps)
    feet = dict(
        zip(
            (first, "left" if first == "right" else "right"),
            bout_feet(plan, step_lengths, settings.get("clearance")),
            strict=True,
        )
    )
    knots = zmp_knots(plan, step_lengths)
    tick = 2 * plan.step_time / POSTURE_SAMPLES
    samples = tick * np.arange((BEFORE + steps + AFTER) * POSTURE_SAMPLES // 2 + 1)
    in_ticks = knots[0] / tick
    time = np.sort(np.append(samples, knots[0][np.abs(in_ticks - np.round(in_ticks)) > BESIDE]))
    sampled = np.searchsorted(time, samples)

    postures = foot_postures(plan, feet.values(), samples)
    standing, dips = standing_height(body), np.zeros(BEFORE + steps + AFTER + 1)
    for _ in range(MOST_TRIES):
        motion, shifts = com_from_rest_to_rest(plan, knots, time, standing, dips)
        legs = bout_legs(body, motion[0, sampled].T, *postures)
        lacking = legs.reach.max(axis=0) - full_reach(body, STRAIGHTEST)
        if lacking.max() < CLOSE:
            break
        # A leg leans little: what it lacks in a step, the body comes down by at both ends of the step.
        each = np.maximum(lacking[1:].reshape(-1, POSTURE_SAMPLES // 2).max(axis=1), 0.0)
        dips[1:-1] += 1.05 * np.maximum(each[1:], each[:-1])
    _refuse_short_legs(body, dips, float(lacking.max()))
    tables = np.stack([legs.thigh, legs.knee, legs.ankle, legs.toe], -1)
    bout = Bout(
        plan=plan,
        first=first,
        step_lengths=step_lengths,
        zmp_shifts=shifts,
        path=quintics(time, motion),
        feet=feet,
        hip_table=PchipInterpolator(samples, legs.hip[0]),
        joint_tables={side: PchipInterpolator(samples, table) for side, table in zip(feet, tables, strict=True)},
    )
    _refuse_feet_off_plan(bout, samples)
    return bout


def _refuse_short_legs(body: Body, dips: NDArray, lacking: float) -> None:
    too_deep = float(dips.max()) - DEEPEST_DIP * body.leg_length
    if too_deep > 0:
        raise SpringfootError(
            f"legs too short for this bout: the CoM would come down by {dips.max():.3f} m, {dips.argmax()} step times "
            f"after the start, {too_deep:.3f} m more than allowed; walk slower"
        )
    if lacking > CLOSE:
        raise SpringfootError(f"legs too short for this bout by {lacking:.5f} m; walk slower")


def _refuse_feet_off_plan(bout: Bout, samples: NDArray) -> None:
    # What is on the ground changes at the events: both sides of each are looked at.
    events = np.concatenate([foot.events for foot in bout.feet.values()])
    time = np.concatenate([samples, events - 1e-9, events + 1e-9])
    rear, front = bout.support(time)
    zmp = bout.zmp(time)
    beyond = np.maximum(rear - zmp, zmp - front)
    if beyond.max() > 1e-6:
        raise SpringfootError(
            f"ZMP outside the feet by {beyond.max():.6f} m at {time[beyond.argmax()]:.2f} s: a longer step or a longer "
            "double support helps"
        )
    ball = bout.plan.body.toe_joint_height
    for side in get_args(Side):
        heights = bout.heel_position(side, time)[1], bout.toe_joint_position(side, time)[1] - ball
        deep = -np.minimum(*heights)
        if deep.max() > FLOOR_TOLERANCE + 1e-5:
            raise SpringfootError(
                f"{side} foot {deep.max():.3f} m in the ground at {time[deep.argmax()]:.2f} s, "
                f"{deep.max() - FLOOR_TOLERANCE:.4f} m more than allowed: more clearance helps"
            )
