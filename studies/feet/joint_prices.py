"""Show which joint pays and which saves: fibre work of each joint with springs, and without an ankle.

    springfoot study joint-prices learned learned-2 learned-3 learned-4 learned-5

Each comparison stands for a possible reason: a spring that acts one way or both ways, with damping or without, with
stiffness that the person may tune to it or not; a missing ankle with less damping, or on uneven ground.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.envs.physics import JOINTS, SIDES
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import Recording
from springfoot.files.markdown import MISSING, table

from ..base.adapting_persons import person_and_settings, require_each_once
from ..base.condition_walks import ConditionWalks
from ..base.kept import Kept
from ..base.study import Answer, OnProgress, WalkingStudy
from ..base.walked_speeds import TWO_PRICES, Row, price_numbers, rows_csv
from .both_feet import both, braced
from .controls import ONE_WAY, TWO_WAY, WITH_MASS

BY_SCHEDULE = {"stiffness_by": "schedule"}
"""Setting with which the fixed schedule sets the stiffness, so that nobody tunes it to a device."""
UNEVEN = {"unevenness_m": 0.005}
"""Setting of uneven ground."""
UNDAMPED = 0.0
"""Damping time of springs that lose nothing [s], as one-way ones are."""
LITTLE_DAMPED = 0.005
"""Damping time of a foot that gives back some four fifths of what it takes [s]; chosen. By default springs have the
damping of muscles, with which it gives back half."""


def _passive(**numbers: float) -> dict[str, Any]:
    """Return the settings of a walk on a passive right foot of 400 N m/rad and further `numbers`."""
    return {"right_foot": {"kind": "passive", "ankle_stiffness": 400.0, **numbers}}


JOINT_CONDITIONS: dict[str, Mapping[str, Any]] = {
    "sound": {},
    "sound, ground uneven by 5 mm": UNEVEN,
    "slack springs": ONE_WAY.settings[0.0],
    "slack springs, scheduled K": {**ONE_WAY.settings[0.0], **BY_SCHEDULE},
    "one-way springs, 50 N·m/rad": ONE_WAY.settings[50.0],
    "one-way springs, 150 N·m/rad": ONE_WAY.settings[150.0],
    "150 N·m/rad, scheduled K": {**ONE_WAY.settings[150.0], **BY_SCHEDULE},
    "two-way springs, 150 N·m/rad": TWO_WAY.settings[150.0],
    "two-way springs without damping": both(
        braced(ankle_stiffness=150.0, damping_time=UNDAMPED) | WITH_MASS,
    ),
    "passive right foot, 400 N·m/rad": _passive(),
    "passive, damping of 5 ms": _passive(damping_time=LITTLE_DAMPED),
    "passive, ground uneven by 5 mm": _passive() | UNEVEN,
    "rigid right foot": {"right_foot": "rigid"},
}
"""Name of a condition -> settings that differ from the sound walk."""
JOINT_COMPARISONS = {
    "one-way springs, 50 N·m/rad": "slack springs",
    "one-way springs, 150 N·m/rad": "slack springs",
    "150 N·m/rad, scheduled K": "slack springs, scheduled K",
    "two-way springs, 150 N·m/rad": "slack springs",
    "two-way springs without damping": "slack springs",
    "passive right foot, 400 N·m/rad": "sound",
    "passive, damping of 5 ms": "sound",
    "passive, ground uneven by 5 mm": "sound, ground uneven by 5 mm",
    "rigid right foot": "sound",
}
"""Condition -> the one that it is compared with."""
JOINT_COLUMNS = (*(f"{side}_{joint}_J_kg_m" for side in SIDES for joint in JOINTS), "ankle_activation")
"""Numbers of a walk beside its prices: fibre work of each joint, and activation of both ankles."""
SHOWN_TOGETHER = {
    "hips": ("left_hip", "right_hip"),
    "knees": ("left_knee", "right_knee"),
    "left ankle": ("left_ankle",),
    "right ankle": ("right_ankle",),
    "toes": ("left_toe", "right_toe"),
}
"""Column of the table -> joints with fibre work that it sums."""


@dataclass(frozen=True, kw_only=True)
class JointPrices(WalkingStudy):
    """Walk learned persons with springs and without an ankle, and tell the price of each joint."""

    persons: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="PERSON ...")] = ("learned",)
    """Policies that move the person: run folders, files, or those of the package, such as `learned`."""
    episodes: int = 5
    """Episodes of each person and condition."""
    seconds: float = 12.0
    """Length of each episode."""
    speed: float = 1.2
    """Commanded speed [m/s]."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 5.0}

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(self.persons) * len(JOINT_CONDITIONS) * self.episodes * self.seconds

    def check(self) -> None:
        """Refuse counts out of range, and a person that is given twice."""
        super().check()
        require_each_once(self.persons)

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with every person under every condition, and compare joint by joint."""
        walks = ConditionWalks(
            study=self, measured=joint_numbers, names=JOINT_COLUMNS, kept=Kept(None), find=person_and_settings
        )
        asked = [{**given, "speed": self.speed} for given in JOINT_CONDITIONS.values()]
        rows = [
            {"person": person, "condition": name, **numbers}
            for person in self.persons
            for name, numbers in zip(JOINT_CONDITIONS, walks.walk(person, asked, progress), strict=True)
        ]
        text = (
            f"{joint_table(rows)}\n\nChanges of fibre work [J/kg/m], of both prices and of the ankles' activation: "
            "mean over persons, least and largest in brackets. A dash: somebody falls. "
            f"{self.what_ran} of each, commanded {self.speed:g} m/s."
        )
        return Answer(text=text, files={"joint_prices.csv": rows_csv(rows)})


def joint_numbers(recording: Recording) -> dict[str, float | None]:
    """Return the numbers of `price_numbers` and `JOINT_COLUMNS` of a recording; None where they cannot be measured."""
    metrics = measure(recording).metrics
    effort = metrics["effort"]
    works = [effort["per_leg"][side]["per_joint"][joint]["fibre_J_kg_m"] for side in SIDES for joint in JOINTS]
    activation = effort["per_joint"]["ankle"]["activation"]
    return price_numbers(metrics) | dict(zip(JOINT_COLUMNS, [*works, activation], strict=True))


def joint_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table of the changes of `JOINT_COMPARISONS`, from a row for each person and condition."""
    persons = list(dict.fromkeys(row["person"] for row in rows))
    by_walk = {(row["person"], row["condition"]): row for row in rows}
    shares = (*TWO_PRICES, JOINT_COLUMNS[-1])
    lines = []
    for name, against in JOINT_COMPARISONS.items():
        pairs = [(by_walk[person, name], by_walk[person, against]) for person in persons]
        line = [f"{name}, against {against}"]
        if any(row["falls"] for pair in pairs for row in pair):
            lines.append([*line, *[MISSING] * (len(SHOWN_TOGETHER) + len(shares))])
            continue
        for joints in SHOWN_TOGETHER.values():
            line.append(_ends([_work(own, joints) - _work(other, joints) for own, other in pairs], "+.2f"))
        line += [_ends([own[price] / other[price] - 1.0 for own, other in pairs], "+.0%") for price in shares]
        lines.append(line)
    return table(["", *SHOWN_TOGETHER, "all fibre work", "effort", "activation of ankles"], lines)


def _work(row: Row, joints: Sequence[str]) -> float:
    """Return the fibre work of some joints together, such as "left_hip" [J/kg/m]."""
    return sum(row[f"{joint}_J_kg_m"] for joint in joints)


def _ends(changes: Sequence[float], form: str) -> str:
    """Return the mean of `changes`, and in brackets the least and the largest of several, in the format `form`."""
    if len(changes) < 2:
        return format(changes[0], form)
    return f"{np.mean(changes):{form}} ({min(changes):{form}} to {max(changes):{form}})"
