"""influence.png: what a step of stiffness does in each joint and phase, link by link."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from springfoot.evaluation.report import MODEL, PEOPLE, PLAN, STYLE

from .stiffness_responses import ACCELERATION, IMPULSE, MANY_STRIDES_SPEED, TORQUE, VELOCITY, Key, Response
from .stiffness_steps import CELLS, PHASES, SPRINGS

UP: Key = ("fixed state", "upward_m_s2", "")
DRAWN_STRIDES = {
    "first stride": ("1", "#9cc5d3", 0.26),
    "second": ("2", "#4d97b0", 0.0),
    "many": ("many", MODEL, -0.26),
}
"""What is drawn of the speed: when, colour and place beside the cell's middle."""
ROWS = -np.array([cell + 1.2 * joint for cell, (joint, _) in enumerate(CELLS)])
"""Place of each cell on the vertical axis, the joints apart."""
LABELLED = 3e-3
"""Cells whose speed changes by this [m/s] have their name in the last panel."""


def save_influence_figure(path: Path, responses: Mapping[str, Response]) -> None:
    """Draw the first of `responses` link by link, and of all of them what the first link says of the last."""
    first = next(iter(responses.values()))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(13.5, 4.9), layout="constrained")
        axes = figure.subplots(1, 6, width_ratios=(1, 1, 1, 1, 1.35, 2.0))
        for ax in axes[1:5]:
            ax.sharey(axes[0])
            ax.tick_params(labelleft=False, left=False)
        _bars(axes[0], first, TORQUE, "Δ torque (N·m)", "1  Torque")
        _bars(axes[1], first, ACCELERATION, "Δ CoM acceleration,\nforward (m/s²)", "2  Acceleration")
        _bars(axes[2], first, UP, "Δ CoM acceleration,\nup (m/s²)", "")
        _bars(axes[3], first, VELOCITY, "Δ CoM velocity as the\nphase ends (mm/s)", "3  Movement", 1e3)
        _speeds(axes[4], first)
        names = [f"{100 * PHASES[p][0]:.0f}–{100 * PHASES[p][1]:.0f} %  {p}" for _, p in CELLS]
        axes[0].set_yticks(ROWS, names)
        beside = axes[0].get_yaxis_transform()
        for joint, name in enumerate(SPRINGS):
            top = ROWS[CELLS.index((joint, "loading"))]
            axes[0].text(-0.02, top + 0.6, name, transform=beside, ha="right", weight="bold")
        for ax in axes[:5]:
            ax.axvline(0, color="#555555", lw=0.8)
            ax.set_ylim(ROWS.min() - 0.6, ROWS.max() + 1.1)
        _foretold(axes[5], responses)
        figure.savefig(path, dpi=130, facecolor="white", metadata={"Software": "springfoot"})


def _bars(ax: Axes, own: Response, key: Key, label: str, title: str, unit: float = 1.0) -> None:
    mean = unit * own.mean[key]
    ax.barh(
        ROWS, mean, 0.62, color=np.where(mean < 0, PLAN, MODEL), xerr=_whiskers(own, key, unit), error_kw={"lw": 0.9}
    )
    ax.set(xlabel=label, title=title)


def _speeds(ax: Axes, own: Response) -> None:
    for label, (when, color, shift) in DRAWN_STRIDES.items():
        key: Key = ("every stride", "speed_m_s", when)
        ax.errorbar(
            1e3 * own.mean[key],
            ROWS + shift,
            xerr=_whiskers(own, key, 1e3),
            fmt="o",
            ms=3.2,
            lw=0.9,
            color=color,
            label=label,
        )
    ax.set(xlabel="Δ speed, changed in\nevery stride (mm/s)")
    ax.legend(frameon=False, fontsize=7.5, loc="center right", bbox_to_anchor=(1.0, 0.33))


def _whiskers(own: Response, key: Key, unit: float) -> np.ndarray:
    return np.abs(unit * (own.interval[key].T - own.mean[key]))


def _foretold(ax: Axes, responses: Mapping[str, Response]) -> None:
    (name, first), *others = responses.items()
    for number, (_, own) in enumerate(others):
        ax.plot(
            1e3 * own.mean[IMPULSE],
            1e3 * own.mean[MANY_STRIDES_SPEED],
            "o",
            ms=2.6,
            color=PEOPLE,
            label="" if number else "other conditions",
        )
    x = 1e3 * first.mean[IMPULSE]
    y = 1e3 * first.mean[MANY_STRIDES_SPEED]
    ax.plot(x, y, "o", ms=5, color=MODEL, label=name)
    for cell, (joint, phase) in enumerate(CELLS):
        if abs(y[cell]) >= 1e3 * LABELLED:
            right = x[cell] < 0.5 * x.max()
            place = {"xytext": (6 if right else -6, 0), "textcoords": "offset points", "va": "center"}
            ax.annotate(
                f"{SPRINGS[joint]}, {phase}", (x[cell], y[cell]), ha="left" if right else "right", fontsize=7.5, **place
            )
    r, low, high, _ = first.links["∫Δa dt → Δspeed of many strides"]
    ax.axhline(0, color="#555555", lw=0.8)
    ax.axvline(0, color="#555555", lw=0.8)
    ax.set(
        xlabel="∫ Δ CoM acceleration dt over the phase,\nforward, unchanged walk's states (mm/s)",
        ylabel="Δ speed of many strides (mm/s)",
        title=f"Does 2 foretell 3?  r = {r:.2f} [{low:.2f}, {high:.2f}]",
    )
    ax.legend(frameon=False, fontsize=7.5, loc="upper left")
