"""Predict a walk from body, plan and physics by one command: plans, a person trained on them, an evaluation.

    springfoot study predict

The person begins at leg constants that nobody tuned (`generic_constants`) and with an untrained network. No earlier
result takes part: the search for the first plan starts at round numbers. docs/results/prediction.md lists the knowledge
of people in it. Each stage keeps its result in the folder `runs`; after a stop the same command goes on, with the bits
of an uninterrupted one.
"""

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import tyro

from springfoot.agents.policies import LAST
from springfoot.agents.training import PRESETS, TrainingConfig
from springfoot.errors import require_count
from springfoot.files.locks import owned
from springfoot.files.markdown import table
from springfoot.files.writing import make_folder, write_atomically

from ..base.pushed_walks import PushedWalks, kept_metrics
from ..base.stage_seconds import StageSeconds
from ..base.study import Answer, OnProgress, WalkingStudy, without_places
from ..base.trained import finish_training
from .constants_file import read_styles, write_constants
from .plan_tuning import PlanTuning
from .prediction_table import people_numbers, plan_numbers, prediction_table, walk_numbers

FOUND = "styles.json"
"""File with the styles of the plans, a `plan_file` of the settings."""
PLAN_SPEEDS: dict[float, float | None] = {1.2: None, 1.05: 1.2, 0.9: 1.05, 1.35: 1.2, 1.5: 1.35, 1.65: 1.5}
"""Speed of a plan [m/s] -> the one with the style at which its search begins; None: at round numbers. Chosen: with one
style for all speeds a walk changes with speed otherwise than people's."""
NEXT_SPREAD = 0.2
"""First spread of a search that begins at another speed's style, in units of the search; chosen."""
QUICK_STEPS = 1920
"""Steps of the training with --quick, one update."""


@dataclass(frozen=True, kw_only=True)
class Predict(WalkingStudy):
    """Predict a walk from nothing: plans of least effort, a person trained on them, numbers."""

    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/predict")
    """Folder in which each stage keeps its result; the same command goes on there after a stop."""
    plan_generations: int = 250
    """Generations of the search for the plan of least effort at 1.2 m/s."""
    next_generations: int = 150
    """Generations of the search at each other speed, which begins at its neighbour's style."""
    population: int = 20
    """Candidates in each generation."""
    timesteps: int = PRESETS["predict"].timesteps
    """Steps of the training of the person (preset `predict`)."""
    search_seed: int = 3
    """Seed of the search for the first plan, of 0 to 4 the one that ends at the least effort; the other searches, which
    begin at a style, have seed 0."""
    training_seed: int = 1
    """Seed of the training."""

    QUICK: ClassVar[dict[str, Any]] = {
        **WalkingStudy.QUICK,
        "plan_generations": 1,
        "next_generations": 1,
        "population": 4,
        "timesteps": QUICK_STEPS,
    }
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse counts out of range."""
        super().check()
        for name in ("plan_generations", "next_generations", "timesteps"):
            require_count(name, getattr(self, name))
        require_count("population", self.population, 4)
        for name in ("search_seed", "training_seed"):
            require_count(name, getattr(self, name), 0, 2**31 - 2)

    @property
    def total(self) -> float:
        """Return the number of generations of all searches; the training has a progress of its own."""
        return self.plan_generations + (len(PLAN_SPEEDS) - 1) * self.next_generations

    @property
    def folder(self) -> Path:
        """Return the folder in which the stages keep their results: `runs`, with --quick `RUNS-quick` beside it."""
        return self.runs.with_name(f"{self.runs.name}-quick") if self.quick else self.runs

    def ask(self, progress: OnProgress) -> Answer:
        """Run the stages, in a folder that no other process can write into."""
        make_folder(self.folder)
        with owned(self.folder):
            return self._run_stages(progress)

    def _run_stages(self, progress: OnProgress) -> Answer:
        """Run the stages in order; each goes on from its result in the folder, if there is one."""
        stages = StageSeconds(self.folder / "seconds.json")
        with stages.of("plans") as keep_seconds:
            self._find_plans(lambda generations: [tell(generations) for tell in (keep_seconds, progress)])
        # The person's folder is named after the plans, so that others train another person.
        styles = read_styles(self.folder / FOUND)["styles"]
        digest = hashlib.sha256(json.dumps(styles).encode()).hexdigest()
        person = self.folder / f"person-{digest[:8]}"
        with stages.of("person") as keep_seconds:
            finish_training(self.training, person, callbacks=[keep_seconds])
        with stages.of("evaluation"):
            text = self._evaluate(person / LAST, digest)
        seconds = {stage: f"{time:.0f}" for stage, time in stages.seconds.items()}
        times = table(["stage", *seconds], [["seconds, all runs", *seconds.values()]])
        return Answer(text=f"{text}\n\n{times}")

    @property
    def training(self) -> TrainingConfig:
        """Return the training of the person, which follows the plans that were found."""
        preset = PRESETS["predict"]
        return replace(
            preset,
            timesteps=self.timesteps,
            update_steps=QUICK_STEPS if self.quick else preset.update_steps,
            seed=self.training_seed,
            threads=self.threads,
            environment=replace(preset.environment, plan_file=str(self.folder / FOUND)),
        )

    def _find_plans(self, progress: OnProgress) -> None:
        """Search for the plan at each speed, and write its style, the search's report, and all styles in `FOUND`."""
        found: dict[str, Any] = {"styles": {}, "found_by": {}}
        for speed, begins_at in PLAN_SPEEDS.items():
            style = self._style_file(speed)
            search = PlanTuning(
                speeds=(speed,),
                generations=self.plan_generations,
                population=self.population,
                seed=self.search_seed if begins_at is None else 0,
                processes=self.threads,
                styles=style,
                command=without_places(self.command),
                log=self.folder / f"plan-{speed:g}.json",
            )
            if begins_at is not None:
                search = replace(
                    search, generations=self.next_generations, sigma=NEXT_SPREAD, start=self._style_file(begins_at)
                )
            write_atomically(self.folder / f"plan-{speed:g}.txt", f"{search.ask(progress).text}\n".encode())
            for entry, values in found.items():
                values |= read_styles(style)[entry]
        write_constants(self.folder / FOUND, found)

    def _style_file(self, speed: float) -> Path:
        """Return the file with the style at `speed` [m/s]: each search begins at one that no later search changes."""
        return self.folder / f"style-{speed:g}.json"

    def _evaluate(self, person: Path, digest: str) -> str:
        """Walk with the person, undisturbed and pushed, and return the report's text.

        Args:
            person: its file.
            digest: of the plans. Metrics are kept, and measured anew for other plans or lengths of the training.
        """
        settings = self.training.environment
        walks = PushedWalks(
            episodes=self.episodes,
            seconds=self.seconds,
            push_newton=settings.push_newton,
            seed=self.seed,
            threads=self.threads,
        )
        metrics = kept_metrics(
            self.folder / "walks.json", walks, [digest, self.timesteps], lambda: walks.metrics(str(person))
        )
        columns = {
            "people": people_numbers(settings),
            "the plan": plan_numbers(settings),
            "the person": walk_numbers(metrics["undisturbed"]),
        }
        pushed = metrics["pushed"]
        falls = f"{pushed['falls']} of {pushed['episodes']}"
        return "\n\n".join(
            [
                prediction_table(columns, ("the person",)),
                f"{self.what_ran}. **Bold**: not as wanted. Falls under pushes of {settings.push_newton:g} N: {falls}.",
            ]
        )
