"""Turn a user's measured walk into a `HumanGait`: a file, its strides, their mean and spread.

It reads CSV in our columns or a laboratory's, OpenSim's .mot and .sto (`motion_files`), C3D (`c3d_process`), the CSV
of Vicon Nexus (`nexus_file`) and Visual3D's text (`visual3d_file`). Heel strikes and toe-offs come from the vertical
force; without it, from the events in the file; without those, from the leg's motion.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import log, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, as_float, perhaps, require_count, require_within
from springfoot.files.text_table import Table, read_csv

from ..body.body import MASS_RANGE
from .c3d_file import trial_of_recording
from .c3d_process import c3d_trial
from .checks import AS_IT_IS, is_mass_given, require_plausible, require_plausible_legs
from .gait_events import CONTACT_THRESHOLD_BW, PERCENT
from .human import COLUMNS, FORCES, PEOPLE_FILE, HumanGait, fourier_series, human_gait, stance_series
from .motion_files import (
    FILE_SIDES,
    NO_NAMES,
    PARAMETERS,
    Series,
    Trial,
    csv_trial,
    known_columns,
    opensim_trial,
    our_columns,
    refuse_impossible_angles,
)
from .nexus_file import is_nexus, read_nexus
from .strides import MeasuredWalk, cut_strides, merge_trials, require_side, strides_of_legs
from .visual3d_file import read_visual3d

ACCEPTED = {
    "speed": (0.1, 4.0, "m/s"),
    "stride_time": (0.4, 4.0, "s"),
    "step_length": (0.05, 2.0, "m"),
    "toe_off": (0.3, 0.9, "of the stride"),
}
"""Parameter beside the curves -> least and largest accepted value, and unit; chosen."""
MISTAKEN_PARAMETERS = {
    "speed": {"mm/s": 1e3, "cm/s": 1e2, "km/h": 3.6},
    "stride_time": {"ms": 1e3},
    "step_length": {"mm": 1e3, "cm": 1e2},
    "toe_off": {"in percent": 1e2, "a fraction, where percent must be": 1e-2},
}
"""Parameter -> mistaken unit -> the factor by which it makes the parameter larger."""
TOE_OFF_COLUMN = "toe_off_percent"
"""Column of the phase of toe-off of mean curves [%]; of one leg with `_left` or `_right` behind."""
COMFORTABLE_SPEED = 1.2
"""Speed of the people to compare curves of unknown speed with [m/s]; chosen."""
SPEEDS_APART = 1.4
"""Largest factor between a file's speed and that of its step length and stride time; chosen. A limping person here
has steps of one foot that make 1.21, and mistakes make 2."""
_MOST_COEFFICIENTS = 64
_LARGEST = 1e3


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnGait:
    """One person's mean curves and their spread over strides, to use in people's place; made by `read_gait`."""

    name: str
    """The file's name."""
    strides: int | None
    """Averaged strides, both feet together; like the next four, None if the file does not tell."""
    speed: float | None
    """Walking speed [m/s]."""
    stride_time: float | None
    """Heel strike to next heel strike of the same foot [s]."""
    step_length: float | None
    """Heel strike to heel strike of the other foot [m]."""
    toe_off: float | None
    """Phase of toe-off, 0..1."""
    mean: Mapping[str, NDArray]
    """Curve -> coefficients as in `HumanGait.mean_series`; only curves that are in the file."""
    sd: Mapping[str, NDArray]
    """As `mean`, of the standard deviation."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OwnGait) and self.to_json() == other.to_json()

    def gait(self, speed: float, height: float, people: str | Path = PEOPLE_FILE) -> HumanGait:
        """Return these curves as a `HumanGait`; missing ones are those of `people` of `height` [m] at `speed` [m/s].

        The curves do not change with `height` and `speed`. An unknown step length follows from the stride time and the
        file's speed, or else `speed`. `HumanGait.borrowed` names the parts taken from people.
        """
        people_gait = human_gait(speed, height, people)
        known: dict[str, float] = {}
        for name in ("stride_time", "step_length", "toe_off"):
            if (value := getattr(self, name)) is not None:
                known[name] = value
        if "stride_time" in known:
            known.setdefault("step_length", (self.speed or speed) * known["stride_time"] / 2)
        borrowed = [name for name in ("stride_time", "step_length", "toe_off") if name not in known]
        borrowed += [name for name in people_gait.mean_series if name not in self.mean]
        borrowed += [f"{name} sd" for name in people_gait.sd_series if name not in self.sd]
        return replace(
            people_gait,
            speed=self.speed or speed,
            condition=self.name,
            clamped=False,
            mean_series={**people_gait.mean_series, **self.mean},
            sd_series={**people_gait.sd_series, **self.sd},
            borrowed=tuple(borrowed),
            **known,  # type: ignore[arg-type]
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON values, SI units; `OwnGait.from_json` is the inverse."""
        return asdict(self) | {kind: _lists_of(getattr(self, kind)) for kind in ("mean", "sd")}

    @classmethod
    def from_json(cls, values: object) -> "OwnGait":
        """Return the gait from the values that `to_json` returned; raise `SpringfootError` for any other value."""
        names = set(cls.__dataclass_fields__)
        if not isinstance(values, Mapping) or set(values) != names or not isinstance(values["name"], str):
            raise SpringfootError(
                f"human must be what springfoot.gait.read_gait(FILE).to_json() gives ({', '.join(sorted(names))}), "
                f"got {values!r:.80}"
            )
        gait = cls(**{**values, "mean": _arrays_of("mean", values["mean"]), "sd": _arrays_of("sd", values["sd"])})
        return _checked_gait(gait)


