"""Walks of the search for leg constants: candidates side by side in one batch, with their own schedule and with springs
that nobody tuned for them, and what was seen of each tick."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from springfoot.agents.policies.baselines import CONSTANT_STIFFNESS
from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.control.equilibrium import REFERENCE_STIFFNESS, foot_curves, plateau_curve
from springfoot.envs.control.foot_springs import action_of, stiffness_ranges
from springfoot.envs.control.leg_constants import LegConstants
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.physics.foot import Feet
from springfoot.envs.physics.measurement import Measurement
from springfoot.envs.physics.model import contact_material
from springfoot.envs.settings.settings import BipedSettings
from springfoot.gait.body.body import Body
from springfoot.gait.body.tissue import TOE_STIFFNESS

SECONDS = 6.5
"""Length of each walk [s]."""
SETTLED = 2.5
"""Strides that begin later [s] are measured."""
QUASI = np.stack([plateau_curve(REFERENCE_STIFFNESS), np.full(len(GRID), TOE_STIFFNESS)], -1)
"""People's ankle quasi-stiffness and `TOE_STIFFNESS`, (SAMPLES, 2) on `GRID` [N m/rad], as all here."""
UNCHANGING = np.tile(CONSTANT_STIFFNESS, (len(GRID), 1))
"""One that is held."""
MID_RANGE = np.tile(np.sqrt(np.prod(stiffness_ranges(BipedSettings(), Body()), axis=0)), (len(GRID), 1))
"""That of action 0, where a training begins."""
FOREIGN, PUSHED_FOREIGN = (UNCHANGING, QUASI, MID_RANGE), (UNCHANGING, QUASI)
"""Springs that nobody tuned for it, with which each candidate walks undisturbed, and pushed."""


def foreign_springs(settings: BipedSettings) -> tuple[Sequence[NDArray], Sequence[NDArray]]:
    """Springs that nobody tuned, undisturbed and pushed; none where the body follows its plan: they are people's, or
    chosen on people's walk."""
    return ((), ()) if settings.guide == "plan" else (FOREIGN, PUSHED_FOREIGN)


def walk(
    settings: BipedSettings,
    candidates: Sequence[LegConstants],
    seeds: Sequence[int],
    threads: int,
    ease: float = 0.0,
    foreign: Sequence[NDArray] = FOREIGN,
    seconds: float = SECONDS,
    watched: bool = True,
    right: Sequence[LegConstants] | None = None,
    feet: Sequence[Feet] | None = None,
) -> tuple[NDArray, Biped, list[Tick]]:
    """Walk candidates equally often, one walk for each of `seeds`, at an equilibrium that is the share `ease` planned.

    The last walks of each have the stiffnesses `foreign`, the others the schedule. `right` are the constants of each
    candidate's right leg, if it has its own, and `feet` each candidate's, in place of those of the settings.

    Returns how much of the walk a fall took (C * walks,): 0 without a fall, 1 at once, 1/3 at the end, and standing
    still counts as one; the core; and, if `watched`, every tick.
    """
    num, walks = len(seeds), len(seeds) // len(candidates)
    variant = np.repeat(np.arange(len(candidates)), walks)
    rest = _eased(settings, candidates, ease) if ease else None
    worn = feet and [feet[index] for index in variant.tolist()]
    biped = Biped(settings, num, threads, legs=candidates, variant=variant, rest=rest, feet=worn, right_legs=right)
    biped.reset(np.arange(num), seeds)
    role = np.tile(np.arange(walks), len(candidates)) - (walks - len(foreign))
    ticks: list[Tick] = []
    biped.on_tick = ticks.append if watched else None
    active, walked = np.ones(num, bool), np.zeros(num)
    for _ in range(round(seconds / biped.dt)):
        if settings.action_mode == "residual":
            action = np.zeros((num, 2, 2))
        else:
            action = action_of(biped.scheduled_stiffness(), settings, biped.body)
        for index, stiffness in enumerate(foreign):
            place = (biped.leg_phase[role == index] * len(GRID)).astype(int)
            action[role == index] = action_of(stiffness[place], settings, biped.body)
        result = biped.step(action.reshape(num, -1), active)
        walked = np.where(active, biped.measurement.com[:, 0] / (settings.speed * seconds), walked)
        active &= ~result.terminated
        if not active.any():
            break
    return np.where(active & (walked > 0.5), 0.0, 1.0 - 2.0 / 3.0 * np.clip(walked, 0.0, 1.0)), biped, ticks


def series(biped: Biped, ticks: Sequence[Tick]) -> dict[str, NDArray]:
    """The ticks as arrays (T, N, ...)."""
    measured = [tick.measurement for tick in ticks]
    return {
        "com": np.stack([m.com for m in measured]),
        "planned_com": np.stack([tick.com_reference for tick in ticks]),
        "phase": np.stack([tick.phase for tick in ticks]),
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


def speed_of(record: dict[str, NDArray]) -> NDArray:
    """(N,) mean forward speed of the CoM from `SETTLED` on [m/s], of a record of `series`."""
    first = round(SETTLED / Biped.tick_dt)
    last = len(record["com"]) - 1
    way = record["com"][last, :, 0] - record["com"][min(first, last), :, 0]
    return way / max((last - first) * Biped.tick_dt, Biped.tick_dt)
