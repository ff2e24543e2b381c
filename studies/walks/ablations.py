"""Measure the contribution of each part of preset `walk`, by training without it, and of each input of the walk
with the tuned schedule.

    springfoot study ablations --seeds 3 --constant 363 79.5

Every row differs from the preset in its flags and in nothing else. A finished seed is neither trained nor measured
again, so the command may be stopped, started again with more rows or seeds, and run with `--no-train` to report the
finished ones. All rows are measured with the default reward, so their returns compare.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.agents.training import PRESETS, Engine, TrainingConfig, is_finished, train_missing
from springfoot.envs.control import GRID, PLATEAUS, LegConstants, foot_curves, reference_walk_at
from springfoot.envs.physics import ACTION_STEP
from springfoot.envs.settings import BipedSettings, settings_from, settings_to_json
from springfoot.errors import SpringfootError, require_count
from springfoot.evaluation.report import people_metrics
from springfoot.files.markdown import MISSING, plus_minus, table, text_of
from springfoot.files.writing import csv_text
from springfoot.gait.people import mean_sd
from springfoot.gait.springs import SPRINGS, Segment, StiffnessSchedule

from ..base.columns import COMPARED_JOINTS, Column
from ..base.pushed_walks import PushedWalks, kept_metrics
from ..base.study import Answer, OnProgress, WalkingStudy

ABLATIONS: dict[str, dict[str, Any]] = {
    "walk": {},
    "residual": {"action_mode": "residual"},
    "plan-moments": {"feedforward": "plan"},
    "neutral": {"equilibrium": "neutral"},
    "phase": {"equilibrium": "phase"},
    "100hz": {"decisions": "100hz"},
    "25hz": {"decisions": "25hz"},
    "event": {"decisions": "event"},
    "no-com": {"reward_weights": {"com_x": 0.0, "com_z": 0.0}},
    "no-zmp": {"reward_weights": {"zmp": 0.0}},
    "no-plan": {"reward_weights": {"com_x": 0.0, "com_z": 0.0, "zmp": 0.0}},
    "no-pose": {"reward_weights": {"pose": 0.0}},
    "no-k-cost": {"reward_weights": {"stiffness": 0.0, "stiffness_rate": 0.0}},
    "ankle-only": {"stiffness_joints": "ankle"},
    "toe-only": {"stiffness_joints": "toe"},
}
"""Row -> environment settings that differ from preset `walk` (planned, absolute, 50 Hz, all terms, both joints);
`phase` also has the schedule of `phase_schedule`."""
MEANING = {
    "walk": "the preset: planned equilibrium, 50 Hz, every reward term, ankle and toe",
    "residual": "a factor on the fixed schedule, in place of K itself",
    "plan-moments": "moments fed forward from the plan's inverse dynamics, not people's; leg constants of its own",
    "neutral": "θ_eq constant, on the leg constants of `neutral`",
    "phase": "θ_eq constant in each of ten phases, the planned one's mean",
    "100hz": "K decided at 100 Hz",
    "25hz": "K decided at 25 Hz",
    "event": "K decided at heel strike, foot flat, heel-off and toe-off of each leg",
    "no-com": "without reward for the CoM's x and z",
    "no-zmp": "without reward for the CoP",
    "no-plan": "without reward for the CoM's x and z and for the CoP",
    "no-pose": "without reward for joint angles",
    "no-k-cost": "without cost of K and of changing it",
    "ankle-only": "toe with the fixed schedule",
    "toe-only": "ankle with the fixed schedule",
}
KNOT_FIELDS = ("hip_knots_deg", "knee_knots_deg", "ankle_knots_deg")
INPUTS: dict[str, Callable[[LegConstants], LegConstants]] = {
    "all inputs": lambda c: c,
    "no moments of hip and knee fed forward": lambda c: replace(c, feedforward=(0.0, 0.0, c.feedforward[2])),
    "no ankle moment fed forward": lambda c: replace(c, feedforward=(*c.feedforward[:2], 0.0)),
    "no knots": lambda c: replace(c, **{name: (0.0,) * len(getattr(c, name)) for name in KNOT_FIELDS}),
    "no speed feedback to the stance hip": lambda c: replace(c, speed_torque=0.0),
    "no shift of the swing hip by speed": lambda c: replace(c, swing_speed_gain=0.0),
}
"""Row -> the fixed walk's leg constants (baseline `schedule`, planned equilibrium) without one input, the rest as
tuned."""
ABLATION_COLUMNS = (
    Column("falls", ".1f", ("undisturbed", "falls")),
    Column("pushed", ".1f", ("pushed", "falls")),
    Column("return", ".0f", ("undisturbed", "return", "mean")),
    Column("m/s", ".2f", ("undisturbed", "speed_m_s", "mean")),
    *(Column(f"{joint} °", ".1f", ("undisturbed", "joints", joint, "rmse_deg")) for joint in COMPARED_JOINTS),
    *(Column(f"peak {k} BW", ".2f", ("undisturbed", "grf", f"vertical_peak{k}_bw")) for k in (1, 2)),
    Column("r up", ".2f", ("undisturbed", "grf", "vertical_r")),
    Column("r fore-aft", ".2f", ("undisturbed", "grf", "forward_r")),
    Column("ankle N·m/kg", ".2f", ("undisturbed", "moments", "ankle", "peak_Nm_kg")),
    Column("at %", ".0f", ("undisturbed", "moments", "ankle", "peak_percent")),
    Column("CoM x off m", ".4f", ("undisturbed", "com", "x_rmse_m")),
    Column("CoP off m", ".4f", ("undisturbed", "zmp", "cop_rmse_single_support_m")),
)
"""Columns of every table."""

RESULT = "ablation.json"
"""File of a trained row's metrics, in its folder."""


