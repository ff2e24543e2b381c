"""Springs beside the right ankle: which helps a weak calf, and which a drop foot.

    springfoot study orthosis

Nobody adapts here: legs and both feet's stiffness are those of sound feet (`pretrained`), so that all that changes is
the muscle and the spring. The stiffness of an orthosis is in N m/deg, as Waterval et al. (2019) measured them. A weak
calf slows the walk, each spring by another bit, and what a metre takes depends on speed: everybody is asked for several
speeds, and energy is compared where they walk equally fast. Last, two people who did adapt, and have no orthosis.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.envs.physics import ANKLE, RIGHT, Spring, damping_times
from springfoot.envs.settings import ADAPTED, body_of, committed_feet, without_person
from springfoot.errors import require_count
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import TICK, WARM_UP, Recording, prepare, record_feet
from springfoot.files.writing import csv_text

from ..base.kept import Kept
from ..base.study import Answer, OnProgress, WalkingStudy
from .foot_walks import NAMES, SCHEDULE, UNSEARCHED, numbers_of, walked
from .orthosis_page import at_walked_speeds, best_springs, draw_drop, draw_weak, drop_text, people_text, weak_text

PER_DEG = 180.0 / np.pi
"""N m/rad in 1 N m/deg."""
WEAK_SPRINGS = (0.0, 0.9, 1.8, 2.7, 3.6, 4.9, 6.2, 7.4, 8.7)
"""Stiffness of an orthosis for a weak calf [N m/deg]; Waterval et al. (2019) tried 0.9 to 8.7."""
STRENGTHS = (0.2, 0.25, 0.3)
"""Strength of the calf over the most that the model's sound one can give; a sound walk at 1.2 m/s asks for 0.4."""
MASSES = (50.0, 63.0, 80.0)
"""[kg] at 1.70 m."""
ASKED_SPEEDS = (0.8, 1.0, 1.2, 1.4, 1.6, 1.8)
"""For which a walk with a weak calf is asked [m/s]."""
WALKED_SPEEDS = (0.8, 1.1, 1.4)
"""At which, walked, springs are compared [m/s]; between two speeds that are walked energy is linear."""
DROP_SPEEDS = (0.8, 1.2, 1.6)
"""For which a walk with a drop foot is asked [m/s]."""
WHO_ADAPTED = ("weak, 20 %", "drop")
"""Names of the committed people who have adapted to such a foot."""
SWING_SPRINGS = (0.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0, 40.0)
"""Stiffness of an orthosis for a drop foot [N m/rad]."""
SWING_RESTS = (-5.0, 0.0, 5.0, 10.0)
"""Its rest angle, dorsiflexion positive [deg]."""
EFFICIENCY = {"positive": 0.25, "negative": 1.2}
"""Mechanical work of muscles over the energy it takes (Margaria 1968, Int. Z. angew. Physiol. 25:339)."""


