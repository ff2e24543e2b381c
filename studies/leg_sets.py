"""What independent searches for leg constants found, and how each result walks with its own fixed schedule.

springfoot study leg-sets --page docs/results.md
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import tyro

from springfoot.agents.baselines import untrained
from springfoot.agents.files import csv_text
from springfoot.agents.markdown import table, text_of
from springfoot.envs.control.leg_constants import LegConstants, constants_from, constants_name
from springfoot.envs.settings import BipedSettings
from springfoot.evaluation.metrics import measure
from springfoot.evaluation.recording import record

from .constants_file import CONSTANTS, read_constants
from .quantities import COMPARED_JOINTS, Quantity
from .study import Answer, OnProgress, WalkingStudy

SETTINGS: tuple[Mapping[str, Any], ...] = (
    {},
    {"speed": 0.8},
    {"speed": 1.6},
    {"equilibrium": "neutral"},
    {"cadence": "thesis"},
    {"feedforward": "plan"},
)
"""Settings whose constants were searched for."""
PUSHED = {"push_newton": 150.0}
WALKED = (
    Quantity("m/s", ".3f", ("speed_m_s", "mean")),
    *(Quantity(f"{joint} °", ".1f", ("joints", joint, "rmse_deg")) for joint in COMPARED_JOINTS),
    Quantity("hip moment r", ".2f", ("moments", "hip", "r")),
    Quantity("in ± 2 SD %", ".0f", ("moments", "hip", "within_2sd_percent")),
    Quantity("late swing N·m/kg", ".2f", ("moments", "hip", "late_swing_peak_Nm_kg")),
    Quantity("knee moment r", ".2f", ("moments", "knee", "r")),
    Quantity("hip work + J/kg", ".2f", ("joint_work_J_kg", "hip", "positive")),
    Quantity("cost of transport", ".3f", ("cost_of_transport",)),
    Quantity("CoP off m", ".3f", ("zmp", "cop_rmse_m")),
)
"""Numbers of a walk."""


@dataclass(frozen=True, kw_only=True)
class LegSets(WalkingStudy):
    """Walk with every committed set of leg constants and its own schedule, and with those of a second search."""

    constants: Annotated[Path, tyro.conf.arg(metavar="FILE")] = CONSTANTS
    """File of constants."""

    QUICK: ClassVar[Mapping[str, Any]] = {**WalkingStudy.QUICK, "seconds": 8.0}

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with each."""
        known = read_constants(self.constants)
        lines, numbers = [], []
        for changed in SETTINGS:
            settings = BipedSettings(action_mode="residual", episode_seconds=self.seconds, **changed)
            name = constants_name(settings.equilibrium, settings.cadence, settings.speed, settings.feedforward)
            for search, sets in (("first", known["constants"]), ("second", known.get("second", {}))):
                if name in sets:
                    legs = constants_from(sets[name])
                    level, pushed = (self._walk(settings, legs, more, progress) for more in ({}, PUSHED))
                    falls = [f"{m['falls']} of {m['episodes']}" for m in (level, pushed)]
                    values = [each.of(level) for each in WALKED]
                    ankle = "/".join(f"{k:.0f}" for k in legs.ankle_schedule)
                    texts = [text_of(value, each.pattern) for value, each in zip(values, WALKED, strict=True)]
                    lines.append([f"{name}: {search}", *falls, *texts, ankle, f"{legs.toe_schedule:.0f}"])
                    numbers.append([name, search, level["falls"], pushed["falls"], *values])
        head = ["set and search", "falls", "pushed", *(each.label for each in WALKED), "K ankle", "K toe"]
        text = (
            f"{table(head, lines)}\n\n{self.what_ran} with the set's own fixed schedule; pushed by ±150 N. "
            "K in N·m/rad: loading / early stance / late stance / push-off / swing."
        )
        columns = ["set", "search", "falls", "falls_pushed", *(each.column for each in WALKED)]
        return Answer(text=text, files={"leg_sets.csv": csv_text(columns, numbers)}, sections={"LEG-SETS": text})

    def _walk(
        self, settings: BipedSettings, legs: LegConstants, more: Mapping[str, float], progress: OnProgress
    ) -> dict[str, Any]:
        settings = replace(settings, **more)
        recorded = record(untrained(settings), settings, name="schedule", legs=legs, progress=progress, **self.how)
        return measure(recorded).metrics
