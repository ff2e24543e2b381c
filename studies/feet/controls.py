"""Hold the price of a walk against conditions with a known answer: the controls that come before patients.

    springfoot study controls
    springfoot study controls learned

With the policy `schedule` one sound person walks and adapts to nothing; a learned person adapts to each condition. A
device that does nothing must cost nothing, and one that takes over a part of a tendon's return must not look
like a large saving. Conditions are compared where all walk equally fast (`walked_speeds`), under both prices.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.envs import BipedSettings
from springfoot.envs.settings import body_of
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import Recording
from springfoot.files.markdown import MISSING, span_text, table, text_of

from ..base.condition_walks import ConditionWalks
from ..base.kept import Kept
from ..base.study import Answer, OnProgress, WalkingStudy
from ..base.walked_speeds import TWO_PRICES, Row, at_walked_speeds, lowest, price_numbers, rows_csv
from .both_feet import both, braced
from .told_apart import gain_words

ASKED_SPEEDS = (0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6)
"""Commanded speeds [m/s]."""
WALKED_SPEEDS = (0.8, 1.0, 1.2)
"""Walked speeds at which prices are compared [m/s]."""
CONTROL_PRICES = (*TWO_PRICES, "net_joint_J_kg_m")
"""Columns of prices in the table of walks; the last is the old price."""
UNCHANGED = "sound"
STIFFEST = "500 N·m/rad, right ankle"
"""The condition with the spring that once "saved" 13 %, when net joint work was the price."""


BOTH_ANKLES = (0.0, 50.0, 100.0, 150.0, 250.0, 350.0, 500.0)
"""Stiffness of springs at both ankles [N m/rad]: a slack device, those of Nuckols & Sawicki (2020), and up to twice
their stiffest."""
DEVICE_KG = 0.45
"""Mass of an exoskeleton at one ankle [kg], spread over the shank: 0.41 to 0.50 kg (Collins et al. 2015, Nature
522:212)."""
_SHANK_RATIO = 1.0 + DEVICE_KG / body_of(BipedSettings()).shank_mass
WITH_MASS = {"shank_mass_ratio": _SHANK_RATIO, "shank_inertia_ratio": _SHANK_RATIO}
"""Numbers of a foot below a shank that bears the device's mass."""


@dataclass(frozen=True, kw_only=True)
class Springs:
    """Springs at both ankles, of rising stiffness."""

    name: str
    """Name of a condition without its stiffness."""
    against: str
    """Condition to compare with."""
    settings: Mapping[float, Mapping[str, Any]]
    """Stiffness [N m/rad] -> settings that differ from the sound walk."""

    @property
    def conditions(self) -> dict[float, str]:
        """Return stiffness [N m/rad] -> name of its condition in `CONTROLS`."""
        return {k: f"{f'{k:g} N·m/rad' if k else 'slack'}, {self.name}" for k in self.settings}


TWO_WAY = Springs(
    name=f"both ankles, {DEVICE_KG:g} kg each",
    against=f"slack, both ankles, {DEVICE_KG:g} kg each",  # like with like: the mass without a spring
    settings={k: both(braced(ankle_stiffness=k) | WITH_MASS) for k in BOTH_ANKLES},
)
ONE_WAY = Springs(
    name=f"both ankles, one-way, {DEVICE_KG:g} kg each",  # from the neutral ankle on, as a clutch does
    against=f"slack, both ankles, one-way, {DEVICE_KG:g} kg each",
    settings={k: both(braced(ankle_stiffness=k, engages="dorsiflexion") | WITH_MASS) for k in BOTH_ANKLES},
)
TRIED_SPRINGS = (
    Springs(
        name="both ankles",
        against=UNCHANGED,
        settings={k: both(braced(ankle_stiffness=k)) for k in BOTH_ANKLES},
    ),
    TWO_WAY,
    ONE_WAY,
)
"""Springs with a best stiffness and a saving that are told."""
CONTROLS: dict[str, Mapping[str, Any]] = {
    UNCHANGED: {},
    **{springs.conditions[k]: given for springs in TRIED_SPRINGS for k, given in springs.settings.items()},
    STIFFEST: {"right_foot": braced(ankle_stiffness=500.0)},
    "feet of twice the mass": both({"kind": "intact", "foot_mass_ratio": 2.0, "foot_inertia_ratio": 2.0}),
    "20 % of body weight on the back": {"carried_ratio": 0.2},
    "slope +2°": {"slope_deg": 2.0},
    "slope −2°": {"slope_deg": -2.0},
    "both calves of 25 %": both({"kind": "weak", "strength": 0.25}),
    "right toe locked": {"right_foot": "rigid_toe"},
    "rigid right foot": {"right_foot": "rigid"},
    "passive right foot, 400 N·m/rad": {"right_foot": {"kind": "passive", "ankle_stiffness": 400.0}},
}
"""Name of a condition -> settings that differ from the sound walk."""


