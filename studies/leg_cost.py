"""What leg constants pay in the search of `leg_tuning`: how far their simulated walks are from people's.

Every candidate walks from random starts with the fixed schedule, with and without pushes, and with two constant
stiffnesses. It pays for falls, and on its unpushed scheduled walks for the distance from people in speed, joint angles,
ground reaction force and ankle and knee moment.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from springfoot.envs.biped_batch import Biped
from springfoot.envs.control.equilibrium import foot_curves
from springfoot.envs.control.foot_springs import action_of
from springfoot.envs.control.leg_constants import LegConstants
from springfoot.envs.control.reference_walk import FED, reference_walk_at
from springfoot.envs.physics.measurement import Measurement
from springfoot.envs.physics.model import ANKLE, HIP, JOINTS, KNEE, SIDES, TOE, contact_material
from springfoot.envs.settings import BipedSettings
from springfoot.envs.step_result import Tick
from springfoot.gait.body import GRAVITY
from springfoot.gait.cycle import CONTACT_THRESHOLD_BW, PERCENT, find_contacts, on_percent
from springfoot.gait.human import HumanGait
from springfoot.gait.scores import stride_work, travel

SECONDS = 6.5
"""Length of each walk [s]."""
SETTLED = 2.5
"""Strides that begin later [s] are measured."""
SCHEDULED, CONSTANT, PUSHED = 2, ((300.0, 40.0), (126.5, 31.6)), 3
"""Walks of each candidate: with the schedule; with constant ankle and toe stiffness [N m/rad]; pushed."""
TOLERANCE = {
    "speed": 0.03,  # m/s
    "period": 0.03,  # share of the plan's stride time
    "thigh": np.deg2rad(1.2),
    "knee": np.deg2rad(2.0),
    "ankle": np.deg2rad(1.4),
    "toe": np.deg2rad(6.0),
    "grf_vertical": 0.06,  # body weights
    "grf_forward": 0.015,
    "force_peak": 0.08,  # largest 10 ms value of a stride beyond 1.2 body weights
    "hip_moment": 0.10,  # N m/kg
    "knee_moment": 0.10,
    "ankle_moment": 0.08,
    "late_hip_moment": 0.1,  # the largest of the hip's from LATE_SWING on, beyond people's
    "work": 0.03,  # J/kg a stride, of hip, knee, ankle, positive and negative: farther from people's than WORK_BAND
    "effort": 0.1,  # J/kg a stride: positive work of the whole leg beyond people's
    "com_x": 0.015,  # m, against the plan
    "com_z": 0.006,
    "com_speed": 0.05,  # m/s, forward, against the plan over the step
    "cop": 0.02,  # m, against the plan's ZMP
    "double_support": 0.02,  # s, against people's
    "travel": 0.008,  # m a stance, of the sole on the floor
    "unsteady": 0.06,  # SD of the vertical force over strides [body weights]
    "constant_speed": 0.15,  # m/s, of the walks with constant stiffness
}
"""Error e at which sqrt(1 + (e / tolerance)^2) - 1 costs 0.41; far beyond, it costs e / tolerance."""
CURVES = ("thigh", "knee", "ankle", "toe", "grf_vertical", "grf_forward", "hip_moment", "knee_moment", "ankle_moment")
"""People's curves that a walk is held against."""
LATE_SWING = 0.8
"""Stride phase from which the hip holds the leg back before it lands."""
WORK_BAND = 0.03
"""Difference from people's work that costs nothing [J/kg a stride]."""
FALL_COST = 30.0
"""Cost of falling at once, threefold with the schedule (a poor walk must be worth more than a fall); one that comes
further costs proportionally less, down to a third."""


def cost(
    settings: BipedSettings, candidates: Sequence[LegConstants], seed: int, threads: int, push: float, ease: float
) -> NDArray:
    """(C,) what each candidate pays; `push` [N], `ease` as in `_walk`."""
    walks = SCHEDULED + len(CONSTANT)
    total = np.zeros(len(candidates))
    missing, biped, ticks = _walk(settings, candidates, walks, seed, threads, ease)
    records = _record(biped, ticks)
    scheduled = np.arange(walks * len(candidates)) % walks < SCHEDULED
    speed = _speed(records)
    for index in range(walks * len(candidates)):
        candidate = index // walks
        if missing[index] > 0:
            total[candidate] += missing[index] * (3 * FALL_COST / SCHEDULED if scheduled[index] else FALL_COST / walks)
        elif scheduled[index]:
            total[candidate] += _distance(records, index, biped, speed[index]) / SCHEDULED
        else:
            total[candidate] += min(((speed[index] - settings.speed) / TOLERANCE["constant_speed"]) ** 2, 3.0)
    pushed = replace(settings, push_newton=push, push_interval=2.5)
    missing = _walk(pushed, candidates, PUSHED, seed, threads, ease, watched=False)[0]
    return total + FALL_COST * missing.reshape(len(candidates), PUSHED).mean(1)


