"""Walk learned persons on a map of right feet, told the truth and told that the foot is sound, and on ankles of one
stiffness.

    springfoot study foot-map learned

The difference between the two walks on a foot is the worth of knowing it; the stiffness of the moment stays true in
both. With ankles of one stiffness the person does not set the stiffness, and is told so.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.agents.policies import PolicyFunction, find_policy
from springfoot.arrays import NDArray
from springfoot.envs import BipedSettings
from springfoot.envs.physics import SOUND
from springfoot.envs.settings import body_of
from springfoot.envs.task import PERSON_OBSERVATION, WORN, worn_entries
from springfoot.errors import require_number
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record, record_feet
from springfoot.files.markdown import MISSING, table, text_of

from ..base.adapting_persons import person_and_settings
from ..base.study import Answer, OnProgress, WalkingStudy
from ..base.walked_speeds import Row, rows_csv
from .foot_numbers import numbers_of_feet
from .told_apart import gain_words

RightFoot = str | dict[str, Any]
PASSIVE = [
    {"kind": "passive", "ankle_stiffness": k, "ankle_deg": rest, "toe_stiffness": toe}
    for k, rest, toe in product((150.0, 250.0, 400.0, 600.0, 1000.0, 1500.0), (0.0, 4.0, 8.0), (20.0, 60.0))
]
"""Passive feet: six ankles, three rest angles, two toes."""
MAPPED_FEET: dict[str, list[RightFoot]] = {
    "sound": ["intact"],
    "calf of 25 %": [{"kind": "weak", "strength": 0.25}],
    "sound, braced by 200 N·m/rad": [{"kind": "intact", "orthosis": {"ankle_stiffness": 200.0}}],
    "36 passive feet": list(PASSIVE),
    "adaptive": ["adaptive"],
    "rigid": ["rigid"],
    "toe locked": ["rigid_toe"],
    "one piece": ["no_toe"],
    "drop foot": ["drop"],
    "drop foot, braced by 10 N·m/rad at 5°": [
        {"kind": "drop", "orthosis": {"ankle_stiffness": 10.0, "ankle_deg": 5.0}},
    ],
}
"""Name of a group -> its right feet."""
FLAT = (50.0, 100.0, 200.0, 300.0, 400.0, 600.0)
"""Stiffness of both ankles, in stance and swing [N m/rad]."""
FLAT_TOE = 40.0
"""Stiffness of both toes with it [N m/rad], that of the baseline `constant`."""
SOUND_FOOT = "a sound foot"
TOLD = ("the truth", SOUND_FOOT)
"""Words on the foot that the person is told."""


def told_sound(act: PolicyFunction, settings: BipedSettings) -> PolicyFunction:
    """Return a policy that acts as `act` does if the observation's entries on the worn feet are those of sound feet."""
    names = [entry.name for entry in PERSON_OBSERVATION]
    first = names.index("muscles_ankle_left")
    sound = worn_entries(body_of(settings), SOUND)

    def acting(observation: NDArray) -> NDArray:
        """Return the actions of `act` for observations (..., entries) that say "both feet are sound"."""
        changed = observation.copy()
        changed[..., first : first + WORN] = sound
        return act(changed)

    return acting


