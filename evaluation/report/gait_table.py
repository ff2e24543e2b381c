"""Print the table of an evaluation in the terminal: the walk's numbers beside people's, readable in 60 columns."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from springfoot.envs.physics.model import LEFT, RIGHT
from springfoot.envs.settings.feet import FOOT_SETTINGS
from springfoot.envs.settings.settings import TUNED, BipedSettings, body_of, reference_gait, settings_from
from springfoot.errors import printable
from springfoot.files.markdown import MISSING, plus_minus, text_of
from springfoot.gait import GRAVITY, HumanGait
from springfoot.gait.people import scores as score
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.plan.effort import effort_of_people

from ..numbers.criteria import fault
from ..recording.open_loop import deciding_legs


def print_table(metrics: dict[str, Any], console: Console | None = None) -> None:
    """Print an evaluation as a table, people beside the model; plain text where the output is no terminal.

    `metrics` is the content of metrics.json, `console` the place to print, standard output unless given.
    """
    print_tables([metrics], console)


def print_tables(walks: Sequence[dict[str, Any]], console: Console | None = None) -> None:
    """Print evaluations as one table with a column for each, people beside them, and a legend; one walk alone has the
    table of its likeness.

    In a terminal too narrow for it, and for walks beside different people, each has a table of its own. `walks` are the
    contents of metrics.json, `console` is the place to print, standard output unless given.
    """
    console = console or Console(highlight=False)
    together = _table_of_several(walks) if len(walks) > 1 and _beside_the_same_people(walks) else None
    one_table = together is not None and _fits_uncut(together, console)
    if one_table:
        _print_head(walks, console)
        console.print(together)
        console.print()
        for metrics in walks:
            _print_notes(metrics, console, f"{metrics['policy']}: ")
    else:
        for metrics in walks:
            _print_head([metrics], console)
            console.print(_widest_that_fits(partial(_table_of_one, metrics), console))
            console.print()
            _print_notes(metrics, console)
    if any(metrics["strides"]["count"] for metrics in walks):  # without strides there are no words to explain
        for line in _legend(walks, with_likeness=not one_table):
            _print_line(line, console)


def _fits_uncut(table: Table, console: Console) -> bool:
    """Return True if a table can be printed uncut; a console that is no terminal is widened to the table before."""
    columns = _uncut_columns(table, console)
    if not console.is_terminal:
        console.width = max(console.width, columns)
    return columns <= console.width


def _uncut_columns(table: Table, console: Console) -> int:
    """Return the width of a table printed uncut, in characters."""
    return console.measure(table, options=console.options.update(width=ANY_WIDTH)).maximum


def _widest_that_fits(make: Callable[[bool], Table], console: Console) -> Table:
    """Return the wide table `make(False)`, or the narrow one, `make(True)`, if the console would cut the wide one."""
    table = make(False)
    return table if _uncut_columns(table, console) <= console.width else make(True)


def _print_line(text: str, console: Console, style: str = "") -> None:
    """Print a text: wrapped between words in a terminal, elsewhere on one line."""
    console.print(escape(text), style=style or None, soft_wrap=not console.is_terminal)


def _print_head(walks: Sequence[dict[str, Any]], console: Console) -> None:
    """Print the names of the policies, and their world (`_world_words`): one line for the policies of equal worlds."""
    names_in = dict[str, list[str]]()
    for metrics in walks:
        names_in.setdefault(_world_words(metrics), []).append(metrics["policy"])
    console.print()
    for world, names in names_in.items():
        console.print(f"[bold]{escape(', '.join(names))}[/] on {escape(world)}", soft_wrap=not console.is_terminal)


def _world_words(metrics: dict[str, Any]) -> str:
    """Return in words the body, speed, rest angles, learned person and pushes of an evaluation; on a line below
    feet that differ."""
    environment = metrics["environment"]
    pushes = f", pushes ±{environment['push_newton']:g} N" if environment["push_newton"] else ""
    person = "" if environment["person"] in (None, TUNED) else f", person {Path(environment['person']).stem}"
    feet = ", ".join(f"{side} {kind}" for side, kind in metrics["feet"].items())
    return (
        f"{environment['height']:g} m, {environment['mass']:g} kg, {environment['speed']:g} m/s, "
        f"springs' rest angles {environment['equilibrium']}{person}{pushes}"
    ) + ("" if metrics["per_leg"] is None else f"\nfeet: {feet}")


def _print_notes(metrics: dict[str, Any], console: Console, of_policy: str = "") -> None:
    """Print below the table of an evaluation the table of its legs, its fault, its falls, a hint if all fell, and its
    own people, where there are any; each note begins with the words `of_policy`."""
    if metrics["per_leg"] is not None and metrics["strides"]["count"]:
        console.print(_widest_that_fits(partial(_leg_table, metrics, heading=f"{of_policy}each leg"), console))
        console.print()
    if warning := fault(metrics):
        _print_line(of_policy + warning, console, "bold red")
    for reason, count in metrics["fall_reasons"].items():
        _print_line(f"{of_policy}{count} × {reason}", console)
    if _all_fell(metrics):
        _print_line(f"{of_policy}Every episode fell: {_hint_on_falls(metrics['environment'])}", console)
    if metrics["environment"]["human"] is not None:
        people = metrics["reference"]
        borrowed = ", ".join(people["borrowed"]) or "nothing"
        _print_line(f"{of_policy}own: {people['condition']}; people's instead: {borrowed}", console)


def _all_fell(metrics: dict[str, Any]) -> bool:
    """Return True if every episode fell."""
    return metrics["falls"] == metrics["episodes"]


def _hint_on_falls(environment: dict[str, Any]) -> str:
    """Return a hint after nothing but falls in an `environment`, the settings in metrics.json."""
    tuned = (
        environment["acts"] == "stiffness"
        and environment["person"] in (None, TUNED)
        and environment["guide"] == "people"
    )
    if tuned and any(environment[foot] != "intact" for foot in FOOT_SETTINGS):
        return "on these feet try --person learned"
    return "springfoot live shows how"


def _people_word(metrics: dict[str, Any]) -> str:
    """Return the heading of the people compared with: `people`, or `own` for own data."""
    return "people" if metrics["environment"]["human"] is None else "own"


def _beside_the_same_people(walks: Sequence[dict[str, Any]]) -> bool:
    """Return True if all evaluations are compared with the same numbers of people."""
    people = [(_people_word(metrics), people_metrics(settings_from(**metrics["environment"]))) for metrics in walks]
    return all(numbers == people[0] for numbers in people)


def _legend(walks: Sequence[dict[str, Any]], with_likeness: bool) -> list[str]:
    """Return lines that explain the words of the tables of some evaluations.

    Tables `with_likeness` have the columns r and in ±SD.
    """
    first, *_ = walks
    feet_differ = any(metrics["per_leg"] is not None for metrics in walks)
    whose = "people's" if _people_word(first) == "people" else "your data's"
    return [
        f"{_people_word(first)}: mean curves at {first['reference']['speed_m_s']:.2f} m/s; "
        "±: SD between episodes; return: sum of rewards",
        *(line.format(whose=whose) for line in (DISTANCE, *(LIKENESS if with_likeness else LIKENESS_ELSEWHERE))),
        *(BOTH_LEGS if feet_differ else ()),
        *WORDS,
    ]


DISTANCE = "RMSE: root mean square difference from {whose} mean curve (CoM, CoP: the plan)"
LIKENESS = (
    "r: correlation with {whose} mean curve (CoM, CoP: with the plan's)",
    "in ±SD: share of the stride with the mean curve inside {whose} mean ± SD",
)
"""Lines of the legend for the columns r and in ±SD."""
LIKENESS_ELSEWHERE = ("correlation, and share of the stride inside {whose} mean ± SD: metrics.json",)
"""Line of the legend in place of `LIKENESS`, where a table lacks these columns."""
BOTH_LEGS = (
    "both legs: means of the two; feedback: of legs whose stiffness the policy sets",
    "stiffness of both legs: without a joint that is locked",
)
"""Lines of the legend for a walk with different feet."""
WORDS = (
    "BW: body weights; J/kg: of one leg in a stride (energy: of both; CoM: in a step)",
    "cost of transport: positive work of joints / (weight · distance), no unit",
    "effort: fibre work / (weight · distance) + activation, its rate, accelerations",
    "CoM: centre of mass; CoP: centre of pressure; ZMP: where the plan has the CoP",
    "stiffness: loading / mid-stance / push-off / swing",
    "rest angles: where the springs of ankles and toes are slack (--equilibrium)",
    "feedback: share of stiffness's variance not due to the phase / SD at equal phase",
)
"""Lines of the legend for every evaluation."""


def _table_of_one(metrics: dict[str, Any], narrow: bool) -> Table:
    """Return the table of one evaluation, with likeness to people; in a `narrow` terminal the unit goes into the label.

    `metrics` is the content of metrics.json.
    """
    what = "" if metrics["per_leg"] is None else "both legs"
    table = _empty_table((what,) if narrow else (what, ""), narrow)
    for name in ("model", _people_word(metrics), "r", "in ±SD"):
        table.add_column(name, justify="right", style="bold" if name == "model" else "", no_wrap=True)
    for section in _sections(metrics):
        for row in section:
            labels = [f"{row.label}, {row.unit}" if row.unit else row.label] if narrow else [row.label, row.unit]
            if not _is_unmeasured([row.model], [metrics]):
                table.add_row(*labels, row.model, row.people, row.r, row.inside)
        table.add_section()
    return table


def _table_of_several(walks: Sequence[dict[str, Any]]) -> Table:
    """Return the table of several evaluations beside the same people; a row that one lacks is empty there."""
    table = _empty_table(("", ""))
    for name in (*(metrics["policy"] for metrics in walks), _people_word(walks[0])):
        table.add_column(escape(name), justify="right", no_wrap=True)
    for sections in zip(*map(_sections, walks), strict=True):  # the same section of each walk
        rows_of = [{(row.label, row.unit): row for row in section} for section in sections]
        for key in dict.fromkeys(key for rows in rows_of for key in rows):
            people = next(rows[key].people for rows in rows_of if key in rows)
            cells = [rows[key].model if key in rows else "" for rows in rows_of]
            if not _is_unmeasured(cells, walks):
                table.add_row(*key, *cells, people)
        table.add_section()
    return table


def _is_unmeasured(cells: Sequence[str], walks: Sequence[dict[str, Any]]) -> bool:
    """Return True if no walk has a number among the `cells` of a row, and every episode of all `walks` fell."""
    return all(map(_all_fell, walks)) and all(set(cell) <= {MISSING, "/"} for cell in cells)


def _empty_table(label_columns: Sequence[str], narrow: bool = False) -> Table:
    """Return a table with columns for the labels of its rows, which take two lines if it is `narrow`."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, padding=(0, 1))  # to fit into 80 columns
    for name in label_columns:
        table.add_column(name, no_wrap=not narrow)
    return table


