"""From recorded episodes to the numbers of an evaluation: how human the walk is.

`measure` is a pure function of a recording, so that anyone can recompute every number from `strides.npz`. Human-facing
edge: angles in degrees, forces in body weights (BW), moments in N m/kg, work in J/kg.
"""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from springfoot.envs.control.standing import steady_walk
from springfoot.envs.physics.foot_contact import CONTACTS
from springfoot.envs.physics.model import ANKLE, HIP, KNEE, SIDES, TOE, contact_material
from springfoot.envs.settings import body_of, reference_gait, settings_to_json
from springfoot.gait import GRAVITY, Body
from springfoot.gait import scores as score
from springfoot.gait.cycle import (
    CONTACT_THRESHOLD_BW,
    PERCENT,
    Contacts,
    find_contacts,
    find_steps,
    next_after,
    on_percent,
)

from .recording import TICK, Recording
from .stride_curves import StrideCurves

WARM_UP = 3.0
"""Beginning of each steady walk left out of the gait's numbers [s]; a fall in it counts."""
SHORTEST_SPEED = 1.0
"""An episode that ends earlier than this after the warm-up [s] tells nothing about speed."""
CLEARANCE_SWING = (0.25, 0.75)
"""Part of the swing in which toe clearance is taken."""

GAIT_CYCLE_COLUMNS = (
    "hip_flexion_deg",
    "knee_flexion_deg",
    "ankle_dorsiflexion_deg",
    "pelvis_anterior_tilt_deg",
    "thigh_flexion_deg",
    "shank_pitch_deg",
    "foot_pitch_deg",
    "hip_moment_Nm_per_kg",
    "knee_moment_Nm_per_kg",
    "ankle_moment_Nm_per_kg",
    "hip_power_W_per_kg",
    "knee_power_W_per_kg",
    "ankle_power_W_per_kg",
    "grf_vertical_bw",
    "grf_forward_bw",
    "mtp_dorsiflexion_deg",
    "mtp_moment_Nm_per_kg",
    "ankle_stiffness_Nm_per_rad",
    "toe_stiffness_Nm_per_rad",
    "ankle_equilibrium_deg",
    "mtp_equilibrium_deg",
)
"""Columns of gait_cycle.csv. Hip: thigh to trunk; shank pitch: foot ahead; foot pitch: toes up. Moments are internal
(actuator and joint damping), hip and knee extension, ankle and toe (mtp) plantarflexion positive; power: generation."""

JOINT_CURVES = {
    "thigh": "thigh_flexion_deg",
    "knee": "knee_flexion_deg",
    "ankle": "ankle_dorsiflexion_deg",
    "toe": "mtp_dorsiflexion_deg",
}
"""Joint as people's curves and metrics.json name it -> column."""
MOMENT_CURVES = {
    "hip": "hip_moment_Nm_per_kg",
    "knee": "knee_moment_Nm_per_kg",
    "ankle": "ankle_moment_Nm_per_kg",
    "toe": "mtp_moment_Nm_per_kg",
}


@dataclass(kw_only=True, eq=False)
class Gait:
    """A measured gait: `metrics` as written to metrics.json, and the mean curves it stands on."""

    metrics: dict[str, Any] = field(default_factory=dict)
    """Plain JSON values; None where something could not be measured."""
    feet: tuple[StrideCurves, StrideCurves] = field(
        default_factory=lambda: (StrideCurves(names=GAIT_CYCLE_COLUMNS), StrideCurves(names=GAIT_CYCLE_COLUMNS))
    )
    """Curves over the stride of the left and the right foot."""
    both: StrideCurves = field(default_factory=lambda: StrideCurves(names=GAIT_CYCLE_COLUMNS))
    """Curves over the stride of both feet."""
    com: StrideCurves = field(default_factory=lambda: StrideCurves(names=("x", "z", "vx")))
    """CoM over the step: x from the ankle of the foot whose stance began last, z above the ground [m], vx [m/s]."""


def measure(recording: Recording) -> Gait:
    """Every number of metrics.json and the mean curves, from the recording alone."""
    gait, tally = Gait(), _Tally()
    body = body_of(recording.settings)
    fell = recording.fall_reason != ""
    begin, end = steady_walk(recording.settings)
    for episode, ticks in enumerate(recording.ticks):
        series = {name: values[episode, :ticks].astype(float) for name, values in recording.series.items()}
        if ticks:
            _add_episode(gait, tally, series, body, (begin + WARM_UP, end), bool(fell[episode]))
            tally.at_rest += not fell[episode] and score.at_rest(
                series["com"], *series["ankle"].swapaxes(0, 1), tick=TICK
            )
    gait.metrics = _metrics(recording, gait, tally, body)
    return gait


