"""Read one person's motion files, and tell how stiff their ankles and toes are over stance.

    springfoot person walk.mot forces.mot moments.sto
    springfoot person walk.csv --mass 71 --columns knee_flexion_deg_left=KneeL --side left

Quasi-stiffness by phase beside people's, the person's curves, and their springs as a schedule that walks here.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from springfoot.agents.training import PRESETS
from springfoot.arrays import NDArray
from springfoot.envs.control import reference_walk_at, tabulated_speeds
from springfoot.envs.physics import damping_times
from springfoot.errors import SpringfootError
from springfoot.evaluation.report import schedule_csv, states_json, table_of_states
from springfoot.files.markdown import MISSING, table, text_of
from springfoot.files.writing import csv_text
from springfoot.gait import GRAVITY, Body, HumanGait, human_gait, schedule_from_curves
from springfoot.gait.body import REFERENCE_MASS, TOE_STIFFNESS
from springfoot.gait.people import (
    AS_IT_IS,
    FILE_CURVES,
    FILTER,
    FINE_PERCENT,
    PARTLY,
    PERCENT,
    TOE_OFF_COLUMN,
    MeasuredPerson,
)
from springfoot.gait.springs import (
    LOWEST_STIFFNESS,
    SPRINGS,
    Estimate,
    Segment,
    StancePhase,
    StiffnessSchedule,
    ankle_events,
    phase_slope,
    stance_phases,
    toe_events,
    with_swing,
)

from ..base.motion_files import USUAL_SPEED, MotionFiles
from ..base.study import Answer, OnProgress
from .person_figures import draw_curves, draw_loops

NO_SPRING = (
    "A quasi-stiffness is a slope of this walk's own curve, moment over angle, and no property of a spring in the "
    "joint: any stiffness gives the same curve at another rest angle (docs/explanation/stiffness.md)."
)
STATE_NAMES = {
    "heel strike": "loading",
    "foot flat": "mid-stance",
    "heel-off": "heel rise",
    "maximum dorsiflexion of the ankle": "push-off",
    "maximum dorsiflexion of the toe": "toe push-off",
    "toe-off": "swing",
}
"""Event at which a finite state begins -> its name."""
HEIGHT_AROUND, MASS_AROUND, SPEED_AROUND = 0.02, 2.0, 0.15
"""Ranges on either side of a person's height [m], mass [kg] and speed [of it] in which a learned person is taught;
chosen: their own step at a far speed may be longer than their legs allow."""
TAUGHT = "learned"
"""Learned person that `--train` begins from."""
SPRING_EVENTS = {
    "ankle": ("heel strike", "foot flat", "maximum dorsiflexion of the ankle", "toe-off"),
    "toe": ("heel strike", "heel-off", "maximum dorsiflexion of the toe", "toe-off"),
}
"""Joint -> events between which its schedule has springs."""


@dataclass(frozen=True, kw_only=True)
class PhaseStiffness:
    """Quasi-stiffness of one joint of one leg in one phase of stance."""

    joint: str
    side: str
    """left, right, both for curves without a side, or norm."""
    phase: StancePhase
    slope: Estimate | None
    """[N m/rad], per kg without a mass; None where the angle hardly moves."""


@dataclass(frozen=True, kw_only=True)
class Person(MotionFiles):
    """How stiff is this person? Reads the motion files of one walk, and tells ankle and toe by phase of stance.

    Writes the person's curves beside people's, and a schedule of stiffness that `springfoot evaluate` walks.
    """

    train: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Print the commands that train towards this person: a policy, into this folder, and a person that learns the
    curves, into FOLDER-person."""

    def ask(self, progress: OnProgress) -> Answer:
        """Read the files, and put the person beside people."""
        return _Sheet(self, self.read()).answer()


