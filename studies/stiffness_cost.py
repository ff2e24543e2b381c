"""What stiffness is worth: trainings of preset `walk` with different weights of its cost, and the knee of the curve.

    springfoot study stiffness-cost --page docs/results.md

Without disturbance the stiffness of a gait is not identified (`springfoot.studies.springs.any_stiffness`): a cost on K
shows what softer springs cost in likeness and under pushes. A seed that is finished is not trained again, so the
command may be stopped and begun anew, with more weights or seeds, or with `--no-train` to measure what there is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import matplotlib
import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from springfoot.agents.training.config import PRESETS, TrainingConfig
from springfoot.agents.training.multi_seed import is_finished
from springfoot.arrays import NDArray
from springfoot.envs.settings.settings import DEFAULT_WEIGHTS, body_of
from springfoot.envs.task.reward_reference import ANKLE_STIFFNESS_UNIT, TOE_SHARE, TOE_STIFFNESS_UNIT
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.metrics import Gait, measure
from springfoot.evaluation.recording.policies import prepare
from springfoot.evaluation.recording.recording import TICK, WARM_UP, Recording, record
from springfoot.evaluation.report.gait_figure import MODEL, PLAN, STYLE
from springfoot.files.markdown import MISSING, plus_minus, table
from springfoot.files.writing import csv_text
from springfoot.gait.people.scores import mean_sd

from .base.quantities import COMPARED_JOINTS
from .base.study import Answer, OnProgress
from .base.trainings import TrainingStudy
from .springs.agreement import agreements

SECTION = "TRADE-OFF"
"""Of the results page."""
WEIGHTS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Of the cost."""
PUSHES = (150.0, 200.0, 250.0)
"""Sizes of pushes [N]."""
COLORS = ("#0b6e8f", "#c26a1b", "#7a5195")
Term = Literal["stiffness", "stiffness_rate"]


def stiffness_cost(recording: Recording) -> float | None:
    """Mean of the reward term `stiffness` (`envs.task.reward`) after `WARM_UP`; None for shorter episodes."""
    unit = np.array([ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT]) * body_of(recording.settings).stiffness_scale
    share = np.array([1.0, TOE_SHARE]) / (1.0 + TOE_SHARE)
    squares = (recording.series["stiffness"][:, round(WARM_UP / TICK) :] / unit) ** 2 @ share
    return float(np.nanmean(squares)) if np.isfinite(squares).any() else None


@dataclass(frozen=True, kw_only=True, eq=False)
class WeightResult:
    """One weight of the cost: what each of its seeds came to."""

    weight: float
    gaits: list[Gait]
    """Undisturbed."""
    cost: list[float | None]
    """`stiffness_cost`, undisturbed."""
    falls: dict[float, list[float]]
    """Push [N] -> share of episodes that fell."""

    @property
    def rmse(self) -> list[float | None]:
        """Of each seed, mean over `COMPARED_JOINTS` [deg]; None where it does not walk."""
        values = [[gait.metrics["joints"][joint]["rmse_deg"] for joint in COMPARED_JOINTS] for gait in self.gaits]
        return [None if None in each else float(np.mean(each)) for each in values]

    @property
    def variation(self) -> dict[str, float] | None:
        """Joint -> mean coefficient of variation of K over seeds where it carries load; None for fewer than two."""
        walking = [gait for gait in self.gaits if gait.both.count]
        if len(walking) < 2:
            return None
        return {each.joint: float(each.variation[each.loaded].mean()) for each in agreements(walking)}


def config_of(weight: float, seed: int, term: Term, timesteps: int | None = None) -> TrainingConfig:
    """Preset `walk` with the cost `term` weighted by `weight` >= 0."""
    preset = PRESETS["walk"]
    weights = preset.environment.reward_weights | {term: -weight if weight else 0.0}
    environment = replace(preset.environment, reward_weights=weights)
    return replace(preset, seed=seed, environment=environment, timesteps=timesteps or preset.timesteps)


def folder_of(out: Path, term: Term, weight: float, seed: int) -> Path:
    """Where that training lies in `out`."""
    return out / f"{term}-{weight:g}" / f"seed-{seed}"


def measure_point(
    weight: float,
    folders: Sequence[Path],
    pushes: Sequence[float] = PUSHES,
    seconds: float = 20.0,
    progress: OnProgress = lambda simulated: None,
    **how: Any,
) -> WeightResult:
    """Walk the best policy of each run folder, undisturbed and under each push; `how` as for `recording.record`."""
    point = WeightResult(weight=weight, gaits=[], cost=[], falls={push: [] for push in pushes})
    for folder in folders:
        for push in (0.0, *pushes):
            policy, settings = prepare(str(folder), {"episode_seconds": seconds, "push_newton": push})
            recording = record(policy, settings, name=str(folder), progress=progress, **how)
            if push:
                point.falls[push].append(float(np.mean(recording.fall_reason != "")))
            else:
                point.gaits.append(measure(recording))
                point.cost.append(stiffness_cost(recording))
    return point