def _walk(
    settings: BipedSettings,
    candidates: Sequence[LegConstants],
    walks: int,
    seed: int,
    threads: int,
    ease: float,
    watched: bool = True,
) -> tuple[NDArray, Biped, list[Tick]]:
    """Walk every candidate `walks` times, at an equilibrium that is the share `ease` planned.

    Returns how much of the walk a fall took (C * walks,): 0 without a fall, 1 at once, 1/3 at the end, and standing
    still counts as one; the core; and, if `watched`, every tick.
    """
    num = len(candidates) * walks
    variant = np.repeat(np.arange(len(candidates)), walks)
    rest = _eased(settings, candidates, ease) if ease else None
    biped = Biped(settings, num, threads, legs=candidates, variant=variant, rest=rest)
    biped.reset(np.arange(num), [seed + index % walks for index in range(num)])
    fixed = action_of(np.array(CONSTANT), settings, biped.body)
    role = np.tile(np.arange(walks), len(candidates)) - SCHEDULED
    ticks: list[Tick] = []
    biped.on_tick = ticks.append if watched else None
    active, walked = np.ones(num, bool), np.zeros(num)
    for _ in range(round(SECONDS / biped.dt)):
        action = action_of(biped.scheduled_stiffness(), settings, biped.body)
        for index in range(len(CONSTANT) if walks > PUSHED else 0):
            action[role == index] = fixed[index]
        result = biped.step(action.reshape(num, -1), active)
        walked = np.where(active, biped.measurement.com[:, 0] / (settings.speed * SECONDS), walked)
        active &= ~result.terminated
        if not active.any():
            break
    return np.where(active & (walked > 0.5), 0.0, 1.0 - 2.0 / 3.0 * np.clip(walked, 0.0, 1.0)), biped, ticks


def _record(biped: Biped, ticks: Sequence[Tick]) -> dict[str, NDArray]:
    """The ticks as arrays (T, N, ...)."""
    measured = [tick.measurement for tick in ticks]
    return {
        "com": np.stack([m.com for m in measured]),
        "planned_com": np.stack([tick.com_reference for tick in ticks]),
        "material": np.stack([contact_material(biped.body, m.contact, m.base, m.angle) for m in measured]),
        "load": np.stack([m.force[..., 1] for m in measured]),
        "pitch": np.stack([m.base[:, 2] for m in measured]),
        "angle": np.stack([m.angle for m in measured]),
        "moment": np.stack([tick.work.torque for tick in ticks]),
        "force": np.stack([m.force.sum(2) for m in measured]),
        "work": np.stack([tick.work.work for tick in ticks]),
        "cop": np.stack([_centre_of_pressure(m) for m in measured]),
        "ankle": np.stack([m.ankle[..., 0] for m in measured]),
    }


def _centre_of_pressure(m: Measurement) -> NDArray:
    """(N,) forward place of both feet's vertical force [m]; in flight the CoM's."""
    load = m.force[..., 1]
    total = load.sum((1, 2))
    return np.where(total > 0.0, (load * m.contact[..., 0]).sum((1, 2)) / np.maximum(total, 1e-9), m.com[:, 0])


def _eased(settings: BipedSettings, candidates: Sequence[LegConstants], ease: float) -> NDArray:
    """(C, SAMPLES, 2) foot equilibrium [rad], by the share `ease` the planned one."""
    walk = reference_walk_at(settings, settings.speed, candidates)
    curves = [
        [foot_curves(kind, c, walk)[0] for c in candidates]
        for kind in (settings, replace(settings, equilibrium="planned"))
    ]
    own, planned = np.array(curves)
    return own + ease * (planned - own)


def _speed(record: dict[str, NDArray]) -> NDArray:
    first = round(SETTLED / Biped.tick_dt)
    last = len(record["com"]) - 1
    way = record["com"][last, :, 0] - record["com"][min(first, last), :, 0]
    return way / max((last - first) * Biped.tick_dt, Biped.tick_dt)