def _leg_table(metrics: dict[str, Any], narrow: bool, heading: str) -> Table:
    """Return the table of the two legs, for feet that differ; a foot's name may take two lines.

    `metrics` is the content of metrics.json; in a `narrow` terminal the unit goes into the label, below the `heading`.
    """
    table = _empty_table((heading,) if narrow else (heading, ""), narrow)
    for side, kind in metrics["feet"].items():
        table.add_column(f"{side}: {kind}", justify="right", min_width=len("-0.00"))
    for label, unit, *values in leg_rows(metrics):
        table.add_row(*([f"{label}, {unit}" if unit else label] if narrow else [label, unit]), *values)
    return table


def leg_rows(metrics: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the rows of the table of the two legs: quantity, unit, left leg, right leg; none if the feet are the same.

    `metrics` is the content of metrics.json.
    """
    if metrics["per_leg"] is None:
        return []
    settings = settings_from(**metrics["environment"])
    rows = [
        (row.label, row.unit, row.text(row.left), row.text(row.right))
        for row in leg_numbers_beside_people(metrics["per_leg"], settings)
    ]
    deciding = deciding_legs(settings)
    left, right = ("policy" if side in deciding else "device" for side in (LEFT, RIGHT))
    return [*rows, ("stiffness is set by", "", left, right)]


class LegRow(NamedTuple):
    """Numbers of a quantity: of the left and the right leg, and of people; None for an unknown one."""

    label: str
    unit: str
    pattern: str
    """Format of the numbers."""
    left: float | str | None
    """Number of the left leg, or a word in its place, as for a locked joint."""
    right: float | str | None
    people: float | None

    def text(self, value: float | str | None) -> str:
        """Return one of the row's values as text."""
        return value if isinstance(value, str) else text_of(value, self.pattern)


def _number_at(numbers: Any, keys: Sequence[str]) -> float | None:
    """Return the number in nested dictionaries to which `keys` lead, from the outermost to the innermost."""
    for key in keys:
        numbers = numbers[key]
    return numbers


def leg_numbers_beside_people(legs: Mapping[str, Mapping[str, Any]], settings: BipedSettings) -> list[LegRow]:
    """Return the numbers of both legs, `per_leg` of metrics.json, beside those of people or own data."""
    people = people_metrics(settings)
    human = reference_gait(settings)

    def row(label: str, unit: str, pattern: str, keys: Sequence[str], of_people: float | None = None) -> LegRow:
        """Return the row of the number to which `keys` lead in the numbers of each leg, and of people's number."""
        left, right = (_number_at(leg, keys) for leg in legs.values())
        return LegRow(label, unit, pattern, left, right, of_people)

    rows = [
        row("step length", "m", ".3f", ("step_length_m",), people["step_length_m"]),
        row("stance", "%", ".1f", ("stance_percent",), people["toe_off_percent"]),
        row("vertical force, peak 1", "BW", ".2f", ("vertical_peak1_bw",), people["grf"]["vertical_peak1_bw"]),
        row("vertical force, peak 2", "BW", ".2f", ("vertical_peak2_bw",), people["grf"]["vertical_peak2_bw"]),
        row("forward force", "BW", ".2f", ("forward_peak_bw",), people["grf"]["forward_peak_bw"]),
    ]
    for joint in ("knee", "ankle", "toe"):
        of_people = float(np.degrees(np.ptp(human.mean(joint, PERCENT / 100))))
        rows.append(row(f"{joint} range", "deg", ".1f", ("joint_range_deg", joint), of_people))
    for joint in ("hip", "knee", "ankle", "toe"):
        of_people = people["joint_work_J_kg"].get(joint, {}).get("positive")
        rows.append(row(f"{joint} work, positive", "J/kg", ".2f", ("joint_work_J_kg", joint, "positive"), of_people))
    for joint in ("ankle", "toe"):
        locked = [getattr(foot, joint).is_locked for foot in settings.feet]
        for part in ("loading", "mid_stance", "push_off", "swing"):
            stiffness = [leg["stiffness_Nm_rad"][joint][part] for leg in legs.values()]
            left, right = (LOCKED if lock else number for lock, number in zip(locked, stiffness, strict=True))
            label = f"{joint} stiffness, {part.replace('_', '-')}"
            rows.append(LegRow(label, "N·m/rad", ".0f", left, right, None))
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


ANY_WIDTH = 10_000
"""More columns than any table takes."""
LOCKED = "locked"
"""Text in place of the stiffness of a lock."""


class TableRow(NamedTuple):
    """Texts of a row: quantity, unit, model's and people's number, r, percent inside people's mean ± SD."""

    label: str
    unit: str
    model: str
    people: str = ""
    r: str = ""
    inside: str = ""


def _sections(metrics: dict[str, Any]) -> list[list[TableRow]]:
    """Return the rows of an evaluation's table in groups: gait, angles, forces, moments and work, energy, plan,
    stiffness.

    `metrics` is the content of metrics.json.
    """
    settings = settings_from(**metrics["environment"])
    people = people_metrics(settings)
    grf = metrics["grf"]
    their_grf = people["grf"]
    valley = grf["vertical_valley_bw"]
    braking = grf["braking_peak_bw"]
    com = metrics["com"]
    zmp = metrics["zmp"]
    rest = metrics["came_to_rest"]
    lasted = [TableRow("an episode lasts", "s", text_of(metrics["seconds_mean"], ".1f"))] if metrics["falls"] else []
    at_rest = [] if rest is None else [TableRow("came to rest", "", f"{rest} of {metrics['episodes']}")]

    def row(
        label: str, unit: str, value: Any, pattern: str, of_people: Any = None, r: Any = None, inside: Any = None
    ) -> TableRow:
        """Return a row: `value`, a number or its mean and SD, people's number, r, and the percent of the stride inside
        people's SD; None leaves a cell empty."""
        text = plus_minus(value, pattern) if isinstance(value, dict) else text_of(value, pattern)
        inside_text = "" if inside is None else f"{inside:.0f} %"
        return TableRow(
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

    def stiffness(joint: str) -> list[TableRow]:
        """Return the rows of the stiffness of a joint in the parts of the stride: of each leg if they are not alike."""
        locked = all(getattr(foot, joint).is_locked for foot in settings.feet)
        by_label = {"": metrics["stiffness_Nm_rad"]}
        if metrics["leg_stiffness_Nm_rad"] is not None:
            by_label = {f", {side}": values for side, values in metrics["leg_stiffness_Nm_rad"].items()}
        texts = {
            end: "/".join(text_of(value, ".0f") for value in values[joint].values()) for end, values in by_label.items()
        }
        return [
            TableRow(f"{joint} stiffness{end}", "N·m/rad", LOCKED if locked else text) for end, text in texts.items()
        ]

    def mm(label: str, value: float | None, r: float | None = None) -> TableRow:
        """Return the row of a length [m], in millimetres."""
        return row(label, "mm", None if value is None else 1000 * value, ".0f", None, r)

    return [
        [
            TableRow("falls", "", f"{metrics['falls']} of {metrics['episodes']}"),
            *lasted,
            *at_rest,
            row("return", "", metrics["return"], ".0f"),
            row("speed", "m/s", metrics["speed_m_s"], ".3f", people["speed_m_s"]),
            row("step length", "m", metrics["step_length_m"], ".3f", people["step_length_m"]),
            row("cadence", "steps/min", metrics["cadence_steps_min"], ".1f", people["cadence_steps_min"]),
            row("double support", "s", metrics["double_support_s"], ".3f", people["double_support_s"]),
            row("toe-off", "% stride", metrics["toe_off_percent"], ".1f", people["toe_off_percent"]),
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
            row("work of muscle fibres", "J/kg/m", metrics["effort"]["fibre_J_kg_m"], ".2f", people["fibre_J_kg_m"]),
            row("effort", "", metrics["effort"]["total"], ".2f", people["effort"]),
            row("push-off, on the CoM", "J/kg", metrics["com_work_J_kg"]["push_off"], ".2f"),
            row("collision, on the CoM", "J/kg", metrics["com_work_J_kg"]["collision"], ".2f"),
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
            mm("CoP to ZMP, on one foot", zmp["cop_rmse_single_support_m"]),
            mm("toe clearance", metrics["toe_clearance_m"]),
            mm("sole's slide a stance", metrics["contact_travel_m"]),
        ],
        [*stiffness("ankle"), *stiffness("toe")]
        + [
            TableRow(f"{name} feedback", "%", "/".join(percent(values[key]) for key in ("share", "spread")))
            for name, values in metrics["feedback"].items()
        ],
    ]


def people_metrics(settings: BipedSettings) -> dict[str, Any]:
    """Return the gait's numbers of people, or of the user's own data, at the body and speed of `settings`; keys as in
    metrics.json.

    They are of people's mean curves. Effort is without the toe: its moment is not measured.
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