@dataclass(kw_only=True)
class _Tally:
    """What is collected stride by stride, step by step and episode by episode."""

    strides_of_falls: int = 0
    at_rest: int = 0
    speed: list[float] = field(default_factory=list)
    distance: float = 0.0
    work: float = 0.0
    step_length: list[float] = field(default_factory=list)
    step_time: list[float] = field(default_factory=list)
    double_support: list[float] = field(default_factory=list)
    toe_off: list[float] = field(default_factory=list)
    vertical_max: list[float] = field(default_factory=list)
    ankle_positive: list[float] = field(default_factory=list)
    ankle_negative: list[float] = field(default_factory=list)
    travel: list[float] = field(default_factory=list)
    clearance: list[float] = field(default_factory=list)


def _add_episode(
    gait: Gait, tally: _Tally, series: dict[str, NDArray], body: Body, steady: tuple[float, float], fell: bool
) -> None:
    """`steady` is the time [s] the numbers are taken from."""
    weight = body.mass * GRAVITY
    com, power = series["com"], (series["torque"] + series["passive_torque"]) * series["velocity"]
    begin, end = (round(min(time / TICK, len(com))) for time in steady)
    if end > begin:
        distance, seconds = com[end - 1, 0] - com[begin - 1, 0], (end - begin) * TICK
        tally.distance += distance
        tally.work += float(score.positive_work(power[begin:end], TICK).sum())
        if seconds >= SHORTEST_SPEED:
            tally.speed.append(distance / seconds)

    # Forces are means over a tick, so they belong to its middle; states to its end.
    vertical = series["force"][..., 1].sum(axis=2)
    contacts = [
        find_contacts(vertical[:, side], TICK, CONTACT_THRESHOLD_BW * weight, first=TICK / 2)
        for side in range(len(SIDES))
    ]
    material = contact_material(body, series["contact"], series["base"], series["angle"])
    for side, foot in enumerate(contacts):
        strides = foot.strides(after=steady[0])
        strides = strides[strides[:, 2] <= steady[1]]
        heel_strike, toe_off, end = strides.T
        curves = np.concatenate(
            [
                on_percent(_states(series, side, body), heel_strike, end, TICK, first=TICK),
                on_percent(_forces(series, side, weight), heel_strike, end, TICK, first=TICK / 2),
            ],
            axis=-1,
        )[..., _ORDER]
        gait.feet[side].add(curves)
        gait.both.add(curves)
        tally.strides_of_falls += fell * len(strides)
        tally.toe_off += list((toe_off - heel_strike) / (end - heel_strike) * 100)
        work = score.stride_work(curves[..., GAIT_CYCLE_COLUMNS.index("ankle_power_W_per_kg")], end - heel_strike)
        tally.ankle_positive += list(work[0])
        tally.ankle_negative += list(work[1])
        contact, load = series["contact"][:, side], series["force"][:, side, :, 1]
        for start, leave, stop in np.floor(strides / TICK).astype(int):
            tally.vertical_max.append(vertical[start : stop + 1, side].max() / weight)
            stance = slice(start, leave + 1)
            tally.travel.append(score.travel(material[stance, side], load[stance], CONTACT_THRESHOLD_BW * weight))
            first, last = (round(leave + share * (stop - leave)) for share in CLEARANCE_SWING)
            tally.clearance.append(contact[first : last + 1, CONTACTS.index("ball") :, 1].min())
    _add_steps(gait, tally, series, contacts, steady)


def _add_steps(
    gait: Gait, tally: _Tally, series: dict[str, NDArray], contacts: list[Contacts], steady: tuple[float, float]
) -> None:
    steps, sides = find_steps(contacts[0], contacts[1], after=steady[0])
    in_time = steps[:, 1] <= steady[1]
    steps, sides = steps[in_time], sides[in_time]
    for side in range(len(SIDES)):
        begin, end = steps[sides == side].T
        relative = np.column_stack(
            [series["com"][:, 0] - series["ankle"][:, side, 0], series["com"][:, 1], series["com_velocity"][:, 0]]
        )
        gait.com.add(on_percent(relative, begin, end, TICK, first=TICK))
        # The foot that lands at the step's end, against where this one landed.
        at = np.floor(np.stack([begin, end]) / TICK).astype(int)
        ankle = series["ankle"][..., 0]
        tally.step_length += list(ankle[at[1], 1 - side] - ankle[at[0], side])
        tally.step_time += list(end - begin)
        # The trailing foot leaves the ground within this step; without such a toe-off the body flew.
        support = next_after(contacts[1 - side].toe_offs, begin) - begin
        tally.double_support += list(np.where(support < end - begin, support, 0.0))


def _states(series: dict[str, NDArray], side: int, body: Body) -> NDArray:
    """(T, C) curves known at a tick's end, in the order of `GAIT_CYCLE_COLUMNS` without the forces."""
    angle = np.degrees(series["angle"][:, side])
    pitch = np.degrees(series["base"][:, 2])
    moment = -(series["torque"] + series["passive_torque"])[:, side] / body.mass
    power = -moment * series["velocity"][:, side]
    thigh = angle[:, HIP] - pitch
    shank = thigh - angle[:, KNEE]
    equilibrium = np.degrees(series["equilibrium"][:, side])
    return np.column_stack(
        [
            *(angle[:, joint] for joint in (HIP, KNEE, ANKLE)),
            pitch,
            thigh,
            shank,
            shank + angle[:, ANKLE],
            *(moment[:, joint] for joint in (HIP, KNEE, ANKLE)),
            *(power[:, joint] for joint in (HIP, KNEE, ANKLE)),
            angle[:, TOE],
            moment[:, TOE],
            series["stiffness"][:, side],
            equilibrium,
        ]
    )