def phase_schedule(settings: BipedSettings) -> StiffnessSchedule:
    """Return the planned rest angles and the tuned schedule of `settings` as ten springs of constant K and theta_eq.

    Each stretch of the stride between two of `PLATEAUS` has one spring: its mean K, and the rest angle with the same
    mean K theta_eq. With fewer springs, as between gait events, the walk falls.
    """
    walk = reference_walk_at(settings, settings.speed)
    planned = replace(settings, equilibrium="planned", schedule=None)
    rest, stiffness = foot_curves(planned, walk.constants[0], walk)
    stretch = np.searchsorted(PLATEAUS, GRID, side="right") - 1  # index of each sample's stretch
    of_joints: list[list[Segment]] = [[], []]
    for index, start in enumerate(PLATEAUS):
        for joint, segments in enumerate(of_joints):
            k = stiffness[stretch == index, joint]
            theta = rest[stretch == index, joint]
            segments.append(Segment(start, float(k.mean()), float((k * theta).mean() / k.mean())))
    return StiffnessSchedule(**dict(zip(SPRINGS, map(tuple, of_joints), strict=True)))


def config_of(name: str, seed: int = 0, timesteps: int | None = None) -> TrainingConfig:
    """Return the training of a row of `ABLATIONS`: simulated time as in the preset, or `timesteps` of 20 ms.

    A row that decides more often takes more, shorter steps.
    """
    preset = PRESETS["walk"]
    changes = dict(ABLATIONS[name])
    if name == "phase":
        changes["schedule"] = phase_schedule(preset.environment)
    environment = settings_from(**settings_to_json(preset.environment) | changes)
    steps_per_20ms = ACTION_STEP / environment.step_seconds
    return replace(
        preset,
        seed=seed,
        environment=environment,
        timesteps=round(steps_per_20ms * (timesteps or preset.timesteps)),
        update_steps=round(steps_per_20ms * preset.update_steps),
        eval_interval=round(steps_per_20ms * preset.eval_interval),
    )


def jobs(out: Path, names: Sequence[str], seeds: int, timesteps: int | None) -> list[tuple[TrainingConfig, Path, str]]:
    """Return configuration, folder and label of the training of each row and seed."""
    order = product(range(seeds), names)  # the first seed of every row, then the second
    return [
        (config_of(name, seed, timesteps), out / name / f"seed-{seed}", f"{name}, seed {seed}") for seed, name in order
    ]


