"""Hold any gait against people: a simulation's or a person's motion files, beside published simulations.

    springfoot score walk.mot walk.sto
    springfoot score gait.csv --speed 1.25

The numbers are those of `springfoot evaluate`, by the same functions, of each leg and of both together.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers import ANGLE_JOINTS, MOMENT_JOINTS, gait_numbers
from springfoot.files.markdown import MISSING, table, text_of
from springfoot.files.text_table import read_csv
from springfoot.files.writing import csv_text
from springfoot.gait import HumanGait, human_gait
from springfoot.gait.people import PERCENT, MeasuredPerson, rmse

from ..base.motion_files import USUAL_SPEED, MotionFiles
from ..base.study import Answer, OnProgress

PUBLISHED = Path("docs", "results", "csv", "published_walks.csv")
"""Table of published simulations: a row each, with source, place and licence; in the repository and in the package."""
SCORED = {
    **{
        joint: {"rmse_deg": ("RMSE, °", ".2f"), "r": ("r", ".3f"), "within_1sd_percent": ("in ±SD, %", ".0f")}
        for joint in ANGLE_JOINTS
    },
    "grf": {
        "vertical_r": ("vertical force, r", ".3f"),
        "vertical_peak1_bw": ("vertical force, peak 1, BW", ".2f"),
        "vertical_peak2_bw": ("vertical force, peak 2, BW", ".2f"),
        "forward_r": ("fore-aft force, r", ".3f"),
        "braking_peak_bw": ("fore-aft force, braking, BW", ".2f"),
        "forward_peak_bw": ("fore-aft force, forward, BW", ".2f"),
    },
    **{f"{joint}_moment": {"r": ("r", ".3f")} for joint in MOMENT_JOINTS},
    "ankle_moment": {"r": ("r", ".3f"), "peak_Nm_kg": ("peak, N·m/kg", ".2f")},
}
"""Curve, as `gait_numbers` names it -> number -> its label and format in the table."""
CURVES = {
    **{joint: f"angle of the {joint}" for joint in ANGLE_JOINTS},
    "grf_vertical": "vertical force",
    "grf_forward": "fore-aft force",
    **{f"{joint}_moment": f"moment of the {joint}" for joint in MOMENT_JOINTS},
}
"""Curve that is scored -> its name in the list of those that are missing."""
BESIDE = {
    "speed_m_s": "m/s",
    "hip_deg": "hip, °",
    "knee_deg": "knee, °",
    "ankle_deg": "ankle, °",
    "angles_deg": "angles, °",
    "angles_sd": "angles, SD between adults",
    "angles_r": "angles, r",
    "all_sd": "all curves together, SD",
    "all_r": "all curves together, r",
    "vertical_percent_bw": "vertical force, % BW",
    "forward_percent_bw": "fore-aft force, % BW",
}
"""Column of `PUBLISHED` -> its heading here; RMSE, but for r."""
COMPARED = ("thigh", "knee", "ankle")
"""Joints of the means over angles; publications have the hip in the thigh's place."""
Scores = Mapping[str, Mapping[str, float | None]]
"""Numbers of one side, as `gait_numbers` gives them."""


@dataclass(frozen=True, kw_only=True)
class Score(MotionFiles):
    """How human is this gait? Reads the motion files of any walk, and holds it against people at its speed.

    Angles, forces and moments as `springfoot evaluate` counts them, beside published simulations.
    """

    def ask(self, progress: OnProgress) -> Answer:
        """Read the files; score the gait against people, and set it beside published simulations."""
        measured = self.read()
        human = human_gait(measured.gait.speed or USUAL_SPEED, self.height)
        curves = curves_by_side(measured)
        numbers = {side: gait_numbers(of_side, human) for side, of_side in curves.items()}
        if not any(numbers.values()):
            raise SpringfootError(f"{measured.gait.name} has none of {', '.join(CURVES.values())}")
        people = peoples_numbers(human)
        last = list(numbers)[-1]  # both legs, where there are two
        missing = [words for curve, words in CURVES.items() if not any(curve in of_side for of_side in curves.values())]
        lines = [
            f"Missing in the files, and not scored: {', '.join(missing) or 'nothing'}.",
            *self.readings(measured, human),
            *measured.notes,
        ]
        text = [
            verdict(numbers[last], human),
            scores_table(numbers, people),
            "People: beside RMSE the rms of their SD between adults, beside peaks their mean's. The thigh's angle is "
            "to the vertical.",
            "\n".join(f"- {line}" for line in lines),
            published_table(numbers[last], measured.gait.speed),
            "RMSE, or r, to people; each walk is held against its own people. The columns of all curves together take "
            f"angles, moments and forces as one, in the SD that each publication used. {PUBLISHED.as_posix()} has the "
            "curves of each, its source and its licence.",
        ]
        files = {"score.csv": scores_csv(numbers, people), "score.json": scores_json(numbers)}
        return Answer(text="\n\n".join(text), files=files)


def curves_by_side(measured: MeasuredPerson) -> dict[str, dict[str, NDArray]]:
    """Return side (left, right, both) -> curve -> its mean (101,) over the strides that count.

    Sides and curves without such a stride are left out, and "both" if only one leg has any.
    """
    strides: dict[str, dict[str, list[NDArray]]] = {}
    for side, leg in measured.legs.items():
        for curve in CURVES.keys() & leg.curves.keys():
            if len(counted := leg.counted(curve)):
                for group in dict.fromkeys((side or "both", "both")):
                    strides.setdefault(group, {}).setdefault(curve, []).append(counted)
    if len(strides) == 2 and "" not in measured.legs:  # one leg alone
        del strides["both"]
    order = [side for side in ("left", "right", "both") if side in strides]
    return {
        side: {curve: np.concatenate(blocks).mean(axis=0) for curve, blocks in strides[side].items()} for side in order
    }


