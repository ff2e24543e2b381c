"""Compute the cost of leg constants in the search of `leg_tuning`: the distance of their walks from people's and the
plan.

`misses` compares one walk with the candidate's schedule: a vector of distances, each in units of its tolerance. `cost`
ranks the candidates of a generation: the length of that vector, and a cost of falls in walks from random starts, with
and without pushes, and with foreign springs (constant stiffness, people's, the thesis's lines). `all_misses` is the
vector that the refinement minimises by least squares.
"""

from collections.abc import Sequence
from dataclasses import astuple, replace
from functools import lru_cache
from typing import Any

import numpy as np

from springfoot.agents.policies import own_settings
from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.envs.control import FED, SLOW_SPEED, LegConstants
from springfoot.envs.settings import BipedSettings
from springfoot.evaluation.numbers import LATE_SWING_PERCENT, StrideTally
from springfoot.evaluation.recording import planned_course
from springfoot.gait.people import PERCENT, HumanGait, correlation, force_features, stride_work

from .leg_walks import FOREIGN, PUSHED_FOREIGN, Walks, measured, walk

SCHEDULED, PUSHED, SET_OFF = 2, 3, 4
"""Walks of each candidate with its schedule: undisturbed, pushed, from standing."""
REFINED = ((0.25, 7), (0.75, 8), (0.25, 9))
"""Walks of `all_misses`: (stride phase at the start, seed)."""
RADIAN = np.pi / 180
UNEVENNESS = 0.002
"""Unevenness of the ground [m]. On level ground a walk locks to its decisions every 20 ms, and misses jump with the
constants."""
REFINED_SECONDS, REFINED_SETTLED = 10.0, 4.0
"""Length of the walks of `REFINED`, and the time from which they are measured [s]."""
CURVES = {
    "thigh": ("thigh_flexion_deg", RADIAN),
    "knee": ("knee_flexion_deg", RADIAN),
    "ankle": ("ankle_dorsiflexion_deg", RADIAN),
    "toe": ("mtp_dorsiflexion_deg", RADIAN),
    "grf_vertical": ("grf_vertical_bw", 1.0),
    "grf_forward": ("grf_forward_bw", 1.0),
    "hip_moment": ("hip_moment_Nm_per_kg", 1.0),
    "knee_moment": ("knee_moment_Nm_per_kg", 1.0),
    "ankle_moment": ("ankle_moment_Nm_per_kg", 1.0),
}
"""People's curve -> the evaluation's curve to compare with it, and the unit of people's curve in that of the
evaluation's."""
TOLERANCE = {
    "thigh": np.deg2rad(1.0),
    "knee": np.deg2rad(1.9),
    "ankle": np.deg2rad(1.2),
    "toe": np.deg2rad(8.0),
    "grf_vertical": 0.07,  # body weights
    "grf_forward": 0.02,
    "hip_moment": 0.11,  # N m/kg
    "knee_moment": 0.09,
    "ankle_moment": 0.09,
    "com_x": 0.03,  # m, against the plan
    "com_z": 0.01,
    "com_speed": 0.06,  # m/s, forward, against the plan over the step
    "cop": 0.025,  # m, against the plan's ZMP
    "beyond_sd": 0.06,  # N m/kg, of the hip moment beyond 1.9 SD from people's
    "late_hip_moment": 0.06,  # N m/kg, from late swing on, beyond people's largest then by more than 0.1
    "speed": 0.02,  # m/s
    "period": 0.02,  # share of the plan's stride time
    "double_support": 0.02,  # s, against people's
    "vertical": 0.03,  # body weights, each of the two peaks and the valley farther from people's than 0.05
    "fore_aft": 0.01,  # body weights, braking and forward peak farther from people's than 0.03
    "peak_moment": 0.05,  # N m/kg, of the ankle farther from people's than 0.07
    "work": 0.02,  # J/kg a stride, of hip, knee, ankle, positive and negative: farther from people's than 0.03
    "effort": 0.04,  # J/kg a stride: positive work of the leg beyond 1.2 of people's
    "force_peak": 0.08,  # body weights, the largest 10 ms of a stride beyond people's peak by more than 0.07
    "travel": 0.01,  # m a stance, of the sole on the floor
    "unsteady": 0.05,  # SD of the vertical force over strides [body weights]
    "ankle_r": 0.01,  # of the ankle's mean curve with people's, below 0.985
    "foreign_speed": 0.15,  # m/s, of the walks with springs that nobody tuned
}
"""Unit in which each distance counts; for a curve, of its root mean square over the stride."""
ALLOWED = {
    "late_hip_moment": 0.1,
    "vertical": 0.05,
    "fore_aft": 0.03,
    "peak_moment": 0.07,
    "work": 0.03,
    "force_peak": 0.07,
}
"""Differences from people that cost nothing, in the units of `TOLERANCE`."""
BAND_SD = 1.9
"""Standard deviations of people's hip moment within which `beyond_sd` is 0 [-]."""
MOST_WORK, LEAST_ANKLE_R = 1.2, 0.985
"""Positive work over people's beyond which `effort` counts, and r of the ankle's curve below which `ankle_r` counts."""
FOREIGN_SHARE = 0.3
"""Weight of walks with foreign springs; the thesis's lines have weight 1. Chosen: at full weight legs stand nearly any
spring, and the knee of the walk with the schedule is 5 degrees off people's."""
FALL_COST = 30.0
"""Cost of a fall at once; a walk with the schedule costs three times as much, so that a poor walk is worth more than a
fall. The cost of a later fall decreases with the distance walked, to a third."""


