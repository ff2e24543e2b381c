"""Write a walk's springs as tables for a controller: K and theta_eq over the stride, and as a few finite states.

Both are read back as policies (`springfoot.agents.policies.schedule_files`).
"""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.control.decision_times import planned_events
from springfoot.envs.control.stiffness_control import FEET
from springfoot.envs.physics.model import SIDES, damping_times
from springfoot.envs.settings.settings import body_of, reference_gait
from springfoot.files.digest import BLANK_DIGEST, DIGEST, with_digest
from springfoot.files.writing import csv_text
from springfoot.gait.body.body import Body
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.springs.stiffness import SPRINGS

from ..recording.open_loop import MEAN_KNOTS, alike_legs, deciding_legs, decisions_of, mean_over_phase
from ..recording.recording import Recording

STATES = ("loading", "early mid-stance", "late mid-stance", "early push-off", "late push-off", "swing")
"""Phases of the stride in which a finite-state controller holds K and theta_eq."""


def write_schedules(folder: Path, recording: Recording) -> None:
    """Write `stiffness_schedule.csv` and, unless both feet have a device, `finite_states.json`.

    Where legs are not alike (`alike_legs`), each that decides has its own, `finite_states_left.json` or `_right`.
    """
    settings = recording.settings
    body = body_of(recording.settings)
    text = schedule_csv(recording.policy, body, settings.speed, settings.equilibrium, schedule_curves(recording))
    (folder / "stiffness_schedule.csv").write_text(text, encoding="utf-8", newline="")
    groups = alike_legs(recording) if deciding_legs(settings) else []
    for legs in groups:
        table = states_json(finite_states(recording, legs))
        end = f"_{SIDES[legs[0]]}" if len(legs) == 1 else ""
        (folder / f"finite_states{end}.json").write_text(table, encoding="utf-8")


def schedule_csv(policy: str, body: Body, speed: float, equilibrium: str, curves: Mapping[str, NDArray]) -> str:
    """Return the CSV text of the stiffness that was recorded from the policy `policy`, a row for each percent of the
    stride.

    `curves` are (101,) by column as in `schedule_curves`, `equilibrium` is the setting that they need.
    """
    # Columns that say where the curves come from, the same in every row.
    origin = {
        "policy": policy,
        "height_m": body.height,
        "mass_kg": body.total_mass,
        "speed_m_s": speed,
        "equilibrium": equilibrium,
    }
    rows = []
    for percent in map(int, PERCENT):
        of_percent = [curve[percent] for curve in curves.values()]
        rows.append([percent, *origin.values(), *of_percent, BLANK_DIGEST])
    # The digest of the whole text stands in each row, in place of the blank one, so that a changed file is noticed.
    return with_digest(csv_text(["percent", *origin, *curves, DIGEST], rows))


