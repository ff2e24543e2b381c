"""Several policies side by side, and the spread of their numbers.

springfoot study seeds runs/five/seed-0 runs/five/seed-1 runs/five/seed-2
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import tyro

from springfoot.errors import SpringfootError
from springfoot.evaluation.recording.policies import prepare
from springfoot.files.markdown import plus_minus, table, text_of
from springfoot.gait.people.scores import mean_sd

from ..base.flags import SettingsFlags, given
from ..base.quantities import OF_A_WALK, walks_csv
from ..base.study import Answer, OnProgress, WalkingStudy
from .comparison import Row, run_row, what_ran

SECTION = "SEEDS"
"""Of the results page."""


def seeds_table(rows: Sequence[Row]) -> str:
    """Markdown: numbers down, policies across, and their mean ± SD over the policies (n - 1)."""
    lines = []
    for each in OF_A_WALK:
        values = [each.of(row.metrics) for row in rows]
        spread = mean_sd([] if None in values else values)
        mean = plus_minus(spread, ".1f" if each.pattern == "d" else each.pattern, alone=False)
        lines.append([each.label, *(text_of(value, each.pattern) for value in values), mean])
    return table(["", *(f"`{row.name}`" for row in rows), "mean ± SD"], lines)


@dataclass(frozen=True, kw_only=True)
class Seeds(WalkingStudy):
    """Several policies side by side, such as the same training from several seeds, and their spread."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = ()
    """Any policies of evaluate.py: run folders, files, names."""
    episodes: int = 100
    """Episodes of each row."""
    environment: tyro.conf.OmitArgPrefixes[SettingsFlags]  # type: ignore[valid-type]
    """What to walk in; a trained policy brings its own settings, standard conditions aside."""

    def check(self) -> None:
        """Refuse an empty list of policies as well."""
        super().check()
        if not self.policies:
            raise SpringfootError("give one policy or more: run folders, .safetensors files or names")

    @property
    def total(self) -> float:
        """Simulated time [s], without falls."""
        return len(self.policies) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every policy."""
        conditions = {"push_newton": 0.0, "episode_seconds": self.seconds} | given(self.environment)
        prepared = [(name, *prepare(name, conditions, self.seed)) for name in self.policies]
        rows = [run_row(*each, **self.how, progress=progress) for each in prepared]
        text = f"{seeds_table(rows)}\n\n{what_ran(self, rows[0])}"
        numbers = walks_csv([({"policy": row.name}, row.metrics) for row in rows])
        return Answer(text=text, files={"seeds.csv": numbers}, sections={SECTION: text})
