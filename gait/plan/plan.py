"""Plan a walk by the zero-moment point (ZMP): CoM, feet, leg inverse kinematics -> joint angles over the stride.

The ZMP runs straight from the rear foot to the front one in double support and along the stance foot in single support.
The feet follow it: the foot is flat as the ZMP passes its heel, the heel rises as the ZMP passes its toe joint, and in
a long double support the toe rolls over its tip once the ZMP has passed the tip, or later by a style's choice, so that
the ZMP never leaves the feet's parts on the ground. The hip is placed so that the CoM of the whole planned body, trunk
upright, is the planned CoM. On a slope the frame leans with the ground, and the trunk stays upright in the world.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil, cos, floor, pi, radians, sqrt
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_within

from ..body.body import ANGLES, GRAVITY, HEIGHT_RANGE, REFERENCE_HEIGHT, Body
from ..people.human import HumanGait, human_gait
from .cart_table import Bob, ComMotion, periodic_com, pivoted_com
from .com_plan import PEOPLES_SHARE, PEOPLES_ZMP, ComPlan, Point
from .foot import FootPath, feet_under_zmp, refuse_swing_in_ground
from .foot_style import between
from .leg_spin import spinning_legs
from .posture import POSTURE_SAMPLES, LegPostures, highest_legs, legs_under_com, refuse_impossible_legs
from .walk_style import WalkStyle

Cadence = Literal["people", "thesis", "effort"]
"""Choice of step length and time: people's, the thesis's, or those of least effort, which a style tells."""

PLAN_SPEED_RANGE = (0.4, 2.0)
"""Accepted speeds of the setting `speed` [m/s]; chosen: people's data reach from 0.85 to 1.96."""
EQUAL_SPEED_RANGE = (
    PLAN_SPEED_RANGE[0] / sqrt(HEIGHT_RANGE[1] / REFERENCE_HEIGHT),
    PLAN_SPEED_RANGE[1] / sqrt(HEIGHT_RANGE[0] / REFERENCE_HEIGHT),
)
"""Speeds [m/s] of a body of 1.70 m that equal, in Froude number, the slowest of the tallest body and the fastest of the
shortest; `plan_walk` takes these, times the square root of the body's scale."""
SLOPE_RANGE = (radians(-5.0), radians(5.0))
"""Accepted slopes [rad], uphill positive; chosen."""
STEP_TIME_RANGE = (0.25, 1.2)
"""Accepted step times [s]; chosen: people take 0.4 to 0.7."""
THESIS_STEP_TIME = 0.5
"""Step time of the thesis (T_c) [s], at 1.70 m."""
DOUBLE_SUPPORT = 0.12
"""Double support over step time [-]: the thesis's 0.06 s of 0.5 s. The toe stays flat until double support ends. In a
longer double support the toe rolls over its tip, further with its length, as people's toe does in their 0.26 at 1.2
m/s."""
LEAST_FULL_ROLL = 0.18
"""Least double support over step time at which the toe rolls as far as people's [-]; otherwise the whole roll takes
`PEOPLES_SHARE` of people's double support; chosen: people's double support at their fastest, 1.96 m/s."""
ROLLING_STEP = (1.0, 1.5)
"""Step lengths without a roll and with a whole roll [foot lengths]; chosen: in short steps the tip of the rear foot
lies beside the front foot."""
ZMP_TRAVEL = ((-0.020, 0.140), PEOPLES_ZMP)
"""ZMP forward of the stance ankle at the start and end of single support [m at 1.70 m], over a flat toe and at a whole
roll; linear in between. The travel over a flat toe is chosen: of the travels tried, it brings the knee nearest to
people's at 1.2 m/s."""
RISE = 0.65
"""Rise and fall of the CoM over that of the stiff-legged compass gait, step_length^2 / (8 leg_length) [-]; chosen: 39
mm at 1.2 m/s, where people's is 36 to 39 mm."""
MOST_UNLOADING = 0.75
"""Largest fraction of the weight that rise and fall may take from the feet [-]; chosen; it limits the rise at high
speeds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkPlan(ComPlan):
    """A periodic walk, CoM, feet and legs; made by `plan_walk`.

    Stride phase 0..1 belongs to one leg, from its heel strike to its next, in that foot's frame. On a slope angles
    stay as they are: the thigh's to the true vertical, knee, ankle and toe between segments.
    """

    feet: FootPath
    """The path of either foot over its stride, with the phases of foot flat, heel-off and toe-off."""
    joint_table: PchipInterpolator = field(repr=False)
    """thigh, knee, ankle, toe [rad] over stride phase, a little beyond 0..1."""
    hip_table: PchipInterpolator = field(repr=False)
    """Hip x, z [m] in the foot's frame over stride phase, a little beyond 0..1."""

    def support(self, step_phase: ArrayLike) -> tuple[NDArray, NDArray]:
        """Return the rear and front end [m] of the base of support, the hull of all parts of the feet on the ground.

        x is forward of the leading (stance) foot's ankle when flat."""
        phase = np.mod(np.asarray(step_phase, float), 1.0) / 2  # of the leading foot's stride; the other's is 0.5 later
        rear, front = self.feet.on_ground(phase)
        rear_of_trailing, front_of_trailing = self.feet.on_ground(phase + 0.5)
        two_feet = phase + 0.5 <= self.feet.toe_off
        return (
            np.where(two_feet, np.minimum(rear, rear_of_trailing - self.step_length), rear),
            np.where(two_feet, np.maximum(front, front_of_trailing - self.step_length), front),
        )

    def joint_angles(self, stride_phase: ArrayLike) -> dict[str, NDArray]:
        """Return thigh (to the vertical), knee, ankle, toe [rad]; flexion, dorsiflexion, toe up positive."""
        return _by_angle(self.joint_table(np.mod(stride_phase, 1.0)))

    def hip_position(self, stride_phase: ArrayLike) -> Point:
        """Return the hip (x, z) [m] in the frame of the foot of this stride."""
        x, z = np.moveaxis(self.hip_table(np.mod(stride_phase, 1.0)), -1, 0)
        return x, z

    def toe_joint_position(self, stride_phase: ArrayLike) -> Point:
        """Return the toe joint (x, z) [m] in the foot's frame; at its standing place from foot flat until the toe rolls
        over."""
        return self.feet.toe_joint(stride_phase)


