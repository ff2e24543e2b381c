"""A page to play with: walks recorded over stiffness, speed and feet, between which its sliders blend.

springfoot study play --page docs/play.md
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any, ClassVar

import numpy as np

from springfoot.agents.markdown import table
from springfoot.agents.source import source
from springfoot.envs.control.foot_springs import action_of, stiffness_ranges
from springfoot.envs.settings import BipedSettings, body_of, settings_from
from springfoot.evaluation.play_data import episodes_of
from springfoot.evaluation.play_page import Grid, play_page
from springfoot.evaluation.recording import BATCH, Recording, record
from springfoot.evaluation.report_page import PAGE_PACKAGES
from springfoot.evaluation.stride_series import WARM_UP
from springfoot.gait.arrays import NDArray
from springfoot.gait.errors import SpringfootError, require_count, require_within

from .study import Answer, OnProgress, WalkingStudy, without_places

PAGE_NAME = "play.html"


@dataclass(frozen=True, kw_only=True)
class Play(WalkingStudy):
    """Record walks with constant stiffness over K of ankle and toe, speed and the right foot; write a page of them."""

    ankle: tuple[float, ...] = (80.0, 130.0, 210.0, 340.0, 550.0)
    """Stiffness of both ankles [N m/rad], ascending; each about 1.6 times the last."""
    toe: tuple[float, ...] = (15.0, 40.0, 100.0)
    """Stiffness of both toes [N m/rad], ascending."""
    speed: tuple[float, ...] = (0.8, 1.0, 1.2, 1.4, 1.6)
    """Commanded speeds [m/s], ascending."""
    feet: tuple[str, ...] = ("intact", "passive", "rigid", "rigid_toe", "no_toe", "drop")
    """Kinds of the right foot; the left one is intact."""
    episodes: int = 2
    """Episodes of each point."""
    seconds: float = 12.0
    """Length of each."""
    seed: int = 0
    """Of the first episode of each foot and speed; the next ones count on."""

    QUICK: ClassVar[Mapping[str, Any]] = {
        "episodes": 1,
        "seconds": 6.0,
        "ankle": (130.0, 340.0),
        "toe": (15.0, 40.0),
        "speed": (1.0, 1.2),
        "feet": ("intact", "passive"),
    }

    def check(self) -> None:
        """Refuse marks of a slider that do not ascend, K that no action gives, and too many episodes of a point."""
        super().check()
        for name in ("ankle", "toe", "speed"):
            marks = getattr(self, name)
            if len(marks) < 2 or any(after <= before for before, after in pairwise(marks)):
                raise SpringfootError(f"{name} must be at least two ascending numbers, got {marks}")
        for name, (low, high) in zip(("ankle", "toe"), _ranges(), strict=True):
            for stiffness in getattr(self, name):
                require_within(name, stiffness, (low, high), "N m/rad")
        if not self.feet:
            raise SpringfootError("feet must be at least one kind of foot")
        require_count("episodes", self.episodes, 1, BATCH)
        if self.seconds <= WARM_UP:
            raise SpringfootError(f"seconds must be more than the warm-up of {WARM_UP:g} s, got {self.seconds:g}")

    @property
    def grid(self) -> Grid:
        """What is recorded."""
        return Grid(feet=self.feet, speed=self.speed, toe=self.toe, ankle=self.ankle)

    @property
    def total(self) -> float:
        """Simulated seconds without falls."""
        return self.grid.size * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk at every point."""
        recordings = [
            walk for foot, speed in product(self.feet, self.speed) for walk in self._walks(foot, speed, progress)
        ]
        words = (
            f"Recorded were {self.grid.size} points with constant stiffness in both legs, {self.episodes} "
            f"episode{'s' * (self.episodes > 1)} of {self.seconds:g} s at each, on level ground, 1.70 m and 63 kg."
        )
        made = source(PAGE_PACKAGES)
        commit = f"{made['commit'] or 'none: not in a clone of the project'}{' and changes to it' * made['modified']}"
        versions = [f"{name} {number}" for name, number in made["versions"].items()]
        how = "\n".join(
            [f"command: {without_places(self.command)}", f"seeds from {self.seed} on", f"commit: {commit}", *versions]
        )
        page = play_page(self.grid, recordings, words, how)
        falls = np.array([each["falls"] for each in page.told]).reshape(len(self.feet), len(self.speed), -1)
        rows = [
            [foot.replace("_", " "), *(f"{(own == 0).sum()} / {(own == self.episodes).sum()}" for own in of_foot)]
            for foot, of_foot in zip(self.feet, falls, strict=True)
        ]
        text = (
            f"{words}\n\n{table(['right foot', *(f'{speed:g} m/s' for speed in self.speed)], rows)}\n\n"
            f"Of {falls.shape[-1]} pairs of stiffness: never fell / always fell."
        )
        return Answer(text=text, files={PAGE_NAME: page.text}, sections={"PLAY": text})

    def _walks(self, foot: str, speed: float, progress: OnProgress) -> Iterator[Recording]:
        """A recording of each stiffness, the ankle's changing fastest; as many side by side as a batch takes."""
        settings = settings_from(right_foot=foot, speed=speed, episode_seconds=self.seconds)
        pairs = np.array([(ankle, toe) for toe, ankle in product(self.toe, self.ankle)])
        side_by_side = BATCH // self.episodes
        for begin in range(0, len(pairs), side_by_side):
            actions = action_of(pairs[begin : begin + side_by_side], settings, body_of(settings))
            each = np.repeat(np.tile(actions, 2), self.episodes, axis=0).astype(np.float32)
            whole = record(
                lambda observation, each=each: each,
                settings,
                name="constant",
                episodes=len(each),
                seed=self.seed,
                threads=self.threads,
                progress=progress,
            )
            for first in range(0, len(each), self.episodes):
                yield episodes_of(whole, np.arange(first, first + self.episodes))


def _ranges() -> NDArray:
    """(joint, (lowest, highest)) stiffness that actions give to the usual body [N m/rad]."""
    settings = BipedSettings()
    return np.stack(stiffness_ranges(settings, body_of(settings)), -1)
