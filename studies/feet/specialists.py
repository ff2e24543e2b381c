"""Ask how much a person that walks on every foot gives away on one of them: it trains on with that foot alone.

    springfoot study specialists learned --runs runs/specialists

The gap between the two is an error of every comparison of feet: a smaller difference says nothing. Each training
begins at the person, with its prices, and ends at the command's number of steps; the table tells if it still gained.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path
from typing import Annotated, Any, ClassVar

import tyro

from springfoot.agents.training import PRESETS, TrainingConfig, read_record
from springfoot.errors import require_choice, require_count
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import record
from springfoot.files.markdown import MISSING, span_text, table
from springfoot.files.writing import make_folder

from ..base.adapting_persons import person_and_settings, require_each_once
from ..base.study import Answer, OnProgress, WalkingStudy
from ..base.trained import finish_training
from ..base.walked_speeds import TWO_PRICES, Row, price_numbers, rows_csv
from .both_feet import both, braced

COLLINS_SPRING = 3.6 / radians(1.0)
"""Stiffness of springs at both ankles [N m/rad]: 3.6 N·m/deg, near that with which people took least energy (Collins et
al. 2015, Nature 522:212)."""
CELLS: dict[str, Mapping[str, Any]] = {
    "sound": {},
    "sound, 3.6 N·m/deg at both ankles": both(braced(ankle_stiffness=COLLINS_SPRING)),
    "rigid right foot": {"right_foot": "rigid"},
    "passive right foot, 300 N·m/rad": {"right_foot": {"kind": "passive", "ankle_stiffness": 300.0}},
    "both calves of 25 %": both({"kind": "weak", "strength": 0.25}),
}
"""Name of a cell -> its feet."""
QUICK_CELLS, QUICK_STEPS = 2, 1920
"""Cells walked with --quick, the first, and steps of each training there, one update."""
LEARNED_SECONDS = PRESETS["person"].environment.episode_seconds
"""Length of an episode of the trainings [s]."""
LEARNING = {"learning_rate": 1.2e-4, "log_std": -2.3, "critic_steps": 300_000}
"""Settings of a training that begins at a person; chosen: at the preset's own rate and spread it first gets worse."""
EVALUATIONS = 20
"""Periodic evaluations of a training; the last quarter of them tells if it still gained."""


