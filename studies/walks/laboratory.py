"""Hold walks on slopes, with loads, on heavy feet and at other step times, as laboratories had people walk, against the
usual walk."""

from collections.abc import Mapping
from typing import Any

from springfoot.files.markdown import table, text_of
from springfoot.gait.body import Body

from ..base.columns import Column, falls_text, walks_csv
from ..feet.both_feet import both

GRADE_DEG = 4.57
"""Slope of 8 % [deg] (Koelewijn et al. 2019)."""
SLOPES = {"level": {}, "up": {"slope_deg": GRADE_DEG}, "down": {"slope_deg": -GRADE_DEG}}
"""Condition -> settings on slopes."""
LOADS = {ratio: {"carried_ratio": ratio} for ratio in (0.0, 0.2, 0.4)}
"""Load on the back over body mass [-] -> settings (Huang & Kuo 2014)."""
_BODY = Body()
WAIST_LOADS = {kg: {"carried_ratio": kg / _BODY.mass, "carried_at": "waist"} for kg in (0.0, 4.0, 8.0, 16.0)}
"""Load around the waist of a body of 63 kg [kg] -> settings (Browning et al. 2007)."""
_FEET_KG = 2.0 * (_BODY.foot_mass + _BODY.toe_mass)
_RATIOS = {kg: 1.0 + kg / _FEET_KG for kg in (4.0, 8.0)}
HEAVY_FEET = {0.0: {}} | {
    kg: both({"kind": "intact", "foot_mass_ratio": ratio, "foot_inertia_ratio": ratio}) for kg, ratio in _RATIOS.items()
}
"""Mass added to both feet together of a body of 63 kg [kg] -> settings (Browning et al. 2007)."""
STEP_TIMES = {ratio: {"step_time_ratio": ratio} for ratio in (0.85, 1.15)}
"""Step time over people's at the same speed [-] -> settings."""
LABORATORY: dict[str, Mapping[str, Any]] = {
    "usual": {},
    "8 % up": SLOPES["up"],
    "8 % down": SLOPES["down"],
    **{f"load of {100 * ratio:g} % on the back": given for ratio, given in LOADS.items() if ratio},
    **{f"load of {kg:g} kg at the waist": given for kg, given in WAIST_LOADS.items() if kg},
    **{f"{kg:g} kg on the feet": given for kg, given in HEAVY_FEET.items() if kg},
    **{f"step time × {ratio:g}": given for ratio, given in STEP_TIMES.items()},
}
"""Condition in words -> settings; the others are compared with the first."""
LABORATORY_COLUMNS = (
    Column("walked, m/s", ".2f", ("speed_m_s", "mean")),
    Column("fibre work, J/kg/m", ".2f", ("effort", "fibre_J_kg_m")),
    Column("effort, –", ".2f", ("effort", "total")),
    Column("CoM push-off, J/kg", ".2f", ("com_work_J_kg", "push_off")),
    Column("collision, J/kg", ".2f", ("com_work_J_kg", "collision")),
    *(Column(f"{joint} moment, N·m/kg", ".2f", ("moments", joint, "peak_Nm_kg")) for joint in ("hip", "knee", "ankle")),
)
"""Numbers of the table, each with its change from the usual walk."""


def laboratory_table(name: str, walks: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the Markdown table of the policy `name`, from the metrics of its walk under each condition, the usual one
    first: numbers, and in brackets their changes from the usual walk."""
    usual, *_ = walks.values()
    lines = []
    for words, metrics in walks.items():
        cells = []
        for column in LABORATORY_COLUMNS:
            value, before = column.of(metrics), column.of(usual)
            has_change = metrics is not usual and value is not None and before
            cells.append(text_of(value, column.pattern) + (f" ({value / before - 1.0:+.0%})" if has_change else ""))
        lines.append([words, falls_text(metrics), *cells])
    return table([f"`{name}`", "falls", *(column.label for column in LABORATORY_COLUMNS)], lines)


def laboratory_csv(walks: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """Return the CSV with a line for each policy and condition; `walks` is policy -> condition -> metrics."""
    return walks_csv(
        [
            (
                {
                    "policy": name,
                    "conditions": words,
                    **{one.csv_name: one.of(metrics) for one in LABORATORY_COLUMNS[1:]},
                },
                metrics,
            )
            for name, of_policy in walks.items()
            for words, metrics in of_policy.items()
        ]
    )
