"""Tabulate the reference of a body at a few speeds: target, plan and leg constants.

The body is that of the settings. Between two tabulated speeds everything is linear in speed. Since mechanics scale
exactly (`envs.physics.model`), another body at a Froude-equal speed does the same in its own units
(`envs.control.subjects`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import ceil, floor, sqrt

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import Body
from springfoot.gait.people.human import HumanGait
from springfoot.gait.plan.com_plan import ComPlan, over_peoples_zmp
from springfoot.gait.plan.kinetics import planned_moments
from springfoot.gait.plan.plan import PLAN_SPEED_RANGE, Cadence, WalkPlan, plan_walk
from springfoot.gait.plan.plan_gait import gait_of
from springfoot.gait.plan.walk_style import least_work

from ..settings.settings import BipedSettings, body_of, plan_file_of, reference_gait
from .constants import LegConstants, generic_constants, leg_constants
from .phase_table import GRID
from .standing import SLOW_SPEED

SPACING = 0.1
"""Distance of tabulated speeds [m/s at 1.70 m, scaled with the square root of height]; chosen: half-way between them
the interpolated CoM is within 1.4 mm of the planned one, and farthest where people's data meet."""


FED = ("hip", "knee", "ankle")
"""Joints with a moment that is fed forward."""
FED_HARMONICS = 8
"""Fourier terms of the plan's moments that are fed forward; chosen: as its contacts are stiff, its moments jump."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ReferenceWalk:
    """Reference of the settings' body at one speed."""

    body: Body
    """The settings' body."""
    speed: float
    """Walking speed [m/s]."""
    target: HumanGait
    """Gait that the body follows: people's, or the plan's own with guide `plan`."""
    plan: ComPlan
    """The planned motion of the CoM, over people's ZMP where the body follows people, and the time of a stride."""
    constants: tuple[LegConstants, ...]
    """Leg constants: one set, or several variants."""
    moments: NDArray
    """(SAMPLES, 3) moments of hip, knee and ankle to feed forward [N m], extension and plantarflexion positive."""


def reference_walks(settings: BipedSettings, legs: Sequence[LegConstants] | None = None) -> tuple[ReferenceWalk, ...]:
    """Return the walks of the settings' body at `tabulated_speeds`, slowest first.

    `legs` are leg constants in place of the committed ones, the same at every speed. Raises `SpringfootError` for a
    walk that cannot be planned, with its speed and the settings that ask for it.
    """
    ratio = settings.step_time_ratio if settings.step_time_ratio != 1.0 else None
    given = {
        "height_range": settings.height_range,
        "speed_range": settings.speed_range,
        "step_time_ratio": ratio,
    }
    asked = " and ".join(f"{name} {value}" for name, value in given.items() if value is not None)
    walks = []
    for speed in tabulated_speeds(settings):
        constants = legs or _constants(settings, speed)
        try:
            walks.append(reference_walk_at(settings, float(speed), constants))
        except SpringfootError as error:
            of_ranges = f", asked for by {asked}" if asked else ""
            raise SpringfootError(f"no walk of {settings.height:g} m at {speed:.3g} m/s{of_ranges}: {error}") from None
    return tuple(walks)


def reference_walk_at(
    settings: BipedSettings, speed: float, legs: Sequence[LegConstants] | None = None
) -> ReferenceWalk:
    """Return the walk of the settings' body at `speed` [m/s]; `legs` as for `reference_walks`."""
    body = body_of(settings)
    people = reference_gait(settings, speed)
    legs = legs or _constants(settings, speed)
    if settings.follows_plan:
        style = least_work(speed / sqrt(body.length_scale), plan_file_of(settings))
        plan = plan_walk(body, speed, settings.cadence, human=people, style=style)
        target = gait_of(plan)
        moments = _moments_of(target, body)
        return ReferenceWalk(body=body, speed=speed, target=target, plan=plan, constants=tuple(legs), moments=moments)
    if settings.human is None and settings.people_file is None and settings.step_time_ratio == 1.0:
        plan = _plan(body, speed, settings.cadence)
    else:
        plan = plan_walk(body, speed, settings.cadence, human=people)
    return ReferenceWalk(
        body=body,
        speed=speed,
        target=people,
        plan=over_peoples_zmp(plan),
        constants=tuple(legs),
        moments=_plans_moments(plan) if settings.feedforward == "plan" else _moments_of(people, body),
    )