@dataclass(frozen=True, kw_only=True)
class Orthosis(WalkingStudy):
    """Walk with a weak calf, or a drop foot, and an orthosis of every stiffness."""

    episodes: int = 5
    """Episodes of each spring and speed with a weak calf."""
    episodes_drop: int = 10
    """The same with a drop foot, and as many pushed."""
    seconds: float = 12.0
    """Length of each."""
    policy: str = "pretrained"
    """Who sets the stiffness of both feet."""
    push_newton: float = 150.0
    """Pushes of the walks with a drop foot [N]."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File in which the numbers of each body, speed and strength are kept, to go on after a stop."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "episodes_drop": 1, "seconds": 6.0, "keep": None}

    def check(self) -> None:
        """Refuse counts out of range."""
        super().check()
        require_count("episodes_drop", self.episodes_drop)

    @property
    def total(self) -> float:
        """Simulated seconds without falls."""
        weak = len(list(self._weak_cells())) * len(WEAK_SPRINGS) * self.episodes
        drop = 2 * len(self._drop_speeds()) * len(SWING_SPRINGS) * len(SWING_RESTS) * self.episodes_drop
        return (weak + drop + 4 * len(self._people()) * self.episodes_drop) * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with every spring."""
        kept = Kept(self.keep)
        dropping = replace(self, episodes=self.episodes_drop)
        elsewhere = replace(dropping, seed=UNSEARCHED)
        weak = self._weak(kept, progress)
        drop = dropping._drop(kept, progress)
        even = at_walked_speeds(weak, (1.1,) if self.quick else WALKED_SPEEDS)
        best = best_springs(even)
        as_asked = best_springs([row for row in weak if row["speed_m_s"] in DROP_SPEEDS])
        files = {
            "weak.csv": _csv(weak),
            "best.csv": _csv(best),
            "best-as-asked.csv": _csv(as_asked),
            "drop.csv": _csv(drop),
            "weak.png": partial(draw_weak, rows=even, best=best),
            "drop.png": partial(draw_drop, rows=drop),
        }
        text = {
            "WEAK": weak_text(weak, best, as_asked, self.what_ran),
            "DROP": drop_text(drop, self.episodes_drop, dropping.what_ran, self.push_newton),
            "ADAPTED": people_text(elsewhere._adapted(kept, progress), elsewhere.what_ran, self.push_newton),
        }
        text = {name: told for name, told in text.items() if told}
        return Answer(text="\n\n".join(text.values()), files=files)

    def _weak(self, kept: Kept, progress: OnProgress) -> list[dict[str, Any]]:
        rows: list[dict[str, Any]] = []
        orthoses = [{"ankle_stiffness": round(spring * PER_DEG, 3), "ankle_deg": 0.0} for spring in WEAK_SPRINGS]
        for mass, speed, strength in self._weak_cells():
            where = {"mass_kg": mass, "speed_m_s": speed, "strength": strength}
            feet = [{"kind": "weak", "strength": strength, "orthosis": each} for each in orthoses]
            cell = self._walk(kept, {"mass": mass, "speed": speed}, feet, progress)
            pairs = zip(WEAK_SPRINGS, cell, strict=True)
            rows += [{**where, "spring_Nm_deg": spring, **_renamed(own)} for spring, own in pairs]
        return rows

    def _drop(self, kept: Kept, progress: OnProgress) -> list[dict[str, Any]]:
        rows = []
        springs = list(product(SWING_SPRINGS, SWING_RESTS))
        feet = [{"kind": "drop", "orthosis": {"ankle_stiffness": k, "ankle_deg": rest}} for k, rest in springs]
        for speed in self._drop_speeds():
            cells = [
                self._walk(kept, {"speed": speed, "push_newton": push}, feet, progress)
                for push in (0.0, self.push_newton)
            ]
            for (stiffness, rest), own, pushed in zip(springs, *cells, strict=True):
                line = {"speed_m_s": speed, "spring_Nm_rad": stiffness, "rest_deg": rest, **_renamed(own)}
                rows.append({**line, "falls_pushed": pushed["falls"]})
        return rows

    def _adapted(self, kept: Kept, progress: OnProgress) -> list[dict[str, Any]]:
        """Walk on the feet of `WHO_ADAPTED`, without and with a person who has adapted."""
        rows = []
        for name in self._people():
            bare = without_person(committed_feet()[name])
            walks = (
                ("not adapted", self.policy, bare, {}),
                ("adapted", SCHEDULE[0], {**bare, ADAPTED: name}, SCHEDULE[1]),
            )
            for person, policy, foot, given in walks:
                given = {**given, "right_foot": foot, "episode_seconds": self.seconds}
                key = [policy, given, committed_feet()[name], {**self.how, "threads": 0}, self.push_newton, NAMES]
                own = kept.get(
                    key, lambda p=policy, g=given: walked(p, g, self.push_newton, progress=progress, **self.how)
                )
                rows.append({"foot": name, "person": person, **own})
        return rows

    def _weak_cells(self) -> Iterator[tuple[float, float, float]]:
        return (
            iter([(63.0, asked, 0.25) for asked in (1.2, 1.4)])
            if self.quick
            else product(MASSES, ASKED_SPEEDS, STRENGTHS)
        )

    def _drop_speeds(self) -> Sequence[float]:
        return (1.2,) if self.quick else DROP_SPEEDS

    def _people(self) -> list[str]:
        return [name for name in WHO_ADAPTED if name in committed_feet()]

    def _walk(
        self, kept: Kept, given: Mapping[str, Any], feet: Sequence[dict[str, Any]], progress: OnProgress
    ) -> list[dict[str, Any]]:
        """Return the numbers of each of the right `feet`, the same episodes for each."""

        def make() -> dict[str, Any]:
            acting, settings = prepare(self.policy, {**given, "episode_seconds": self.seconds})
            recordings = record_feet(acting, settings, feet, name=self.policy, progress=progress, **self.how)
            return {
                "walks": [{**numbers_of(measure(each)), "energy_J_kg_m": muscle_energy(each)} for each in recordings]
            }

        how = {**self.how, "threads": 0, "policy": self.policy, "seconds": self.seconds}
        return kept.get([how, given, feet], make)["walks"]


def muscle_energy(recording: Recording) -> float | None:
    """Energy that muscles take [J/kg/m] after `WARM_UP`: work of every joint without the orthosis's, by `EFFICIENCY`.

    The right ankle's is of the mean torque and the change of angle of each 10 ms; None without progress.
    """
    settings = recording.settings
    first = round(WARM_UP / TICK)
    orthosis = settings.right_foot.foot.ankle.orthosis or Spring()
    beta = damping_times(body_of(settings))[ANKLE] if orthosis.damping_time is None else orthosis.damping_time
    energy = way = 0.0
    for episode, end in enumerate(recording.ticks):
        if end <= first + 1:
            continue
        work = recording.series["joint_work"][episode, first + 1 : end].astype(float)
        angle = recording.series["angle"][episode, first:end, RIGHT, ANKLE].astype(float)
        torque = recording.series["joint_torque"][episode, first + 1 : end, RIGHT, ANKLE].astype(float)
        change = np.diff(angle)
        middle = 0.5 * (angle[1:] + angle[:-1])
        spring = orthosis.stiffness * (orthosis.rest - middle - beta * change / TICK)
        muscle = (torque - spring) * change
        work[:, RIGHT, ANKLE] = np.stack([np.maximum(muscle, 0.0), np.minimum(muscle, 0.0)], -1)
        up = work[..., 0].sum()
        down = -work[..., 1].sum()
        energy += up / EFFICIENCY["positive"] + down / EFFICIENCY["negative"]
        way += float(recording.series["com"][episode, end - 1, 0] - recording.series["com"][episode, first, 0])
    return energy / (body_of(settings).mass * way) if way > 0.5 else None


def _renamed(numbers: Mapping[str, Any]) -> dict[str, Any]:
    return {("walked_m_s" if key == "speed_m_s" else key): value for key, value in numbers.items()}


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    return csv_text(list(rows[0]), [list(row.values()) for row in rows])