def read_gait(
    *paths: str | Path,
    condition: str | None = None,
    side: str = "both",
    mass: float | None = None,
    trust_units: bool = False,
    columns: Mapping[str, str] = NO_NAMES,
) -> OwnGait:
    """Return the mean walk in a file, or in several of the same walk (say OpenSim's angles, forces and moments).

    Args:
        paths: CSV files, OpenSim's .mot and .sto, Visual3D's .txt, or C3D (needs ezc3d). A CSV file has the column
            `percent` 0, 1, ..., 100 (or 0, 2, ..., 100) and mean curves in our columns, their spread with `_sd` behind,
            as evaluate.py writes gait_cycle.csv; or `time_s` and curves over time, with `_left` or `_right` behind for
            two legs.
        condition: picks one of several gaits that stand below each other in a CSV file over `percent`.
        side: "both" pools the strides of both feet; or "left" or "right".
        mass: body mass [kg] by which forces and moments in N and N m are divided. By default it is the one that the
            forces bear over whole strides; without forces, moments in N m are left out.
        trust_units: accept curves that no walk has in these units and with these signs
            (`springfoot.gait.people.checks`).
        columns: our name of a column -> its name in the files, where that is another one.

    Raises `SpringfootError` for an unreadable file, naming file, line and column, and for implausible curves, with the
    likeliest cause.
    """
    if mass is not None:
        require_within("mass", mass, MASS_RANGE, "kg")
    read = read_files(paths, columns)
    if isinstance(read, Table):
        return gait_of_percents(one_condition(read, condition), side, trust_units)
    return gait_of_walk(read, side, mass, trust_units)


def read_files(paths: Sequence[str | Path], columns: Mapping[str, str] = NO_NAMES) -> Table | MeasuredWalk:
    """Return the content of files of one walk: a table of mean curves over percent, or the walk over time.

    `columns` as in `read_gait`. Raises `SpringfootError` for an unreadable file, for a column that is in none, and for
    a name that means nothing here.
    """
    for ours in columns:
        if ours not in (known := known_columns()):
            raise SpringfootError(f"columns: {ours!r:.60} is no column that is read here{perhaps(ours, sorted(known))}")
    renamed = {theirs: ours for ours, theirs in columns.items()}
    trials: list[Trial] = []
    for path in map(Path, paths):
        match path.suffix.lower():
            case ".csv" if is_nexus(path):
                trials.append(trial_of_recording(read_nexus(path)))
            case ".csv" | ".txt":
                as_read = read_csv(path) if path.suffix.lower() == ".csv" else read_visual3d(path)
                table = as_read.renamed(renamed)
                if "percent" in table.columns and len(paths) == 1:
                    _require_columns(renamed, as_read.columns)
                    return table
                trials.append(replace(csv_trial(table), columns=as_read.columns))
            case ".mot" | ".sto":
                trials.append(opensim_trial(path, renamed))
            case ".c3d":
                trials.append(c3d_trial(path))
            case _:
                raise SpringfootError(f"{path.name} must be a .csv, .txt, .mot, .sto or .c3d file")
    if not trials:
        raise SpringfootError("read_gait needs a file")
    _require_columns(renamed, [column for trial in trials for column in trial.columns])
    return merge_trials(trials)


