"""Print the table of an evaluation in the terminal: the walk's numbers beside people's, readable in 60 columns."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from springfoot.envs.settings.settings import BipedSettings, body_of, reference_gait, settings_from
from springfoot.errors import printable
from springfoot.files.markdown import plus_minus, text_of
from springfoot.gait import GRAVITY, HumanGait
from springfoot.gait.people import scores as score
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.plan.effort import effort_of_people

from ..numbers.criteria import fault


def print_table(metrics: dict[str, Any], console: Console | None = None) -> None:
    """Print an evaluation as a table, people beside the model; plain text where the output is no terminal.

    `metrics` is the content of metrics.json, `console` the place to print, standard output unless given.
    """
    console = console or Console(highlight=False)
    environment = metrics["environment"]
    people = metrics["reference"]
    pushes = f", pushes ±{environment['push_newton']:g} N" if environment["push_newton"] else ""
    console.print(
        f"\n[bold]{escape(metrics['policy'])}[/] on {environment['height']:g} m, {environment['mass']:g} kg, "
        f"{environment['speed']:g} m/s, equilibrium {environment['equilibrium']}{pushes}",
        soft_wrap=not console.is_terminal,
    )
    if metrics["per_leg"] is not None:
        console.print("feet: " + ", ".join(f"{side} {kind}" for side, kind in metrics["feet"].items()))
    reference = "people" if environment["human"] is None else "own"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    narrow = console.width < NARROW
    label_columns = ("",) if narrow else ("", "")  # quantity and unit, or both in one column
    for name in (*label_columns, "model", reference, "r", "in ±SD"):
        table.add_column(
            name,
            justify="right" if name else "left",
            style="bold" if name == "model" else "",
            no_wrap=bool(name) or not narrow,
        )
    for section in _sections(metrics):
        for label, unit, *values in section:
            label_with_unit = f"{label}, {unit}" if unit else label
            labels = [label_with_unit] if narrow else [label, unit]
            table.add_row(*labels, *values)
        table.add_section()
    console.print(table)
    if metrics["per_leg"] is not None:
        console.print(_leg_table(metrics, narrow))
    if warning := fault(metrics):
        console.print(f"[bold red]{escape(warning)}[/]", soft_wrap=not console.is_terminal)
    for reason, count in metrics["fall_reasons"].items():
        console.print(f"{count} × {reason}")
    if environment["human"] is not None:
        borrowed = ", ".join(people["borrowed"]) or "nothing"
        console.print(f"own: {people['condition']}; people's instead: {borrowed}", soft_wrap=not console.is_terminal)
    console.print(
        f"{reference} at {people['speed_m_s']:.2f} m/s; r and share of the stride inside their mean ± SD: of mean "
        "curves, the CoM's against the plan; stiffness: loading / mid-stance / push-off / swing; "
        "feedback: share of its variance that the phase does not explain / its SD at equal phase",
        soft_wrap=not console.is_terminal,
    )


def _leg_table(metrics: dict[str, Any], narrow: bool) -> Table:
    """Return the table of the two legs, for feet that differ; a foot's name may take two lines.

    `metrics` is the content of metrics.json; in a `narrow` terminal the unit goes into the label.
    """
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    for name in ("each leg",) if narrow else ("each leg", ""):
        table.add_column(name, no_wrap=not narrow)
    for side, kind in metrics["feet"].items():
        table.add_column(f"{side}: {kind}", justify="right", min_width=len("-0.00"))
    for label, unit, *values in leg_rows(metrics):
        table.add_row(*([f"{label}, {unit}"] if narrow else [label, unit]), *values)
    return table


def leg_rows(metrics: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the rows of the table of the two legs: quantity, unit, left leg, right leg; none if the feet are the same.

    `metrics` is the content of metrics.json.
    """
    if metrics["per_leg"] is None:
        return []
    legs = metrics["per_leg"].values()

    def row(label: str, unit: str, values: Iterable[float | None], pattern: str) -> tuple[str, str, str, str]:
        """Return a row with the two legs' `values` as text."""
        left, right = (text_of(value, pattern) for value in values)
        return label, unit, left, right

    # Label, unit, key of the number in `per_leg`, format.
    of_leg = (
        ("step length", "m", "step_length_m", ".3f"),
        ("stance", "%", "stance_percent", ".1f"),
        ("vertical force, peak 1", "BW", "vertical_peak1_bw", ".2f"),
        ("vertical force, peak 2", "BW", "vertical_peak2_bw", ".2f"),
        ("forward force", "BW", "forward_peak_bw", ".2f"),
    )
    rows = [row(label, unit, (leg[key] for leg in legs), pattern) for label, unit, key, pattern in of_leg]
    for joint in ("knee", "ankle", "toe"):
        rows.append(row(f"{joint} range", "deg", (leg["joint_range_deg"][joint] for leg in legs), ".1f"))
    for joint in ("hip", "knee", "ankle", "toe"):
        work = (leg["joint_work_J_kg"][joint]["positive"] for leg in legs)
        rows.append(row(f"{joint} work, positive", "J/kg", work, ".2f"))
    return rows


