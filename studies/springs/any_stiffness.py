"""Walk the same gait with other stiffnesses, each with the rest angle that gives the gait's torque.

    springfoot study any-stiffness schedule
    springfoot study any-stiffness pretrained --episodes 100

A recorded gait has a mean angle, velocity and torque of ankle and toe at each phase of the leg controller. For any
K(phase) > 0, theta_eq = theta + beta dtheta/dt + tau/K gives back that torque. Each pair of K and theta_eq is a
schedule for the equilibrium `phase`, and walks as the baseline `schedule`: undisturbed, pushed, on uneven ground.
Decisions come at 100 Hz, as often as theta_eq moves: held for longer, K and theta_eq would belong to an earlier phase.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, nan
from typing import Annotated, Any

import numpy as np
import tyro

from springfoot.agents.policies import schedule
from springfoot.arrays import NDArray
from springfoot.envs.control import FEET, GRID, REFERENCE_STIFFNESS, plateau_curve, stiffness_ranges
from springfoot.envs.physics import damping_times
from springfoot.envs.settings import BipedSettings, body_of
from springfoot.envs.task import ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import Recording, policy_and_settings, record
from springfoot.files.markdown import table, text_of
from springfoot.gait.body import TOE_STIFFNESS, Body
from springfoot.gait.springs import SPRINGS, Segment, StiffnessSchedule

from ..base.columns import falls_text, rmse_text, walks_csv
from ..base.study import Answer, OnProgress, WalkingStudy

PHASE_SEGMENTS = 200
"""Segments of a rebuilt schedule: half a percent of a stride each, less than the control window that holds theta_eq."""
STARTS = np.arange(PHASE_SEGMENTS) / PHASE_SEGMENTS
"""First phase of each segment, (PHASE_SEGMENTS,)."""
STIFFNESSES = ("recorded", "flat:150", "flat:250", "flat:400", "times:0.6", "times:1.6", "reversed", "people")
"""Default stiffnesses: the gait's own; one value at every phase [N m/rad of the ankle]; a multiple of the gait's own;
its own reversed in time; people's quasi-stiffness."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeanSprings:
    """Mean springs of a recorded gait over the phase of the leg controller, both legs together.

    Arrays are (PHASE_SEGMENTS, (ankle, toe)).
    """

    body: Body
    """Body that walked."""
    angle: NDArray
    """Angle at the ends of the control windows that began in each segment [rad]."""
    velocity: NDArray
    """Angular velocity at the same instants [rad/s]."""
    torque: NDArray
    """Torque of the springs [N m]."""
    stiffness: NDArray
    """K [N m/rad]."""


def mean_springs(recording: Recording) -> MeanSprings:
    """Return the mean springs of a recorded gait, where it is measured; in segments without a sample they are
    interpolated.

    Raises `SpringfootError` for a gait without samples in half of the segments or more.
    """
    ticks = recording.measured_ticks
    phase = recording.series["phase"][:, ticks].ravel()
    valid = np.isfinite(phase)
    # Index of the segment of each sample; a phase of float32 just below 1 may round up to it.
    segment = np.minimum((phase[valid] * PHASE_SEGMENTS).astype(int), PHASE_SEGMENTS - 1)
    count = np.bincount(segment, minlength=PHASE_SEGMENTS)
    seen = count > 0  # a leg that lands early skips the last segments: they are interpolated
    if not valid.any() or seen.sum() < PHASE_SEGMENTS / 2:
        raise SpringfootError(
            f"{recording.policy} walks no strides whose springs could be rebuilt, where it is measured"
        )

    def mean(name: str) -> NDArray:
        """Return the mean of a series in each segment, (PHASE_SEGMENTS, (ankle, toe)), interpolated where there is no
        sample."""
        values = recording.series[name][:, ticks]  # of all four joints, but `stiffness` of ankle and toe alone
        values = (values if name == "stiffness" else values[..., FEET]).reshape(-1, 2)[valid].astype(float)
        totals = [np.bincount(segment, values[:, joint], PHASE_SEGMENTS)[seen] for joint in range(2)]
        return np.stack([np.interp(STARTS, STARTS[seen], total / count[seen], period=1.0) for total in totals], -1)

    return MeanSprings(
        body=body_of(recording.settings),
        **{name: mean(name) for name in ("angle", "velocity", "torque", "stiffness")},
    )