Rows = dict[str, list[dict[str, Any]]]
"""Row of a table -> metrics of each seed, `undisturbed` and `pushed`."""


def measure_trained(out: Path, walks: PushedWalks) -> Rows:
    """Return the metrics of the finished seeds of each row of `ABLATIONS`; rows without a finished seed are left out.

    Metrics that a seed's folder keeps are not measured again.
    """
    rows = {}
    for name in ABLATIONS:
        folders = sorted((out / name).glob("seed-*"), key=lambda folder: int(folder.name.removeprefix("seed-")))
        finished = [folder for folder in folders if is_finished(folder)]
        if finished:
            rows[name] = [
                kept_metrics(folder / RESULT, walks, name, partial(walks.metrics, str(folder))) for folder in finished
            ]
    return rows


def measure_inputs(out: Path, walks: PushedWalks) -> Rows:
    """Return the metrics of the baseline `schedule` with the leg constants of each of `INPUTS`, and with people's ankle
    angle alone as rest angle. Metrics that the folder `out` keeps are not measured again."""
    tuned = reference_walk_at(BipedSettings(), BipedSettings().speed).constants[0]
    rows: Rows = {}
    for number, (name, change) in enumerate(INPUTS.items()):
        legs = change(tuned)
        make = partial(walks.metrics, "schedule", legs=legs)
        rows[name] = [kept_metrics(out / f"input-{number}.json", walks, vars(legs), make)]
    make = partial(walks.metrics, "schedule", {"equilibrium": "angle"})
    of_angle = kept_metrics(out / "input-angle.json", walks, vars(tuned), make)
    return rows | {"θ_eq: people's ankle angle alone": [of_angle]}


def measure_springs(out: Path, walks: PushedWalks, constant: tuple[float, float] | None) -> Rows:
    """Return the metrics of the baseline `thesis`, and before it of the stiffness `constant` (ankle, toe) [N m/rad]
    unless that is None. Metrics that the folder `out` keeps are not measured again."""
    names = {"thesis lines": "thesis"}
    if constant is not None:
        names = {"best fixed spring": "constant:{:g},{:g}".format(*constant)} | names
    return {
        f"{label} (`{name}`)": [
            kept_metrics(out / f"{name.partition(':')[0]}.json", walks, name, partial(walks.metrics, name))
        ]
        for label, name in names.items()
    }


def rows_table(rows: Rows, head: str, people: bool = False) -> str:
    """Return the Markdown table of `ABLATION_COLUMNS`, mean ± SD (n - 1) over the seeds of each row.

    `head` is the label of the rows' column; with `people` the last row has people's numbers.
    """
    lines = []
    for name, seeds in rows.items():
        cells = [name, str(len(seeds))]
        for column in ABLATION_COLUMNS:
            values = [value for value in map(column.of, seeds) if value is not None]
            is_count = column.path[-1] == "falls" and len(values) == 1  # a whole number, no mean
            cells.append(plus_minus(mean_sd(values), ".0f" if is_count else column.pattern))
        lines.append(cells)
    if people:
        of_people = people_metrics(BipedSettings())
        nested = of_people | {"speed_m_s": {"mean": of_people["speed_m_s"]}}
        nested["moments"] = {name: {"peak_Nm_kg": peak} for name, peak in of_people["moments"].items()}
        lines.append(["people", MISSING, *(_people_cell(nested, column) for column in ABLATION_COLUMNS)])
    return table([head, "seeds", *(column.label for column in ABLATION_COLUMNS)], lines)


def _people_cell(metrics: dict[str, Any], column: Column) -> str:
    """Return people's number of a column, from `metrics` nested as those of a walk under one condition; a dash if there
    is none."""
    value: Any = metrics
    for key in column.path[1:]:  # [0] is the condition
        value = value.get(key) if isinstance(value, dict) else None
    return text_of(value, column.pattern)