def peoples_numbers(human: HumanGait) -> dict[str, dict[str, float | None]]:
    """Return the numbers of people's mean curves: peaks and valley, for an angle's RMSE the root mean square of
    people's SD, and None for all others."""
    phase = PERCENT / 100
    numbers = gait_numbers({curve: human.mean(curve, phase) for curve in CURVES}, human)
    for curve, of_curve in numbers.items():
        of_curve |= {name: None for name in of_curve if "peak" not in name and "valley" not in name}
        if curve in ANGLE_JOINTS:
            of_curve["rmse_deg"] = rmse(np.degrees(human.sd(curve, phase)), np.zeros(len(phase)))
    return numbers


def verdict(numbers: Scores, human: HumanGait) -> str:
    """Return a sentence with the RMSE of each angle and r of the vertical force, from the `numbers` of one side."""
    angles = [f"{joint} {numbers[joint]['rmse_deg']:.1f}°" for joint in ANGLE_JOINTS if joint in numbers]
    parts = [f"{', '.join(angles)} rms from people's mean"] if angles else []
    r = numbers.get("grf", {}).get("vertical_r")
    if r is not None:
        parts.append(f"vertical force r {r:.3f}")
    return f"**At {human.speed:.2f} m/s: {'; '.join(parts) or 'moments alone were measured'}.**"


def scores_table(numbers: Mapping[str, Scores], people: Scores) -> str:
    """Return the table of the scores: a row for each number that is there, a column for each side, and people's."""
    lines = []
    for curve, labels in SCORED.items():
        for name, (label, pattern) in labels.items():
            values = [of_side.get(curve, {}).get(name) for of_side in numbers.values()]
            if any(value is not None for value in values):
                words = label if curve == "grf" else f"{curve.replace('_', ' ')}, {label}"
                cells = [text_of(value, pattern) for value in (*values, people[curve].get(name))]
                lines.append([words, *cells])
    return table(["", *numbers, "people"], lines)


def scores_csv(numbers: Mapping[str, Scores], people: Scores) -> str:
    """Return every number as CSV, named as in metrics.json."""
    names = {(curve, name) for of_side in numbers.values() for curve in of_side for name in of_side[curve]}
    order = [(curve, name) for curve in people for name in people[curve] if (curve, name) in names]
    rows = (
        [curve, name, *(of_side.get(curve, {}).get(name) for of_side in numbers.values()), people[curve].get(name)]
        for curve, name in order
    )
    return csv_text(["curve", "number", *numbers, "people"], rows)


def scores_json(numbers: Mapping[str, Scores]) -> str:
    """Return the numbers as JSON with the keys `joints`, `grf` and `moments` of metrics.json: of both legs together, or
    of the one there is, and below `per_leg` of each leg."""

    def keyed(of_side: Scores) -> dict[str, Any]:
        """Return the numbers of one side by the keys of metrics.json."""
        return {
            "joints": {joint: of_side[joint] for joint in ANGLE_JOINTS if joint in of_side},
            "grf": of_side.get("grf", {}),
            "moments": {joint: of_side[name] for joint in MOMENT_JOINTS if (name := f"{joint}_moment") in of_side},
        }

    *_, last = numbers.values()
    per_leg = {side: keyed(of_side) for side, of_side in numbers.items() if side != "both"}
    return f"{json.dumps(keyed(last) | {'per_leg': per_leg}, indent=2, allow_nan=False)}\n"


def published_table(numbers: Scores, speed: float | None) -> str:
    """Return the Markdown table of one side's `numbers` and walking `speed` [m/s] beside published simulations."""

    def mean(name: str) -> float | None:
        """Return a number's mean over `COMPARED`; None unless each is there."""
        values = [numbers.get(joint, {}).get(name) for joint in COMPARED]
        known = [value for value in values if value is not None]
        return float(np.mean(known)) if len(known) == len(values) else None

    def percent(name: str) -> float | None:
        """Return a force's number in percent of the body weight."""
        value = numbers.get("grf", {}).get(name)
        return None if value is None else 100 * value

    hip, knee, ankle = (numbers.get(joint, {}).get("rmse_deg") for joint in COMPARED)
    ours = [
        text_of(speed, ".2f"),
        *(text_of(value, ".1f") for value in (hip, knee, ankle, mean("rmse_deg"))),
        *(text_of(mean(name), ".2f") for name in ("rmse_sd", "r")),
        *(MISSING, MISSING),  # angles, forces and moments together
        *(text_of(percent(f"{name}_rmse_bw"), ".1f") for name in ("vertical", "forward")),
    ]
    rows = [[f"{row['walk']}, {row['kind']}", *(row[name] or MISSING for name in BESIDE)] for row in published_walks()]
    return table(["walk", *BESIDE.values()], [["these files (thigh for hip)", *ours], *rows])


def published_walks() -> list[dict[str, str]]:
    """Return the rows of `PUBLISHED`, column -> text."""
    table_of_walks = read_csv(Path(__file__).resolve().parents[2] / PUBLISHED)
    return [dict(zip(table_of_walks.columns, cells, strict=True)) for _, cells in table_of_walks.rows]
