"""Compute rest angles of ankle and toe springs, and their stiffness without an action: curves over the stride."""

from collections.abc import Iterable

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.body.body import Body
from springfoot.gait.people.human import FootHabits, HumanGait, foot_habits

from ..physics.model import ANKLE, TOE, damping_times
from ..settings.settings import BipedSettings
from .constants import LegConstants
from .legs import knot_curve
from .phase_table import GRID
from .reference_walk import ReferenceWalk

_PEOPLES = foot_habits()
PLATEAUS = _PEOPLES.plateaus
"""Stride phases at which loading, early stance, late stance, push-off and swing start and end. `plateau_curve` is
constant on them and linear between them; chosen near people's."""
REFERENCE_STIFFNESS = _PEOPLES.ankle_quasi_stiffness or ()
"""K_ref [N m/rad] on the plateaus, for 1.70 m and 63 kg: people's ankle quasi-stiffness by phase, of the package's own
file (`springfoot.gait.people.human`)."""
TOE_OFF = _PEOPLES.toe_off
"""Stride phases over which people's planned toe returns to its swing posture."""


def plateau_curve(values: tuple[float, ...], plateaus: tuple[float, ...] = PLATEAUS) -> NDArray:
    """Return (SAMPLES,) curve on `GRID` that has these five values on the plateaus; periodic, linear between them."""
    return np.interp(GRID, plateaus, np.repeat(values, 2), period=1.0)


def foot_curves(settings: BipedSettings, constants: LegConstants, walk: ReferenceWalk) -> tuple[NDArray, NDArray]:
    """Return rest angles [rad] and scheduled stiffness [N m/rad] of ankle and toe, (SAMPLES, 2) each, on `GRID`.

    The setting `equilibrium` says which rest angles: `planned`, `angle`, `neutral`, or those of `schedule`. The
    stiffness is that of the setting `schedule`, or `fixed_stiffness` without one. `constants` and `walk` are a row of
    the tables (`reference_walk.rows`).
    """
    if settings.schedule is None:
        stiffness = fixed_stiffness(constants, walk.body, walk.target.foot.plateaus)
        rest = neutral(constants)
    else:
        stiffness, rest = settings.schedule.at(GRID)
    match settings.equilibrium:  # "phase" keeps the schedule's rest angles
        case "planned":
            rest = planned(constants, walk)
        case "angle":
            rest = angle(walk.target)
        case "neutral":
            rest = neutral(constants)
    return rest, stiffness


def foot_tables(settings: BipedSettings, rows: Iterable[tuple[LegConstants, ReferenceWalk]]) -> tuple[NDArray, NDArray]:
    """Return rest angles and scheduled stiffness of each of R rows (`reference_walk.rows`), for `PhaseTable`s.

    Rest angles are (R, SAMPLES, 2), with torques beside the springs (`foot_feed`) (R, SAMPLES, 4); stiffness is (R,
    SAMPLES, 2).
    """
    rests = []
    stiffnesses = []
    for constants, walk in rows:
        rest, stiffness = foot_curves(settings, constants, walk)
        feed = foot_feed(settings, constants, walk)
        rests.append(rest if feed is None else np.concatenate([rest, feed], axis=-1))
        stiffnesses.append(stiffness)
    return np.stack(rests), np.stack(stiffnesses)


def fixed_stiffness(constants: LegConstants, body: Body, plateaus: tuple[float, ...] = PLATEAUS) -> NDArray:
    """Return the tuned schedule of ankle and toe stiffness over the stride, (SAMPLES, 2) [N m/rad], for `body`.

    It is a part of `constants`: five values of the ankle, on the `plateaus`, and a constant one of the toe.
    """
    toe = np.full(len(GRID), constants.toe_schedule)
    return np.stack([plateau_curve(constants.ankle_schedule, plateaus), toe], axis=-1) * body.stiffness_scale