def _require_columns(names: Iterable[str], columns: Sequence[str]) -> None:
    """Raise `SpringfootError` if one of `names` is not among the `columns` of the files."""
    for name in names:
        if name not in columns:
            raise SpringfootError(f"no column {name!r:.60} in a text file; there are {', '.join(columns):.400}")


def percent_curves(table: Table, end: str = "") -> dict[str, Series]:
    """Return side -> curves (101,) of a table over percent: "" for curves without a side, and left, right.

    `end` stands behind the names, as `_sd`. Curves on a 2 % grid are interpolated: by a cubic spline, as phases of
    stance begin at extremes, which lie between the rows; forces, which have kinks, and spreads without overshoot.
    """
    legs = {side: our_columns(table, f"_{side}{end}" if side else end) for side in ("", *FILE_SIDES)}
    if len(table.rows) != len(PERCENT):
        from scipy.interpolate import CubicSpline, PchipInterpolator  # half a second to import

        coarse = np.linspace(0, 100, len(table.rows))
        for curves in legs.values():
            for name, values in curves.items():
                through = PchipInterpolator if end or name in FORCES else CubicSpline
                curves[name] = through(coarse, values)(PERCENT)
    return {side: curves for side, curves in legs.items() if curves}


def toe_off_of(table: Table, side: str, curves: Series) -> float | None:
    """Return the phase of toe-off, 0..1, of a leg with mean `curves` (101,); None if the table does not tell it.

    `side` is left, right or "". The column of that leg goes before the leg's vertical force, and that before the column
    of both legs. Raises `SpringfootError` for a phase outside `ACCEPTED`.
    """
    own = f"{TOE_OFF_COLUMN}_{side}" if side else TOE_OFF_COLUMN
    if table.has(own):
        phase = float(table.numbers(own)[0]) / 100
        _require_accepted(f"{table.name}: {own}", "toe_off", phase)
        return phase
    if "grf_vertical" in curves and (loaded := np.flatnonzero(curves["grf_vertical"] > CONTACT_THRESHOLD_BW)).size:
        last = min(int(loaded[-1]), len(PERCENT) - 2)
        before, after = curves["grf_vertical"][last : last + 2]
        return (last + float((before - CONTACT_THRESHOLD_BW) / (before - after))) / 100 if after < before else 1.0
    return float(table.numbers(TOE_OFF_COLUMN)[0]) / 100 if table.has(TOE_OFF_COLUMN) else None


def _require_side(side: str) -> None:
    """Raise `SpringfootError` unless `side` is both, left or right."""
    if side not in ("both", *FILE_SIDES):
        raise SpringfootError(f"side must be 'both', 'left' or 'right', got {side!r}")


def gait_of_percents(table: Table, side: str, trust_units: bool) -> OwnGait:
    """Return the gait in a table of one gait's mean curves over percent 0 to 100 of the stride.

    With `side` "both" a curve without a side counts, else the mean of left and right, or the only one of them. With
    "left" or "right" that side's curve counts, else the one without a side.
    """
    _require_side(side)
    legs = percent_curves(table)
    if legs and "" not in legs:
        require_side(table.name, legs, side)
    spreads = percent_curves(table, "_sd")
    chosen = FILE_SIDES if side == "both" else (side,)
    if not trust_units:
        for leg in FILE_SIDES:
            if leg in legs and leg in chosen:
                known = {curve: values for curve, values in legs[leg].items() if curve in COLUMNS}
                require_plausible(f"{table.name}, the {leg} leg", known, people_at(None))
    mean: Series = {}
    sd: Series = {}
    for kind, of_kind in ((mean, legs), (sd, spreads)):
        for curve in COLUMNS:
            sided = [of_kind[leg][curve] for leg in chosen if curve in of_kind.get(leg, {})]
            if curve in of_kind.get("", {}) and (side == "both" or not sided):
                kind[curve] = of_kind[""][curve]
            elif sided:
                kind[curve] = np.mean(sided, axis=0)
    if not mean:
        raise SpringfootError(f"{table.name}, line 1: none of the columns {', '.join(COLUMNS.values())}")

    def parameter(column: str) -> float | None:
        return float(table.numbers(column)[0]) if table.has(column) else None

    toe_off = parameter(TOE_OFF_COLUMN)
    if toe_off is None:
        offs = [toe_off_of(table, leg, curves) for leg, curves in legs.items() if leg in ("", *chosen)]
        known = [off for off in offs if off is not None]
        toe_off = 100 * float(np.mean(known)) if known else None
    strides = parameter("n")
    if strides is not None and strides % 1:
        raise SpringfootError(f"{table.name}: n must be a whole number of strides, got {strides:g}")
    gait = OwnGait(
        name=table.name,
        strides=None if strides is None else round(strides),
        toe_off=None if toe_off is None else toe_off / 100,
        mean={},  # `_with_series` puts the series here
        sd={},
        **{name: parameter(column) for name, column in PARAMETERS.items()},
    )
    return _with_series(gait, mean, {name: curve for name, curve in sd.items() if name in mean}, trust_units)


