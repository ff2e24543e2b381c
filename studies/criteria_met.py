"""Which criteria of a human-like walk a policy meets, and which of following its plan; its open-loop copy beside it.

springfoot study criteria pretrained --episodes 100
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from springfoot.agents.policies.baselines import and_copy
from springfoot.evaluation.numbers.criteria import FOLLOWS_THE_PLAN, HUMAN_LIKE, Criterion, number_text, numbers, unmet
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_label, prepare
from springfoot.evaluation.recording.recording import record
from springfoot.files.markdown import table
from springfoot.files.writing import csv_text

from .base.flags import SettingsFlags, given
from .base.quantities import OPEN_LOOP, open_loop_note
from .base.study import Answer, OnProgress, WalkingStudy

CRITERIA = (*HUMAN_LIKE, *FOLLOWS_THE_PLAN)
"""Of the table, in its order: down the left half, then down the right."""


def criteria_table(walks: Mapping[str, dict[str, Any]], criteria: Sequence[Criterion] = CRITERIA) -> str:
    """Markdown in two halves: criterion, its range and the number of each walk, by its head; what is missed in bold."""
    values = [numbers(metrics) for metrics in walks.values()]
    cells = [[each.label or each.name, each.text, *(_number(each, walk) for walk in values)] for each in criteria]
    half = (len(cells) + 1) // 2
    head = ["", "criterion", *walks]
    left, right = cells[:half], cells[half:] + [[""] * len(head)] * (2 * half - len(cells))
    return table(head + head, [one + other for one, other in zip(left, right, strict=True)])


def _number(criterion: Criterion, values: Mapping[str, Any]) -> str:
    text = number_text(criterion, dict(values))
    return text if criterion.holds(dict(values)) else f"**{text}**"


@dataclass(frozen=True, kw_only=True)
class CriteriaMet(WalkingStudy):
    """Hold a policy's walk against every criterion: human-like in motion and force, and its plan followed.

    A trained policy stands beside its open-loop copy, which has its mean stiffness over the stride and no feedback.
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "pretrained"
    """Any policy of evaluate.py."""
    episodes: int = 100
    """Episodes."""
    environment: tyro.conf.OmitArgPrefixes[SettingsFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    @property
    def total(self) -> float:
        """Simulated seconds without falls."""
        return len(and_copy(self.policy)) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk, and judge."""
        conditions = {"episode_seconds": self.seconds} | given(self.environment)
        walks, lines, missed = {}, [], []
        for name in and_copy(self.policy):
            label = policy_label(name)
            policy, settings = prepare(name, conditions, self.seed, self.threads)
            metrics = measure(record(policy, settings, name=label, progress=progress, **self.how)).metrics
            values = numbers(metrics)
            walks[f"`{label}`" if name == self.policy else OPEN_LOOP] = metrics
            lines += [
                [label, each.name, each.low, each.high, each.value(values), each.holds(values)] for each in CRITERIA
            ]
            missed.append(f"{len(unmet(metrics, CRITERIA))} of {len(CRITERIA)}")
        text = f"{criteria_table(walks)}\n\n{self.what_ran}. In bold what is missed: {'; open loop '.join(missed)}."
        text += open_loop_note(self.policy)
        files = {"criteria.csv": csv_text(["policy", "criterion", "low", "high", "value", "holds"], lines)}
        return Answer(text=text, files=files, sections={"CRITERIA": text})
