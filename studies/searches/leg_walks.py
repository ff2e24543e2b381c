"""Walks of the search for leg constants: candidates side by side in one batch, recorded as an evaluation records.

They walk with their own schedule and with springs that nobody tuned for them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from springfoot.agents.policies import CONSTANT_STIFFNESS
from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.envs.control import (
    GRID,
    REFERENCE_STIFFNESS,
    LegConstants,
    action_of,
    foot_curves,
    plateau_curve,
    reference_walk_at,
    stiffness_ranges,
)
from springfoot.envs.physics import Feet
from springfoot.envs.settings import BipedSettings
from springfoot.evaluation.numbers import StrideTally, add_episode
from springfoot.evaluation.recording import TICK, Episodes, record_walk
from springfoot.gait.body import TOE_STIFFNESS, Body

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
    return ((), ()) if settings.follows_plan else (FOREIGN, PUSHED_FOREIGN)


def walk(
    settings: BipedSettings,
    candidates: Sequence[LegConstants],
    seeds: Sequence[int],
    threads: int,
    ease: float = 0.0,
    foreign: Sequence[NDArray] = FOREIGN,
    seconds: float = SECONDS,
    right: Sequence[LegConstants] | None = None,
    feet: Sequence[Feet] | None = None,
) -> "Walks":
    """Walk candidates equally often, one walk for each of `seeds`, at an equilibrium that is the share `ease` planned.

    The last walks of each have the stiffnesses `foreign`, the others the schedule. `right` are the constants of each
    candidate's right leg, if it has its own, and `feet` each candidate's, in place of those of the settings.
    """
    num = len(seeds)
    walks = num // len(candidates)
    variant = np.repeat(np.arange(len(candidates)), walks)
    rest = _eased(settings, candidates, ease) if ease else None
    worn = feet and [feet[index] for index in variant.tolist()]
    biped = Biped(settings, num, threads, legs=candidates, variant=variant, rest=rest, feet=worn, right_legs=right)
    biped.reset(np.arange(num), seeds)
    role = np.tile(np.arange(walks), len(candidates)) - (walks - len(foreign))

    def act(_observation: NDArray) -> NDArray:
        if settings.action_mode == "residual":
            action = np.zeros((num, 2, 2))
        else:
            action = action_of(biped.scheduled_stiffness(), settings, biped.body)
        for index, stiffness in enumerate(foreign):
            place = (biped.leg_phase[role == index] * len(GRID)).astype(int)
            action[role == index] = action_of(stiffness[place], settings, biped.body)
        return action.reshape(num, -1)

    steps = round(seconds / biped.dt)
    episodes = Episodes.empty(num, steps * biped.windows_per_step)
    record_walk(biped, act, episodes, steps=steps)
    return Walks(biped=biped, episodes=episodes, seconds=seconds)


@dataclass(frozen=True, kw_only=True, eq=False)
class Walks:
    """N walks of a search, recorded and measured as an evaluation records and measures."""

    biped: Biped
    """The batch that walked."""
    episodes: Episodes
    """One of each walk."""
    seconds: float
    """Their length without falls [s]."""

    @property
    def missing(self) -> NDArray:
        """(N,) the share of each walk that a fall took: 0 without one, 1 at once, 1/3 at the end.

        Standing still counts as a fall.
        """
        com = self.episodes.series["com"][..., 0].astype(float)
        way = com[np.arange(len(com)), self.episodes.ticks - 1]
        walked = way / (self.biped.settings.speed * self.seconds)
        stood = self.episodes.fall_reason == ""
        return np.where(stood & (walked > 0.5), 0.0, 1.0 - 2.0 / 3.0 * np.clip(walked, 0.0, 1.0))

    @property
    def speed(self) -> NDArray:
        """(N,) mean forward speed of the CoM from `SETTLED` on [m/s]."""
        first = round(SETTLED / TICK)
        found = np.zeros(len(self.episodes.ticks))
        for index, ticks in enumerate(self.episodes.ticks.tolist()):
            com = self.episodes.series["com"][index, :ticks, 0].astype(float)
            last = ticks - 1
            found[index] = (com[last] - com[min(first, last)]) / max((last - first) * TICK, TICK)
        return found

    def episode(self, index: int) -> dict[str, NDArray]:
        """Return the series of walk `index`, as `evaluation.recording.recording.Episodes.episode`."""
        return self.episodes.episode(index)


def measured(series: dict[str, NDArray], biped: Biped, settled: float = SETTLED) -> StrideTally | None:
    """Return the evaluation's tally of one walk's strides from `settled` [s] on; None if a leg takes fewer than two."""
    tally = StrideTally()
    add_episode(tally, series, biped.body, (settled, np.inf))
    return None if min(curves.count for curves in tally.feet) < 2 else tally


def _eased(settings: BipedSettings, candidates: Sequence[LegConstants], ease: float) -> NDArray:
    """Return (C, SAMPLES, 2) foot equilibrium [rad], by the share `ease` the planned one."""
    walk = reference_walk_at(settings, settings.speed, candidates)
    curves = [
        [foot_curves(kind, c, walk)[0] for c in candidates]
        for kind in (settings, replace(settings, equilibrium="planned"))
    ]
    own, planned = np.array(curves)
    return own + ease * (planned - own)