def table_rows(metrics: dict[str, Any]) -> list["TableRow"]:
    """Return the rows of an evaluation's table one after another, for the page; `metrics` is the content of
    metrics.json."""
    return [row for section in _sections(metrics) for row in section]


def print_results(out: Path, files: Sequence[str]) -> None:
    """Print the folder of the results, ready to copy, and the names of the files."""
    print(f"\nResults: {out}")
    print_words(", ".join(files))


def print_words(text: str) -> None:
    """Print a sentence, wrapped between words if the output is a terminal."""
    console = Console(highlight=False, markup=False, emoji=False)
    console.print(printable(text), soft_wrap=not console.is_terminal)


NARROW = 76
"""Columns of a terminal below which the unit goes into the label, which may take two lines; numbers never do."""
TableRow = tuple[str, str, str, str, str, str]
"""Quantity, unit, model, people, r, fraction inside people's mean ± SD."""


def _sections(metrics: dict[str, Any]) -> list[list[TableRow]]:
    """Return the rows of an evaluation's table in groups: gait, angles, forces, moments and work, energy, plan,
    stiffness.

    `metrics` is the content of metrics.json.
    """
    people = people_metrics(settings_from(**metrics["environment"]))
    grf = metrics["grf"]
    their_grf = people["grf"]
    valley = grf["vertical_valley_bw"]
    braking = grf["braking_peak_bw"]
    com = metrics["com"]
    zmp = metrics["zmp"]
    rest = metrics["came_to_rest"]
    at_rest = [] if rest is None else [("came to rest", "", f"{rest} of {metrics['episodes']}", "", "", "")]

    def row(
        label: str, unit: str, value: Any, pattern: str, of_people: Any = None, r: Any = None, inside: Any = None
    ) -> TableRow:
        """Return a row: `value`, a number or its mean and SD, people's number, r, and the percent of the stride inside
        people's SD; None leaves a cell empty."""
        text = plus_minus(value, pattern) if isinstance(value, dict) else text_of(value, pattern)
        inside_text = "" if inside is None else f"{inside:.0f} %"
        return (
            label,
            unit,
            text,
            "" if of_people is None else text_of(of_people, pattern),
            "" if r is None else f"{r:.2f}",
            inside_text,
        )

    def percent(value: float | None) -> str:
        """Return a fraction as text of its percent."""
        return text_of(None if value is None else 100 * value, ".0f")

    def mm(label: str, value: float | None, r: float | None = None) -> TableRow:
        """Return the row of a length [m], in millimetres."""
        return row(label, "mm", None if value is None else 1000 * value, ".0f", None, r)

    return [
        [
            ("falls", "", f"{metrics['falls']} of {metrics['episodes']}", "", "", ""),
            *at_rest,
            row("return", "", metrics["return"], ".1f"),
            row("speed", "m/s", metrics["speed_m_s"], ".3f", people["speed_m_s"]),
            row("step length", "m", metrics["step_length_m"], ".3f", people["step_length_m"]),
            row("cadence", "steps/min", metrics["cadence_steps_min"], ".1f", people["cadence_steps_min"]),
            row("double support", "s", metrics["double_support_s"], ".3f", people["double_support_s"]),
            row("toe-off", "%", metrics["toe_off_percent"], ".1f", people["toe_off_percent"]),
        ],
        [
            row(f"{name} angle, RMSE", "deg", v["rmse_deg"], ".1f", None, v["r"], v["within_1sd_percent"])
            for name, v in metrics["joints"].items()
        ],
        [
            row("vertical force, peak 1", "BW", grf["vertical_peak1_bw"], ".2f", their_grf["vertical_peak1_bw"]),
            row("vertical force, valley", "BW", valley, ".2f", their_grf["vertical_valley_bw"], grf["vertical_r"]),
            row("vertical force, peak 2", "BW", grf["vertical_peak2_bw"], ".2f", their_grf["vertical_peak2_bw"]),
            row("vertical force, largest", "BW", grf["vertical_max_bw"], ".2f"),
            row("braking force", "BW", braking, ".2f", their_grf["braking_peak_bw"], grf["forward_r"]),
            row("forward force", "BW", grf["forward_peak_bw"], ".2f", their_grf["forward_peak_bw"]),
        ],
        [
            row(f"{name} moment, peak", "N·m/kg", v["peak_Nm_kg"], ".2f", people["moments"].get(name), v["r"])
            for name, v in metrics["moments"].items()
        ]
        + [
            row(f"{name} work, {sign}", "J/kg", work[sign], ".2f", people["joint_work_J_kg"].get(name, {}).get(sign))
            for name, work in metrics["joint_work_J_kg"].items()
            for sign in ("positive", "negative")
        ]
        + [
            row("cost of transport", "", metrics["cost_of_transport"], ".3f"),
            row("fibre work", "J/kg/m", metrics["effort"]["fibre_J_kg_m"], ".2f", people["fibre_J_kg_m"]),
            row("effort", "", metrics["effort"]["total"], ".2f", people["effort"]),
            row("push-off on the CoM", "J/kg", metrics["com_work_J_kg"]["push_off"], ".2f"),
            row("collision of the CoM", "J/kg", metrics["com_work_J_kg"]["collision"], ".2f"),
        ],
        [
            row(f"energy, {name.replace('_', ' ')}", "J/kg", metrics["energy_J_kg"][name], "+.3f")
            for name in ("actuators", "passive_damping", "contact", "residual")
        ],
        [
            mm("CoM x to plan, RMSE", com["x_rmse_m"]),
            mm("CoM z to plan, RMSE", com["z_rmse_m"], com["z_r"]),
            mm("CoM rise", com["rise_m"]),
            mm("CoP to ZMP, RMSE", zmp["cop_rmse_m"], zmp["r"]),
            mm("in single support", zmp["cop_rmse_single_support_m"]),
            mm("toe clearance", metrics["toe_clearance_m"]),
            mm("contact travel a stance", metrics["contact_travel_m"]),
        ],
        [
            (f"{name} stiffness", "N·m/rad", "/".join(text_of(v, ".0f") for v in values.values()), "", "", "")
            for name, values in metrics["stiffness_Nm_rad"].items()
        ]
        + [
            (f"{name} feedback", "%", "/".join(percent(values[key]) for key in ("share", "spread")), "", "", "")
            for name, values in metrics["feedback"].items()
        ],
    ]


