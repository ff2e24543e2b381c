"""Compare the results of independent searches for leg constants: how each set walks, and likeness against robustness.

springfoot study leg-sets
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure

from springfoot.envs.control import LegConstants, constants_from, constants_name
from springfoot.envs.settings import BipedSettings
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record
from springfoot.evaluation.report import MODEL, STYLE
from springfoot.files.markdown import table, text_of
from springfoot.files.writing import csv_text

from ..base.columns import COMPARED_JOINTS, Column
from ..base.study import Answer, OnProgress, WalkingStudy
from .constants_file import CONSTANTS, read_constants
from .leg_cost import REFINED_SECONDS, all_misses

SETTINGS: tuple[Mapping[str, Any], ...] = (
    {},
    {"speed": 0.8},
    {"speed": 1.6},
    {"equilibrium": "neutral"},
    {"cadence": "thesis"},
    {"feedforward": "plan"},
)
"""Settings that have leg constants of their own; the first are also those of the searches at other prices ("front")."""
SCHEDULE = "untrained", {"action_mode": "residual"}
"""Policy and settings with which a set walks its own fixed schedule."""
UNTUNED = ("constant", "quasi_stiffness", "untrained", "thesis")
"""Policies whose stiffness no set was tuned with."""
PUSHED = {"push_newton": 150.0}
WALKED = (
    Column("m/s", ".3f", ("speed_m_s", "mean")),
    *(Column(f"{joint} °", ".1f", ("joints", joint, "rmse_deg")) for joint in COMPARED_JOINTS),
    Column("hip moment r", ".2f", ("moments", "hip", "r")),
    Column("in ± 2 SD %", ".0f", ("moments", "hip", "within_2sd_percent")),
    Column("late swing N·m/kg", ".2f", ("moments", "hip", "late_swing_peak_Nm_kg")),
    Column("knee moment r", ".2f", ("moments", "knee", "r")),
    Column("hip work + J/kg", ".2f", ("joint_work_J_kg", "hip", "positive")),
    Column("cost of transport", ".3f", ("cost_of_transport",)),
    Column("CoP off m", ".3f", ("zmp", "cop_rmse_m")),
)
"""Numbers that the table shows of each walk."""


@dataclass(frozen=True, kw_only=True)
class LegSets(WalkingStudy):
    """Walk with every committed set of leg constants, and draw its likeness against its falls with untuned springs."""

    constants: Annotated[Path, tyro.conf.arg(metavar="FILE")] = CONSTANTS
    """File of constants."""

    QUICK: ClassVar[Mapping[str, Any]] = {**WalkingStudy.QUICK, "seconds": 8.0}

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        sets = [given for _, given, _ in _sets(read_constants(self.constants))]
        walks = 2 * len(sets) + len(UNTUNED) * sets.count(SETTINGS[0])
        return walks * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with each set, and make the table and the figure."""
        lines = []
        numbers = []
        front = {}
        for label, given, legs in _sets(read_constants(self.constants)):
            name, as_factors = SCHEDULE
            undisturbed, pushed = (
                self._walk(name, {**given, **as_factors, **pushes}, legs, progress) for pushes in ({}, PUSHED)
            )
            misses = self._misses(given, legs)
            untuned = None
            if given == SETTINGS[0]:
                walks = [self._walk(other, {**given, **PUSHED}, legs, progress) for other in UNTUNED]
                untuned = 100 * sum(metrics["falls"] for metrics in walks) / (len(UNTUNED) * self.episodes)
                front[label] = misses, untuned
            values = [misses, untuned, *(column.of(undisturbed) for column in WALKED)]
            patterns = [".1f", ".0f", *(column.pattern for column in WALKED)]
            falls = [f"{m['falls']} of {m['episodes']}" for m in (undisturbed, pushed)]
            ankle = "/".join(f"{k:.0f}" for k in legs.ankle_schedule)
            texts = [text_of(value, pattern) for value, pattern in zip(values, patterns, strict=True)]
            lines.append([label, *falls, *texts, ankle, f"{legs.toe_schedule:.0f}"])
            numbers.append([label, undisturbed["falls"], pushed["falls"], *values])
        walked = ["misses", "untuned springs fall %", *(column.label for column in WALKED)]
        head = ["set", "falls", "pushed", *walked, "K ankle", "K toe"]
        names = ", ".join(f"`{name}`" for name in UNTUNED)
        text = (
            f"{table(head, lines)}\n\n{self.what_ran}, with the set's own fixed schedule; pushed by ±150 N. Misses: "
            "length of the vector that the search pays for, falls apart. Untuned springs: "
            f"{names} on these legs under the same pushes. "
            "K in N·m/rad: loading / early stance / late stance / push-off / swing."
        )
        columns = [
            "set",
            "falls",
            "falls_pushed",
            "misses",
            "untuned_falls_percent",
            *(column.csv_name for column in WALKED),
        ]
        files = {"leg_sets.csv": csv_text(columns, numbers), "leg_sets.png": partial(_draw, front=front)}
        picture = "![Misses of a set against falls of springs that nobody tuned](leg_sets.png)"
        return Answer(text=f"{picture}\n\n{text}", files=files)

    def _walk(self, name: str, given: Mapping[str, Any], legs: LegConstants, progress: OnProgress) -> dict[str, Any]:
        """Return the metrics of a policy's walk on these legs."""
        policy, settings = policy_and_settings(name, {"episode_seconds": self.seconds, **given})
        return measure(record(policy, settings, name=name, legs=legs, progress=progress, **self.how)).metrics

    def _misses(self, given: Mapping[str, Any], legs: LegConstants) -> float | None:
        """Return the length of the vector `all_misses` of these legs; None if they fall."""
        (misses,) = all_misses(BipedSettings(episode_seconds=REFINED_SECONDS + 1, **given), [legs], self.threads)
        return None if misses is None else float(np.linalg.norm(misses))


def _sets(known: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any], LegConstants]]:
    """Yield label, settings and constants of every set: both searches of each of `SETTINGS`, then the searches at other
    prices."""
    for given in SETTINGS:
        settings = BipedSettings(**given)
        name = constants_name(settings.equilibrium, settings.cadence, settings.speed, settings.feedforward)
        for search, sets in (("first", known["constants"]), ("second", known.get("second", {}))):
            if name in sets:
                yield f"{name}: {search}", given, constants_from(sets[name])
    for name, values in known.get("front", {}).items():
        yield name, SETTINGS[0], constants_from(values)


def _draw(path: Path, front: Mapping[str, tuple[float | None, float]]) -> None:
    """Draw the falls of each set with untuned springs over its misses."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 3.6), layout="constrained")
        ax = figure.subplots()
        drawn = sorted((falls, misses, label) for label, (misses, falls) in front.items() if misses is not None)
        for index, (falls, misses, label) in enumerate(drawn):
            ax.plot(misses, falls, "o", color=MODEL)
            above_or_below = 4 if index % 2 == 0 else -11  # in turn, as labels of neighbours would overlap
            ax.annotate(label, (misses, falls), (6, above_or_below), textcoords="offset points", fontsize=8)
        ax.set_xlabel("misses of the walk with its own schedule (tolerances)")
        ax.set_ylabel("falls of springs nobody tuned,\nunder ±150 N (%)")
        ax.set_ylim(0, 105)
        ax.margins(x=0.5)
        figure.savefig(path, dpi=130, facecolor="white", metadata={"Software": "springfoot"})