@dataclass(frozen=True, kw_only=True)
class Controls(WalkingStudy):
    """Walk a sound person under conditions of known price, and compare prices at equal walked speeds."""

    episodes: int = 5
    """Episodes of each condition and commanded speed."""
    seconds: float = 12.0
    """Length of each episode."""
    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = ("schedule",)
    """Policies to walk with; the schedule of stiffness reacts to nothing."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File in which the numbers of each walk are kept, to go on after a stop."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 6.0, "keep": None}

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(self.policies) * len(CONTROLS) * len(self._commanded_speeds()) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with every policy under every condition and commanded speed; compare where all walk equally fast."""
        asked = [
            (name, speed, {**given, "speed": speed})
            for name, given in CONTROLS.items()
            for speed in self._commanded_speeds()
        ]
        walks = [
            {"policy": policy, "condition": name, "speed_m_s": speed, **numbers}
            for policy in self.policies
            for (name, speed, _), numbers in zip(
                asked, self.walk(policy, [given for _, _, given in asked], progress), strict=True
            )
        ]
        even = at_walked_speeds(walks, ("policy", "condition"), (0.9,) if self.quick else WALKED_SPEEDS)
        best = best_springs(even)
        files = {"walks.csv": rows_csv(walks), "equal_speeds.csv": rows_csv(even), "best_springs.csv": rows_csv(best)}
        how = (
            f"{self.what_ran} of each condition and commanded speed; policies {', '.join(self.policies)}. "
            f"{gain_words('intact', 'passive', 'weak')}"
        )
        return Answer(text=f"{controls_table(even)}\n\n{best_table(best)}\n\n{how}", files=files)

    def walk(
        self, policy: str, conditions: Sequence[Mapping[str, Any]], progress: OnProgress = lambda seconds: None
    ) -> list[dict[str, float | None]]:
        """Return the numbers of `_control_numbers` for a policy's walk under each of `conditions`; those in the file
        `keep` are not walked again."""
        walks = ConditionWalks(study=self, measured=_control_numbers, names=CONTROL_PRICES, kept=Kept(self.keep))
        return walks.walk(policy, conditions, progress)

    def _commanded_speeds(self) -> Sequence[float]:
        """Return the commanded speeds [m/s]."""
        return (0.8, 1.0) if self.quick else ASKED_SPEEDS


def _control_numbers(recording: Recording) -> dict[str, float | None]:
    """Return the share of episodes that fall, the walked speed [m/s] and the prices `CONTROL_PRICES` of a recording;
    None where they cannot be measured."""
    metrics = measure(recording).metrics
    return price_numbers(metrics) | {CONTROL_PRICES[-1]: metrics["effort"]["net_joint_J_kg_m"]}


def _rows_by_walk(even: Sequence[Row]) -> dict[tuple[str, str, float], Row]:
    """Return (policy, condition, walked speed [m/s]) -> its row, from rows of `at_walked_speeds`."""
    return {(row["policy"], row["condition"], row["speed_m_s"]): row for row in even}