def people_metrics(settings: BipedSettings) -> dict[str, Any]:
    """Return the numbers of people, or of own data, at the body and speed of `settings`; keys as in metrics.json.

    They are of people's mean curves. Effort is without the toe, whose moment is not measured.
    """
    human = reference_gait(settings)
    body = body_of(settings)
    effort = effort_of_people(human, body)
    phase = PERCENT / 100
    features = score.force_features(human.mean("grf_vertical", phase), human.mean("grf_forward", phase))
    work = {name: _people_work(human, name) for name in ("hip", "knee", "ankle")}
    return {
        "speed_m_s": human.speed,
        "step_length_m": human.step_length,
        "cadence_steps_min": 2 * 60 / human.stride_time,
        # From the heel strike of the other foot, half a stride on, to the toe-off.
        "double_support_s": (human.toe_off - 0.5) * human.stride_time,
        "toe_off_percent": 100 * human.toe_off,
        "grf": {
            "vertical_peak1_bw": features.vertical_peak1,
            "vertical_valley_bw": features.vertical_valley,
            "vertical_peak2_bw": features.vertical_peak2,
            "braking_peak_bw": features.braking_peak,
            "forward_peak_bw": features.forward_peak,
        },
        "moments": {name: score.largest(human.mean(f"{name}_moment", phase))[0] for name in ("hip", "knee", "ankle")},
        "ankle_work_J_kg": work["ankle"],
        "joint_work_J_kg": work,
        # Effort is per weight with load and metre, this number per mass of the body alone and metre.
        "fibre_J_kg_m": effort.work * GRAVITY * body.total_mass / body.mass,
        "effort": effort.total,
    }


def _people_work(human: HumanGait, joint: str) -> dict[str, float]:
    """Return positive and negative work of one of people's joints in a stride [J/kg], from their mean power."""
    power = human.mean(f"{joint}_power", PERCENT / 100)[None]  # (1, 101): of one stride
    positive, negative = score.stride_work(power, np.array([human.stride_time]))
    return {"positive": float(positive[0]), "negative": float(negative[0])}