def cost(
    settings: BipedSettings,
    candidates: Sequence[LegConstants],
    seed: int,
    threads: int,
    push: float,
    ease: float = 0.0,
    foreign: float = 1.0,
) -> NDArray:
    """Return the cost of each candidate, (C,).

    Args:
        settings: settings of the environment.
        candidates: C leg constants.
        seed: seed of the first walk.
        threads: threads of the physics.
        push: size of the pushes in the pushed walks [N]; 0 leaves these walks out.
        ease: as in `leg_walks.walk`.
        foreign: factor on the cost of walks with foreign springs.
    """
    count = len(candidates)
    settings = replace(settings, unevenness_m=UNEVENNESS)
    total = np.zeros(count)

    # Undisturbed: each candidate walks SCHEDULED times with its schedule, then once with each foreign spring.
    walks = SCHEDULED + len(FOREIGN)
    seeds = [seed + index % walks for index in range(walks * count)]
    walked = walk(settings, candidates, seeds, threads, ease, FOREIGN)
    missing = walked.missing  # 0 for walks without a fall
    for index in range(walks * count):
        candidate = index // walks
        if index % walks >= SCHEDULED:
            total[candidate] += foreign * FOREIGN_SHARE * _foreign_cost(walked, index, missing[index])
        elif missing[index] > 0:
            total[candidate] += missing[index] * 3 * FALL_COST / SCHEDULED
        else:
            tally = measured(walked.episode(index), walked.biped)
            distance = FALL_COST if tally is None else float(np.linalg.norm(misses(tally, walked.biped)))
            total[candidate] += distance / SCHEDULED

    # The thesis's constant springs.
    if settings.equilibrium == "planned":
        thesis = replace(settings, **own_settings("thesis", settings))
        walked = walk(thesis, candidates, [seed] * count, threads, foreign=())
        total += [foreign * _foreign_cost(walked, index, lost) for index, lost in enumerate(walked.missing)]

    # Standing starts, for which only the constants of the slowest speed are used.
    if settings.speed <= SLOW_SPEED:
        seeds = [seed + index % SET_OFF for index in range(SET_OFF * count)]
        standing = replace(settings, start="standing")
        missing = walk(standing, candidates, seeds, threads, foreign=()).missing
        total += FALL_COST * missing.reshape(count, SET_OFF).mean(1)
    if push == 0:
        return total

    # Pushes: only falls count.
    pushed = replace(settings, push_newton=push, push_interval=2.5)
    walks = PUSHED + len(PUSHED_FOREIGN)
    seeds = [seed + index % walks for index in range(walks * count)]
    missing = walk(pushed, candidates, seeds, threads, ease, foreign=PUSHED_FOREIGN).missing.reshape(count, walks)
    fallen = missing[:, :PUSHED].mean(1) + foreign * FOREIGN_SHARE * missing[:, PUSHED:].sum(1) / len(FOREIGN)
    return total + FALL_COST * fallen


def _foreign_cost(walked: Walks, index: int, missing: float) -> float:
    """Return the cost of walk `index`, with foreign springs: that of its fall if `missing`, its entry of
    `Walks.missing`, is above 0, else that of its error of speed."""
    if missing > 0:
        return missing * FALL_COST / len(FOREIGN)
    return abs(walked.speed(index) - walked.biped.settings.speed) / TOLERANCE["foreign_speed"]


def all_misses(settings: BipedSettings, candidates: Sequence[LegConstants], threads: int) -> list[NDArray | None]:
    """Return for each candidate its misses in the walks of `REFINED`, each over the square root of their number, as one
    vector; None for a candidate that falls or takes too few strides in one of them."""
    by_candidate: list[list[NDArray] | None] = [[] for _ in candidates]
    for start, seed in REFINED:
        refined = replace(settings, start=start, unevenness_m=UNEVENNESS)
        walked = walk(refined, candidates, [seed] * len(candidates), threads, foreign=(), seconds=REFINED_SECONDS)
        missing = walked.missing
        for index, of_candidate in enumerate(by_candidate):
            fell = missing[index] > 0
            tally = None if fell else measured(walked.episode(index), walked.biped, REFINED_SETTLED)
            if tally is None or of_candidate is None:
                by_candidate[index] = None
            else:
                of_candidate.append(misses(tally, walked.biped) / np.sqrt(len(REFINED)))
    return [None if of_walks is None else np.concatenate(of_walks) for of_walks in by_candidate]


