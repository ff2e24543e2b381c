"""Compute the cost of a person in the search of `adapt`: falls, speed, symmetry, force peaks, effort, odd posture.

Every candidate walks with its fixed schedule at the sound foot, from random starts, undisturbed and pushed.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.envs.physics import RIGHT
from springfoot.envs.settings import BipedSettings
from springfoot.evaluation.recording import TICK
from springfoot.gait.people import PERCENT

from ..searches.leg_cost import FALL_COST, UNEVENNESS
from ..searches.leg_walks import SETTLED, measured, walk
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
"""Unit in which each distance counts; chosen."""


def cost(
    settings: BipedSettings,
    people: Sequence[Person],
    seed: int,
    threads: int,
    push: float,
    bend: float | None = None,
    bend_weight: float = 1.0,
) -> NDArray:
    """Return the cost of each person, (C,).

    Args:
        settings: settings of the environment, the right foot aside.
        people: C candidates.
        seed: seed of the first walk, the same for all.
        threads: threads of the physics.
        push: size of the pushes in the pushed walks [N].
        bend: range of the right toe beyond which it costs [rad]; None for none.
        bend_weight: factor on that cost.
    """
    settings = replace(settings, unevenness_m=UNEVENNESS, action_mode="residual")
    legs = [p.sound for p in people]
    right = [p.other for p in people]
    feet = [p.feet for p in people]
    total = np.zeros(len(people))
    seeds = [seed + index % LEVEL for index in range(LEVEL * len(people))]
    walked = walk(settings, legs, seeds, threads, foreign=(), right=right, feet=feet)
    for index, missing in enumerate(walked.missing):  # 0 without a fall; LEVEL walks in turn of each candidate
        if missing > 0:
            total[index // LEVEL] += missing * 3 * FALL_COST / LEVEL
        else:
            distances = misses(walked.episode(index), walked.biped, bend, bend_weight)
            total[index // LEVEL] += (FALL_COST if distances is None else float(np.linalg.norm(distances))) / LEVEL
    pushed = replace(settings, push_newton=push, push_interval=PUSH_INTERVAL)
    seeds = [seed + index % PUSHED for index in range(PUSHED * len(people))]
    missing = walk(pushed, legs, seeds, threads, foreign=(), right=right, feet=feet).missing
    return total + FALL_COST * missing.reshape(len(people), PUSHED).mean(1)


def misses(
    series: dict[str, NDArray], biped: Biped, bend: float | None = None, bend_weight: float = 1.0
) -> NDArray | None:
    """Return the distances of one walk from a good one, as one vector, each in its unit of `TOLERANCE`.

    The numbers are those of an evaluation, of the strides that begin after `SETTLED`; None if these are too few.
    `series` are the walk's, from `leg_walks.Walks.episode`; `bend` and `bend_weight` are as for `cost`.
    """
    tally = measured(series, biped)
    if tally is None:
        return None
    target = biped.target
    first = round(SETTLED / TICK)  # tick
    sides = np.array(tally.stride_sides)
    landed = np.array(tally.step_sides)
    off: dict[str, list[float]] = {name: [] for name in TOLERANCE}
    step_length = []
    stance = []
    for side, curves in enumerate(tally.feet):
        if side == RIGHT and bend is not None:
            toe = np.radians(curves.mean("mtp_dorsiflexion_deg"))
            off["bend"].append(bend_weight * max(float(np.ptp(toe)) - bend, 0.0))
        for name in ("thigh", "knee"):
            curve = np.radians(curves.mean(f"{name}_flexion_deg"))
            off[name].append(float(np.sqrt(np.mean((curve - target.mean(name, PERCENT / 100)) ** 2))))
        off["force_peak"].append(max(float(np.mean(np.array(tally.vertical_max)[sides == side])) - MOST_PEAK, 0.0))
        step_length.append(float(np.mean(np.array(tally.step_length)[landed == side])))
        stance.append(float(np.mean(np.array(tally.toe_off)[sides == side])) / 100)
    off["speed"] = [tally.speed[0] - biped.settings.speed]
    for name, (left, right) in (("step_length", step_length), ("stance", stance)):
        off[name] = [2 * (right - left) / max(abs(right + left), 0.1)]  # 0.1: where both are about 0
    off["work"] = [max(tally.work / biped.body.mass / max(tally.distance, 0.1) - MOST_WORK, 0.0)]
    off["pitch"] = [float(np.sqrt(np.mean(series["base"][first:, 2] ** 2)))]  # base: x, z, pitch
    return np.concatenate([np.array(values) / TOLERANCE[name] for name, values in off.items()])
