"""Write a page of recorded walks: a learned person on several feet, at several masses and speeds.

springfoot study walks
springfoot study walks --foot intact --foot my_foot.csv --side right
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import tyro

from springfoot.errors import SpringfootError, require_count
from springfoot.evaluation.page import PAGE_PACKAGES, Grid, Walk, walk_of, walks_page
from springfoot.evaluation.recording import BATCH, WARM_UP, policy_label, record_feet
from springfoot.files.markdown import table, text_of
from springfoot.files.provenance import versions_and_commit

from ..base.adapting_persons import person_and_settings
from ..base.study import Answer, OnProgress, WalkingStudy, without_places
from ..base.walked_speeds import rows_csv
from .foot_choice import MOST_FEET, SIDES_OF, named_feet
from .foot_numbers import FOOT_NUMBERS, numbers_of_feet
from .orthosis import braced_calf

PAGE_NAME = "walks.html"
PAGE_FEET: Mapping[str, Mapping[str, Any]] = {
    "sound": {},
    "weak calves, 25 %": {side: {"kind": "weak", "strength": 0.25} for side in SIDES_OF["both"]},
    "weak calves, springs of 3 N·m/deg": dict.fromkeys(SIDES_OF["both"], braced_calf(0.25, 3.0)),
    "right foot passive, 300 N·m/rad": {"right_foot": {"kind": "passive", "ankle_stiffness": 300.0}},
    "right foot passive, 600 N·m/rad": {"right_foot": {"kind": "passive", "ankle_stiffness": 600.0}},
    "right foot rigid": {"right_foot": "rigid"},
    "right foot drops": {"right_foot": "drop"},
    "right foot drops, spring of 5 N·m/rad at 10°": {
        "right_foot": {"kind": "drop", "orthosis": {"ankle_stiffness": 5.0, "ankle_deg": 10.0}}
    },
}
"""Feet of the page unless the user names others: name -> settings. Each hindrance stands before the same with a spring;
docs/results/feet.md has the springs."""
PAGE_COLUMNS = {
    "walked, m/s": "speed_m_s",
    "fibre work, J/kg/m": "fibre_J_kg_m",
    "push-off, J/kg": "push_off_J_kg",
    "largest force, BW": "sound_peak_bw",
}
"""Heading of the page's table -> number of `FOOT_NUMBERS`."""


@dataclass(frozen=True, kw_only=True)
class Walks(WalkingStudy):
    """How does a learned person walk on each foot? Records it over foot, mass and speed, and writes a page of it."""

    person: str = "learned"
    """Person that adapts to the feet: a run folder, a file, or one of the package, such as `learned`."""
    foot: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FOOT"), tyro.conf.UseAppendAction] = ()
    """A foot, as of --right-foot: a kind, JSON, or a file; once for each foot. Without it eight feet are compared."""
    side: Literal["left", "right", "both"] = "right"
    """Side on which the feet of --foot are worn; the other foot is sound."""
    mass: tuple[float, ...] = (50.0, 63.0, 80.0)
    """Masses of the body [kg], ascending."""
    speed: tuple[float, ...] = (0.9, 1.2, 1.5)
    """Speeds that are asked for [m/s], ascending."""
    episodes: int = 5
    """Episodes on each foot, at each mass and speed."""
    seconds: float = 12.0
    """Length of each episode."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 6.0, "mass": (63.0,), "speed": (1.2,)}
    REPEATABLE: ClassVar[Collection[str]] = frozenset({"--foot"})

    def check(self) -> None:
        """Refuse masses and speeds that do not ascend, too many feet, and episodes without a stride."""
        super().check()
        for name in ("mass", "speed"):
            values = getattr(self, name)
            if not values or any(after <= before for before, after in pairwise(values)):
                raise SpringfootError(f"{name} must be ascending numbers, got {values}")
        require_count("episodes", self.episodes, 1, BATCH)
        if self.seconds <= WARM_UP:
            raise SpringfootError(f"seconds must be more than the warm-up of {WARM_UP:g} s, got {self.seconds:g}")
        if len(self.feet) > MOST_FEET:
            raise SpringfootError(f"give at most {MOST_FEET} feet, got {len(self.feet)}")

    @cached_property
    def feet(self) -> Mapping[str, Mapping[str, Any]]:
        """Return name -> settings of each foot."""
        if not self.foot:
            return PAGE_FEET
        return {name: dict.fromkeys(SIDES_OF[self.side], foot) for name, foot in named_feet(self.foot).items()}

    @property
    def grid(self) -> Grid:
        """Return the walks to record: every combination of mass, speed and foot."""
        return Grid(mass=self.mass, speed=self.speed, foot=list(self.feet))

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(self.mass) * len(self.speed) * len(self.feet) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk at every mass and speed on every foot, and write the page."""
        person = policy_label(self.person)
        walks: list[Walk] = []
        for mass, speed in product(self.mass, self.speed):
            given = {"mass": mass, "speed": speed, "episode_seconds": self.seconds}
            act, settings = person_and_settings(self.person, given)
            feet = list(self.feet.values())
            recordings = record_feet(act, settings, feet, name=person, progress=progress, **self.how)
            walks.extend(map(walk_of, recordings))
        side = self.side if self.foot else "right"
        numbers = [
            dict.fromkeys(FOOT_NUMBERS) if walk.gait is None else numbers_of_feet(walk.gait, side) for walk in walks
        ]
        # (masses, speeds, feet) number of episodes that fell.
        falls = np.array([(walk.recording.fall_reason != "").sum() for walk in walks])
        rows = [
            {"mass_kg": mass, "asked_m_s": speed, "foot": foot, **of_walk, "falls": fell / self.episodes}
            for (mass, speed, foot), of_walk, fell in zip(product(*self.grid), numbers, falls.tolist(), strict=True)
        ]
        texts = [[text_of(of_walk[key], ".2f") for key in PAGE_COLUMNS.values()] for of_walk in numbers]
        episodes = f"{self.episodes} episode{'s' * (self.episodes > 1)} of {self.seconds:g} s"
        words = (
            f"A learned person ({person}) walked {episodes} on each foot, at each mass and speed, on level ground, "
            "1.70 m tall."
        )
        versions = (f"{name} {number}" for name, number in versions_and_commit(PAGE_PACKAGES)["versions"].items())
        made_by = "\n".join([f"command: {without_places(self.command)}", f"seeds from {self.seed} on", *versions])
        page = walks_page(self.grid, walks, list(PAGE_COLUMNS), texts, words, made_by)
        by_foot = falls.reshape(len(self.mass), len(self.speed), -1).T  # (feet, speeds, masses)
        lines = [
            [foot, *(f"{' / '.join(map(str, counts))} of {self.episodes}" for counts in by_speed)]
            for foot, by_speed in zip(self.feet, by_foot, strict=True)
        ]
        masses = " / ".join(f"{mass:g}" for mass in self.mass)
        head = ["foot", *(f"{speed:g} m/s" for speed in self.speed)]
        text = f"{words} Falls at {masses} kg:\n\n{table(head, lines)}"
        return Answer(text=text, files={PAGE_NAME: page, "walks.csv": rows_csv(rows)})
