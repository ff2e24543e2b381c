"""What a person pays in the search of `adapt`: falls, then speed, symmetry, force peaks, effort, and how odd it looks.

Every candidate walks with its own fixed schedule at its sound foot, from random starts, undisturbed and pushed.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.model import HIP, KNEE, RIGHT, SIDES, TOE
from springfoot.envs.settings.settings import BipedSettings
from springfoot.gait.body.body import GRAVITY
from springfoot.gait.people.cycle import CONTACT_THRESHOLD_BW, PERCENT, find_contacts, on_percent

from ..searches.leg_cost import FALL_COST, UNEVENNESS
from ..searches.leg_walks import SETTLED, series, walk
from .person_search import Person

LEVEL, PUSHED = 2, 3
"""Walks of each candidate: undisturbed, and pushed."""
PUSH_INTERVAL = 2.5
"""Mean time between their pushes [s]."""
MOST_PEAK, MOST_WORK = 1.2, 0.9
"""Largest vertical force of a stride [body weights], and positive work of all joints [J/kg/m], that cost nothing;
chosen: of a committed walk on two intact feet."""
TOLERANCE = {
    "speed": 0.03,  # m/s
    "step_length": 0.05,  # right less left over their mean
    "stance": 0.05,  # likewise
    "force_peak": 0.1,  # body weights, each leg's
    "work": 0.1,  # J/kg/m
    "thigh": np.deg2rad(4.0),  # off people's, root mean square over the stride, each leg's
    "knee": np.deg2rad(6.0),
    "pitch": np.deg2rad(3.0),  # of the trunk, root mean square
    "bend": np.deg2rad(2.0),  # range of the right toe beyond what is allowed
}
"""What counts as one; chosen."""


def cost(
    settings: BipedSettings,
    people: Sequence[Person],
    seed: int,
    threads: int,
    push: float,
    bend: float | None = None,
    bend_weight: float = 1.0,
) -> NDArray:
    """(C,) what each person pays; `push` [N]; the range of the right toe beyond `bend` [rad], if given, costs too,
    `bend_weight` times."""
    settings = replace(settings, unevenness_m=UNEVENNESS, action_mode="residual")
    legs, right, feet = [p.sound for p in people], [p.other for p in people], [p.feet for p in people]
    total = np.zeros(len(people))
    seeds = [seed + index % LEVEL for index in range(LEVEL * len(people))]
    missing, biped, ticks = walk(settings, legs, seeds, threads, foreign=(), right=right, feet=feet)
    record = series(biped, ticks)
    for index, lost in enumerate(missing):
        if lost > 0:
            total[index // LEVEL] += lost * 3 * FALL_COST / LEVEL
        else:
            missed = misses(record, index, biped, bend, bend_weight)
            total[index // LEVEL] += (FALL_COST if missed is None else float(np.linalg.norm(missed))) / LEVEL
    pushed = replace(settings, push_newton=push, push_interval=PUSH_INTERVAL)
    seeds = [seed + index % PUSHED for index in range(PUSHED * len(people))]
    missing = walk(pushed, legs, seeds, threads, foreign=(), watched=False, right=right, feet=feet)[0]
    return total + FALL_COST * missing.reshape(len(people), PUSHED).mean(1)


def misses(
    record: dict[str, NDArray], index: int, biped: Biped, bend: float | None = None, bend_weight: float = 1.0
) -> NDArray | None:
    """What walk `index` misses in strides that begin after `SETTLED`, in tolerances; None if it takes too few."""
    human, mass, tick = biped.human, biped.body.mass, Biped.tick_dt
    first = round(SETTLED / tick)
    com, ankle = record["com"][:, index, 0], record["ankle"][:, index]
    off: dict[str, list[float]] = {name: [] for name in TOLERANCE}
    step_length, stance = [], []
    for side in range(len(SIDES)):
        force = record["force"][:, index, side, 1]
        strides = find_contacts(force, tick, CONTACT_THRESHOLD_BW * mass * GRAVITY).strides(SETTLED)
        if len(strides) < 2:
            return None
        angle = record["angle"][:, index, side]
        joints = np.column_stack([angle[:, HIP] - record["pitch"][:, index], angle[:, KNEE], angle[:, TOE]])
        curves = on_percent(joints, strides[:, 0], strides[:, 2], tick).mean(0)
        if side == RIGHT and bend is not None:
            off["bend"].append(bend_weight * max(float(np.ptp(curves[:, 2])) - bend, 0.0))
        for name, curve in zip(("thigh", "knee"), curves.T, strict=False):
            off[name].append(float(np.sqrt(np.mean((curve - human.mean(name, PERCENT / 100)) ** 2))))
        begin, leave, end = np.floor(strides / tick).astype(int).T
        peaks = [force[a:b].max() / (mass * GRAVITY) for a, b in zip(begin, end, strict=True)]
        off["force_peak"].append(max(float(np.mean(peaks)) - MOST_PEAK, 0.0))
        step_length.append(float(np.mean(ankle[begin, side] - ankle[begin, 1 - side])))
        stance.append(float(np.mean((leave - begin) / (end - begin))))
    way = com[-1] - com[first]
    off["speed"] = [way / ((len(com) - 1 - first) * tick) - biped.settings.speed]
    for name, (left, right) in (("step_length", step_length), ("stance", stance)):
        off[name] = [2 * (right - left) / max(abs(right + left), 0.1)]
    work = record["work"][first:, index].reshape(len(com) - first, -1, 2)[..., 0].sum()
    off["work"] = [max(float(work) / mass / max(way, 0.1) - MOST_WORK, 0.0)]
    off["pitch"] = [float(np.sqrt(np.mean(record["pitch"][first:, index] ** 2)))]
    return np.concatenate([np.array(values) / TOLERANCE[name] for name, values in off.items()])
