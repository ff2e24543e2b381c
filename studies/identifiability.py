"""Is the stiffness of a gait identified? The same gait walked with any other stiffness, its equilibrium rebuilt.

    python -m springfoot.studies.identifiability schedule
    python -m springfoot.studies.identifiability pretrained --episodes 100 --page docs/results.md

A recorded gait has a mean angle, velocity and torque of ankle and toe at each phase of the leg controller. For any
K(phase) > 0, theta_eq = theta + beta dtheta/dt + tau/K gives back that torque. Each such pair of K and theta_eq is a
schedule for equilibrium `phase`, and walks here as the baseline `schedule`: undisturbed, pushed, on uneven ground. It
is decided at 100 Hz, as theta_eq moves: held longer, K and theta_eq would be those of an earlier phase.
"""

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, nan
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray
from tqdm import tqdm

from springfoot.agents.baselines import schedule
from springfoot.agents.command_line import exit_code
from springfoot.agents.files import write_atomically
from springfoot.agents.markdown import table, text_of, write_section
from springfoot.envs.control.equilibrium import REFERENCE_STIFFNESS, plateau_curve
from springfoot.envs.control.foot_springs import FEET, stiffness_ranges
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.physics.model import damping_times
from springfoot.envs.settings import BipedSettings, body_of
from springfoot.envs.task.reward_reference import ANKLE_STIFFNESS_UNIT, TOE_STIFFNESS_UNIT
from springfoot.evaluation.metrics import measure
from springfoot.evaluation.recording import TICK, Recording, prepare, record
from springfoot.evaluation.stride_tally import WARM_UP
from springfoot.gait.body import Body
from springfoot.gait.errors import SpringfootError, require_count
from springfoot.gait.stiffness import SPRINGS, TOE_STIFFNESS, Segment, StiffnessSchedule

SECTION = "ANY-K"
"""Of the results page."""
PHASE_SEGMENTS = 200
"""Of a rebuilt schedule: half a percent of a stride each, less than the control window in which theta_eq is held."""
STARTS = np.arange(PHASE_SEGMENTS) / PHASE_SEGMENTS
"""Their first phases, (PHASE_SEGMENTS,)."""
STIFFNESSES = ("recorded", "flat:150", "flat:250", "flat:400", "times:0.6", "times:1.6", "reversed", "people")
"""The K walked with by default: the gait's own; the same at every phase [N m/rad of the ankle]; a multiple of its own;
its own backwards in time; people's quasi-stiffness."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeanSprings:
    """Ankle and toe of both legs over the phase of the leg controller, means of a recording, (PHASE_SEGMENTS, 2) each."""

    body: Body
    angle: NDArray
    """At the ends of the control windows that began in each segment [rad]."""
    velocity: NDArray
    """[rad/s]."""
    torque: NDArray
    """Of the springs [N m]."""
    stiffness: NDArray
    """K [N m/rad]."""


def mean_springs(recording: Recording) -> MeanSprings:
    """What the springs of a recorded gait did at each phase, the first `WARM_UP` seconds of each episode left out."""
    begin = round(WARM_UP / TICK)
    phase = recording.series["phase"][:, begin:].ravel()
    walked = np.isfinite(phase)
    segment = np.minimum((phase[walked] * PHASE_SEGMENTS).astype(int), PHASE_SEGMENTS - 1)
    count = np.bincount(segment, minlength=PHASE_SEGMENTS)
    if not walked.any() or (count > 0).sum() < PHASE_SEGMENTS / 2:
        raise SpringfootError(f"{recording.policy} walks no strides after {WARM_UP:g} s whose springs could be rebuilt")

    def mean(name: str) -> NDArray:
        values = recording.series[name][:, begin:]
        values = (values if name == "stiffness" else values[..., FEET]).reshape(-1, 2)[walked].astype(float)
        totals = [np.bincount(segment, values[:, joint], PHASE_SEGMENTS)[count > 0] for joint in range(2)]
        at = STARTS[count > 0]  # a leg that lands early skips the last phases
        return np.stack([np.interp(STARTS, at, total / count[count > 0], period=1.0) for total in totals], -1)

    return MeanSprings(
        body=body_of(recording.settings),
        **{name: mean(name) for name in ("angle", "velocity", "torque", "stiffness")},
    )


def rebuilt(springs: MeanSprings, stiffness: NDArray) -> StiffnessSchedule:
    """K (PHASE_SEGMENTS, 2) > 0 [N m/rad] with the equilibrium at which it gives the gait's torque on the gait's course."""
    beta = np.array(damping_times(springs.body))[FEET]
    rest = springs.angle + beta * springs.velocity + springs.torque / stiffness
    columns = zip(SPRINGS, stiffness.T, rest.T, strict=True)
    return StiffnessSchedule(**{joint: tuple(map(Segment, STARTS, k, theta)) for joint, k, theta in columns})


def stiffness_named(name: str, springs: MeanSprings) -> NDArray:
    """(PHASE_SEGMENTS, 2) K of ankle and toe [N m/rad]: one of `STIFFNESSES`, or those with other numbers."""
    kind, _, text = name.partition(":")
    try:
        number = float(text) if text else nan
    except ValueError:
        number = nan
    scale = springs.body.stiffness_scale
    if kind in ("flat", "times") and 0 < number < inf:
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


def spring_work(recording: Recording) -> dict[str, NDArray]:
    """Work put into the springs in each control window [J], (E, T, side, 2) for ankle and toe, NaN before the second.

    `stiffness`: by changing K under load; `equilibrium`: by moving theta_eq. As the environment's `work/` of a step.
    """
    series = {name: values.astype(float) for name, values in recording.series.items()}
    angle, rest, stiffness = series["angle"][..., FEET], series["equilibrium"], series["stiffness"]
    work = {name: np.full(stiffness.shape, np.nan) for name in ("stiffness", "equilibrium")}
    before, moved = rest[:, :-1] - angle[:, :-1], rest[:, 1:] - angle[:, :-1]
    work["stiffness"][:, 1:] = 0.5 * np.diff(stiffness, axis=1) * before**2
    work["equilibrium"][:, 1:] = 0.5 * stiffness[:, 1:] * (moved**2 - before**2)
    return work


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """One stiffness, walked under every condition."""

    name: str
    metrics: dict[str, dict[str, Any]]
    """Condition -> as metrics.json."""
    work: dict[str, float | None]
    """Net work put into one ankle's spring in an undisturbed stride [J/kg], by `stiffness` and by `equilibrium`."""


