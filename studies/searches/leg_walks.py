"""Walk candidate leg constants side by side in one batch, recorded and measured as an evaluation records and measures.

Each candidate walks with its schedule, and with springs that were not tuned for it ("foreign").
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
from springfoot.envs.settings import BipedSettings
from springfoot.evaluation.numbers import StrideTally, add_episode
from springfoot.evaluation.recording import Episodes, record_walk
from springfoot.gait.body import TOE_STIFFNESS, Body

SECONDS = 6.5
"""Length of each walk [s]."""
SETTLED = 2.5
"""Time from which a walk is measured [s]."""
QUASI = np.stack([plateau_curve(REFERENCE_STIFFNESS), np.full(len(GRID), TOE_STIFFNESS)], -1)
"""Foreign springs: people's ankle quasi-stiffness and `TOE_STIFFNESS`, (SAMPLES, 2) on `GRID` [N m/rad]."""
UNCHANGING = np.tile(CONSTANT_STIFFNESS, (len(GRID), 1))
"""Foreign springs: the baseline's constant stiffness, (SAMPLES, 2) [N m/rad]."""
MID_RANGE = np.tile(np.sqrt(np.prod(stiffness_ranges(BipedSettings(), Body()), axis=0)), (len(GRID), 1))
"""Foreign springs: the stiffness of action 0, where a training begins, (SAMPLES, 2) [N m/rad]."""
FOREIGN, PUSHED_FOREIGN = (UNCHANGING, QUASI, MID_RANGE), (UNCHANGING, QUASI)
"""Foreign springs with which each candidate walks undisturbed, and under pushes."""


def walk(
    settings: BipedSettings,
    candidates: Sequence[LegConstants],
    seeds: Sequence[int],
    threads: int,
    ease: float = 0.0,
    foreign: Sequence[NDArray] = FOREIGN,
    seconds: float = SECONDS,
) -> "Walks":
    """Record the walks of C candidate leg constants, side by side: N / C walks of each candidate, one for each seed.

    Args:
        settings: settings of the environment.
        candidates: C leg constants.
        seeds: N seeds, those of the first candidate first.
        threads: threads of the physics.
        ease: fraction [0, 1] by which the rest angles move from the settings' to the planned ones.
        foreign: stiffness curves (SAMPLES, 2) on `GRID`, one for each of the last walks of a candidate; its first walks
            have the schedule.
        seconds: length of each walk [s].
    """
    num = len(seeds)
    walks_each = num // len(candidates)
    variant = np.repeat(np.arange(len(candidates)), walks_each)
    rest = _eased_rest_angles(settings, candidates, ease) if ease else None
    biped = Biped(settings, num, threads, legs=candidates, variant=variant, rest=rest)
    biped.reset(np.arange(num), seeds)
    # (N,) index in `foreign` of the springs that a walk has; negative for the schedule.
    springs = np.tile(np.arange(walks_each), len(candidates)) - (walks_each - len(foreign))

    def act(_observation: NDArray) -> NDArray:
        """Return the actions (N, 4) that set the schedule, or one of `foreign`, at each leg's phase."""
        if settings.action_mode == "residual":
            action = np.zeros((num, 2, 2))
        else:
            action = action_of(biped.scheduled_stiffness(), settings, biped.body)
        for index, stiffness in enumerate(foreign):
            sample = (biped.leg_phase[springs == index] * len(GRID)).astype(int)  # index on `GRID` of each leg's phase
            action[springs == index] = action_of(stiffness[sample], settings, biped.body)
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
    """Record of each walk, as one episode."""
    seconds: float
    """Length of a walk without a fall [s]."""

    @property
    def missing(self) -> NDArray:
        """Return (N,) how early each walk fell: 0 without a fall, else 1 for a fall at once, decreasing with the
        distance walked to 1/3 for a fall at the end.

        A walk that covers less than half of the commanded distance counts as a fall.
        """
        com = self.episodes.series["com"][..., 0].astype(float)
        distance = com[np.arange(len(com)), self.episodes.ticks - 1]
        walked = distance / (self.biped.settings.speed * self.seconds)  # as a fraction of the commanded distance
        stood = self.episodes.fall_reason == ""
        return np.where(stood & (walked > 0.5), 0.0, 1.0 - 2.0 / 3.0 * np.clip(walked, 0.0, 1.0))

    def episode(self, index: int) -> dict[str, NDArray]:
        """Return name -> series (T, ...) of walk `index` over its T ticks, without those after its end."""
        return self.episodes.episode(index)

    def speed(self, index: int) -> float:
        """Return the evaluation's mean forward speed of walk `index` from `SETTLED` on [m/s]."""
        return tally_from(self.episode(index), self.biped.settings, SETTLED).speed[0]


def tally_from(series: dict[str, NDArray], settings: BipedSettings, settled: float) -> StrideTally:
    """Return the evaluation's measurements of one walk from `settled` [s] on; `series` as from `Walks.episode`."""
    tally = StrideTally()
    add_episode(tally, series, settings, (settled, np.inf))
    return tally


def measured(series: dict[str, NDArray], biped: Biped, settled: float = SETTLED) -> StrideTally | None:
    """Return the evaluation's measurements of one walk from `settled` [s] on; None if a leg takes fewer than two
    strides, or if the body does not advance."""
    tally = tally_from(series, biped.settings, settled)
    walked = min(curves.count for curves in tally.feet) >= 2 and tally.distance > 0.0
    return tally if walked else None


def _eased_rest_angles(settings: BipedSettings, candidates: Sequence[LegConstants], ease: float) -> NDArray:
    """Return the rest angles (C, SAMPLES, 2) [rad] of ankle and toe on `GRID`, for each of C candidates: the settings'
    ones, moved by the fraction `ease` to the planned ones."""
    walk = reference_walk_at(settings, settings.speed, candidates)
    curves = [
        [foot_curves(variant, constants, walk)[0] for constants in candidates]
        for variant in (settings, replace(settings, equilibrium="planned"))
    ]
    by_settings, planned = np.array(curves)
    return by_settings + ease * (planned - by_settings)
