"""Put together the numbers of an evaluation: how human the walk is, from the strides and steps of `tally`.

`measure` is a pure function of a recording, so that anyone can recompute every number from `strides.npz`. Human-facing
edge: angles in degrees, forces in body weights (BW), moments in N m/kg, work in J/kg.
"""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.energy import ledger_entries
from springfoot.envs.physics.model import JOINTS, SIDES
from springfoot.envs.physics.timing import ACTION_STEP
from springfoot.envs.settings.settings import DEFAULT_WEIGHTS, body_of, reference_gait, settings_to_json
from springfoot.envs.task.reward import TERMS
from springfoot.gait.people import scores as score
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.plan.effort import AS_IS, Muscle

from ..recording.open_loop import alike_legs, feedback
from ..recording.recording import REWARD, TICK, Recording
from .curves import StrideCurves
from .likeness import angle_numbers, force_numbers, moment_numbers
from .measured_effort import cost_of_transport, effort_numbers
from .per_leg import ANGLE_COLUMNS, USUAL_TOE_OFF, asymmetry, feet_differ, kinds_of, leg_numbers
from .tally import StrideTally, tally_strides

MOMENT_CURVES = {
    "hip": "hip_moment_Nm_per_kg",
    "knee": "knee_moment_Nm_per_kg",
    "ankle": "ankle_moment_Nm_per_kg",
    "toe": "mtp_moment_Nm_per_kg",
}
"""Joint -> column of its moment's curve over the stride."""


@dataclass(kw_only=True, eq=False)
class Gait:
    """A measured gait: `metrics` as written to metrics.json, and the curves from which they come."""

    metrics: dict[str, Any] = field(default_factory=dict)
    """Plain JSON values; None for a number that could not be measured."""
    tally: StrideTally = field(default_factory=StrideTally)
    """Curves and values from which the numbers are computed."""

    @property
    def feet(self) -> tuple[StrideCurves, StrideCurves]:
        """Curves over the stride of the left and the right foot."""
        return self.tally.feet

    @property
    def both(self) -> StrideCurves:
        """Curves over the stride of both feet."""
        return self.tally.both

    @property
    def com(self) -> StrideCurves:
        """CoM over the step, as in `StrideTally`."""
        return self.tally.com


def measure(recording: Recording, muscle: Muscle = AS_IS) -> Gait:
    """Compute every number of metrics.json and the mean curves, from the recording alone.

    `muscle` has factors on properties of the muscles with measured effort.
    """
    tally = tally_strides(recording, muscle)
    return Gait(metrics=_metrics(recording, tally), tally=tally)


def _metrics(recording: Recording, tally: StrideTally) -> dict[str, Any]:
    """Return the numbers of metrics.json, nested as in docs/reference/metrics.md."""
    settings = recording.settings
    both = tally.both
    human = reference_gait(settings)
    reasons = Counter(str(reason) for reason in recording.fall_reason if reason)
    forces = force_numbers(both.mean("grf_vertical_bw"), both.mean("grf_forward_bw"), human)
    toe_off = _mean(tally.toe_off)
    plan_x, plan_z = recording.plan_com.T
    com_z = tally.com.mean("z")
    of_each_leg = leg_numbers(tally)
    legs = of_each_leg if feet_differ(settings) else None
    unlike = legs is None and len(alike_legs(recording)) > 1

    def stiffness(name: str) -> dict[str, Any]:
        """Return the entry `name`, ankle or toe, of `stiffness_Nm_rad`: mean K of both legs in each part of the stride.

        If one leg's joint is locked, it is the mean of the other leg alone.
        """
        free = [side for side, foot in zip(SIDES, settings.feet, strict=True) if not getattr(foot, name).is_locked]
        if legs is not None and len(free) == 1:
            return legs[free[0]]["stiffness_Nm_rad"][name]
        swing_begin = USUAL_TOE_OFF if toe_off is None else toe_off
        return score.phase_means(both.mean(f"{name}_stiffness_Nm_per_rad"), swing_begin)

    work = _joint_work(tally)
    return {
        "policy": recording.policy,
        "environment": settings_to_json(settings),
        "reference": {
            "condition": human.condition,
            "speed_m_s": human.speed,
            "borrowed": list(human.borrowed),
        },
        "feet": kinds_of(settings),
        "seed": recording.seed,
        "episodes": len(recording.ticks),
        "falls": sum(reasons.values()),
        "fall_reasons": dict(reasons),
        "came_to_rest": None if settings.stop_at is None else tally.at_rest,
        "seconds_mean": float(recording.ticks.mean() * TICK),
        "return": score.mean_sd(recording.returns),
        "reward_terms": _reward_terms(recording),
        "strides": {"count": both.count, "in_episodes_that_fell": tally.strides_of_falls},
        "speed_m_s": score.mean_sd(tally.speed),
        "step_length_m": _mean(tally.step_length),
        "cadence_steps_min": 60 / float(np.mean(tally.step_time)) if tally.step_time else None,
        "double_support_s": _mean(tally.double_support),
        "toe_off_percent": toe_off,
        "joints": {name: angle_numbers(both.mean(column), human, name) for name, column in ANGLE_COLUMNS.items()},
        "com": {
            "x_rmse_m": score.rmse(tally.com.mean("x"), plan_x),
            "z_rmse_m": score.rmse(com_z, plan_z),
            "z_r": score.correlation(com_z, plan_z),
            "vx_r": score.correlation(tally.com.mean("vx"), np.gradient(plan_x)),
            "rise_m": float(np.ptp(com_z)) if tally.com.count else None,
        },
        "grf": forces | {"vertical_max_bw": float(max(tally.vertical_max)) if tally.vertical_max else None},
        "moments": {name: moment_numbers(both.mean(column), human, name) for name, column in MOMENT_CURVES.items()},
        "ankle_work_J_kg": work["ankle"],
        "joint_work_J_kg": work,
        "effort": effort_numbers(tally.effort, body_of(settings)),
        "com_work_J_kg": {"push_off": _mean(tally.push_off), "collision": _mean(tally.collision)},
        "energy_J_kg": _energy(tally),
        "springs_J_kg": _springs(tally),
        "zmp": _zmp(recording.plan_zmp, tally),
        "cost_of_transport": cost_of_transport(tally.work, body_of(settings).mass, tally.distance),
        "stiffness_Nm_rad": {name: stiffness(name) for name in ("ankle", "toe")},
        "leg_stiffness_Nm_rad": {side: of_each_leg[side]["stiffness_Nm_rad"] for side in SIDES} if unlike else None,
        "feedback": feedback(recording),
        "per_leg": legs,
        "asymmetry": None if legs is None else asymmetry(legs),
        "contact_travel_m": _mean(tally.travel),
        "toe_clearance_m": float(np.median(tally.clearance)) if tally.clearance else None,
    }