def walk_row(name: str, walks: dict[str, Recording]) -> Row:
    """Measure the recordings of one stiffness, by condition; the first is the undisturbed one."""
    metrics = {condition: measure(recording).metrics for condition, recording in walks.items()}
    undisturbed = next(iter(walks.values()))
    cadence, begin = next(iter(metrics.values()))["cadence_steps_min"], round(WARM_UP / TICK)
    work: dict[str, float | None] = {}
    for source, joules in spring_work(undisturbed).items():
        power = joules[:, begin:, :, 0] / TICK / undisturbed.settings.mass
        work[source] = float(np.nanmean(power)) * 120.0 / cadence if cadence else None
    return Row(name=name, metrics=metrics, work=work)


def any_stiffness(
    name: str,
    given: dict[str, Any],
    stiffnesses: Sequence[str] = STIFFNESSES,
    disturbances: dict[str, dict[str, Any]] | None = None,
    *,
    progress: Callable[[float], object] = lambda seconds: None,
    **how: Any,
) -> tuple[list[Row], dict[str, StiffnessSchedule]]:
    """The policy `name` and its gait rebuilt with each of `stiffnesses`; also the schedules, by their names.

    Args:
        name: any policy of `recording.prepare`.
        given: environment settings that differ from the evaluation's standard conditions and the policy's own.
        stiffnesses: as in `STIFFNESSES`; values beyond the action's range are the nearer end's.
        disturbances: more conditions, by name: settings that differ from the undisturbed one's.
        progress, how: as for `recording.record`.
    """
    policy, settings = prepare(name, given, how.get("seed", 0))
    conditions = {"undisturbed": {}} | (disturbances or {})

    def walk(name: str, make: Callable[[BipedSettings], Any], settings: BipedSettings) -> dict[str, Recording]:
        recordings = {}
        for condition, other in conditions.items():
            changed = replace(settings, **other)
            recordings[condition] = record(make(changed), changed, name=name, progress=progress, **how)
        return recordings

    own = walk(name, lambda _: policy, settings)
    springs = mean_springs(own["undisturbed"])
    rows, schedules = [walk_row(name, own)], {}
    lowest, highest = stiffness_ranges(settings, springs.body)
    for each in stiffnesses:
        schedules[each] = rebuilt(springs, np.clip(stiffness_named(each, springs), lowest, highest))
        own_springs = {"schedule": schedules[each].to_json(), "equilibrium": "phase", "decisions": "100hz"}
        changed = replace(settings, action_mode="absolute", **own_springs)
        rows.append(walk_row(each, walk(each, schedule, changed)))
    return rows, schedules