def one_condition(table: Table, condition: str | None) -> Table:
    """Return a table with the rows of one gait, percent 0 to 100 by 1 or by 2; `condition` picks it from several.

    Raises `SpringfootError` for other percents, or if the condition is unknown, missing, or that of several gaits.
    """
    percent = table.numbers("percent")
    step = 2 if len(percent) > 1 and percent[1] == 2 else 1
    size = 100 // step + 1  # rows of one gait
    for k, ((line, _), value) in enumerate(zip(table.rows, percent, strict=True)):
        if value != k % size * step:
            grid = f"{k % size * step} here (0, {step}, ..., 100)"
            raise table.error(line, "percent", f"must be {grid}, got {value:g}")
    if len(percent) % size:
        line = table.rows[-1][0]
        raise table.error(line, "percent", f"ends at {percent[-1]:g}, must go on to 100")
    blocks = [table.rows[k : k + size] for k in range(0, len(percent), size)]
    if len(blocks) == 1 and condition is None:
        return table
    if "condition" not in table.columns:
        held = (
            "one gait, without a name: give no condition"
            if len(blocks) == 1
            else (f"{len(blocks)} gaits and no column condition to tell them apart")
        )
        raise SpringfootError(f"{table.name} holds {held}")
    column = table.columns.index("condition")
    names = [cells[column] for (_, cells), *_ in blocks]  # in the first row of each gait
    if condition not in names:
        raise SpringfootError(
            f"{table.name} holds the conditions {', '.join(names)}; condition must be one of them (on the command "
            f"line {table.name}:{names[0]}), got {condition!r}"
        )
    if (count := names.count(condition)) > 1:
        raise SpringfootError(f"{table.name} holds {count} gaits of the condition {condition}; it must name one")
    return replace(table, name=f"{table.name}:{condition}", rows=blocks[names.index(condition)])


def gait_of_walk(walk: MeasuredWalk, side: str, mass: float | None, trust_units: bool) -> OwnGait:
    """Return the mean gait of a walk's strides, or raise `SpringfootError` for curves that no walk has."""
    _require_side(side)
    walk = replace(walk, trusted=trust_units)
    if walk.speed is not None:
        _require_accepted(f"{walk.name}: speed, of {walk.speed_column},", "speed", walk.speed)
    strides, curves = cut_strides(walk, side, mass)  # strides: heel strike, toe-off, next heel strike
    mean = {name: values.mean(axis=0) for name, values in curves.items()}
    for name in ("thigh", "hip"):
        # At 0 %, heel strike, the thigh is ahead of where it is half a stride later.
        if name in mean and mean[name][0] <= mean[name][50]:
            raise SpringfootError(
                f"{walk.name}: the {name} is behind at heel strike; are left and right, or a sign, interchanged?"
            )
    if not trust_units:
        require_plausible_legs(walk, side, mass, people_at(walk.speed))
    stride_time = float(np.mean(strides[:, 2] - strides[:, 0]))
    legs = strides_of_legs(walk, side, mass)
    gait = OwnGait(
        name=walk.name,
        strides=len(strides),
        speed=walk.speed,
        stride_time=stride_time,
        step_length=None if walk.speed is None else walk.speed * stride_time / 2,
        toe_off=float(np.mean(np.concatenate([leg.toe_off_phase for leg in legs.values()]))),
        mean={},  # `_with_series` puts the series here
        sd={},
    )
    sd = {name: values.std(axis=0, ddof=1) for name, values in curves.items()}
    return _with_series(gait, mean, sd, trust_units, is_mass_given(walk, mass))


def _require_one_speed(gait: OwnGait) -> None:
    """Raise `SpringfootError` for a speed that contradicts stride time and step length."""
    if gait.speed and gait.stride_time and gait.step_length:
        covered = 2 * gait.step_length / gait.stride_time
        if not 1 / SPEEDS_APART < gait.speed / covered < SPEEDS_APART:
            raise SpringfootError(
                f"{gait.name}: two steps of {gait.step_length:g} m in {gait.stride_time:g} s are {covered:.2f} m/s, "
                f"and the speed is {gait.speed:g}: a stride's length, or a step's time? {AS_IT_IS}"
            )


