"""Columns of several studies' tables: numbers of metrics.json, each with its label and format."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from typing import Any

from springfoot.agents.policies import and_copy
from springfoot.files.markdown import text_of
from springfoot.files.writing import csv_text

COMPARED_JOINTS = ("thigh", "knee", "ankle")
"""Joints with angles that are compared; people's toe comes from another measurement of other people."""


OPEN_LOOP = "open loop"
"""Name of a policy's open-loop copy in tables."""


def open_loop_note(name: str) -> str:
    """Return the sentence that explains a policy's open-loop copy below a table; empty if the policy has none."""
    copies = ", ".join(f"`{copy}`" for copy in and_copy(name)[1:])  # [0] is the policy itself
    return copies and f" Open loop: {copies}, the policy's mean K over the stride at the same θ_eq, without feedback."


@dataclass(frozen=True)
class Column:
    """Column of a table."""

    label: str
    """Head of the column."""
    pattern: str
    """Format of its numbers, such as `.2f`."""
    path: tuple[str, ...]
    """Keys that lead to its number in nested metrics."""

    def of(self, metrics: Mapping[str, Any]) -> Any:
        """Return the column's number in `metrics`; None if it could not be measured."""
        return reduce(getitem, self.path, metrics)

    @property
    def csv_name(self) -> str:
        """Return the column's name in a CSV file: its keys, joined."""
        return "_".join(self.path)


WALK_COLUMNS = (
    Column("falls", "d", ("falls",)),
    Column("return", ".1f", ("return", "mean")),
    Column("speed m/s", ".3f", ("speed_m_s", "mean")),
    *(Column(f"RMSE {joint} °", ".2f", ("joints", joint, "rmse_deg")) for joint in (*COMPARED_JOINTS, "toe")),
    *(Column(f"vertical peak {peak} BW", ".2f", ("grf", f"vertical_peak{peak}_bw")) for peak in (1, 2)),
    Column("vertical force r", ".3f", ("grf", "vertical_r")),
    *(
        Column(f"{joint} K {phase.replace('_', '-')} N·m/rad", ".0f", ("stiffness_Nm_rad", joint, phase))
        for joint in ("ankle", "toe")
        for phase in ("loading", "mid_stance", "push_off", "swing")
    ),
)
"""Numbers of a walk in the tables of `compare` and in CSV files of walks."""


def walks_csv(rows: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> str:
    """Return the CSV with a line for each of `rows` (labels by column name, metrics): labels, number of episodes,
    `WALK_COLUMNS`."""
    head = [*rows[0][0], "episodes", *(column.csv_name for column in WALK_COLUMNS)]
    lines = (
        [*labels.values(), metrics["episodes"], *(column.of(metrics) for column in WALK_COLUMNS)]
        for labels, metrics in rows
    )
    return csv_text(head, lines)


def falls_text(metrics: Mapping[str, Any]) -> str:
    """Return the number of episodes that fell, as in "2 of 20"."""
    return f"{metrics['falls']} of {metrics['episodes']}"


def rmse_text(metrics: Mapping[str, Any]) -> str:
    """Return the RMSE of each of `COMPARED_JOINTS` to people's mean [deg], as in "4.1 / 5.0 / 3.2"."""
    return " / ".join(text_of(metrics["joints"][joint]["rmse_deg"], ".1f") for joint in COMPARED_JOINTS)
