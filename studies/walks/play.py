"""Write a page to play with: walks over stiffness, speed and feet, between which its sliders blend.

springfoot study play
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any, ClassVar

import numpy as np

from springfoot.agents.policies import PolicyFunction
from springfoot.arrays import NDArray
from springfoot.envs.control import action_of, stiffness_of
from springfoot.envs.physics import SIDES
from springfoot.envs.settings import BipedSettings, body_of
from springfoot.errors import SpringfootError, require_count
from springfoot.evaluation.page import PAGE_PACKAGES, Grid, episodes_of, play_page
from springfoot.evaluation.recording import BATCH, WARM_UP, Recording, policy_and_settings, record
from springfoot.files.markdown import table
from springfoot.files.provenance import versions_and_commit
from springfoot.gait.springs import SPRINGS

from ..base.study import Answer, OnProgress, WalkingStudy, without_places

PAGE_NAME = "play.html"


@dataclass(frozen=True, kw_only=True)
class Play(WalkingStudy):
    """Record walks of a policy with scaled K of ankle and toe, over speed and right foot, and write a page of them."""

    policy: str = "schedule"
    """Policy whose stiffness is scaled."""
    ankle: tuple[float, ...] = (0.5, 0.7, 1.0, 1.4, 2.0)
    """Factors on the stiffness of both ankles, ascending; a device keeps its own."""
    toe: tuple[float, ...] = (0.5, 1.0, 2.0)
    """Factors on the stiffness of both toes, ascending."""
    speed: tuple[float, ...] = (0.8, 1.0, 1.2, 1.4, 1.6)
    """Commanded speeds [m/s], ascending."""
    feet: tuple[str, ...] = ("intact", "passive", "rigid_toe", "no_toe", "weak")
    """Kinds of the right foot; the left one is intact."""
    episodes: int = 2
    """Episodes of each point."""
    seconds: float = 12.0
    """Length of each episode."""
    seed: int = 0
    """Seed of the first episode of each foot and speed."""

    QUICK: ClassVar[Mapping[str, Any]] = {
        "episodes": 1,
        "seconds": 6.0,
        "ankle": (0.7, 1.4),
        "toe": (0.5, 1.0),
        "speed": (1.0, 1.2),
        "feet": ("intact", "passive"),
    }

    def check(self) -> None:
        """Refuse slider marks that do not ascend, and too many episodes of a point."""
        super().check()
        for name in ("ankle", "toe", "speed"):
            marks = getattr(self, name)
            if len(marks) < 2 or marks[0] <= 0.0 or any(after <= before for before, after in pairwise(marks)):
                raise SpringfootError(f"{name} must be at least two ascending positive numbers, got {marks}")
        if not self.feet:
            raise SpringfootError("feet must be at least one kind of foot")
        require_count("episodes", self.episodes, 1, BATCH)
        if self.seconds <= WARM_UP:
            raise SpringfootError(f"seconds must be more than the warm-up of {WARM_UP:g} s, got {self.seconds:g}")

    @property
    def grid(self) -> Grid:
        """Return the points to record: every combination of foot, speed and factors."""
        return Grid(feet=self.feet, speed=self.speed, toe=self.toe, ankle=self.ankle)

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return self.grid.size * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk at every point of the grid, and write the page."""
        recordings = [
            walk for foot, speed in product(self.feet, self.speed) for walk in self._walks(foot, speed, progress)
        ]
        words = (
            f"Recorded: the policy {self.policy}, its K of ankles and toes times a factor, at {self.grid.size} points, "
            f"{self.episodes} episode{'s' * (self.episodes > 1)} of {self.seconds:g} s each, on level ground, "
            "1.70 m and 63 kg."
        )
        versions = (f"{name} {number}" for name, number in versions_and_commit(PAGE_PACKAGES)["versions"].items())
        made_by = "\n".join([f"command: {without_places(self.command)}", f"seeds from {self.seed} on", *versions])
        page = play_page(self.grid, recordings, words, made_by)
        # (feet, speeds, pairs of factors) number of episodes that fell.
        falls = np.array([point["falls"] for point in page.numbers]).reshape(len(self.feet), len(self.speed), -1)
        never = (falls == 0).sum(axis=2)
        always = (falls == self.episodes).sum(axis=2)
        rows = [
            [foot.replace("_", " "), *(f"{n} / {a}" for n, a in zip(never[index], always[index], strict=True))]
            for index, foot in enumerate(self.feet)
        ]
        text = (
            f"{words}\n\n{table(['right foot', *(f'{speed:g} m/s' for speed in self.speed)], rows)}\n\n"
            f"Of {falls.shape[-1]} pairs of factors: never fell / always fell."
        )
        return Answer(text=text, files={PAGE_NAME: page.text})

    def _walks(self, foot: str, speed: float, progress: OnProgress) -> Iterator[Recording]:
        """Yield a recording for each pair of factors, the ankle's changing fastest; a batch walks many pairs at
        once."""
        conditions = {"right_foot": foot, "speed": speed, "episode_seconds": self.seconds}
        policy, settings = policy_and_settings(self.policy, conditions, self.seed, self.threads)
        if settings.action_mode != "absolute":
            raise SpringfootError(f"policy must set K itself (action_mode absolute), got {self.policy}")
        pairs = np.array([(ankle, toe) for toe, ankle in product(self.toe, self.ankle)])
        pairs_per_batch = BATCH // self.episodes
        for begin in range(0, len(pairs), pairs_per_batch):
            factor = np.repeat(pairs[begin : begin + pairs_per_batch], self.episodes, axis=0)
            batch = record(
                _with_scaled_stiffness(policy, factor, settings),
                settings,
                name=self.policy,
                episodes=len(factor),
                seed=self.seed,
                threads=self.threads,
                progress=progress,
            )
            for first in range(0, len(factor), self.episodes):
                yield episodes_of(batch, np.arange(first, first + self.episodes))


def _with_scaled_stiffness(policy: PolicyFunction, factor: NDArray, settings: BipedSettings) -> PolicyFunction:
    """Return `policy` with its K of ankles and toes times `factor` (N, 2), within the range of actions, in N bodies."""
    body = body_of(settings)

    def scaled(observation: NDArray) -> NDArray:
        """Return the actions (N, 4) of scaled stiffness for observations (N, D)."""
        action = policy(observation).astype(float).reshape(-1, len(SIDES), len(SPRINGS))
        stiffness = stiffness_of(action, settings, body) * factor[:, None]  # (N, side, 2)
        return action_of(stiffness, settings, body).reshape(len(factor), -1).astype(np.float32)

    return scaled
