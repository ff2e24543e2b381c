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
"""Joints whose angles are compared; people's toe comes from another measurement of other people."""


OPEN_LOOP = "open loop"
"""Name of a policy's open-loop copy in tables."""


def open_loop_note(name: str) -> str:
    """Return the sentence under a table with a policy's open-loop copy; empty if the policy has none."""
    copies = ", ".join(f"`{copy}`" for copy in and_copy(name)[1:])
    return copies and f" Open loop: {copies}, the policy's mean K over the stride at the same θ_eq, without feedback."


@dataclass(frozen=True)
class Column:
    """Column of a table: its label, the format of its numbers, and their keys in nested metrics."""

    label: str
    pattern: str
    path: tuple[str, ...]

    def of(self, metrics: Mapping[str, Any]) -> Any:
        """Return the number; None if it could not be measured."""
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
    """Return the CSV with a line for each walk: its labels, `WALK_COLUMNS`, and the number of episodes."""
    head = [*rows[0][0], "episodes", *(each.csv_name for each in WALK_COLUMNS)]
    lines = ([*of.values(), metrics["episodes"], *(each.of(metrics) for each in WALK_COLUMNS)] for of, metrics in rows)
    return csv_text(head, lines)


def falls_text(metrics: Mapping[str, Any]) -> str:
    """Return how many episodes fell, in words."""
    return f"{metrics['falls']} of {metrics['episodes']}"


def rmse_text(metrics: Mapping[str, Any]) -> str:
    """Return the RMSE of `COMPARED_JOINTS` to people's mean [deg], in words."""
    return " / ".join(text_of(metrics["joints"][joint]["rmse_deg"], ".1f") for joint in COMPARED_JOINTS)