def knee(cost: ArrayLike, loss: ArrayLike) -> int | None:
    """Which point of a falling, convex curve of loss over cost is its knee; None where none lies below the chord.

    Kneedle (Satopää et al. 2011): both axes scaled to 0..1, the point farthest below the straight line between the
    curve's ends. Of points given; between them nothing is known.
    """
    x, y = (np.asarray(values, float) for values in (cost, loss))
    if len(x) < 3 or not np.ptp(x) or not np.ptp(y):
        return None
    x, y = (x - x.min()) / np.ptp(x), (y - y.min()) / np.ptp(y)
    ends = [x.argmin(), x.argmax()]
    below = np.interp(x, x[ends], y[ends]) - y
    return int(below.argmax()) if below.max() > 1e-9 else None


def knee_of(points: Sequence[WeightResult]) -> int | None:
    """The knee of loss over stiffness cost: RMSE and falls under pushes, each scaled to 0..1 over the points and added.

    A point whose seeds do not all walk has no place on the curve.
    """
    known = [index for index, point in enumerate(points) if None not in (*point.rmse, *point.cost)]
    walking = [points[index] for index in known]
    if len(walking) < 3:
        return None
    rmse = np.array([np.mean([value for value in point.rmse if value is not None]) for point in walking])
    falls = np.array([np.mean(list(point.falls.values())) for point in walking])
    loss = sum((each - each.min()) / (np.ptp(each) or 1.0) for each in (rmse, falls))
    found = knee([float(np.mean([value for value in point.cost if value is not None])) for point in walking], loss)
    return None if found is None else known[found]


def tradeoff_table(points: Sequence[WeightResult], term: Term) -> str:
    """Markdown: a row a weight, mean ± SD over its seeds."""
    pushes = list(points[0].falls)
    head = [f"weight of `{term}`", "seeds", "mean K² cost", "RMSE thigh, knee, ankle °", "falls"]
    head += [*(f"at ±{push:g} N" for push in pushes), "CV of K: ankle, toe", ""]
    found, lines = knee_of(points), []
    for index, point in enumerate(points):
        marks = ["default"] * (point.weight == -DEFAULT_WEIGHTS[term]) + ["**knee**"] * (index == found)
        variation = point.variation
        falls = [gait.metrics["falls"] / gait.metrics["episodes"] for gait in point.gaits]
        lines.append(
            [
                f"{point.weight:g}",
                str(len(point.gaits)),
                _spread(point.cost),
                _spread(point.rmse),
                *(f"{100 * np.mean(each):.0f} %" for each in (falls, *point.falls.values())),
                MISSING if variation is None else ", ".join(f"{100 * value:.0f} %" for value in variation.values()),
                ", ".join(marks),
            ]
        )
    return table(head, lines)


def save_figure(path: Path, points: Sequence[WeightResult], term: Term) -> None:
    """Write the picture: RMSE, falls and variation over seeds against the stiffness cost; the knee and the default."""
    points = [point for point in points if None not in (*point.rmse, *point.cost)]
    if not points:
        raise SpringfootError("no weight's seeds all walk, so there is nothing to draw")
    cost = np.array([np.mean(np.array(point.cost, float)) for point in points])
    found = knee_of(points)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 3.4), layout="constrained")
        likeness, robustness, agreement = figure.subplots(1, 3)
        _line(likeness, cost, np.array([np.mean(np.array(point.rmse, float)) for point in points]), MODEL, "")
        for point in points:
            likeness.plot(np.array(point.cost, float), np.array(point.rmse, float), ".", color=MODEL, alpha=0.4, ms=4)
        likeness.set(title="Human-likeness", ylabel="RMSE of thigh, knee and ankle (deg)")
        for push, color in zip(points[0].falls, COLORS * len(points[0].falls), strict=False):
            falls = np.array([100 * np.mean(point.falls[push]) for point in points])
            _line(robustness, cost, falls, color, f"±{push:g} N")
        robustness.set(title="Robustness", ylabel="episodes that fall (%)", ylim=(-2, 102))
        for joint, color in zip(("ankle", "toe"), COLORS, strict=False):
            values = [100 * (point.variation or {}).get(joint, np.nan) for point in points]
            _line(agreement, cost, np.array(values), color, joint)
        agreement.set(title="Agreement of seeds", ylabel="CV of K under load (%)", ylim=(0, None))
        for ax in (likeness, robustness, agreement):
            ax.set_xlabel("stiffness cost, mean K² measure")
            ax.grid(color="#ededed", lw=0.6)
            for index, point in enumerate(points):
                if point.weight == -DEFAULT_WEIGHTS[term]:
                    ax.axvline(cost[index], color="#777777", lw=0.9, ls=(0, (2, 2)), zorder=0.5, label="default")
                if index == found:
                    ax.axvline(cost[index], color=PLAN, lw=0.9, zorder=0.4, label="knee")
            if ax.get_legend_handles_labels()[0]:
                ax.legend(frameon=False)
        for x, y, point in zip(cost, (np.mean(np.array(point.rmse, float)) for point in points), points, strict=True):
            likeness.annotate(f"{point.weight:g}", (x, y), (4, 4), textcoords="offset points", fontsize=7.5)
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})