def plan_walk(
    body: Body,
    speed: float = 1.2,
    cadence: Cadence = "people",
    *,
    step_time: float | None = None,
    double_support: float | None = None,
    com_height: float | None = None,
    com_amplitude: float | None = None,
    zmp_travel: tuple[float, float] | None = None,
    slope: float = 0.0,
    clearance: float | None = None,
    human: HumanGait | None = None,
    style: WalkStyle | None = None,
) -> WalkPlan:
    """Plan a walk of `body` at `speed` [m/s] along the ground.

    Args:
        body: lengths and masses.
        speed: mean forward speed [m/s], within `EQUAL_SPEED_RANGE` at 1.70 m.
        cadence: "people": step length and time as people of that height choose them at that speed (0.66 m, 0.55 s at
            1.2 m/s, 1.70 m); outside their data both change with the square root of speed. "thesis": 0.5 s a step at
            every speed (0.6 m at 1.2 m/s), times the square root of height / 1.70 m.
            "effort": people's times `step_time_ratio` of the `style`.
        step_time: [s] in place of the cadence's; the step length follows from the speed.
        double_support: [s]; by default `DOUBLE_SUPPORT` times the step time. In a longer double support the toe rolls
            further over its tip, and the default `zmp_travel` lies further forward.
        com_height: mean [m]; by default the greatest that leaves the knees `STRAIGHTEST_KNEE`.
        com_amplitude: half of rise and fall [m]; 0 keeps the height constant, solved in closed form.
        zmp_travel: ZMP at the start and end of single support, from the stance ankle [m].
        clearance: least height of the swing foot in mid-swing [m] (`FootPath.clearance`; 17 mm at 1.70 m by default).
        slope: [rad], uphill positive. Step time and length, rockers and swing stay those of level ground unless given,
            so the knees bend more than people's: people change step and swing on a slope.
        human: gait in place of people's (`human_gait`): its step length and time, and its toe in swing.
        style: choices in place of those by people's curves (`walk_style`); the other arguments override the style.

    At 1.2 m/s, 1.70 m the angles lie within 3.4 (thigh), 4.3 (knee) and 6.0 deg rms (ankle) of people's, and the CoM is
    accelerated by up to 0.26 g fore and aft, as double support is shorter than people's. With a double support
    of 0.12 s, 0.22 of the step, the acceleration is 0.23 g, and the angles are 5.6, 7.0 and 9.3 deg off.

    Raises `SpringfootError`, saying by how much, for an impossible walk: legs too short, ZMP outside the feet, a swing
    foot in the ground.
    """
    unit = sqrt(body.length_scale)
    slowest, fastest = (unit * equal for equal in EQUAL_SPEED_RANGE)
    # Outwards to centimetres a second, so that the ends themselves are inside; 1e-6 against ends that miss by rounding.
    slowest, fastest = floor(100 * slowest + 1e-6) / 100, ceil(100 * fastest - 1e-6) / 100
    speed = require_within("speed", speed, (slowest, fastest), "m/s")
    if cadence not in get_args(Cadence):
        raise SpringfootError(f"cadence must be 'people', 'thesis' or 'effort', got {cadence!r}")
    if cadence == "effort" and style is None:
        raise SpringfootError("cadence 'effort' needs a style, which tells its step time")
    slope = require_within("slope", slope, SLOPE_RANGE, "rad")
    human = human_gait(speed, body.height) if human is None else human
    if step_time is None:
        ratio = style.step_time_ratio if style is not None and cadence == "effort" else 1.0
        step_time, step_length = (ratio * usual for usual in _step_time_and_length(body, speed, cadence, human))
    else:
        step_time = require_within("step_time", step_time, STEP_TIME_RANGE, "s")
        step_length = speed * step_time
    if double_support is None:
        double_support = (DOUBLE_SUPPORT if style is None else style.double_support) * step_time
    double_support = require_within("double_support", double_support, (0.02, 0.4 * step_time), "s")
    # The amplitude that takes all weight off the feet at mid-stance; above it they would have to pull the body down.
    weightless = GRAVITY * cos(slope) * (step_time / (2 * pi)) ** 2
    if com_amplitude is None:
        rise = RISE if style is None else style.rise
        # 16 = 2 x 8: the amplitude is half of the rise and fall, and `RISE` is over step_length^2 / (8 leg_length).
        com_amplitude = min(rise * step_length**2 / (16 * body.leg_length), MOST_UNLOADING * weightless)
    com_amplitude = require_within("com_amplitude", com_amplitude, (0.0, 0.9 * weightless), "m")
    if com_height is not None:
        com_height = require_within("com_height", com_height, (0.5 * body.height, 0.7 * body.height), "m")

    roll = _roll(body, human, double_support, step_time, step_length) if style is None else 1.0
    # The ZMP travel of a style is for a foot of average length: it scales with the foot's length.
    default_travel = between(ZMP_TRAVEL, roll) if style is None else np.array(style.zmp_travel) * body.foot_ratio
    zmp_from, zmp_to = _zmp_travel(body, zmp_travel, default_travel)
    # Corners of the ZMP's course over a step: heel strike, toe-off of the other foot, the style's points within single
    # support (none without a style), the next heel strike.
    covered = [] if style is None or style.zmp_way is None else style.zmp_way
    times_between = double_support + np.arange(1, len(covered) + 1) / (len(covered) + 1) * (step_time - double_support)
    zmp_times = np.array([0.0, double_support, *times_between, step_time])
    points_between = zmp_from + np.array(covered) * (zmp_to - zmp_from)
    zmp_points = np.array([zmp_to - step_length, zmp_from, *points_between, zmp_to])
    feet = feet_under_zmp(
        body, step_length, zmp_times, zmp_points, roll, clearance, None if style is None else style.foot
    )
    lean = 0.0 if style is None else style.lean

    bob = Bob(
        step_time=step_time,
        amplitude=com_amplitude,
        lowest_at=double_support * (0.5 if style is None else style.lowest),
        second=(0.0, 0.0) if style is None else style.rise_again,
    )
    if style is not None:
        com_at = pivoted_com(zmp_times, zmp_points, step_length, bob, slope)
        motion, legs = spinning_legs(body, com_at, feet, human, step_time, style.knee, com_height, lean)
    else:

        def legs_at(height: float) -> tuple[ComMotion, LegPostures]:
            """Plan CoM and legs at a mean CoM height [m]."""
            motion = periodic_com(zmp_times, zmp_points, step_length, height, bob, slope)
            return motion, legs_under_com(body, motion, feet, human)

        motion, legs = highest_legs(body, legs_at) if com_height is None else legs_at(com_height)
    refuse_impossible_legs(body, legs)
    table = np.stack([legs.thigh, legs.knee, legs.ankle, legs.toe], -1)
    plan = WalkPlan(
        body=body,
        speed=speed,
        step_time=step_time,
        step_length=step_length,
        double_support=double_support,
        motion=motion,
        feet=feet,
        human=human,
        lean=lean,
        joint_table=_periodic_table(table),
        hip_table=_periodic_table(legs.hip, shift=np.array([2 * step_length, 0.0])),
    )
    refuse_swing_in_ground(feet)
    _refuse_zmp_outside(plan)
    return plan


