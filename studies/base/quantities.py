"""Numbers of metrics.json that stand in several studies' tables, each with its label and format."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from typing import Any

from springfoot.agents.policies import and_copy
from springfoot.files.markdown import text_of
from springfoot.files.writing import csv_text

COMPARED_JOINTS = ("thigh", "knee", "ankle")
"""Whose angles are compared; people's toe is that of other people."""


OPEN_LOOP = "open loop"
"""What tables call a policy's open-loop copy."""


def open_loop_note(name: str) -> str:
    """Return the sentence under a table that has the open-loop copy of a policy; empty where it has none."""
    copies = ", ".join(f"`{copy}`" for copy in and_copy(name)[1:])
    return copies and f" Open loop: {copies}, the policy's mean K over the stride at the same θ_eq, without feedback."


@dataclass(frozen=True)
class Quantity:
    """A number and where it stands in nested metrics."""

    label: str
    pattern: str
    path: tuple[str, ...]

    def of(self, metrics: Mapping[str, Any]) -> Any:
        """Return the number; None where it could not be measured."""
        return reduce(getitem, self.path, metrics)

    @property
    def column(self) -> str:
        """Its name in a CSV file: the place, joined."""
        return "_".join(self.path)


OF_A_WALK = (
    Quantity("falls", "d", ("falls",)),
    Quantity("return", ".1f", ("return", "mean")),
    Quantity("speed m/s", ".3f", ("speed_m_s", "mean")),
    *(Quantity(f"RMSE {joint} °", ".2f", ("joints", joint, "rmse_deg")) for joint in (*COMPARED_JOINTS, "toe")),
    *(Quantity(f"vertical peak {peak} BW", ".2f", ("grf", f"vertical_peak{peak}_bw")) for peak in (1, 2)),
    Quantity("vertical force r", ".3f", ("grf", "vertical_r")),
    *(
        Quantity(f"{joint} K {phase.replace('_', '-')} N·m/rad", ".0f", ("stiffness_Nm_rad", joint, phase))
        for joint in ("ankle", "toe")
        for phase in ("loading", "mid_stance", "push_off", "swing")
    ),
)
"""The numbers of a walk that `compare` tabulates over several policies, and that CSV files of walks hold."""


def walks_csv(rows: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> str:
    """CSV: a line for each walk, of what it is of and its metrics: `OF_A_WALK` and the number of episodes."""
    head = [*rows[0][0], "episodes", *(each.column for each in OF_A_WALK)]
    lines = ([*of.values(), metrics["episodes"], *(each.of(metrics) for each in OF_A_WALK)] for of, metrics in rows)
    return csv_text(head, lines)


def falls_text(metrics: Mapping[str, Any]) -> str:
    """Return how many episodes fell, in words."""
    return f"{metrics['falls']} of {metrics['episodes']}"


def rmse_text(metrics: Mapping[str, Any]) -> str:
    """RMSE of `COMPARED_JOINTS` to people's mean [deg], in words."""
    return " / ".join(text_of(metrics["joints"][joint]["rmse_deg"], ".1f") for joint in COMPARED_JOINTS)