def _forces(series: dict[str, NDArray], side: int, weight: float) -> NDArray:
    """(T, 2) vertical and forward force of one foot [BW]."""
    return series["force"][:, side].sum(axis=1)[:, ::-1] / weight


_FORCES = ("grf_vertical_bw", "grf_forward_bw")
_STATES = tuple(name for name in GAIT_CYCLE_COLUMNS if name not in _FORCES)
_ORDER = [(_STATES + _FORCES).index(name) for name in GAIT_CYCLE_COLUMNS]


def _metrics(recording: Recording, gait: Gait, tally: _Tally, body: Body) -> dict[str, Any]:
    settings, both = recording.settings, gait.both
    human = reference_gait(settings)
    phase = PERCENT / 100
    reasons = Counter(str(reason) for reason in recording.fall_reason if reason)
    features = score.force_features(both.mean("grf_vertical_bw"), both.mean("grf_forward_bw"))
    toe_off = _mean(tally.toe_off)
    plan_x, plan_z = recording.plan_com.T
    com_z = gait.com.mean("z")

    def joint(name: str) -> dict[str, Any]:
        curve, people = both.mean(JOINT_CURVES[name]), np.degrees(human.mean(name, phase))
        return {
            "rmse_deg": score.rmse(curve, people),
            "r": score.correlation(curve, people),
            "within_1sd_percent": score.share_within_sd(curve, people, np.degrees(human.sd(name, phase))),
        }

    def moment(name: str) -> dict[str, Any]:
        curve = both.mean(MOMENT_CURVES[name])
        peak, percent = score.largest(curve)
        people = human.mean(f"{name}_moment", phase) if name != "toe" else None
        r = None if people is None else score.correlation(curve, people)
        return {"peak_Nm_kg": peak, "peak_percent": percent, "r": r}

    def force_r(name: str) -> float | None:
        return score.correlation(both.mean(f"{name}_bw"), human.mean(name, phase))

    def stiffness(name: str) -> dict[str, Any]:
        return score.phase_means(both.mean(f"{name}_stiffness_Nm_per_rad"), 60.0 if toe_off is None else toe_off)

    return {
        "policy": recording.policy,
        "environment": settings_to_json(settings),
        "reference": {
            "condition": human.condition,
            "speed_m_s": human.speed,
            "borrowed": list(human.borrowed),
        },
        "seed": recording.seed,
        "episodes": len(recording.ticks),
        "falls": sum(reasons.values()),
        "fall_reasons": dict(reasons),
        "came_to_rest": None if settings.stop_at is None else tally.at_rest,
        "seconds_mean": float(recording.ticks.mean() * TICK),
        "return": score.mean_sd(recording.returns),
        "strides": {"count": both.count, "in_episodes_that_fell": tally.strides_of_falls},
        "speed_m_s": score.mean_sd(tally.speed),
        "step_length_m": _mean(tally.step_length),
        "cadence_steps_min": 60 / float(np.mean(tally.step_time)) if tally.step_time else None,
        "double_support_s": _mean(tally.double_support),
        "toe_off_percent": toe_off,
        "joints": {name: joint(name) for name in JOINT_CURVES},
        "com": {
            "x_rmse_m": score.rmse(gait.com.mean("x"), plan_x),
            "z_rmse_m": score.rmse(com_z, plan_z),
            "z_r": score.correlation(com_z, plan_z),
            "vx_r": score.correlation(gait.com.mean("vx"), np.gradient(plan_x)),
            "rise_m": float(np.ptp(com_z)) if gait.com.count else None,
        },
        "grf": {
            "vertical_peak1_bw": features.vertical_peak1,
            "vertical_valley_bw": features.vertical_valley,
            "vertical_peak2_bw": features.vertical_peak2,
            "vertical_max_bw": float(max(tally.vertical_max)) if tally.vertical_max else None,
            "vertical_r": force_r("grf_vertical"),
            "braking_peak_bw": features.braking_peak,
            "forward_peak_bw": features.forward_peak,
            "forward_r": force_r("grf_forward"),
        },
        "moments": {name: moment(name) for name in MOMENT_CURVES},
        "ankle_work_J_kg": {"positive": _mean(tally.ankle_positive), "negative": _mean(tally.ankle_negative)},
        "cost_of_transport": score.cost_of_transport(tally.work, body.mass, tally.distance),
        "stiffness_Nm_rad": {name: stiffness(name) for name in ("ankle", "toe")},
        "contact_travel_m": _mean(tally.travel),
        "toe_clearance_m": float(np.median(tally.clearance)) if tally.clearance else None,
    }


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None