@dataclass(frozen=True, kw_only=True)
class FootMap(WalkingStudy):
    """Walk learned persons on a map of feet, told the truth and told that the foot is sound."""

    persons: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="PERSON ...")] = ("learned",)
    """Policies that move the person: run folders, files, or those of the package, such as `learned`."""
    speed: float = 1.2
    """Commanded speed [m/s]."""

    QUICK: ClassVar = {"episodes": 1, "seconds": 6.0}

    def check(self) -> None:
        """Refuse counts and speeds out of range."""
        super().check()
        require_number("speed", self.speed, 0.0, 3.0, above=True, unit="m/s")

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        feet = sum(map(len, MAPPED_FEET.values()))
        return len(self.persons) * (len(TOLD) * feet + len(FLAT)) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every person on every foot of the map, and with ankles of one stiffness."""
        rows = [row for person in self.persons for row in self._foot_rows(person, progress)]
        flat = [row for person in self.persons for row in self._flat_rows(person, progress)]
        how = f"{self.what_ran} of each, commanded {self.speed:g} m/s. {gain_words('intact', 'passive', 'weak')}"
        text = f"{map_table(rows)}\n\n{flat_table(flat)}\n\n{how}"
        return Answer(text=text, files={"feet.csv": rows_csv(rows), "flat.csv": rows_csv(flat)})

    def _foot_rows(self, person: str, progress: OnProgress) -> list[dict[str, Any]]:
        """Walk a person on every foot of the map, with the true observation and with that of sound feet; return a row
        for each walk."""
        act, settings = person_and_settings(person, {"speed": self.speed, "episode_seconds": self.seconds})
        groups = [(name, foot) for name, feet in MAPPED_FEET.items() for foot in feet]
        rows = []
        for told, acting in zip(TOLD, (act, told_sound(act, settings)), strict=True):
            feet = [{"right_foot": foot} for _, foot in groups]
            recordings = record_feet(acting, settings, feet, name=person, progress=progress, **self.how)
            for (name, foot), recording in zip(groups, recordings, strict=True):
                given = {} if isinstance(foot, str) else foot
                numbers = {key: given.get(key) for key in ("ankle_stiffness", "ankle_deg", "toe_stiffness")}
                row = {"person": person, "told": told, "foot": name, **numbers, "episodes": self.episodes}
                rows.append(row | numbers_of_feet(measure(recording)))
        return rows

    def _flat_rows(self, person: str, progress: OnProgress) -> list[dict[str, Any]]:
        """Walk a person with both ankles at each stiffness of `FLAT` over the whole stride; return a row for each."""
        given = {"person": str(find_policy(person)), "speed": self.speed, "episode_seconds": self.seconds}
        rows = []
        for stiffness in FLAT:
            name = f"constant:{stiffness:g},{FLAT_TOE:g}"
            act, settings = policy_and_settings(name, given)
            gait = measure(record(act, settings, name=name, progress=progress, **self.how))
            row = {"person": person, "ankle_N_m_rad": stiffness, "episodes": self.episodes}
            rows.append(row | numbers_of_feet(gait))
        return rows


def map_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table of groups of feet, `rows` being those of `FootMap`.

    Falls are of all episodes of a group, with the true observation / with that of sound feet. Speed and prices are
    means over the feet without a fall with the true observation; the last column is the change of fibre work with the
    observation of sound feet, on the feet without a fall in either walk.
    """
    head = ["right foot", "falls, told the truth / a sound foot", "m/s", "fibre work J/kg/m", "effort"]
    lines = []
    for name in dict.fromkeys(row["foot"] for row in rows):
        true, sound = ([row for row in rows if (row["foot"], row["told"]) == (name, told)] for told in TOLD)
        falls = " / ".join(f"{_falls(group)} of {sum(row['episodes'] for row in group)}" for group in (true, sound))
        walked = [row for row in true if not row["falls"]]
        compared = [pair for pair in zip(true, sound, strict=True) if not any(row["falls"] for row in pair)]
        line = [name, falls, *(_mean(walked, key) for key in ("speed_m_s", "fibre_J_kg_m", "effort"))]
        lines.append([*line, _fibre_work_change(compared)])
    return table([*head, "told a sound foot: fibre work"], lines)


def _fibre_work_change(compared: Sequence[tuple[Row, Row]]) -> str:
    """Return the mean change of fibre work from the first to the second row of each pair, and the number of pairs;
    pairs without fibre work in the second row are left out."""
    changes = [
        second["fibre_J_kg_m"] / first["fibre_J_kg_m"] - 1.0 for first, second in compared if second["fibre_J_kg_m"]
    ]
    return f"{np.mean(changes):+.0%} (feet: {len(changes)})" if changes else MISSING


def _falls(rows: Sequence[Row]) -> int:
    """Return the number of episodes that fall, over all `rows`."""
    return round(sum(row["falls"] * row["episodes"] for row in rows))


def _mean(rows: Sequence[Row], key: str) -> str:
    """Return the mean of the column `key` over `rows`, without those in which it is None; a dash if all are."""
    values = [row[key] for row in rows if row[key] is not None]
    return text_of(float(np.mean(values)), ".2f") if values else MISSING


def flat_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table of walks with ankles of one stiffness, from rows of `FootMap._flat_rows`.

    Falls are of all persons' episodes; speed and prices are means over the persons without a fall.
    """
    lines = []
    for stiffness in dict.fromkeys(row["ankle_N_m_rad"] for row in rows):
        here = [row for row in rows if row["ankle_N_m_rad"] == stiffness]
        falls = f"{_falls(here)} of {sum(row['episodes'] for row in here)}"
        walks = [row for row in here if not row["falls"]]
        keys = ("speed_m_s", "fibre_J_kg_m", "effort")
        lines.append([f"{stiffness:g}", falls, *(_mean(walks, key) for key in keys)])
    return table(["both ankles, N·m/rad", "falls", "m/s", "fibre work J/kg/m", "effort"], lines)