def _step_time_and_length(body: Body, speed: float, cadence: str, human: HumanGait) -> tuple[float, float]:
    """Return step time [s] and step length [m] at `speed` [m/s]: the thesis's with that cadence, people's with others.

    `human` gives those of people at the nearest speed of their data.
    """
    if cadence == "thesis":
        step_time = THESIS_STEP_TIME * sqrt(body.length_scale)
        return step_time, speed * step_time
    # Outside the speeds of people's data step length and step rate both change by the same factor.
    factor = sqrt(speed * human.stride_time / (2 * human.step_length))
    return human.stride_time / 2 / factor, human.step_length * factor


def _roll(body: Body, human: HumanGait, double_support: float, step_time: float, step_length: float) -> float:
    """Return the roll of the toe over its tip (`FootPath.roll`, 0 to 1) for a double support [s].

    Longer double supports than `DOUBLE_SUPPORT` give more roll, steps below `ROLLING_STEP` less. The step has a time
    [s] and a length [m].
    """
    full_roll = max(PEOPLES_SHARE * (2 * human.toe_off - 1), LEAST_FULL_ROLL)
    roll = float(np.interp(double_support, [DOUBLE_SUPPORT * step_time, full_roll * step_time], [0.0, 1.0]))
    return roll * float(np.interp(step_length / body.foot_length, ROLLING_STEP, [0.0, 1.0]))