class _Sheet:
    """The report on one person, by the flags of the command."""

    def __init__(self, flags: Person, measured: MeasuredPerson):
        self._flags = flags
        self._measured = measured
        self._speed = measured.gait.speed or USUAL_SPEED
        self._mass = measured.mass
        self._norm: HumanGait = human_gait(self._speed, flags.height)
        self._gait: HumanGait = measured.gait.gait(self._speed, flags.height)
        if not any("ankle" in leg.curves for leg in measured.legs.values()):
            raise SpringfootError(
                f"{measured.gait.name}: no ankle angle, such as {FILE_CURVES['ankle']} or ankle_angle_r; "
                "--columns names it if it is called otherwise"
            )
        legs = measured.legs.values()
        if any(leg.partly.any() for leg in legs) and not any(leg.weighed.any() for leg in legs):
            raise SpringfootError(f"{measured.gait.name}: no stride tells a stiffness: in each {PARTLY}; {AS_IT_IS}")

    @property
    def _unit(self) -> str:
        """Return the unit of a stiffness: per kg if the mass is unknown."""
        return "N·m/rad" if self._mass else "N·m/(rad·kg)"

    @property
    def _body(self) -> Body:
        """Return the body that walks the schedule; `REFERENCE_MASS` if the person's mass is unknown."""
        return Body(height=self._flags.height, mass=self._mass or REFERENCE_MASS)

    def answer(self) -> Answer:
        """Return the report and its files; without a schedule where none can be made."""
        files: dict[str, Any] = {
            "quasi_stiffness.csv": self._stiffness_csv(),
            "curves.csv": self._curves_csv(),
        }
        notes = list(self._measured.notes)
        try:
            springs = self._schedule()
            files |= {"schedule.csv": self._schedule_csv(springs), "finite_states.json": self._finite_states(springs)}
        except SpringfootError as error:
            notes.append(f"No schedule: {error}.")
        files["curves.png"] = partial(draw_curves, sheet=self._mean_curves(), norm=self._norm)
        files["torque_angle.png"] = partial(
            draw_loops, sheet=self._mean_curves(), norm=self._norm, starts=self._phase_bounds()
        )
        return Answer(text=self._text(notes, "schedule.csv" in files), files=files)

    # Quasi-stiffness -----------------------------------------------------------------------------------------

    @cached_property
    def rows(self) -> list[PhaseStiffness]:
        """Return the quasi-stiffness of each joint, leg and phase of stance, from the strides on a force plate; behind
        each joint's legs that of people. Computed once."""
        rows = []
        factor = self._mass or 1.0
        for joint in SPRINGS:
            moment = f"{joint}_moment"
            for side, leg in self._measured.legs.items():
                toe_off = self._measured.toe_off(side) or self._norm.toe_off
                if {joint, moment} <= leg.fine.keys() and leg.weighed.any():
                    angles, moments = (leg.fine[name][leg.weighed] for name in (joint, moment))
                    for phase in stance_phases(joint, angles.mean(axis=0), toe_off):
                        slope = phase_slope(angles, factor * moments, phase)
                        rows.append(PhaseStiffness(joint=joint, side=side or "both", phase=phase, slope=slope))
            if moment in self._norm.mean_series:
                angle, torque = (self._norm.mean(name, FINE_PERCENT / 100)[None] for name in (joint, moment))
                scale = factor * self._body.length_scale
                for phase in stance_phases(joint, angle[0], self._norm.toe_off):
                    slope = phase_slope(angle, scale * torque, phase)
                    rows.append(PhaseStiffness(joint=joint, side="norm", phase=phase, slope=slope))
        return rows

    @property
    def _sides(self) -> list[str]:
        """Return the heads of the table's columns: the sides that were read, and the norm."""
        return [*(side or "both" for side in self._measured.legs), "norm"]

    def _table(self) -> str:
        """Return the table of quasi-stiffness: a row for each joint and phase."""
        pattern = ".0f" if self._mass else ".2f"
        names = list(dict.fromkeys((row.joint, row.phase.name) for row in self.rows))
        lines = []
        for joint, name in names:
            cells = []
            for side in self._sides:
                rows = [row for row in self.rows if (row.joint, row.phase.name, row.side) == (joint, name, side)]
                cells.append(_cell(rows[0], pattern) if rows else MISSING)
            lines.append([f"{joint}, {name}", *cells])
        return table([f"quasi-stiffness, {self._unit}", *self._sides], lines)

    def _stiffness_csv(self) -> str:
        """Return the table of quasi-stiffness as CSV."""
        head = ["joint", "phase", "side", "from_percent", "to_percent", "unit", "quasi_stiffness", "low", "high"]
        unit = self._unit.replace("·", " ")
        lines = []
        for row in self.rows:
            slope = [None] * 3 if row.slope is None else list(row.slope)
            place = [row.joint, row.phase.name, row.side, 100 * row.phase.start, 100 * row.phase.end]
            lines.append([*place, unit, *slope])
        return csv_text(head, lines)

    # Curves --------------------------------------------------------------------------------------------------

    def _mean_curves(self) -> dict[str, dict[str, NDArray]]:
        """Return side -> curve -> its mean (101,) over the strides that count; curves without one are left out."""
        return {
            side or "both": {name: leg.counted(name).mean(axis=0) for name in FILE_CURVES if _has_strides(leg, name)}
            for side, leg in self._measured.legs.items()
        }

    def _phase_bounds(self) -> dict[tuple[str, str], list[float]]:
        """Return (joint, side) -> stride phases at which the phases of stance begin, and the end of the last."""
        starts: dict[tuple[str, str], list[float]] = {}
        for row in self.rows:
            starts.setdefault((row.joint, row.side), [row.phase.start]).append(row.phase.end)
        return starts

    def _curves_csv(self) -> str:
        """Return the curves as CSV: those of the strides that count, which `--human` reads, left, right and norm."""
        gait = self._measured.gait
        numbers = {
            "n": gait.strides,
            "speed_m_s": gait.speed,
            "stride_time_s": gait.stride_time,
            "step_length_m": gait.step_length,
            TOE_OFF_COLUMN: None if gait.toe_off is None else 100 * gait.toe_off,
        }
        for side in filter(None, self._measured.legs):
            toe_off = self._measured.toe_off(side)
            numbers[f"{TOE_OFF_COLUMN}_{side}"] = None if toe_off is None else 100 * toe_off
        numbers = {name: value for name, value in numbers.items() if value is not None}
        columns: dict[str, NDArray] = {}
        phase = PERCENT / 100
        for name, column in FILE_CURVES.items():
            unit = np.degrees(1.0) if column.endswith("_deg") else 1.0
            if name in gait.mean:
                columns[column] = unit * self._gait.mean(name, phase)
            if name in gait.sd:
                columns[f"{column}_sd"] = unit * self._gait.sd(name, phase)
            for side, leg in self._measured.legs.items():
                if side and _has_strides(leg, name):
                    columns[f"{column}_{side}"] = unit * leg.counted(name).mean(axis=0)
                    if len(leg.counted(name)) > 1:
                        columns[f"{column}_{side}_sd"] = unit * leg.counted(name).std(axis=0, ddof=1)
            if name in self._norm.mean_series:
                columns[f"{column}_norm"] = unit * self._norm.mean(name, phase)
                columns[f"{column}_norm_sd"] = unit * self._norm.sd(name, phase)
        rows = ([percent, *numbers.values(), *(values[percent] for values in columns.values())] for percent in PERCENT)
        return csv_text(["percent", *numbers, *columns], rows)

    # Springs -------------------------------------------------------------------------------------------------

    def _toe_moment(self) -> NDArray | None:
        """Return the mean moment of the toe (101,) [N m/kg] of the strides that count; None if it was not measured."""
        counted = [leg.counted("toe_moment") for leg in self._measured.legs.values() if _has_strides(leg, "toe_moment")]
        return np.concatenate(counted).mean(axis=0) if counted else None

    def _schedule(self) -> StiffnessSchedule:
        """Return the person's springs by equation (4) of the thesis, their rest angles corrected for the damping of the
        model's joints."""
        gait = self._gait
        body = self._body
        phase = np.linspace(0.0, gait.toe_off, 1001)
        own_mass = body.total_mass
        ankle_mass = own_mass if "ankle_moment" in self._measured.gait.mean else own_mass * body.length_scale
        toe = self._toe_moment()
        scale = body.stiffness_scale
        springs = schedule_from_curves(
            phase,
            gait.toe_off,
            (gait.mean("ankle", phase), -ankle_mass * gait.mean("ankle_moment", phase)),
            None if toe is None else (gait.mean("toe", phase), -own_mass * np.interp(phase, PERCENT / 100, toe)),
            lowest=(LOWEST_STIFFNESS[0] * scale, LOWEST_STIFFNESS[1] * scale),
            toe_stiffness=TOE_STIFFNESS * scale,
        )
        damped = []
        for joint, beta in zip(SPRINGS, damping_times(body)[-len(SPRINGS) :], strict=True):
            segments = getattr(springs, joint)
            moved = []
            for segment, after in pairwise(segments):
                change = np.diff(gait.mean(joint, np.array([segment.start, after.start])))[0]
                rate = change / (after.start - segment.start) / gait.stride_time
                moved.append(Segment(segment.start, segment.stiffness, float(segment.equilibrium + beta * rate)))
            damped.append((*moved, segments[-1]))
        return with_swing(StiffnessSchedule(*damped), body)

    @property
    def _policy_name(self) -> str:
        """Return the name of the schedule as a policy."""
        return f"person {self._measured.gait.name}"

    def _schedule_csv(self, springs: StiffnessSchedule) -> str:
        """Return the CSV of K and rest angle of ankle and toe over percent of the stride."""
        stiffness, rest = springs.at(np.minimum(PERCENT, 99.999) / 100)
        curves = {f"{joint}_stiffness_Nm_per_rad": stiffness[:, k] for k, joint in enumerate(SPRINGS)}
        curves |= {f"{joint}_equilibrium_deg": np.degrees(rest[:, k]) for k, joint in enumerate(SPRINGS)}
        return schedule_csv(self._policy_name, self._body, self._speed, "phase", curves)

    def _finite_states(self, springs: StiffnessSchedule) -> str:
        """Return the JSON of the springs as finite states, one for each event at which a spring begins."""
        events: dict[float, str] = {}
        for joint in SPRINGS:
            starts = [segment.start for segment in getattr(springs, joint)]
            names = _events(self._gait, joint)
            events |= {start: names[round(start, 6)] for start in starts if start not in events}
        betas = damping_times(self._body)[-len(SPRINGS) :]
        states = []
        for start, event in sorted(events.items()):
            stiffness, rest = springs.at(start)
            state: dict[str, Any] = {"name": STATE_NAMES[event], "phase": round(start, 6), "event": event}
            for k, joint in enumerate(SPRINGS):
                state[joint] = {
                    "stiffness_Nm_per_rad": float(stiffness[k]),
                    "damping_time_s": float(betas[k]),
                    "equilibrium_deg": float(np.degrees(rest[k])),
                }
            states.append(state)
        return states_json(table_of_states(self._policy_name, self._body, self._speed, states))

    # Words ---------------------------------------------------------------------------------------------------

    def _text(self, notes: list[str], has_schedule: bool) -> str:
        """Return the report; `notes` are further items of its list, the schedule's paragraph needs `has_schedule`."""
        has_rows = any(row.side != "norm" for row in self.rows)
        parts = [self._verdict(), self._table(), self._table_note(has_rows), NO_SPRING, self._read_list(notes)]
        if has_schedule:
            parts.append(self._schedule_words())
        if self._flags.train is not None:
            parts.append(self._train_words())
        parts += ["![Curves](curves.png)", "![Moment over angle](torque_angle.png)"]
        return "\n\n".join(parts)

    def _verdict(self) -> str:
        """Return a sentence with the ankle's quasi-stiffness in late mid-stance, on each side and in people."""
        pattern = ".0f" if self._mass else ".2f"
        late = {row.side: row.slope for row in self.rows if (row.joint, row.phase.name) == ("ankle", "late rising")}
        own = [f"{slope.value:{pattern}} {side}" for side, slope in late.items() if side != "norm" and slope]
        if not any(row.side != "norm" and row.slope for row in self.rows):
            return "**No stiffness, only curves: these files give no moment of an ankle that counts.**"
        if not own:
            return (
                "**The ankle hardly turns in late mid-stance, so its moment has no slope there; other phases below.**"
            )
        norm = late.get("norm")
        beside = f"; people's norm is {norm.value:{pattern}}" if norm else ""
        words = " and ".join(own).replace(" both", "")
        return f"**In late mid-stance the ankle's moment rises by {words} {self._unit}{beside}.**"

    def _table_note(self, has_rows: bool) -> str:
        """Return the paragraph below the table; `has_rows` is True if it has rows of the person, with or without
        a number."""
        several = any(row.slope and np.isfinite(row.slope.low) for row in self.rows)
        words = "In brackets: 95 % interval over strides"
        if not several:
            words = "Without intervals: there is one curve a leg"
        words += (
            "; behind it the part of the stride, in percent. – : the angle makes less than 2°, or was not measured."
        )
        if has_rows and not any(row.joint == "toe" for row in self.rows):
            words += " The toe has none: no moment of it (mtp_angle_r_moment, mtp_moment_Nm_per_kg) is in the files."
        return f"{words} The norm's toe is unknown; its ankle is scaled with mass and height."

    def _read_list(self, notes: list[str]) -> str:
        """Return the list of readings, borrowings and omissions."""
        borrowed = ", ".join(name.replace("_", " ") for name in self._gait.borrowed if not name.endswith(" sd"))
        over_time = any(len(leg.times) for leg in self._measured.legs.values())
        without_mass = f": stiffness is per kg, the schedule of {REFERENCE_MASS:g} kg"
        lines = [
            *self._flags.readings(self._measured, self._norm, without_mass),
            *self._load_words(),
            f"Borrowed from the norm: {borrowed or 'nothing'}.",
            f"Filter: none on the curves; {FILTER}, on angles for events and joint powers."
            if over_time
            else "Filter: none.",
            *notes,
        ]
        return "\n".join(f"- {line}" for line in lines)

    def _load_words(self) -> list[str]:
        """Return sentences on the lever at which each foot bears the body in push-off, and on its share of the weight.

        Where a plate or a moment has another scale, they are not alike left and right, or not like people's.
        """
        names = ("grf_vertical", "ankle_moment")
        means = {
            side: [leg.counted(name).mean(axis=0) for name in names]
            for side, leg in self._measured.legs.items()
            if all(_has_strides(leg, name) for name in names)
        }
        if not means:
            return []
        means["norm"] = [self._norm.mean(name, PERCENT / 100) for name in names]
        levers = []
        for side, (force, moment) in means.items():
            top = int(moment.argmax())
            levers.append(f"{moment[top] / (GRAVITY * force[top]):.3f} m {side}".rstrip())
        lines = [f"Lever of the vertical force about the ankle, where its moment is largest: {', '.join(levers)}."]
        if {"left", "right"} <= means.keys():
            left, right = (float(means[side][0][:-1].mean()) for side in ("left", "right"))
            share = 100 * left / (left + right)
            lines.append(f"The left foot bears {share:.0f} % of the weight, the right {100 - share:.0f} %.")
        return lines

    def _schedule_words(self) -> str:
        """Return the paragraph on the schedule, with the command that walks it."""
        body = f"--mass {self._body.mass:.4g} --height {self._flags.height:g} --speed {self._speed:.3g}"
        borrowed = "" if self._toe_moment() is not None else " The toe's stiffness is the model's own."
        return (
            "`schedule.csv` and `finite_states.json` hold straight lines between events of the mean curves, both legs "
            f"alike; swing is the model's.{borrowed} `springfoot evaluate schedule.csv {body}` tries it, in the "
            "folder of these results: it may fall, as nothing but the phase decides, and both legs get one schedule."
        )

    def _train_words(self) -> str:
        """Return the commands that train towards this person: a policy, and a person."""
        place = Path("curves.csv") if self._flags.out is None else self._flags.out / "curves.csv"
        where = " in the folder of these results" if self._flags.out is None else ""
        body = f"--mass {self._body.mass:.4g} --height {self._flags.height:g} --speed {self._speed:.3g}"
        out = self._flags.train
        policy = f"springfoot train --human {place} {body} --out {out}"
        words = f"To train a policy towards this person{where}: `{policy}`. "
        ranges = {
            "height_range": _around(self._flags.height, HEIGHT_AROUND),
            "mass_range": _around(self._body.mass, MASS_AROUND),
            "speed_range": _around(self._speed, SPEED_AROUND * self._speed),
        }
        taught = replace(
            PRESETS["person"].environment, human=self._measured.gait.to_json(), drawn_bodies=None, **ranges
        )
        try:
            for speed in tabulated_speeds(taught):
                reference_walk_at(taught, float(speed))
        except SpringfootError as error:
            return f"{words}No learned person can be taught these curves: {error}."
        flags = " ".join(f"--{name.replace('_', '-')} {low:g} {high:g}" for name, (low, high) in ranges.items())
        person = (
            f"springfoot train --preset person --begin-from {TAUGHT} --human {place} {flags} --drawn-bodies None "
            f"--out {out}-person"
        )
        return f"{words}To teach these curves to a learned person, about this size and speed on drawn feet: `{person}`"