def misses(tally: StrideTally, biped: Biped) -> NDArray:
    """Return the distances of a walk from its target and its plan, each in its unit of `TOLERANCE`, as one vector.

    The walk's numbers are those of an evaluation (`springfoot.evaluation.numbers`).
    """
    target = biped.target
    both = tally.both
    phase = PERCENT / 100
    mean = {curve: both.mean(column) * unit for curve, (column, unit) in CURVES.items()}
    target_mean, target_work, band = _target_numbers(target)
    # Curves: joints, forces and moments from the target, CoM and CoP from the plan.
    off: dict[str, Any] = {curve: values - target_mean[curve] for curve, values in mean.items()}
    course = planned_course(biped.plan)
    planned_speed = biped.plan.com_velocity(np.minimum(phase, 1 - 1e-9))[0]  # at 100 % still of this step
    off["com_x"] = tally.com.mean("x") - course["plan_com"][:, 0]  # columns x, z
    off["com_z"] = tally.com.mean("z") - course["plan_com"][:, 1]
    off["com_speed"] = tally.com.mean("vx") - planned_speed
    off["cop"] = np.nan_to_num(tally.cop.mean("x") - course["plan_zmp"])[:-1]  # at 100 % the plan is at the next foot
    off["beyond_sd"] = _excess(off["hip_moment"], band)
    off = {name: values / np.sqrt(len(values)) for name, values in off.items()}  # so that the length is an RMS
    # Numbers: timing, peaks, work, and the properties of a good walk.
    late = PERCENT > LATE_SWING_PERCENT
    late_hip_moment = mean["hip_moment"][late] - target_mean["hip_moment"][late].max()
    off["late_hip_moment"] = np.maximum(late_hip_moment - ALLOWED["late_hip_moment"], 0.0)
    off["speed"] = np.mean(tally.speed) - biped.settings.speed
    off["period"] = np.mean(tally.stride_time) / biped.plan.stride_time - 1
    off["double_support"] = np.mean(tally.double_support) - (target.toe_off - 0.5) * target.stride_time
    features = astuple(force_features(mean["grf_vertical"], mean["grf_forward"]))
    target_features = astuple(force_features(target_mean["grf_vertical"], target_mean["grf_forward"]))
    # `ForceFeatures` begin with two peaks and the valley between them, then braking and forward peak.
    for name, part in (("vertical", slice(0, 3)), ("fore_aft", slice(3, 5))):
        off[name] = _excess(np.subtract(features[part], target_features[part]), ALLOWED[name])
    peak_moment = mean["ankle_moment"].max() - target_mean["ankle_moment"].max()
    off["peak_moment"] = _excess(peak_moment, ALLOWED["peak_moment"])
    work = np.abs(np.mean(tally.joint_work, axis=0))  # (joint, positive and negative), mean over strides
    off["work"] = _excess(work[: len(target_work)] - target_work, ALLOWED["work"])
    ankle_r = correlation(mean["ankle"], target_mean["ankle"]) or 0.0  # None for an ankle that does not move
    off["ankle_r"] = max(LEAST_ANKLE_R - ankle_r, 0.0)
    off["effort"] = max(work[:, 0].sum() - MOST_WORK * target_work[:, 0].sum(), 0.0)
    force_peak = np.array(tally.vertical_max) - target_mean["grf_vertical"].max()
    off["force_peak"] = np.mean(np.maximum(force_peak - ALLOWED["force_peak"], 0.0))
    off["travel"] = np.mean(tally.travel)
    off["unsteady"] = tally.unsteady
    return np.concatenate([np.ravel(value) / TOLERANCE[name] for name, value in off.items()])


def _excess(difference: NDArray, band: NDArray | float) -> NDArray:
    """Return the part of a difference that lies outside [-band, band], with its sign; 0 inside."""
    return np.sign(difference) * np.maximum(np.abs(difference) - band, 0.0)


@lru_cache(maxsize=16)
def _target_numbers(gait: HumanGait) -> tuple[dict[str, NDArray], NDArray, NDArray]:
    """Return a target's mean curves (101,) by the names of `CURVES`, its work and its band of hip moments, cached.

    The work (3, 2) [J/kg] is positive and negative, of hip, knee and ankle, from the mean power. The band (101,) is
    `BAND_SD` of the hip moment [N m/kg].
    """
    curves = {name: gait.mean(name, PERCENT / 100) for name in CURVES}
    powers = [gait.mean(f"{joint}_power", PERCENT / 100)[None] for joint in FED]
    work = [np.concatenate(stride_work(power, np.array([gait.stride_time]))) for power in powers]
    return curves, np.stack(work), BAND_SD * gait.sd("hip_moment", PERCENT / 100)