def planned(constants: LegConstants, walk: ReferenceWalk) -> NDArray:
    """Return the rest angles (SAMPLES, 2) [rad] of the equilibrium "planned".

    The ankle follows the target's angle theta and feeds its moment M (plantarflexion positive) forward through K_ref:
    theta_eq = theta + a (beta dtheta/dt - M/K_ref) + knots, a = `constants.feedforward`. A body that is on the plan
    and has K = K_ref then gets a times M. The toe's rest angle is the tuned one from foot flat to toe-off, and that of
    swing otherwise.

    A plan as target has no K_ref: theta_eq = theta + beta dtheta/dt + correction at ankle and toe, and its moments are
    fed forward beside the springs (`foot_feed`).
    """
    body = walk.body
    target = walk.target
    foot = target.foot
    beta = damping_times(body)
    period = constants.period_factor * walk.plan.stride_time
    if foot.ankle_quasi_stiffness is None:  # a plan is the target
        flat = np.interp(GRID, [*foot.toe_flat, *foot.toe_off], [0.0, 1.0, 1.0, 0.0])  # 1 from foot flat to toe-off
        corrections = knot_curve(constants.ankle_knots_deg), flat * np.deg2rad(constants.toe_flat_deg)
        joints = zip(("ankle", "toe"), (beta[ANKLE], beta[TOE]), corrections, strict=True)
        angles = [target.mean(name, GRID) + b * target.rate(name, GRID) / period + shift for name, b, shift in joints]
        return np.stack(angles, axis=-1)
    k_ref = plateau_curve(foot.ankle_quasi_stiffness or (), foot.plateaus) * body.stiffness_scale
    # `walk.moments` are positive in plantarflexion, the rest angle in dorsiflexion.
    lead = beta[ANKLE] * target.rate("ankle", GRID) / period - walk.moments[:, ANKLE] / k_ref
    ankle = target.mean("ankle", GRID) + constants.feedforward[ANKLE] * lead + knot_curve(constants.ankle_knots_deg)
    return np.stack([ankle, _toe_rest(foot, constants.toe_flat_deg)], axis=-1)


def foot_feed(settings: BipedSettings, constants: LegConstants, walk: ReferenceWalk) -> NDArray | None:
    """Return the torque (SAMPLES, 2) [N m], dorsiflexion positive, that acts beside the springs of ankle and toe,
    whatever their K: the target's moments, fed forward.

    None unless the equilibrium is "planned" and the target is a plan.
    """
    if settings.equilibrium != "planned" or walk.target.foot.ankle_quasi_stiffness is not None:
        return None
    unit = walk.body.total_mass * walk.body.length_scale  # of the target's moments, plantarflexion positive
    moments = [walk.target.mean(f"{joint}_moment", GRID) for joint in ("ankle", "toe")]
    return -constants.feedforward[ANKLE] * unit * np.stack(moments, axis=-1)


def angle(target: HumanGait) -> NDArray:
    """Return the rest angles (SAMPLES, 2) [rad] of the equilibrium "angle": the target's ankle angle alone, and a toe
    that is straight from foot flat to toe-off."""
    return np.stack([target.mean("ankle", GRID), _toe_rest(target.foot, 0.0)], axis=-1)


def neutral(constants: LegConstants) -> NDArray:
    """Return the rest angles (SAMPLES, 2) [rad] of the equilibrium "neutral", constant over the stride."""
    return np.tile(np.deg2rad(constants.neutral_deg), (len(GRID), 1))


def _toe_rest(foot: FootHabits, flat_deg: float) -> NDArray:
    """Return the rest angle of the toe over the stride (SAMPLES,) [rad]: `flat_deg` [deg] from foot flat to toe-off,
    else that of swing, and linear in the times of change of `foot`."""
    corners = [*foot.toe_flat, *foot.toe_off]  # stride phases: the toe goes to `flat_deg`, and back to swing
    swing = foot.toe_swing_deg
    return np.deg2rad(np.interp(GRID, corners, [swing, flat_deg, flat_deg, swing]))