def _constants(settings: BipedSettings, speed: float) -> list[LegConstants]:
    """Return the constants for the settings' body at `speed` [m/s], one variant.

    They are tuned to people's walk, and generic for a body that follows the plan.
    """
    if settings.follows_plan:
        return [generic_constants()]
    equal_speed = speed / sqrt(body_of(settings).length_scale)  # of a body of 1.70 m
    return [leg_constants(settings.equilibrium, settings.cadence, equal_speed, settings.feedforward)]


def _moments_of(gait: HumanGait, body: Body) -> NDArray:
    """Return (SAMPLES, 3) a gait's mean moments of the joints in `FED`, scaled to the body [N m]."""
    moments = [gait.mean(f"{joint}_moment", GRID) for joint in FED]
    return np.stack(moments, -1) * body.total_mass * body.length_scale


def _plans_moments(plan: WalkPlan) -> NDArray:
    """Return (SAMPLES, 3) the moments of the joints in `FED` by inverse dynamics of the plan [N m], without harmonics
    above `FED_HARMONICS`, as they jump where feet land and leave."""
    by_joint = planned_moments(plan, GRID)
    waves = np.fft.rfft(np.stack([by_joint[joint] for joint in FED], -1), axis=0)  # over the stride, [0] the mean
    waves[FED_HARMONICS + 1 :] = 0.0
    return np.fft.irfft(waves, len(GRID), axis=0)


def rows(walks: Sequence[ReferenceWalk]) -> Iterator[tuple[LegConstants, ReferenceWalk]]:
    """Yield leg constants and walk of each row of a table: all speeds of the constants' first variant, then of the
    next."""
    for variant, walk in product(range(len(walks[0].constants) if walks else 0), walks):
        yield walk.constants[variant], walk


def tabulated_speeds(settings: BipedSettings) -> NDArray:
    """Return (G,) ascending speeds [m/s] of the settings' body that cover all Froude speeds of the settings.

    With one speed to cover this is the settings' speed alone. Else (`speed_range`, `height_range`, or a start or stop,
    which go down to `SLOW_SPEED`) it is the multiples of `SPACING` that enclose all of them, and the settings' speed. A
    multiple that no plan reaches (`PLAN_SPEED_RANGE`) is replaced by the end of that range, or by the outermost speed
    that is needed, if that lies beyond.
    """
    height = settings.height
    speed = settings.speed
    # A body of another height walks at the Froude number at which this body walks sqrt(height / other) times as fast.
    tallest_ratio, shortest_ratio = (
        sqrt(height / other) for other in reversed(settings.height_range or (height, height))
    )
    slow, fast = settings.speed_range or (speed, speed)
    slow = min(slow * tallest_ratio, speed)
    fast = max(fast * shortest_ratio, speed)
    unit = sqrt(body_of(settings).length_scale)  # speed of this body over the Froude-equal one at 1.70 m
    if settings.start == "standing" or settings.stop_at is not None:
        slow = min(slow, SLOW_SPEED * unit)
    if slow == fast:
        return np.array([speed])
    first = floor(slow / unit / SPACING + 1e-9)  # 1e-9: a speed that is a multiple but for rounding needs no other one
    last = ceil(fast / unit / SPACING - 1e-9)
    multiples = [round(k * SPACING, 9) * unit for k in range(first, last + 1)]  # rounded: 12 x 0.1 is not 1.2
    slowest_planned, fastest_planned = PLAN_SPEED_RANGE
    slowest = min(slow, slowest_planned)
    fastest = max(fast, fastest_planned)
    pulled_in = {min(max(multiple, slowest), fastest) for multiple in multiples}
    return np.array(sorted(pulled_in | {speed}))


@lru_cache(maxsize=256)
def _plan(body: Body, speed: float, cadence: Cadence) -> WalkPlan:
    """Return the plan with people's steps, cached, as planning takes a tenth of a second."""
    return plan_walk(body, speed, cadence)