def _zmp_travel(body: Body, travel: tuple[float, float] | None, default: ArrayLike) -> tuple[float, float]:
    """Return the ZMP [m] from the stance ankle at the start and end of single support: `travel` [m], or without a
    `travel` the `default` [m at 1.70 m]."""
    if travel is None:
        zmp_from, zmp_to = np.asarray(default) * body.length_scale
        return float(zmp_from), float(zmp_to)
    if not isinstance(travel, Sequence | np.ndarray) or len(travel) != 2:
        raise SpringfootError(f"zmp_travel must be 2 numbers (start, end of single support) [m], got {travel!r}")
    bounds = (-body.foot_length, body.foot_length)
    return require_within("zmp_travel start", travel[0], bounds, "m"), require_within(
        "zmp_travel end", travel[1], bounds, "m"
    )


def _refuse_zmp_outside(plan: WalkPlan) -> None:
    """Raise `SpringfootError` if the ZMP of a plan leaves the feet on the ground."""
    feet = plan.feet
    # The parts of the feet on the ground change at the events: check just before and just after each event.
    events = 2 * np.array([feet.foot_flat, feet.heel_off, feet.tip_off - 0.5, feet.toe_off - 0.5])
    phase = np.concatenate([np.arange(2000) / 2000, events - 1e-9, events + 1e-9])
    rear, front = plan.support(phase)
    zmp = plan.zmp(phase)
    beyond = np.maximum(rear - zmp, zmp - front)
    if beyond.max() > 1e-6:  # [m]; a ZMP at an edge may err by rounding
        raise SpringfootError(
            f"ZMP outside the feet by {beyond.max():.4f} m at {phase[beyond.argmax()]:.0%} of the step"
        )


def _periodic_table(values: NDArray, shift: NDArray | float = 0.0) -> PchipInterpolator:
    """Return a table (POSTURE_SAMPLES, n) over phase 0..1 as a shape-keeping cubic, which does not overshoot."""
    edge = 4  # samples beyond each end: the stride's other end, shifted
    padded = np.concatenate([values[-edge:] - shift, values, values[: edge + 1] + shift])
    with np.errstate(over="ignore"):  # a slope next to none has an infinite weight, which makes the knot's slope 0
        return PchipInterpolator(np.arange(-edge, POSTURE_SAMPLES + edge + 1) / POSTURE_SAMPLES, padded, axis=0)


def _by_angle(columns: NDArray) -> dict[str, NDArray]:
    """Return name -> angle (...) [rad] from columns (..., 4): thigh, knee, ankle and toe, the names of `ANGLES`."""
    return dict(zip(ANGLES, np.moveaxis(columns, -1, 0), strict=True))
