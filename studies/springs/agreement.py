"""Compare the springs of several policies over the stride, and the criteria of a human-like walk that each misses.

    springfoot study agreement runs/five/seed-0 runs/five/seed-1 runs/five/seed-2

An undisturbed gait does not identify stiffness (`springfoot.studies.springs.any_stiffness`), so K stands beside the
rest angle and the torque. Agreement on K is judged where the joint carries load, by the coefficient of variation (SD /
mean) over the policies.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from springfoot.agents.policies import and_copy
from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers import HUMAN_LIKE, Gait, measure, number_text, with_derived
from springfoot.evaluation.recording import policy_and_settings, policy_label, record
from springfoot.evaluation.report import PNG, STYLE
from springfoot.files.markdown import MISSING, table
from springfoot.files.writing import csv_text
from springfoot.gait.people import PERCENT

from ..base.columns import OPEN_LOOP, falls_text, rmse_text, walks_csv
from ..base.study import Answer, OnProgress, WalkingStudy

LOADED = 0.1
"""A joint carries load where its moment is beyond this fraction of its largest."""
AGREES = 0.15
"""Largest coefficient of variation of K under load at which policies agree."""
SPRING_COLUMNS = {
    "ankle": ("ankle_stiffness_Nm_per_rad", "ankle_equilibrium_deg", "ankle_moment_Nm_per_kg"),
    "toe": ("toe_stiffness_Nm_per_rad", "mtp_equilibrium_deg", "mtp_moment_Nm_per_kg"),
}
"""Joint -> columns of gait_cycle.csv: K, theta_eq, torque."""
COLORS = {"ankle": "#0b6e8f", "toe": "#c26a1b"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Agreement:
    """Springs of one joint in S policies; curves (S, 101) over percent of the stride."""

    joint: str
    """Joint, one of `SPRING_COLUMNS`."""
    stiffness: NDArray
    """K [N m/rad]."""
    equilibrium: NDArray
    """theta_eq [deg]."""
    torque: NDArray
    """Moment, plantarflexion positive [N m/kg]."""

    @property
    def loaded(self) -> NDArray:
        """Return (101,) True where the joint carries load: the mean moment is beyond `LOADED` of its largest."""
        size = np.abs(self.torque.mean(axis=0))
        return size > LOADED * size.max()

    @property
    def variation(self) -> NDArray:
        """Return (101,) the coefficient of variation of K over the policies: SD (n - 1) / mean."""
        return self.stiffness.std(axis=0, ddof=1) / self.stiffness.mean(axis=0)

    @property
    def worst(self) -> tuple[float, int]:
        """Return the largest coefficient of variation under load, and its percent of the stride."""
        percent = int(np.where(self.loaded, self.variation, -1.0).argmax())
        return float(self.variation[percent]), percent

    @property
    def agree(self) -> bool:
        """Return True if the policies agree at every percent under load."""
        return self.worst[0] <= AGREES


def agreements(gaits: Sequence[Gait]) -> list[Agreement]:
    """Return the agreement of two gaits or more, one for the ankle and one for the toe.

    Raises `SpringfootError` for fewer gaits, and for a gait without strides.
    """
    _require_two(len(gaits))
    if without := [gait.metrics["policy"] for gait in gaits if not gait.both.count]:
        raise SpringfootError(f"{without[0]} walks no strides to compare")
    of_joints = []
    for joint, names in SPRING_COLUMNS.items():
        stiffness, equilibrium, torque = (np.stack([gait.both.mean(name) for gait in gaits]) for name in names)
        of_joints.append(Agreement(joint=joint, stiffness=stiffness, equilibrium=equilibrium, torque=torque))
    return of_joints


def _require_two(policies: int) -> None:
    """Raise `SpringfootError` for fewer than two policies."""
    if policies < 2:
        raise SpringfootError(f"agreement needs two policies or more, got {policies}")


def agreement_table(of_joints: Sequence[Agreement]) -> str:
    """Return the Markdown table that says for each joint how much K, theta_eq and torque vary between the policies
    where it carries load."""
    head = ["joint", "carries load at", "CV of K: mean", "95th percentile", "worst", f"≤ {100 * AGREES:.0f} %"]
    head += ["SD of θ_eq: mean, worst", "SD of torque / peak: mean, worst"]
    lines = []
    for agreement in of_joints:
        loaded = agreement.loaded
        worst, percent = agreement.worst
        variation = 100 * agreement.variation[loaded]
        rest = agreement.equilibrium.std(axis=0, ddof=1)[loaded]
        torque = 100 * agreement.torque.std(axis=0, ddof=1)[loaded] / np.abs(agreement.torque.mean(axis=0)).max()
        lines.append(
            [
                agreement.joint,
                f"{_stretches(loaded)} % of the stride",
                f"{variation.mean():.1f} %",
                f"{np.percentile(variation, 95):.1f} %",
                f"{100 * worst:.1f} % at {percent} %",
                "agree" if agreement.agree else "**do not agree**",
                f"{rest.mean():.2f}°, {rest.max():.2f}°",
                f"{torque.mean():.1f} %, {torque.max():.1f} %",
            ]
        )
    return table(head, lines)


def _stretches(mask: NDArray) -> str:
    """Return the percents at which a mask (101,) is True, as in "2–60, 95–100"."""
    # First percent of each stretch, and the one after its last, in turn.
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return ", ".join(f"{first}–{last - 1}" for first, last in edges.reshape(-1, 2))


def criteria_table(
    names: Sequence[str], metrics: Sequence[dict[str, Any]], copies: Sequence[dict[str, Any] | None] = ()
) -> str:
    """Return the Markdown table of every criterion and its number in each evaluation.

    Args:
        names: labels of the policies.
        metrics: metrics of each policy.
        copies: metrics of each policy's open-loop copy, None without one; falls and angles form the last rows.

    Bracketed numbers meet only the loosened criterion, bold ones not even that; the row `missed` counts the bold ones.
    """
    measured = [with_derived(metrics_of_policy) for metrics_of_policy in metrics]
    lines = []
    missed = [0] * len(measured)
    for criterion in HUMAN_LIKE:
        cells = []
        for column, values in enumerate(measured):
            text = number_text(criterion, values)
            if criterion.holds(values):
                cells.append(text)
            elif criterion.loosened().holds(values):
                cells.append(f"({text})")
            else:
                cells.append(f"**{text}**")
                missed[column] += 1
        loose = criterion.loosened()
        lines.append([criterion.name, criterion.text, loose.text if loose != criterion else "", *cells])
    lines.append(["missed", "", "", *map(str, missed)])
    if any(copies):
        falls = [MISSING if copy is None else falls_text(copy) for copy in copies]
        angles = [MISSING if copy is None else rmse_text(copy) for copy in copies]
        lines += [[f"{OPEN_LOOP}: falls", "", "", *falls], [f"{OPEN_LOOP}: thigh / knee / ankle °", "", "", *angles]]
    return table(["", "criterion", "loosened", *(f"`{name}`" for name in names)], lines)


def curves_csv(of_joints: Sequence[Agreement]) -> str:
    """Return the CSV over percent of the stride, for each joint: mean and SD of K, theta_eq and torque over the
    policies, CV of K, and whether it carries load."""
    columns: dict[str, NDArray] = {"percent": PERCENT}
    for agreement in of_joints:
        joint = agreement.joint
        curves_of_joint = (agreement.stiffness, agreement.equilibrium, agreement.torque)
        for name, curves in zip(SPRING_COLUMNS[joint], curves_of_joint, strict=True):
            columns |= {name: curves.mean(axis=0), f"{name}_sd": curves.std(axis=0, ddof=1)}
        columns |= {f"{joint}_stiffness_cv": agreement.variation, f"{joint}_loaded": agreement.loaded.astype(int)}
    return csv_text(list(columns), zip(*columns.values(), strict=True))


def save_figure(path: Path, of_joints: Sequence[Agreement]) -> None:
    """Draw K, rest angle and torque of each policy over the stride, a row for each joint, grey where it carries no
    load."""
    titles = ("stiffness K", "equilibrium θ_eq", "torque")
    units = ("N·m/rad", "dorsiflexion, toe up (deg)", "plantarflexion (N·m/kg)")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 5.6), layout="constrained")
        for row, agreement in zip(figure.subplots(len(of_joints), 3, squeeze=False), of_joints, strict=True):
            joint = agreement.joint
            curves_of_joint = (agreement.stiffness, agreement.equilibrium, agreement.torque)
            for ax, curves, title, unit in zip(row, curves_of_joint, titles, units, strict=True):
                mean = curves.mean(axis=0)
                sd = curves.std(axis=0, ddof=1)
                ax.fill_between(PERCENT, mean - sd, mean + sd, color=COLORS[joint], alpha=0.22, lw=0)
                ax.plot(PERCENT, curves.T, color=COLORS[joint], lw=0.9, alpha=0.8)
                whole_height = ax.get_xaxis_transform()
                ax.fill_between(
                    PERCENT, 0, 1, where=~agreement.loaded, transform=whole_height, color="#f1f1f1", zorder=0
                )
                ax.set(title=f"{joint.capitalize()} {title}", ylabel=unit, xlabel="% of stride", xlim=(0, 100))
            row[0].set_ylim(0, None)
            worst, percent = agreement.worst
            row[0].set_title(f"{joint.capitalize()} K, worst CV under load {100 * worst:.0f} % at {percent} %")
        handles = {
            "each policy": Line2D([], [], color="#777777", lw=0.9),
            "mean ± SD over policies": Patch(color="#777777", alpha=0.22, lw=0),
            f"moment below {100 * LOADED:.0f} % of its peak": Patch(color="#f1f1f1", lw=0),
        }
        figure.legend(
            list(handles.values()), list(handles), loc="outside lower center", ncols=3, frameon=False, fontsize=9
        )
        figure.savefig(path, dpi=110, **PNG)


@dataclass(frozen=True, kw_only=True)
class SeedAgreement(WalkingStudy):
    """Compare several policies, such as one training from several seeds, with each other and with people."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = ()
    """Two or more policies of evaluate.py: run folders, files, names."""

    def check(self) -> None:
        """Refuse counts and lengths out of range, and fewer than two policies."""
        super().check()
        _require_two(len(self.policies))

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return sum(len(and_copy(name)) for name in self.policies) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with every policy, and compare them."""
        walked = [[self._walk(row, progress) for row in and_copy(name)] for name in self.policies]
        gaits = [gait for gait, *_ in walked]
        copies = [copy[0].metrics if copy else None for _, *copy in walked]  # one copy, or none
        of_joints = agreements(gaits)
        labels = [policy_label(name) for name in self.policies]
        note = (
            f"{self.episodes} episodes × {self.seconds:g} s each. (Brackets): met by the loosened criterion alone; "
            "**bold**: missed."
        )
        if any(copies):
            note += " Open loop: each policy's mean K over the stride at the same θ_eq, without feedback."
        table_of_criteria = criteria_table(labels, [gait.metrics for gait in gaits], copies)
        text = "\n\n".join([agreement_table(of_joints), table_of_criteria, note])
        walks = walks_csv([({"policy": gait.metrics["policy"]}, gait.metrics) for pair in walked for gait in pair])
        draw = partial(save_figure, of_joints=of_joints)
        files = {"agreement.csv": curves_csv(of_joints), "policies.csv": walks, "agreement.png": draw}
        return Answer(text=text, files=files)

    def _walk(self, name: str, progress: OnProgress) -> Gait:
        """Record the walk of the policy `name`; return its measurements."""
        policy, settings = policy_and_settings(name, {"episode_seconds": self.seconds}, self.seed, self.threads)
        return measure(record(policy, settings, name=policy_label(name), progress=progress, **self.how))
