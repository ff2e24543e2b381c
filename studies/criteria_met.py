"""Which criteria of a human-like walk a policy meets, and which of following its plan.

springfoot study criteria pretrained --episodes 100
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from springfoot.agents.command_line import policy_label
from springfoot.agents.files import csv_text
from springfoot.agents.flags import SettingsFlags, given
from springfoot.agents.markdown import table
from springfoot.evaluation.criteria import FOLLOWS_THE_PLAN, HUMAN_LIKE, Criterion, number_text, numbers
from springfoot.evaluation.metrics import measure
from springfoot.evaluation.policies import prepare
from springfoot.evaluation.recording import record

from .study import Answer, OnProgress, WalkingStudy

CRITERIA = (*HUMAN_LIKE, *FOLLOWS_THE_PLAN)
"""Of the table, in its order: down the left half, then down the right."""


def criteria_table(name: str, metrics: dict[str, Any], criteria: Sequence[Criterion] = CRITERIA) -> str:
    """Markdown in two halves: criterion, its range and the number; what is missed in bold."""
    values = numbers(metrics)
    cells = [[each.label or each.name, each.text, _number(each, values)] for each in criteria]
    half = (len(cells) + 1) // 2
    left, right = cells[:half], cells[half:] + [["", "", ""]] * (2 * half - len(cells))
    head = ["", "criterion", f"`{name}`"]
    return table(head + head, [one + other for one, other in zip(left, right, strict=True)])


def _number(criterion: Criterion, values: Mapping[str, Any]) -> str:
    text = number_text(criterion, dict(values))
    return text if criterion.holds(dict(values)) else f"**{text}**"


@dataclass(frozen=True, kw_only=True)
class CriteriaMet(WalkingStudy):
    """Hold a policy's walk against every criterion: human-like in motion and force, and its plan followed."""

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Any policy of evaluate.py."""
    episodes: int = 100
    """Episodes."""
    environment: tyro.conf.OmitArgPrefixes[SettingsFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    @property
    def total(self) -> float:
        """Simulated seconds without falls."""
        return self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk, and judge."""
        label = policy_label(self.policy)
        policy, settings = prepare(self.policy, {"episode_seconds": self.seconds} | given(self.environment), self.seed)
        metrics = measure(record(policy, settings, name=label, progress=progress, **self.how)).metrics
        values = numbers(metrics)
        missed = sum(not each.holds(values) for each in CRITERIA)
        text = (
            f"{criteria_table(label, metrics)}\n\n{self.what_ran}. In bold what is missed: {missed} of {len(CRITERIA)}."
        )
        lines = ([each.name, each.low, each.high, each.value(values), each.holds(values)] for each in CRITERIA)
        files = {"criteria.csv": csv_text(["criterion", "low", "high", "value", "holds"], lines)}
        return Answer(text=text, files=files, sections={"CRITERIA": text})