def stiffness_table(rows: Sequence[Row]) -> str:
    """Markdown: a row for each stiffness; undisturbed, and what falls and how near people it walks when disturbed."""
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
                _falls(m),
                text_of(m["speed_m_s"]["mean"], ".3f"),
                _rmse(m),
                " / ".join(text_of(force, ".2f") for force in forces),
                " / ".join(text_of(work, ".2f") for work in m["ankle_work_J_kg"].values()),
                " / ".join(text_of(work, "+.3f") for work in row.work.values()),
                *(f"{_falls(row.metrics[name])}, {_rmse(row.metrics[name])}" for name in disturbed),
            ]
        )
    return table(head, lines)


def _falls(metrics: dict[str, Any]) -> str:
    return f"{metrics['falls']} of {metrics['episodes']}"


def _rmse(metrics: dict[str, Any]) -> str:
    return " / ".join(text_of(metrics["joints"][joint]["rmse_deg"], ".1f") for joint in ("thigh", "knee", "ankle"))


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Walk a gait again with any stiffness, its equilibrium rebuilt, undisturbed and disturbed."""

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "schedule"
    """Whose gait: any policy of evaluate.py."""
    stiffness: tuple[str, ...] = STIFFNESSES
    """The K walked with: recorded, flat:N (ankle N N·m/rad, toe a fifth of it), times:X, reversed, people."""
    episodes: int = 20
    """Episodes of each row and condition."""
    seconds: float = 12.0
    """Length of each."""
    seed: int = 0
    """Episode i is seeded with seed + i, in every row."""
    push_newton: float = 150.0
    """Size of the pushes [N]."""
    unevenness_m: float = 0.01
    """Unevenness of the ground [m]."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""
    schedules: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Also write each K with its equilibrium there, for evaluate.py schedule --equilibrium phase --decisions 100hz
    --schedule FILE."""
    page: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Also write the table into this page, between the markers of ANY-K."""


def run(flags: Flags) -> None:
    """Walk every row, print the table, and write what was asked for."""
    for name, least in (("episodes", 1), ("seed", 0), ("threads", 1)):
        require_count(name, getattr(flags, name), least)
    disturbances = {
        f"±{flags.push_newton:g} N": {"push_newton": flags.push_newton},
        f"±{100 * flags.unevenness_m:g} cm": {"unevenness_m": flags.unevenness_m},
    }
    how = {"episodes": flags.episodes, "seed": flags.seed, "threads": flags.threads}
    given = {"episode_seconds": flags.seconds}
    with tqdm(desc="any stiffness", unit="s", unit_scale=True, leave=False, disable=None) as bar:
        rows, schedules = any_stiffness(flags.policy, given, flags.stiffness, disturbances, progress=bar.update, **how)
    text = f"{stiffness_table(rows)}\n\n{_what_ran(flags)}"
    print(text)
    if flags.schedules is not None:
        flags.schedules.mkdir(parents=True, exist_ok=True)
        for name, each in schedules.items():
            content = json.dumps(each.to_json()) + "\n"
            write_atomically(flags.schedules / f"{name.replace(':', '-')}.json", content.encode())
    if flags.page is not None:
        command = f"`python -m springfoot.studies.identifiability {flags.policy}`"
        write_section(flags.page, SECTION, f"{text} Made by {command}.")


def _what_ran(flags: Flags) -> str:
    return (
        f"First row: `{flags.policy}` itself; each other row walks its mean torque with this K and "
        f"θ_eq = θ + β·θ̇ + τ/K over the controller's phase. {flags.episodes} episodes × {flags.seconds:g} s, the same "
        f"seeds in every row; RMSE to people's mean; work put into one ankle's spring a stride, net."
    )


def main() -> int:
    """Exit code: 0 done, 2 bad input, 130 ended by Ctrl-C."""
    flags = tyro.cli(Flags, prog="springfoot.studies.identifiability", description=__doc__)
    return exit_code("identified", lambda: run(flags))


if __name__ == "__main__":
    sys.exit(main())