def controls_table(even: Sequence[Row]) -> str:
    """Return the Markdown table of prices at equal walked speeds, with their differences from the sound walk.

    `even` are rows of `at_walked_speeds`. Of several policies it has the means, and of the differences the range.
    """
    prices = _rows_by_walk(even)
    policies, conditions, speeds = (list(dict.fromkeys(names)) for names in zip(*prices, strict=True))
    lines = []
    for name in conditions:
        walks = [[(prices[who, name, at], prices[who, UNCHANGED, at]) for who in policies] for at in speeds]
        lines.append([name, *map(_cell, walks)])
    head = ["", *(f"walking {speed:g} m/s" for speed in speeds)]
    return f"{table(head, lines)}\n\nFibre work [J/kg/m] / all of effort [-], in brackets against the sound walk."


def _cell(pairs: Sequence[tuple[Row, Row]]) -> str:
    """Return both prices of a condition, means over policies, with their differences from the sound walk.

    `pairs` has for each policy its row under the condition and its row of the sound walk. A dash if a price is None.
    """
    if any(row[price] is None for pair in pairs for row in pair for price in TWO_PRICES):
        return MISSING
    shown = []
    differences = []
    for price in TWO_PRICES:
        changes = [own[price] / sound[price] - 1.0 for own, sound in pairs]
        shown.append(text_of(float(np.mean([own[price] for own, _ in pairs])), ".2f"))
        differences.append(span_text(changes, "+.0%"))
    return f"{' / '.join(shown)} ({' / '.join(differences)})"


def best_springs(even: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the best stiffness [N m/rad] of `TRIED_SPRINGS` and its saving, for each policy, price and walked speed.

    The best stiffness is that of `lowest`. The saving is a share of the price under the condition `Springs.against`,
    > 0 if the spring is cheaper. None where no price is known.
    """
    prices = _rows_by_walk(even)
    policies, _, speeds = (list(dict.fromkeys(names)) for names in zip(*prices, strict=True))
    rows = []
    for who, springs, at, price in product(policies, TRIED_SPRINGS, speeds, TWO_PRICES):
        without = prices[who, springs.against, at][price]
        walked = {k: prices[who, name, at][price] for k, name in springs.conditions.items()}
        priced = {k: value for k, value in walked.items() if value is not None}
        best, least = lowest(priced) if priced else (None, None)
        saving = None if least is None or without is None else 1.0 - least / without
        named = {"policy": who, "springs": springs.name, "speed_m_s": at, "price": price}
        rows.append({**named, "best_N_m_rad": best, "saving": saving})
    return rows


def best_table(best: Sequence[Row]) -> str:
    """Return the Markdown table of the best springs and their savings of fibre work; of several policies the ranges.

    `best` are rows of `best_springs`.
    """
    speeds = list(dict.fromkeys(row["speed_m_s"] for row in best))
    lines = []
    for springs in TRIED_SPRINGS:
        line = [springs.name, springs.against]
        for speed in speeds:
            rows = [
                row
                for row in best
                if (row["springs"], row["speed_m_s"], row["price"]) == (springs.name, speed, TWO_PRICES[0])
            ]
            line.append(_span(rows))
        lines.append(line)
    return table(["best spring: N·m/rad, saving", "against", *(f"walking {speed:g} m/s" for speed in speeds)], lines)


def _span(rows: Sequence[Row]) -> str:
    """Return best stiffness [N m/rad] and saving as a cell, from `rows` of `best_springs`, one for each policy: the
    least and the largest of each, a dash if a saving is None."""
    if any(row["saving"] is None for row in rows):
        return MISSING
    return ", ".join(
        span_text([row[column] for row in rows], form) for column, form in (("best_N_m_rad", ".0f"), ("saving", ".0%"))
    )
