"""What no policy has together: of several policies, every criterion that one of them misses, and by how much.

springfoot study front pretrained schedule runs/three/seed-0 runs/three/seed-1 runs/three/seed-2
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import tyro
from matplotlib.figure import Figure

from springfoot.evaluation.numbers.criteria import Criterion, number_text, numbers
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import prepare
from springfoot.evaluation.recording.recording import record
from springfoot.evaluation.report.gait_figure import STYLE
from springfoot.files.markdown import table, text_of
from springfoot.files.writing import csv_text

from .base.flags import SettingsFlags, given
from .base.study import Answer, OnProgress, WalkingStudy
from .criteria_met import CRITERIA

MARKS = "osD^vP*X<>"
"""Shapes of the figure's marks, one after the other for the policies; a further policy begins anew."""


def beyond_percent(criterion: Criterion, values: Mapping[str, Any]) -> float | None:
    """How far a number lies beyond the nearer end of its range [% of that end]; negative inside.

    None where it was not measured, or the nearer end is 0.
    """
    value = criterion.value(dict(values))
    if value is None:
        return None
    ends = [(end, side * (value - end)) for end, side in ((criterion.low, -1), (criterion.high, 1)) if abs(end) < inf]
    end, distance = max(ends, key=lambda each: each[1])
    return 100 * distance / abs(end) if end else None


@dataclass(frozen=True, kw_only=True)
class Front(WalkingStudy):
    """Hold several policies against the criteria, and show those that one of them misses at least."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = (
        "pretrained",
        "schedule",
    )
    """Any policies of evaluate.py: run folders, files, names."""
    episodes: int = 100
    """Episodes of each policy."""
    environment: tyro.conf.OmitArgPrefixes[SettingsFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    @property
    def total(self) -> float:
        """Simulated seconds without falls."""
        return len(self.policies) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk, and judge."""
        conditions = {"episode_seconds": self.seconds} | given(self.environment)
        walks = {}
        for name in self.policies:
            policy, settings = prepare(name, conditions, self.seed, self.threads)
            walk = record(policy, settings, name=name, progress=progress, **self.how)
            walks[name] = numbers(measure(walk).metrics)
        missed = [each for each in CRITERIA if not all(each.holds(values) for values in walks.values())]
        text = (
            f"{_table(walks, missed)}\n\n{self.what_ran}. Of {len(CRITERIA)} criteria those that a row misses, in bold."
        )
        lines = [
            [name, each.name, each.value(values), each.holds(values), beyond_percent(each, values)]
            for name, values in walks.items()
            for each in CRITERIA
        ]
        files = {
            "front.csv": csv_text(["policy", "criterion", "value", "holds", "beyond_percent"], lines),
            "front.png": partial(_draw, walks=walks, criteria=missed),
        }
        picture = "![How far beyond each criterion the policies are](front.png)"
        return Answer(text=text, files=files, sections={"FRONT": f"{picture}\n\n{text}"})


def _table(walks: Mapping[str, dict[str, Any]], missed: Sequence[Criterion]) -> str:
    """Markdown: policies down, their speed, how many criteria they miss, and the numbers of those in `missed`."""
    lines = []
    for name, values in walks.items():
        texts = [number_text(each, values) for each in missed]
        cells = [t if each.holds(values) else f"**{t}**" for each, t in zip(missed, texts, strict=True)]
        speed = text_of(values["speed_m_s"]["mean"], ".3f")
        lines.append([f"`{name}`", speed, str(sum("**" in cell for cell in cells)), *cells])
    return table(["policy", "m/s", "misses", *(f"{each.label or each.name} {each.text}" for each in missed)], lines)


def _draw(path: Path, walks: Mapping[str, dict[str, Any]], criteria: Sequence[Criterion]) -> None:
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 1.2 + 0.32 * max(len(criteria), 1)), layout="constrained")
        ax = figure.subplots()
        for index, (name, values) in enumerate(walks.items()):
            beyond = [(beyond_percent(each, values), row) for row, each in enumerate(criteria)]
            known = [pair for pair in beyond if pair[0] is not None]
            x, y = zip(*known, strict=True) if known else ((), ())
            ax.plot(x, y, MARKS[index % len(MARKS)], label=name, alpha=0.8)
        left, right = ax.get_xlim()
        ax.axvspan(0, max(right, 1), color="0.93", zorder=0)
        ax.set_xlim(left, max(right, 1))
        ax.axvline(0, color="0.3", linewidth=0.8)
        ax.set_yticks(range(len(criteria)), [f"{each.label or each.name} {each.text}" for each in criteria])
        ax.set_ylim(len(criteria) - 0.5, -0.5)
        ax.set_xlabel("beyond the criterion (% of it); grey: missed")
        figure.legend(loc="outside right upper", fontsize=8)
        figure.savefig(path, dpi=130, facecolor="white", metadata={"Software": "springfoot"})