def _distance(record: dict[str, NDArray], index: int, biped: Biped, speed: float) -> float:
    """Distance of one walk from people."""
    human, weight, tick = biped.human, biped.body.mass * GRAVITY, Biped.tick_dt
    phase = PERCENT / 100
    curves, periods, supports, travels = [], [], [], []
    off_plan = record["com"][:, index] - record["planned_com"][:, index]
    for side in range(len(SIDES)):
        angle, moment, force = (record[name][:, index, side] for name in ("angle", "moment", "force"))
        strides = find_contacts(force[:, 1], tick, CONTACT_THRESHOLD_BW * weight).strides(SETTLED)
        if len(strides) < 2:
            return FALL_COST / 2
        thigh = angle[:, HIP] - record["pitch"][:, index]
        series = np.column_stack(
            [
                *(thigh, angle[:, KNEE], angle[:, ANKLE], angle[:, TOE]),
                *(force[:, 1] / weight, force[:, 0] / weight),
                *(-moment[:, joint] / biped.body.mass for joint in (HIP, KNEE, ANKLE)),
                off_plan,
                np.gradient(record["com"][:, index, 0], tick),
                record["cop"][:, index] - record["ankle"][:, index, side],
                record["work"][:, index, side].reshape(len(angle), -1) / tick / biped.body.mass,
            ]
        )
        curves.append(on_percent(series, strides[:, 0], strides[:, 2], tick))
        periods.append(strides[:, 2] - strides[:, 0])
        supports.append((strides[:, 1] - strides[:, 0]) - 0.5 * (strides[:, 2] - strides[:, 0]))
        for start, leave, _ in np.floor(strides / tick).astype(int):
            sole = slice(start, leave + 1), index, side
            travels.append(travel(record["material"][sole], record["load"][sole], CONTACT_THRESHOLD_BW * weight))
    stride = np.concatenate(curves)
    mean = stride.mean(0)
    theirs, their_work = _people(human)
    errors = dict(zip(CURVES, _rms(mean[:, : len(CURVES)] - theirs), strict=True))
    late = phase > LATE_SWING, CURVES.index("hip_moment")
    errors["late_hip_moment"] = max(mean[late].max() - theirs[late].max(), 0.0)
    off = mean[:, len(CURVES) : len(CURVES) + 3]
    off = off - np.array([0.0, 0.0, 1.0]) * biped.plan.com_velocity((2 * phase) % 1.0)[0][:, None]
    errors |= zip(("com_x", "com_z", "com_speed"), _rms(off), strict=True)
    step = phase < 0.5
    errors["cop"] = _rms(mean[step, len(CURVES) + 3] - biped.plan.zmp(2 * phase[step]))
    period = np.mean(np.concatenate(periods))
    errors["travel"] = np.mean(travels)
    errors["speed"] = speed - biped.settings.speed
    errors["period"] = period / (2 * biped.plan.step_time) - 1
    errors["double_support"] = np.mean(np.concatenate(supports)) - (human.toe_off - 0.5) * human.stride_time
    errors["unsteady"] = np.sqrt(np.mean(stride[..., 4].var(0)))
    errors["force_peak"] = np.mean(np.maximum(stride[..., 4].max(1) - 1.2, 0.0))
    work = np.abs(mean[:-1, len(CURVES) + 4 :].mean(0).reshape(len(JOINTS), 2)) * period
    beyond = np.maximum(np.abs(work[: len(their_work)] - their_work) - WORK_BAND, 0.0)
    errors["effort"] = max(work[:, 0].sum() - their_work[:, 0].sum(), 0.0)
    total = sum(_price(error, name) for name, error in errors.items())
    return float(total + sum(_price(error, "work") for error in beyond.ravel()))


def _rms(error: NDArray) -> NDArray:
    return np.sqrt(np.mean(error**2, axis=0))


def _price(error: float, name: str) -> float:
    return float(np.hypot(1.0, error / TOLERANCE[name]) - 1.0)


@lru_cache(maxsize=16)
def _people(human: HumanGait) -> tuple[NDArray, NDArray]:
    """(101, len(CURVES)) people's mean curves over the stride, and (3, 2) positive and negative work of their hip, knee
    and ankle in it [J/kg], from their mean power."""
    curves = np.stack([human.mean(name, PERCENT / 100) for name in CURVES], -1)
    power = [human.mean(f"{joint}_power", PERCENT / 100)[None] for joint in FED]
    work = [np.concatenate(stride_work(each, np.array([human.stride_time]))) for each in power]
    return curves, np.stack(work)