def _around(value: float, width: float) -> tuple[float, float]:
    """Return the range of `width` on either side of a value, to two decimals."""
    return round(value - width, 2), round(value + width, 2)


def _events(gait: HumanGait, joint: str) -> dict[float, str]:
    """Return stride phase, to 6 decimals -> name of a joint's event in stance; of events at one phase the last."""
    phase = np.linspace(0.0, gait.toe_off, 1001)
    find = ankle_events if joint == "ankle" else toe_events
    times = find(phase, gait.mean(joint, phase), gait.toe_off).values()
    return {round(time, 6): name for time, name in zip(times, SPRING_EVENTS[joint], strict=True)}


def _has_strides(leg: Any, name: str) -> bool:
    """Return True if a leg (of `MeasuredPerson.legs`) has a stride of the curve `name` that counts."""
    return name in leg.curves and len(leg.counted(name)) > 0


def _cell(row: PhaseStiffness, pattern: str) -> str:
    """Return a cell of the table: slope, its interval in brackets, part of the stride; a dash for a slope of None."""
    part = f"{100 * row.phase.start:.0f}–{100 * row.phase.end:.0f} %"
    if row.slope is None:
        return f"{MISSING}, {part}"
    value, low, high = row.slope
    interval = f" ({low:{pattern}} to {high:{pattern}})" if np.isfinite(low) else ""
    return f"{text_of(value, pattern)}{interval}, {part}"
