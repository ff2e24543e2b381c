"""Predict a walk from body, plan and physics by one command: plan, legs, policy, evaluation.

    springfoot study predict

Legs first follow the plan, then walk with least effort at three speeds. No earlier result takes part: the search for
the plan starts at round numbers, that for leg constants at `generic` ones, and the policy is untrained.
docs/results/prediction.md lists the knowledge of people in it. Each stage keeps its result in the folder `runs`; after
a stop the same command goes on, with the bits of an uninterrupted one.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any, ClassVar

import tyro

from springfoot.agents.training import PRESETS
from springfoot.envs.control import GENERIC, constants_name
from springfoot.envs.settings import BipedSettings
from springfoot.errors import require_count
from springfoot.files.locks import owned
from springfoot.files.markdown import table
from springfoot.files.writing import make_folder, write_atomically

from ..base.pushed_walks import PushedWalks, kept_metrics
from ..base.study import Answer, OnProgress, WalkingStudy, without_places
from ..base.trained import finish_training
from .constants_file import read_constants, write_constants
from .leg_tuning import LegTuning
from .plan_tuning import PlanTuning
from .prediction_table import people_numbers, plan_numbers, prediction_table, walk_numbers

FOUND = "found.json"
"""File with the plan's style and the leg constants, a `plan_file` of the settings."""
STAGE_PUSH = 100.0
"""Size of the pushes in stages three and four, in the training and in half of the evaluation [N]; chosen."""
FIRST_SPREAD, EFFORT_SPREAD = 0.5, 0.6
"""First spread of stages two and three [units of the search]; chosen: stage three leaves the planned walk, and ends in
a walk of more effort if it starts narrower."""
OTHER_SPEEDS, OTHER_SPREAD, OTHER_UNPUSHED = (0.9, 1.5), 0.3, 60
"""Speeds [m/s], first spread and generations without pushes of stage four; chosen: with the constants of 1.2 m/s alone
the body falls at 1.4 m/s."""
STAGES = tuple(f"{name}_generations" for name in ("plan", "walk", "effort", "push", "other"))
"""Settings with the generations of the searches, in order; the last counts for each of `OTHER_SPEEDS`."""