def rebuilt(springs: MeanSprings, stiffness: NDArray) -> StiffnessSchedule:
    """Return the schedule of K (PHASE_SEGMENTS, 2) > 0 [N m/rad], with the rest angles that give the gait's torque:
    theta_eq = theta + beta dtheta/dt + tau/K."""
    beta = np.array(damping_times(springs.body))[FEET]
    rest = springs.angle + beta * springs.velocity + springs.torque / stiffness
    columns = zip(SPRINGS, stiffness.T, rest.T, strict=True)
    return StiffnessSchedule(**{joint: tuple(map(Segment, STARTS, k, theta)) for joint, k, theta in columns})


def stiffness_named(name: str, springs: MeanSprings) -> NDArray:
    """Return K (PHASE_SEGMENTS, (ankle, toe)) [N m/rad] for a name as in `STIFFNESSES`, with any positive number after
    the colon; raise `SpringfootError` for another name. `springs` are those of the recorded gait."""
    kind, _, text = name.partition(":")  # "flat:150"
    try:
        number = float(text) if text else nan
    except ValueError:
        number = nan
    scale = springs.body.stiffness_scale
    if kind in ("flat", "times") and 0 < number < inf:  # NaN is refused below
        if kind == "times":
            return number * springs.stiffness
        flat = number * np.array([1.0, TOE_STIFFNESS_UNIT / ANKLE_STIFFNESS_UNIT]) * scale
        return np.tile(flat, (PHASE_SEGMENTS, 1))
    if name == "recorded":
        return springs.stiffness
    if name == "reversed":
        return springs.stiffness[::-1]
    if name == "people":
        ankle = np.interp(STARTS, GRID, plateau_curve(REFERENCE_STIFFNESS))
        return np.stack([ankle, np.full(PHASE_SEGMENTS, TOE_STIFFNESS)], -1) * scale
    raise SpringfootError(f"stiffness must be one of {', '.join(STIFFNESSES)} (or other numbers > 0), got {name!r}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """Measurements of one stiffness, under every condition."""

    name: str
    """Name of the stiffness, or of the policy for its own."""
    metrics: dict[str, dict[str, Any]]
    """Condition -> metrics, as in metrics.json."""
    work: dict[str, float | None]
    """Net work into one ankle's spring in an undisturbed stride [J/kg]: by changes of K, and by movement of
    theta_eq."""


def walk_row(name: str, walks: dict[str, Recording]) -> Row:
    """Return the measurements of one stiffness from its recordings by condition, the undisturbed condition first."""
    metrics = {condition: measure(recording).metrics for condition, recording in walks.items()}
    springs = next(iter(metrics.values()))["springs_J_kg"]["ankle"]
    work = {source: springs[f"{source}_changes"] for source in ("stiffness", "equilibrium")}
    return Row(name=name, metrics=metrics, work=work)


def any_stiffness(
    name: str,
    given: dict[str, Any],
    stiffnesses: Sequence[str] = STIFFNESSES,
    disturbances: dict[str, dict[str, Any]] | None = None,
    *,
    progress: OnProgress = lambda seconds: None,
    **how: Any,
) -> tuple[list[Row], dict[str, StiffnessSchedule]]:
    """Walk with the policy `name`, then with its gait rebuilt at each of `stiffnesses`.

    Returns a row for each walk, and the schedule of each stiffness by name.

    Args:
        name: any policy of `policies.policy_and_settings`.
        given: environment settings that differ from the evaluation's standard conditions and the policy's own.
        stiffnesses: as in `STIFFNESSES`; K beyond the range of the actions is clipped to it.
        disturbances: further conditions, by name: settings that differ from the undisturbed condition's.
        progress, how: as for `recording.record`.
    """
    policy, settings = policy_and_settings(name, given, how.get("seed", 0))
    conditions = {"undisturbed": {}} | (disturbances or {})

    def walk(
        row_name: str, make_policy: Callable[[BipedSettings], Any], settings: BipedSettings
    ) -> dict[str, Recording]:
        """Return condition -> recording of one row, by the policy that `make_policy` makes for its settings."""
        recordings = {}
        for condition, changes in conditions.items():
            changed = replace(settings, **changes)
            recordings[condition] = record(make_policy(changed), changed, name=row_name, progress=progress, **how)
        return recordings

    recordings = walk(name, lambda _: policy, settings)
    springs = mean_springs(recordings["undisturbed"])
    rows = [walk_row(name, recordings)]
    schedules = {}
    lowest, highest = stiffness_ranges(settings, springs.body)
    for stiffness in stiffnesses:
        schedules[stiffness] = rebuilt(springs, np.clip(stiffness_named(stiffness, springs), lowest, highest))
        rebuilt_springs = {"schedule": schedules[stiffness], "equilibrium": "phase", "decisions": "100hz"}
        changed = replace(settings, action_mode="absolute", **rebuilt_springs)
        rows.append(walk_row(stiffness, walk(stiffness, schedule, changed)))
    return rows, schedules


def stiffness_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table with a row for each stiffness: the undisturbed walk in full, then falls and RMSE under
    each disturbance."""
    undisturbed, *disturbed = rows[0].metrics
    head = [
        "K",
        "falls",
        "m/s",
        "RMSE thigh / knee / ankle °",
        "peak 1 / valley / peak 2 BW",
        "ankle work + / − J/kg",
        "put in by K / by θ_eq J/kg",
        *(f"{condition}: falls, RMSE °" for condition in disturbed),
    ]
    lines = []
    for row in rows:
        m = row.metrics[undisturbed]
        forces = [m["grf"][f"vertical_{name}_bw"] for name in ("peak1", "valley", "peak2")]
        lines.append(
            [
                f"`{row.name}`",
                falls_text(m),
                text_of(m["speed_m_s"]["mean"], ".3f"),
                rmse_text(m),
                " / ".join(text_of(force, ".2f") for force in forces),
                " / ".join(text_of(work, ".2f") for work in m["ankle_work_J_kg"].values()),
                " / ".join(text_of(work, "+.3f") for work in row.work.values()),
                *(f"{falls_text(row.metrics[name])}, {rmse_text(row.metrics[name])}" for name in disturbed),
            ]
        )
    return table(head, lines)


def stiffness_csv(rows: Sequence[Row]) -> str:
    """Return the CSV with a line for each stiffness and condition."""
    return walks_csv(
        [
            (
                {"stiffness": row.name, "condition": condition}
                | {f"work_by_{source}_J_kg": work for source, work in row.work.items()},
                metrics,
            )
            for row in rows
            for condition, metrics in row.metrics.items()
        ]
    )


@dataclass(frozen=True, kw_only=True)
class AnyStiffness(WalkingStudy):
    """Walk a gait with other stiffnesses, its rest angles rebuilt, undisturbed and disturbed.

    The folder of the results also has each K with its rest angles, for evaluate.py schedule --equilibrium phase
    --decisions 100hz --schedule FILE.
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "schedule"
    """Policy of the gait: any of evaluate.py."""
    stiffness: tuple[str, ...] = STIFFNESSES
    """Stiffnesses: recorded, flat:N (ankle N N·m/rad, toe a fifth of it), times:X, reversed, people."""
    seconds: float = 12.0
    """Length of each episode."""
    push_newton: float = 150.0
    """Size of the pushes [N]."""
    unevenness_m: float = 0.01
    """Unevenness of the ground [m]."""

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        conditions = 3  # undisturbed, pushed, on uneven ground
        return (1 + len(self.stiffness)) * conditions * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk the policy's gait with every stiffness, undisturbed, pushed and on uneven ground."""
        disturbances = {
            f"±{self.push_newton:g} N": {"push_newton": self.push_newton},
            f"±{100 * self.unevenness_m:g} cm": {"unevenness_m": self.unevenness_m},
        }
        given = {"episode_seconds": self.seconds}
        rows, schedules = any_stiffness(self.policy, given, self.stiffness, disturbances, progress=progress, **self.how)
        text = (
            f"{stiffness_table(rows)}\n\n"
            f"First row: `{self.policy}` itself; each other row walks its mean torque with this K and "
            f"θ_eq = θ + β·θ̇ + τ/K over the controller's phase. {self.episodes} episodes × {self.seconds:g} s, the "
            f"same seeds in every row; RMSE to people's mean; work put into one ankle's spring a stride, net."
        )
        files = {
            f"{name.replace(':', '-')}.json": json.dumps(springs.to_json()) + "\n"
            for name, springs in schedules.items()
        }
        return Answer(text=text, files={"stiffness.csv": stiffness_csv(rows)} | files)