def ablations_csv(tables: dict[str, Rows]) -> str:
    """Return the CSV with a line for each seed of each row of each table."""
    lines = [
        [name, row, seed, *(column.of(metrics) for column in ABLATION_COLUMNS)]
        for name, rows in tables.items()
        for row, seeds in rows.items()
        for seed, metrics in enumerate(seeds)
    ]
    return csv_text(["table", "row", "seed", *(column.csv_name for column in ABLATION_COLUMNS)], lines)


@dataclass(frozen=True, kw_only=True)
class Ablations(WalkingStudy):
    """Train preset `walk` without each of its parts, and measure the contribution of each.

    A finished seed is neither trained nor measured again: the command may be stopped and started again.
    """

    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/ablations")
    """Folder of all trainings and their metrics; finished ones are kept."""
    seeds: int = 3
    """Seeds of each training, 0 and the next ones."""
    timesteps: int | None = None
    """Steps of 20 ms of each training, the preset's unless given."""
    engine: Engine = "here"
    """Where missing seeds are trained: in processes on this machine, or on a Ray cluster (extra `rllib`) with
    nodes that share the folder of the trainings."""
    train: bool = True
    """Train missing seeds; without, use the finished ones."""
    only: tuple[str, ...] = ()
    """Rows to train, all of them unless given."""
    constant: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="ANKLE TOE")] = None
    """A fixed spring [N m/rad] to compare the trained policies with."""
    push_newton: float = 150.0
    """Size of the pushes [N]."""

    QUICK: ClassVar[dict[str, Any]] = {
        **WalkingStudy.QUICK,
        **{"seeds": 1, "timesteps": 8192, "runs": Path("runs/ablations-quick"), "only": ("walk",)},
    }

    def check(self) -> None:
        """Refuse counts out of range and unknown rows."""
        super().check()
        require_count("seeds", self.seeds)
        if self.timesteps is not None:
            require_count("timesteps", self.timesteps)
        for name in self.only:
            if name not in ABLATIONS:
                raise SpringfootError(f"no row {name!r}; there are {', '.join(ABLATIONS)}")

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        trained = len(self.only or ABLATIONS) * self.seeds
        inputs = len(INPUTS) + 1  # 1: the row of the ankle's angle alone
        fixed_springs = 1 + (self.constant is not None)  # the thesis's lines, the constant
        rows = trained + inputs + fixed_springs
        conditions = 2  # undisturbed, pushed
        return conditions * rows * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Train missing seeds, and measure trained policies, springs and inputs."""
        walks = PushedWalks(seconds=self.seconds, push_newton=self.push_newton, progress=progress, **self.how)
        failed = self._train()
        trained = measure_trained(self.runs, walks)
        of_springs = measure_springs(self.runs, walks, self.constant)
        learned = {"walk": "learned, planned θ_eq", "neutral": "learned, constant θ_eq"}
        of_springs |= {f"{label} (`{name}`)": trained[name] for name, label in learned.items() if name in trained}
        explained = {f"`{name}`: {MEANING[name]}": seeds for name, seeds in trained.items()}
        tables = {"SPRINGS": of_springs, "ABLATIONS": explained, "INPUTS": measure_inputs(self.runs, walks)}
        heads = {"SPRINGS": "spring", "ABLATIONS": "training", "INPUTS": "fixed schedule"}
        note = f"{walks.sentence} Mean ± SD over training seeds."
        texts = {name: rows_table(rows, heads[name], people=name == "SPRINGS") for name, rows in tables.items()}
        text = "\n\n".join([*texts.values(), note])
        return Answer(text=text, files={"ablations.csv": ablations_csv(tables)}, failed=failed)

    def _train(self) -> bool:
        """Train the missing seeds of each row of the table if `train` is set; return True if a training failed.

        Raises `KeyboardInterrupt` if the user stopped one.
        """
        missing = jobs(self.runs, self.only or tuple(ABLATIONS), self.seeds, self.timesteps)
        status = train_missing(missing, self.engine) if self.train else "finished"
        if status == "interrupted":
            raise KeyboardInterrupt
        return status == "failed"
