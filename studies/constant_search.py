"""The constant stiffness, and the factor on the tuned schedule, that earn most in a policy's environment and reward.

springfoot study best-constant
springfoot study best-factor
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar

import numpy as np
import tyro

from springfoot.agents.policies.baselines import constant, schedule
from springfoot.arrays import NDArray
from springfoot.envs.settings.settings import BipedSettings
from springfoot.evaluation.recording.policies import prepare
from springfoot.evaluation.recording.recording import record
from springfoot.files.writing import csv_text

from .base.intervals import RESAMPLES, mean_interval
from .base.study import Answer, OnProgress, WalkingStudy
from .walks.comparison import PushedFlags, pushed

COARSE = (8, 5)
"""First grid of the search for a constant, ankle by toe stiffness: evenly on a log scale over their ranges."""
REFINEMENTS = 3
"""Times the search then halves its spacing around the best so far."""
FACTORS = tuple(round(0.5 * 1.1**k, 2) for k in range(17))
"""On the schedule, 0.5 to 2.3, a tenth apart."""
_INTERVAL = f"Interval: 95 %, percentile bootstrap over episodes (scipy.stats, {RESAMPLES:,} resamples)."
SEARCH_SEED = 100_000
"""Of the search's first episode: far from a comparison's, so that the best constant is not fitted to its starts."""


def best_constant(
    settings: BipedSettings,
    *,
    grid: tuple[int, int] = COARSE,
    refinements: int = REFINEMENTS,
    episodes: int = 16,
    seed: int = SEARCH_SEED,
    threads: int = 2,
    progress: OnProgress = lambda candidates: None,
) -> tuple[tuple[float, float], dict[tuple[float, float], NDArray]]:
    """The constant ankle and toe stiffness of the highest mean return in `settings`, and the returns of all tried.

    A log `grid` over the settings' ranges, then `refinements` around the best; all candidates walk the same episodes.
    Stiffness [N m/rad] is for 1.70 m and 63 kg. The return of the best of many is optimistic: judge it on other seeds.
    """
    low, high = np.log([settings.ankle_stiffness_range, settings.toe_stiffness_range]).T
    spacing = (high - low) / (np.array(grid) - 1)
    settings = replace(settings, action_mode="absolute")
    how: dict[str, Any] = {"episodes": episodes, "seed": seed, "threads": threads}
    tried: dict[tuple[float, float], NDArray] = {}

    def best() -> tuple[float, float]:
        return max(tried, key=lambda pair: tried[pair].mean())

    for refinement in range(refinements + 1):
        points = low + np.array(list(product(*map(range, grid)))) * spacing
        if refinement:
            points = np.log(best()) + np.array(list(product((-1, 0, 1), repeat=2))) * spacing / 2**refinement
        for point in np.exp(np.clip(points, low, high)):
            pair = float(f"{point[0]:.3g}"), float(f"{point[1]:.3g}")  # as it will be typed
            if pair not in tried:
                tried[pair] = record(constant(settings, pair), settings, name="constant", **how).returns
            progress(1)
    return best(), tried


@dataclass(frozen=True, kw_only=True)
class _Search(WalkingStudy):
    """Candidates that all walk the same episodes, in the environment and by the reward of a policy."""

    policy: str = "pretrained"
    """In whose environment and reward: any policy of evaluate.py; untrained for the defaults."""
    episodes: int = 16
    """Episodes of each candidate."""
    seed: int = SEARCH_SEED
    """Of every candidate's first episode; keep it apart from that of the comparison."""
    environment: tyro.conf.OmitArgPrefixes[PushedFlags]  # type: ignore[valid-type]
    """What to walk in."""

    UNIT: ClassVar[str] = " tries"
    QUICK: ClassVar[dict[str, Any]] = {"episodes": 1, "seconds": 1.0}

    def settings(self) -> BipedSettings:
        """In which they walk."""
        return prepare(self.policy, pushed(self.seconds, self.environment))[1]


@dataclass(frozen=True, kw_only=True)
class BestConstant(_Search):
    """Find the constant ankle and toe stiffness with the highest mean return."""

    @property
    def total(self) -> float:
        """Candidates."""
        return COARSE[0] * COARSE[1] + 9 * REFINEMENTS

    def ask(self, progress: OnProgress) -> Answer:
        """Search."""
        (ankle, toe), tried = best_constant(self.settings(), **self.how, progress=progress)
        returns = tried[ankle, toe]
        low, high = mean_interval(returns)
        text = (
            f"--constant {ankle:g} {toe:g}\n"
            f"ankle {ankle:g}, toe {toe:g} N·m/rad for 1.70 m and 63 kg: mean return {returns.mean():.1f} "
            f"[{low:.1f}, {high:.1f}] over the search's {len(returns)} episodes, the best of {self.total:g} tries.\n"
            f"{_INTERVAL}"
        )
        lines = [(*pair, float(each.mean())) for pair, each in tried.items()]
        head = ["ankle_Nm_per_rad", "toe_Nm_per_rad", "return_mean"]
        return Answer(text=text, files={"tried.csv": csv_text(head, lines)}, sections={"BEST-CONSTANT": text})


@dataclass(frozen=True, kw_only=True)
class BestFactor(_Search):
    """Find the factor on the tuned schedule with the highest mean return."""

    @property
    def total(self) -> float:
        """Candidates."""
        return len(FACTORS)

    def ask(self, progress: OnProgress) -> Answer:
        """Search."""
        settings = replace(self.settings(), action_mode="absolute")
        tried: dict[float, NDArray] = {}
        for factor in FACTORS:
            policy = schedule(settings, factor)
            tried[factor] = record(policy, settings, name="schedule", **self.how).returns
            progress(1)
        best = max(tried, key=lambda factor: tried[factor].mean())
        low, high = mean_interval(tried[best])
        text = (
            f"--factor {best:g}\n"
            f"schedule × {best:g}: mean return {tried[best].mean():.1f} [{low:.1f}, {high:.1f}] over the search's "
            f"{len(tried[best])} episodes, the best of {len(FACTORS)} tries.\n{_INTERVAL}"
        )
        numbers = csv_text(["factor", "return_mean"], [(factor, float(own.mean())) for factor, own in tried.items()])
        return Answer(text=text, files={"tried.csv": numbers}, sections={"BEST-FACTOR": text})