def states_json(table: Mapping[str, Any]) -> str:
    """Return the text of a table of finite states, as `table_of_states` returns it."""
    return with_digest(
        json.dumps({**table, DIGEST: BLANK_DIGEST}, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    )


def table_of_states(policy: str, body: Body, speed: float, states: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the content of a table of finite states of the policy named `policy`; `states` are those of
    `finite_states`."""
    return {
        "format": "springfoot finite states",
        "version": 1,
        "policy": policy,
        "law": "torque = stiffness x (equilibrium - angle - damping_time x rate) in SI; dorsiflexion, toe up positive",
        "phase": "share of the leg's stride, from its heel strike on; a state holds until the next one begins",
        "height_m": body.height,
        "mass_kg": body.total_mass,
        "speed_m_s": speed,
        "states": states,
    }


def schedule_curves(recording: Recording) -> dict[str, NDArray]:
    """Return column of `stiffness_schedule.csv` -> (101,) over percent of the leg's phase.

    Mean K [N m/rad] and theta_eq [deg] of each spring at its decisions, and their standard deviation at equal phase;
    NaN without decisions.
    """
    curves: dict[str, NDArray] = {}
    for side, name in enumerate(SIDES):
        for series, column, unit in (
            ("stiffness", "stiffness_Nm_per_rad", 1.0),
            ("equilibrium", "equilibrium_deg", np.degrees(1.0)),
        ):
            phase, values = decisions_of(recording, [side], series)
            mean, sd = _mean_and_sd_over_phase(phase, values * unit)
            for joint, spring in enumerate(SPRINGS):
                curves[f"{spring}_{name}_{column}"] = mean[:, joint]
                curves[f"{spring}_{name}_{column}_sd"] = sd[:, joint]
    return dict(sorted(curves.items(), key=lambda item: "equilibrium" in item[0]))  # first all K, then all rest angles


def _mean_and_sd_over_phase(phase: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    """Return mean and standard deviation over percent of the phase, (101, 2) each, of `values` (n, 2) at `phase` (n,).

    The columns are ankle and toe. Both curves are linear between the knots of `mean_over_phase`; NaN without values.
    """
    if not len(phase):
        missing = np.full((len(PERCENT), values.shape[1]), np.nan)
        return missing, missing
    knots = np.clip(mean_over_phase(phase, values), values.min(0), values.max(0))
    squares = (values - _between_knots(knots, phase)) ** 2
    variance = np.maximum(mean_over_phase(phase, squares), 0.0)
    return _between_knots(knots, PERCENT / 100), np.sqrt(_between_knots(variance, PERCENT / 100))


def _between_knots(knots: NDArray, phase: NDArray) -> NDArray:
    """Return at `phase` (n,) the periodic curves (n, C) that are linear between `knots` (MEAN_KNOTS, C)."""
    knot_phases = np.arange(MEAN_KNOTS) / MEAN_KNOTS
    return np.stack([np.interp(phase, knot_phases, curve, period=1.0) for curve in knots.T], -1)


def finite_states(recording: Recording, legs: Sequence[int]) -> dict[str, Any]:
    """Return the content of `finite_states.json`: K, beta and theta_eq of ankle and toe in each of `STATES`.

    They are of all `legs` (0 left, 1 right) together. K is the mean over the state; theta_eq is the rest angle with
    which the spring has the state's mean torque at its mean angle and rate. None stands for a state that the walk does
    not have; times with slack muscles are left out. The states begin at the target's events (`planned_events`), the
    inner ones half-way between two.
    """
    settings = recording.settings
    body = body_of(recording.settings)
    strike, flat, heel_off, toe_off = planned_events(reference_gait(settings))
    starts = [strike, flat, (flat + heel_off) / 2, heel_off, (heel_off + toe_off) / 2, toe_off]
    events = ["heel strike", "foot flat", None, "heel-off", None, "toe-off"]  # None: half-way between two events
    ticks = recording.measured_ticks
    phase = recording.series["phase"][:, ticks, legs].ravel().astype(float)
    # Name -> (episode, tick, leg, ankle and toe); all but K have hip and knee too, which are left out below.
    columns = {
        name: recording.series[name][:, ticks][:, :, legs] for name in ("stiffness", "angle", "velocity", "torque")
    }
    usable = np.isfinite(phase) & (columns["stiffness"] > 0.0).all(-1).ravel()
    columns |= {name: columns[name][..., FEET] for name in ("angle", "velocity", "torque")}
    # Name -> (n, (ankle, toe)) of all usable ticks of all legs.
    springs = {name: values.reshape(-1, len(SPRINGS))[usable].astype(float) for name, values in columns.items()}
    phase = phase[usable] % 1.0
    beta = damping_times(body)[FEET]
    states = []
    for name, event, (start, stop) in zip(STATES, events, pairwise([*starts, 1.0]), strict=True):
        inside = (phase >= start) & (phase < stop)
        state: dict[str, Any] = {"name": name, "phase": round(float(start), 6), "event": event}
        for joint, spring in enumerate(SPRINGS):
            entry: dict[str, float | None] = dict.fromkeys(
                ("stiffness_Nm_per_rad", "damping_time_s", "equilibrium_deg")
            )
            entry["damping_time_s"] = float(beta[joint])
            if inside.any():
                mean = {key: float(values[inside, joint].mean()) for key, values in springs.items()}
                # torque = K (rest - angle - beta rate), solved for the rest angle
                rest = mean["torque"] / mean["stiffness"] + mean["angle"] + beta[joint] * mean["velocity"]
                entry |= {"stiffness_Nm_per_rad": mean["stiffness"], "equilibrium_deg": float(np.degrees(rest))}
            state[spring] = entry
        states.append(state)
    return table_of_states(recording.policy, body, settings.speed, states)
