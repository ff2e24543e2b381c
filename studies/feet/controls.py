"""Hold the price of a walk against conditions whose answer is known: the controls that come before patients.

    springfoot study controls

One sound person walks whom nobody adapts: legs and the schedule of stiffness stay. A device that does nothing must cost
nothing, and one that takes over a part of what a tendon gives back must not look like a saving. Conditions are compared
where all walk equally fast (`walked_speeds`), under both prices.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.files.markdown import MISSING, table, text_of

from ..base.study import Answer, OnProgress, WalkingStudy
from .walked_speeds import TWO_PRICES, Row, at_walked_speeds, rows_csv

ASKED_SPEEDS = (0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6)
"""Commanded speeds [m/s]."""
WALKED_SPEEDS = (0.8, 1.0, 1.2)
"""Walked speeds at which prices are compared [m/s]."""
UNCHANGED = "sound"
SLACK = "slack device, both ankles"
STIFFEST = "spring 500 N·m/rad, right ankle"
"""The condition whose spring once "saved" 13 %, when net joint work was the price."""


def _brace(**numbers: Any) -> dict[str, Any]:
    """Return a sound foot with an orthosis at its ankle."""
    return {"kind": "intact", "orthosis": numbers}


def _both(foot: dict[str, Any]) -> dict[str, Any]:
    """Return the setting of both feet."""
    return {"left_foot": foot, "right_foot": foot}


BOTH_ANKLES = (50.0, 100.0, 150.0, 250.0, 500.0)
"""Stiffness of springs at both ankles [N m/rad]: those of Nuckols & Sawicki (2020), and twice their stiffest."""
CONTROLS: dict[str, dict[str, Any]] = {
    UNCHANGED: {},
    SLACK: _both(_brace(ankle_stiffness=0.0)),
    **{f"spring {k:g} N·m/rad, both ankles": _both(_brace(ankle_stiffness=k)) for k in BOTH_ANKLES},
    **{
        f"one-way spring {k:g} N·m/rad, both ankles": _both(
            _brace(ankle_stiffness=k, ankle_deg=-5.73, engages="dorsiflexion")
        )
        for k in BOTH_ANKLES[:4]
    },
    STIFFEST: {"right_foot": _brace(ankle_stiffness=500.0)},
    "feet of twice the mass": _both({"kind": "intact", "foot_mass_ratio": 2.0, "foot_inertia_ratio": 2.0}),
    "20 % of body weight on the back": {"carried_ratio": 0.2},
    "slope +2°": {"slope_deg": 2.0},
    "slope −2°": {"slope_deg": -2.0},
}
"""Name of a condition -> settings that differ from the sound walk."""


@dataclass(frozen=True, kw_only=True)
class Controls(WalkingStudy):
    """Walk a sound person under conditions whose price is known, and compare prices at equal walked speeds."""

    episodes: int = 5
    """Episodes of each condition and commanded speed."""
    seconds: float = 12.0
    """Length of each episode."""
    policy: str = "schedule"
    """Policy that sets the stiffness of both feet; the schedule reacts to nothing."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 6.0}

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(CONTROLS) * len(self._asked()) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk under every condition."""
        walks = [
            {"condition": name, "speed_m_s": speed, **self.walk({**given, "speed": speed}, progress)}
            for name, given in CONTROLS.items()
            for speed in self._asked()
        ]
        even = at_walked_speeds(walks, ("condition",), (0.9,) if self.quick else WALKED_SPEEDS)
        files = {"walks.csv": rows_csv(walks), "equal_speeds.csv": rows_csv(even)}
        return Answer(
            text=f"{controls_table(even)}\n\n{self.what_ran} of each condition and commanded speed.", files=files
        )

    def walk(self, given: Mapping[str, Any], progress: OnProgress = lambda seconds: None) -> dict[str, float | None]:
        """Return the share of episodes that fall, walked speed and prices of one condition at one commanded speed; None
        where they cannot be measured."""
        act, settings = policy_and_settings(self.policy, {**given, "episode_seconds": self.seconds})
        metrics = measure(record(act, settings, name=self.policy, progress=progress, **self.how)).metrics
        effort = metrics["effort"]
        return {
            "falls": metrics["falls"] / metrics["episodes"],
            "walked_m_s": metrics["speed_m_s"]["mean"],
            "fibre_J_kg_m": effort["fibre_J_kg_m"],
            "effort": effort["total"],
            "net_joint_J_kg_m": effort["net_joint_J_kg_m"],
        }

    def _asked(self) -> Sequence[float]:
        return (0.8, 1.0, 1.2) if self.quick else ASKED_SPEEDS


def controls_table(even: Sequence[Row]) -> str:
    """Return the Markdown table of prices at equal walked speeds, with their differences from the sound walk.

    `even` are rows of `at_walked_speeds`.
    """
    speeds = list(dict.fromkeys(row["speed_m_s"] for row in even))
    prices = {(row["condition"], row["speed_m_s"]): row for row in even}
    lines = []
    for name in dict.fromkeys(row["condition"] for row in even):
        cells = [_cell(prices[name, speed], prices[UNCHANGED, speed]) for speed in speeds]
        lines.append([name, *cells])
    head = ["", *(f"walking {speed:g} m/s" for speed in speeds)]
    return f"{table(head, lines)}\n\nFibre work [J/kg/m] / all of effort [-], in brackets against the sound walk."


def _cell(own: Row, sound: Row) -> str:
    """Return both prices of a walk with their differences from the sound one."""
    if own[TWO_PRICES[0]] is None or sound[TWO_PRICES[0]] is None:
        return MISSING
    differences = [own[price] / sound[price] - 1.0 for price in TWO_PRICES]
    shown = " / ".join(text_of(own[price], ".2f") for price in TWO_PRICES)
    return f"{shown} ({differences[0]:+.0%} / {differences[1]:+.0%})"