def _reward_terms(recording: Recording) -> dict[str, dict[str, float]]:
    """Return `reward_terms` of metrics.json: each term's weight and mean contribution to the return of an episode."""
    terms = np.nan_to_num(recording.series[REWARD].astype(float))  # (E, T, TERMS); 0 after an episode's end
    weights = DEFAULT_WEIGHTS | recording.settings.reward_weights
    alive = terms[..., TERMS.index("alive")]  # 1, and 0 in the step of a fall, which has no reward
    # A weight is paid per `ACTION_STEP`, a tick is a part of that.
    return {
        name: {
            "weight": float(weights[name]),
            "return_mean": float(weights[name] * (alive * terms[..., term]).sum(1).mean() * TICK / ACTION_STEP),
        }
        for term, name in enumerate(TERMS)
    }


def _joint_work(tally: StrideTally) -> dict[str, dict[str, float | None]]:
    """Return `joint_work_J_kg` of metrics.json: each joint's mean positive and negative work of one leg in a stride.

    Negative work is a positive number.
    """
    if not tally.joint_work:
        return {joint: {"positive": None, "negative": None} for joint in JOINTS}
    mean = np.mean(tally.joint_work, axis=0)  # (joint, (positive, negative))
    return {
        joint: {"positive": float(positive), "negative": float(-negative)}
        for joint, (positive, negative) in zip(JOINTS, mean, strict=True)
    }


SPRING_SOURCES = ("stiffness_changes", "equilibrium_changes", "spring_damping")
"""Entries of the energy ledger that put energy into a spring and take it out, besides the joint's work
(`springfoot.envs.physics.energy`)."""


def _energy(tally: StrideTally) -> dict[str, float | None]:
    """Return `energy_J_kg` of metrics.json: mean flows of energy in a stride, both legs together, into the body
    positive.

    `residual` is the part of the change of mechanical energy that the flows do not explain.
    """
    order = ("actuators", "stiffness_changes", "equilibrium_changes", "passive_damping", "spring_damping", "contact")
    names = (*order, "pushes", "mechanical_change", "residual")
    if not tally.energy:
        return dict.fromkeys(names)
    entry = dict(zip(ledger_entries(), np.mean(tally.energy, axis=0).tolist(), strict=True))
    for source in SPRING_SOURCES:  # of all joints together
        entry[source] = sum(entry[f"{source}/{joint}"] for joint in JOINTS)
    change = entry["mechanical_change"] = entry["mechanical"]
    entry["residual"] = change - sum(entry[name] for name in ("actuators", "passive_damping", "contact", "pushes"))
    return {name: entry[name] for name in names}


def _springs(tally: StrideTally) -> dict[str, dict[str, float | None]]:
    """Return `springs_J_kg` of metrics.json: mean energy put into each joint's spring of one leg in a stride, by each
    of `SPRING_SOURCES`.

    The ledger is of both legs, of which each gets half.
    """
    if not tally.energy:
        return {joint: dict.fromkeys(SPRING_SOURCES) for joint in JOINTS}
    entry = dict(zip(ledger_entries(), np.mean(tally.energy, axis=0).tolist(), strict=True))
    return {joint: {source: 0.5 * entry[f"{source}/{joint}"] for source in SPRING_SOURCES} for joint in JOINTS}


def _zmp(planned: NDArray, tally: StrideTally) -> dict[str, float | None]:
    """Return `zmp` of metrics.json: RMSE and correlation of the mean centre of pressure (CoP) with the `planned` ZMP
    over the step (101,).

    Percent 100 is left out, as the plan is at the next foot there.
    """
    cop = tally.cop.mean("x")[:-1]
    single_support = np.full(len(cop), False)
    if tally.step_time:  # a step begins with its double support
        single_support = PERCENT[:-1] >= 100 * np.mean(tally.double_support) / np.mean(tally.step_time)
    return {
        "cop_rmse_single_support_m": score.rmse(cop[single_support], planned[:-1][single_support])
        if single_support.any()
        else None,
        "cop_rmse_m": score.rmse(cop, planned[:-1]),
        "r": score.correlation(cop, planned[:-1]),
    }


def _mean(values: list[float]) -> float | None:
    """Return the mean of values; None without any."""
    return float(np.mean(values)) if values else None