@dataclass(frozen=True, kw_only=True)
class Predict(WalkingStudy):
    """Predict a walk from nothing: a plan of least effort, legs that follow it and then minimise effort, a policy,
    numbers."""

    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/predict")
    """Folder in which each stage keeps its result; the same command goes on there after a stop."""
    plan_generations: int = 300
    """Generations of the first stage, the plan of least effort."""
    walk_generations: int = 100
    """Generations of the second stage, leg constants of walks near the plan, without pushes."""
    effort_generations: int = 300
    """Generations of the third stage, leg constants of walks of least effort and impact."""
    push_generations: int = 300
    """Generations with pushes that continue the third stage."""
    other_generations: int = 100
    """Generations of the fourth stage, leg constants of least effort at a slower and a faster speed, each from those of
    1.2 m/s."""
    population: int = 20
    """Candidates in each generation."""
    timesteps: int = PRESETS["predict"].timesteps
    """Steps of the fifth stage, the training of a policy (preset `predict`)."""
    search_seed: int = 0
    """Seed of the searches and of the training."""

    QUICK: ClassVar[dict[str, Any]] = {
        **WalkingStudy.QUICK,
        "plan_generations": 1,
        "walk_generations": 1,
        "effort_generations": 1,
        "push_generations": 1,
        "other_generations": 1,
        "population": 4,
        "timesteps": 8192,
    }
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse counts out of range."""
        super().check()
        for name in (*STAGES, "timesteps"):
            require_count(name, getattr(self, name))
        require_count("population", self.population, 4)
        require_count("search_seed", self.search_seed, 0, 2**31 - 2)

    @property
    def total(self) -> float:
        """Return the number of generations of all searches."""
        return sum(getattr(self, name) for name in STAGES) + (len(OTHER_SPEEDS) - 1) * self.other_generations

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
        found = self.folder / FOUND
        seconds = {}  # wall time of each stage

        def stage(name: str, make: Callable[[], Any]) -> Any:
            """Return the result of a stage, made by `make`, and note its wall time."""
            began = perf_counter()
            result = make()
            seconds[name] = perf_counter() - began
            return result

        if not found.is_file():
            write_constants(found, {"styles": {}, "constants": {}, "found_by": {}})
        plan = PlanTuning(
            generations=self.plan_generations,
            population=self.population,
            seed=self.search_seed,
            styles=found,
            command=without_places(self.command),
            log=self.folder / "plan.json",
        )
        walk = LegTuning(
            guide="plan",
            start=GENERIC,
            push_newton=0.0,
            generations=self.walk_generations,
            population=self.population,
            sigma=FIRST_SPREAD,
            seed=self.search_seed,
            threads=self.threads,
            constants=found,
            plan_file=found,
            command=without_places(self.command),
            log=self.folder / "walk.json",
        )
        effort = replace(
            walk,
            start="",
            pays="effort",
            push_newton=STAGE_PUSH,
            pushed_from=self.effort_generations,
            generations=self.effort_generations + self.push_generations,
            sigma=EFFORT_SPREAD,
            seed=self.search_seed + 1,
            log=self.folder / "effort.json",
        )
        searches = {"plan": plan, "walk": walk, "effort": effort}
        for speed in OTHER_SPEEDS:
            searches[f"effort-{speed:g}"] = replace(
                effort,
                speed=speed,
                start=constants_name("planned", "people", follows_plan=True),
                pushed_from=OTHER_UNPUSHED,
                generations=self.other_generations,
                sigma=OTHER_SPREAD,
                log=self.folder / f"effort-{speed:g}.json",
            )
        for name, search in searches.items():
            text = stage(name, lambda search=search: search.ask(progress)).text
            write_atomically(self.folder / f"{name}.txt", f"{text}\n".encode())
        # The policy's folder is named after plan and constants, so that other constants train another policy.
        constants = read_constants(found)
        digest = hashlib.sha256(json.dumps([constants["styles"], constants["constants"]]).encode()).hexdigest()
        policy = self.folder / f"policy-{digest[:8]}"
        settings = replace(PRESETS["predict"].environment, plan_file=str(found))
        stage("policy", lambda: self._train(settings, policy))
        text = stage("evaluation", lambda: self._evaluate(found, digest, policy, settings))
        times = table(["stage", *seconds], [["seconds, this time", *(f"{time:.0f}" for time in seconds.values())]])
        return Answer(text=f"{text}\n\n{times}")

    def _train(self, settings: BipedSettings, out: Path) -> None:
        """Train a policy in the folder `out`, or go on with its training there; do nothing if it is finished.

        Raises `SpringfootError` if other settings were trained there, and `KeyboardInterrupt` if the user stops it.
        """
        preset = PRESETS["predict"]
        config = replace(
            preset, timesteps=self.timesteps, seed=self.search_seed, environment=settings, threads=self.threads
        )
        finish_training(config, out)

    def _evaluate(self, found: Path, digest: str, policy: Path, settings: BipedSettings) -> str:
        """Walk with schedule and policy, undisturbed and pushed, and return the report's text.

        Both walk with the plan and the legs of the file `found`: the schedule, which is the search's own springs,
        otherwise in the default settings, the policy in those of its training.

        Args:
            found: file of plan and constants.
            digest: of their content. Metrics are kept, and measured anew for another digest or length of the training.
            policy: run folder of the trained policy.
            settings: environment of the training; the table has its people and its plan beside the walks.
        """
        walks = PushedWalks(
            episodes=self.episodes, seconds=self.seconds, push_newton=STAGE_PUSH, seed=self.seed, threads=self.threads
        )
        guided = {"guide": "plan", "plan_file": str(found)}
        columns = {"people": people_numbers(settings), "the plan": plan_numbers(settings)}
        pushed = []
        for name, label in (("schedule", "schedule"), (str(policy), "policy")):
            key = [name, digest, self.timesteps]
            metrics = kept_metrics(
                self.folder / f"{label}.json", walks, key, lambda name=name: walks.metrics(name, guided)
            )
            columns[label] = walk_numbers(metrics["undisturbed"])
            pushed.append(f"{label} {metrics['pushed']['falls']} of {metrics['pushed']['episodes']}")
        return "\n\n".join(
            [
                prediction_table(columns, ("schedule", "policy")),
                f"{self.what_ran}. Schedule: the search's own springs, no policy. **Bold**: not as wanted. "
                f"Falls under pushes of {STAGE_PUSH:g} N: {', '.join(pushed)}.",
            ]
        )