def people_at(speed: float | None) -> HumanGait:
    """Return people's gait at a speed [m/s]; at a comfortable one if it is unknown or outside the accepted range."""
    low, high, _ = ACCEPTED["speed"]
    return human_gait(speed if speed and low <= speed <= high else COMFORTABLE_SPEED)


def _with_series(gait: OwnGait, mean: Series, sd: Series, trust_units: bool, mass_given: bool = False) -> OwnGait:
    """Return `gait` with series fitted to mean curves and spreads (101,); raise `SpringfootError` for implausible ones.

    `trust_units` accepts curves that differ from people's; `mass_given` as in `require_plausible`.
    """

    def fit(curves: Series) -> dict[str, list]:
        lists = {}
        for name, curve in curves.items():
            # Forces without a toe-off are fitted over the whole stride here, and refused by the last check.
            lists[name] = stance_series(curve, gait.toe_off or 1.0) if name in FORCES else fourier_series(curve)
        return lists

    refuse_impossible_angles(gait.name, mean)
    if not trust_units:
        require_plausible(gait.name, mean, people_at(gait.speed), sd, mass_given)
        _require_one_speed(gait)
    gait = _checked_gait(gait)
    return _checked_gait(replace(gait, mean=_arrays_of("mean", fit(mean)), sd=_arrays_of("sd", fit(sd))))


def _checked_gait(gait: OwnGait) -> OwnGait:
    """Return `gait`, unchanged; raise `SpringfootError` for parameters outside `ACCEPTED`, and for forces without a
    toe-off."""
    for name in ACCEPTED:
        if getattr(gait, name) is not None:
            _require_accepted(f"{gait.name}: {name}", name, getattr(gait, name))
    if gait.strides is not None:
        require_count(f"{gait.name}: strides", gait.strides)
    if gait.toe_off is None and any(name in FORCES for name in (*gait.mean, *gait.sd)):
        raise SpringfootError(f"{gait.name}: forces need a toe_off")
    return gait


def _require_accepted(label: str, name: str, value: object) -> None:
    """Raise `SpringfootError` for the `value` of a parameter outside `ACCEPTED`, with the likeliest mistaken unit; it
    begins with `label`."""
    low, high, unit = ACCEPTED[name]
    try:
        require_within(label, value, (low, high), unit)
    except SpringfootError as error:
        number = as_float(value)
        units = {factor: unit for unit, factor in MISTAKEN_PARAMETERS[name].items() if low <= number / factor <= high}
        # Of several units the one that makes it most usual, the middle of the range in ratios.
        guess = min(units, key=lambda factor: abs(log(number / factor / sqrt(low * high))), default=None)
        raise SpringfootError(str(error) if guess is None else f"{error}: {units[guess]}?") from None


def _lists_of(series: Mapping[str, NDArray]) -> dict[str, list]:
    """Return curve -> coefficients as plain lists, complex ones as [real, imaginary]."""
    return {
        name: (np.stack([np.real(c), np.imag(c)], -1) if np.iscomplexobj(c) else c).tolist()
        for name, c in series.items()
    }


def _arrays_of(kind: str, rows: object) -> dict[str, NDArray]:
    """Return curve -> array of coefficients from the lists that `_lists_of` returned.

    Raises `SpringfootError` for any other value. `kind`, mean or sd, stands in the error's text.
    """
    if not isinstance(rows, Mapping):
        raise SpringfootError(f"human {kind} must map curves to coefficients, got {rows!r:.60}")
    series = {}
    for name, values in rows.items():
        if name not in COLUMNS:
            raise SpringfootError(f"human {kind} has no curve {name!r:.40}; there are {', '.join(COLUMNS)}")
        try:
            array = np.array(values, float)
        except (TypeError, ValueError, OverflowError):  # no numbers, rows of unequal length, a number too large
            array = np.empty(0)
        # Forces have real coefficients (n,), other curves pairs of real and imaginary part (n, 2).
        shape_fits = array.ndim == 1 if name in FORCES else array.ndim == 2 and array.shape[1:] == (2,)
        if not shape_fits or not 0 < len(array) <= _MOST_COEFFICIENTS or not (np.abs(array) < _LARGEST).all():
            raise SpringfootError(f"human {kind} {name} must be finite coefficients, got {values!r:.60}")
        series[name] = array if name in FORCES else array[:, 0] + 1j * array[:, 1]
    return series
