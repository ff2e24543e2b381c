"""Measure a policy's walks undisturbed and pushed, from the same seeds, and keep the result in a file."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from springfoot.envs.control import LegConstants
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record

from .kept import Kept
from .study import OnProgress


@dataclass(frozen=True, kw_only=True)
class PushedWalks:
    """Measurement of a policy: episodes undisturbed and pushed, the same seeds for all policies of a table."""

    episodes: int = 20
    """Undisturbed episodes of each row and seed, and as many pushed."""
    seconds: float = 20.0
    """Length of each episode."""
    push_newton: float = 150.0
    """Size of the pushes [N]."""
    seed: int = 0
    """Episode i is seeded with seed + i."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""
    progress: OnProgress = lambda seconds: None
    """Function called with the simulated time [s] of each step."""

    def metrics(
        self, policy: str, settings: dict[str, Any] | None = None, legs: LegConstants | None = None
    ) -> dict[str, Any]:
        """Return the metrics of walks of the policy of that name, by condition: `undisturbed` and `pushed`.

        The reward is the default one. `settings` are further environment settings; `legs` are leg constants in place of
        the tuned ones.
        """
        metrics = {}
        for condition, push in (("undisturbed", 0.0), ("pushed", self.push_newton)):
            given = {"reward_weights": {}, "episode_seconds": self.seconds, "push_newton": push} | (settings or {})
            acting, environment = policy_and_settings(policy, given, self.seed)
            names = ("episodes", "seed", "threads", "progress")
            arguments: dict[str, Any] = {name: getattr(self, name) for name in names} | {"legs": legs}
            metrics[condition] = measure(record(acting, environment, name=policy, **arguments)).metrics
        return metrics

    @property
    def sentence(self) -> str:
        """Return the sentence that explains the columns below a table."""
        return (
            f"Falls of {self.episodes} episodes × {self.seconds:g} s, undisturbed and pushed by "
            f"±{self.push_newton:g} N, the same seeds in every row; all else undisturbed: return of the default "
            "reward, speed, RMSE of thigh, knee and ankle to people's mean, vertical force peaks, r of both forces "
            "with people's, largest ankle moment and where in the stride, RMSE of the CoM to the plan forward and of "
            "the CoP to the planned ZMP in single support. In episodes that end in a fall, only the strides "
            "before it count."
        )


def kept_metrics(path: Path, walks: PushedWalks, key: Any, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return the metrics that the file `path` keeps for `walks` and `key`; else call `make` and keep its result.

    `key` is a JSON value that differs between policies, settings and leg constants. Threads and progress do not count:
    the metrics do not depend on them.
    """
    question = {"how": {**vars(walks), "threads": None, "progress": None}, "of": key}
    return Kept(path).get(question, make)