def _line(ax: Axes, x: NDArray, y: NDArray, color: str, label: str) -> None:
    order = np.argsort(x)
    ax.plot(x[order], y[order], "o-", color=color, ms=3.5, lw=1.3, label=label or None)


@dataclass(frozen=True, kw_only=True)
class StiffnessCost(TrainingStudy):
    """Train with different weights of the stiffness cost, walk and be pushed, and draw what each costs and gives.

    A seed that is finished is not trained again: the command may be stopped and begun anew.
    """

    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/stiffness-cost")
    """Folder of all trainings; what is finished in it is kept."""
    term: Term = "stiffness"
    """Which cost: of K, or of changing it."""
    weights: tuple[float, ...] = WEIGHTS
    """Its weights."""
    pushes: tuple[float, ...] = PUSHES
    """Sizes of the pushes [N]."""

    _QUICK_RUNS: ClassVar[Path] = Path("runs/stiffness-cost-quick")
    QUICK: ClassVar[dict[str, Any]] = {**TrainingStudy.QUICK, "runs": _QUICK_RUNS, "weights": (0.02,)}

    def check(self) -> None:
        """Refuse an empty list of weights or pushes as well."""
        super().check()
        if not self.weights or not self.pushes:
            raise SpringfootError("give one weight and one push or more")

    @property
    def total(self) -> float:
        """Simulated time [s], without falls."""
        return len(set(self.weights)) * self.seeds * (1 + len(self.pushes)) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Train what is missing, walk and be pushed."""
        weights = sorted(set(self.weights))
        folders = {
            (weight, seed): folder_of(self.runs, self.term, weight, seed)
            for seed in range(self.seeds)  # every weight once before any twice
            for weight in weights
        }
        jobs = [
            (config_of(*key, self.term, self.timesteps), folder, f"{self.term} {key[0]:g}, seed {key[1]}")
            for key, folder in folders.items()
        ]
        failed = self.train_missing(jobs)
        points = []
        for weight in weights:
            done = [folder for key, folder in folders.items() if key[0] == weight and is_finished(folder)]
            if done:
                points.append(measure_point(weight, done, self.pushes, self.seconds, progress=progress, **self.how))
        if not points:
            raise SpringfootError(f"no finished training of {self.term} in {self.runs}")
        text = f"{tradeoff_table(points, self.term)}\n\n" + (
            f"{self.episodes} episodes × {self.seconds:g} s of each seed's best policy; mean ± SD over seeds; CV of K: "
            "over seeds, mean where the joint carries load. Knee: of RMSE and falls under pushes, each scaled to 0..1 "
            "and added, against the K² cost, the point farthest below the line between the curve's ends (Kneedle)."
        )
        files: dict[str, Any] = {"policies.csv": points_csv(points)}
        if any(None not in (*point.rmse, *point.cost) for point in points):
            files["tradeoff.png"] = partial(save_figure, points=points, term=self.term)
        return Answer(text=text, files=files, sections={SECTION: text}, failed=failed)


def _spread(values: Sequence[float | None]) -> str:
    return plus_minus(mean_sd([value for value in values if value is not None]), ".2f")


def points_csv(points: Sequence[WeightResult]) -> str:
    """CSV: a line for each policy, its weight, cost, RMSE, and share of falls undisturbed and under each push."""
    head = [
        "weight",
        "policy",
        "stiffness_cost",
        "rmse_deg",
        "falls",
        *(f"falls_{push:g}_N" for push in points[0].falls),
    ]
    lines = []
    for point in points:
        for index, (gait, cost, rmse) in enumerate(zip(point.gaits, point.cost, point.rmse, strict=True)):
            falls = [gait.metrics["falls"] / gait.metrics["episodes"], *(each[index] for each in point.falls.values())]
            lines.append([point.weight, gait.metrics["policy"], cost, rmse, *falls])
    return csv_text(head, lines)