@dataclass(frozen=True, kw_only=True)
class Specialists(WalkingStudy):
    """Train learned persons on with one foot alone, and compare their prices with before."""

    persons: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="PERSON ...")] = ("learned",)
    """Policies that move the person: run folders, files, or those of the package, such as `learned`."""
    cells: tuple[str, ...] = tuple(CELLS)
    """Feet to train on with, by the names in the table."""
    timesteps: int = 2_000_000
    """Steps of each training."""
    training_seed: int = 0
    """Seed of the trainings."""
    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/specialists")
    """Folder of the trainings; after a stop the same command goes on there."""

    QUICK: ClassVar[Mapping[str, Any]] = {**WalkingStudy.QUICK, "timesteps": QUICK_STEPS}
    UNIT: ClassVar[str] = " trainings"

    def check(self) -> None:
        """Refuse counts out of range."""
        super().check()
        require_count("timesteps", self.timesteps)
        require_count("cells", len(self.cells))
        for cell in self.cells:
            require_choice("cells", cell, tuple(CELLS))
        require_count("training_seed", self.training_seed, 0, 2**31 - 1)
        require_each_once(self.persons)

    @property
    def total(self) -> float:
        """Return the number of trainings."""
        return len(self.persons) * len(self._cells)

    def ask(self, progress: OnProgress) -> Answer:
        """Train a specialist for each person and cell, and walk both there."""
        rows = []
        for number, person in enumerate(self.persons):
            for place, (cell, feet) in enumerate(self._cells.items()):
                folder = self._folder / f"person-{number + 1}-cell-{place + 1}"
                make_folder(folder.parent)
                finish_training(self._config(person, feet), folder, begin_from=person)
                before = self._numbers(person, feet)
                after = self._numbers(str(folder), feet)
                rows.append({"person": person, "cell": cell, **_columns(before, after), "gained": late_gain(folder)})
                progress(1)
        text = (
            f"{gap_table(rows)}\n\n{self.what_ran} of each, commanded 1.2 m/s on level ground; trained there for "
            f"{self.timesteps:,} steps, without pushes. Gaps: specialist less generalist. Still gained: best return of "
            "the last quarter of the periodic evaluations over the best before. Ranges are over persons."
        )
        return Answer(text=text, files={"specialists.csv": rows_csv(rows)})

    @property
    def _cells(self) -> dict[str, Mapping[str, Any]]:
        """Return name -> feet of the cells that are walked."""
        cells = {name: CELLS[name] for name in self.cells}
        return dict(list(cells.items())[:QUICK_CELLS]) if self.quick else cells

    @property
    def _folder(self) -> Path:
        """Return the folder of the trainings: `runs`, with --quick `RUNS-quick` beside it."""
        return self.runs.with_name(f"{self.runs.name}-quick") if self.quick else self.runs

    def _config(self, person: str, feet: Mapping[str, Any]) -> TrainingConfig:
        """Return the training of a person's specialist: the preset's, but with the person's prices, under the
        conditions of an evaluation."""
        _, environment = person_and_settings(person, {"episode_seconds": LEARNED_SECONDS, **feet})
        preset = PRESETS["person"]
        return replace(
            preset,
            **LEARNING,
            timesteps=self.timesteps,
            update_steps=QUICK_STEPS if self.quick else preset.update_steps,
            seed=self.training_seed,
            threads=self.threads,
            eval_interval=max(1, self.timesteps // EVALUATIONS),
            environment=environment,
        )

    def _numbers(self, policy: str, feet: Mapping[str, Any]) -> dict[str, float | None]:
        """Return the numbers of `price_numbers` of a policy that walks on `feet`."""
        act, settings = person_and_settings(policy, {"episode_seconds": self.seconds, **feet})
        return price_numbers(measure(record(act, settings, name=policy, **self.how)).metrics)


def _columns(before: Row, after: Row) -> dict[str, float | None]:
    """Return the numbers of generalist and specialist in one row, and the gap of each price [-]."""
    columns = {
        f"{who}_{key}": value
        for who, numbers in (("generalist", before), ("specialist", after))
        for key, value in numbers.items()
    }
    for price in TWO_PRICES:
        pair = (before[price], after[price])
        columns[f"{price}_gap"] = None if None in pair else pair[1] / pair[0] - 1.0
    return columns


def late_gain(folder: Path) -> float | None:
    """Return the gain [-] of the best return in the last quarter of a run's periodic evaluations over the best before;
    None with fewer than four evaluations."""
    returns = [entry["return_mean"] for entry in read_record(folder)["evaluations"]]
    late = len(returns) // 4
    if not late:
        return None
    before = max(returns[:-late])
    return (max(returns[-late:]) - before) / abs(before)  # a return may be negative


def gap_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table of a row for each cell: falls, walked speeds, prices and gaps, over the persons."""
    lines = []
    for cell in dict.fromkeys(row["cell"] for row in rows):
        here = [row for row in rows if row["cell"] == cell]
        lines.append(
            [
                cell,
                *(_over(here, f"{who}_falls", ".0%") for who in ("generalist", "specialist")),
                " → ".join(_over(here, f"{who}_walked_m_s", ".2f") for who in ("generalist", "specialist")),
                " → ".join(_over(here, f"{who}_{TWO_PRICES[0]}", ".2f") for who in ("generalist", "specialist")),
                *(_over(here, key, "+.1%") for key in (*(f"{price}_gap" for price in TWO_PRICES), "gained")),
            ]
        )
    head = ["cell", "generalist falls", "specialist falls", "m/s", "fibre work J/kg/m", "gap", "gap of effort"]
    return table([*head, "still gained"], lines)


def _over(rows: Sequence[Row], key: str, pattern: str) -> str:
    """Return the least and the largest number of a column over `rows`, one if they read alike; a dash without any."""
    values = [row[key] for row in rows if row[key] is not None]
    return span_text(values, pattern) if values else MISSING
