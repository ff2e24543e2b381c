"""Draw the two pictures of `springfoot person`: curves over the stride, and moment over angle of ankle and toe."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from springfoot.arrays import NDArray
from springfoot.evaluation.report import PEOPLE, PNG, STYLE
from springfoot.gait import HumanGait
from springfoot.gait.people import PERCENT
from springfoot.gait.springs import SPRINGS

LINE_COLOURS = {"left": "#0b6e8f", "right": "#c77800", "both": "#0b6e8f"}
"""Side -> its colour."""
CURVE_PANELS = (
    ("hip", "knee", "ankle", "toe"),
    ("hip_moment", "knee_moment", "ankle_moment", "toe_moment"),
)
"""Curves of each row of the picture."""
Sheet = Mapping[str, Mapping[str, NDArray]]
"""Side -> curve -> its mean (101,)."""


def draw_curves(path: Path, sheet: Sheet, norm: HumanGait) -> None:
    """Draw angles and moments over the stride into the picture `path`, the norm's mean ± SD behind them."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 5.2), layout="constrained")
        for axes, names in zip(figure.subplots(2, len(CURVE_PANELS[0]), sharex=True), CURVE_PANELS, strict=True):
            for ax, name in zip(axes, names, strict=True):
                is_angle = not name.endswith("_moment")
                unit = np.degrees(1.0) if is_angle else 1.0
                if name in norm.mean_series:
                    mean, sd = (unit * of(name, PERCENT / 100) for of in (norm.mean, norm.sd))
                    ax.fill_between(PERCENT, mean - sd, mean + sd, color=PEOPLE, alpha=0.25, lw=0)
                    ax.plot(PERCENT, mean, color=PEOPLE, lw=1.2, label="norm ± SD")
                for side, curves in sheet.items():
                    if name in curves:
                        ax.plot(PERCENT, unit * curves[name], color=LINE_COLOURS[side], lw=1.6, label=side)
                ax.set_title(f"{name.replace('_', ' ').capitalize()}, {'deg' if is_angle else 'N·m/kg'}")
                _add_grid(ax)
        for ax in figure.axes[-len(CURVE_PANELS[0]) :]:
            ax.set_xlabel("stride (%)")
        _legend(figure)
        figure.savefig(path, dpi=110, **PNG)


def draw_loops(path: Path, sheet: Sheet, norm: HumanGait, starts: Mapping[tuple[str, str], Sequence[float]]) -> None:
    """Draw moment over angle in stance into the picture `path`, with dots at the bounds of the phases of stance.

    `starts` is (joint, side) -> stride phases of the bounds; a side without any is not drawn.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(8.4, 3.8), layout="constrained")
        phase = PERCENT / 100
        people = {name: norm.mean(name, phase) for name in norm.mean_series}
        for ax, joint in zip(figure.subplots(1, len(SPRINGS)), SPRINGS, strict=True):
            for side, curves in {"norm": people, **sheet}.items():
                bounds = np.array(starts.get((joint, side), []))
                if not len(bounds):
                    continue
                at = np.linspace(bounds[0], bounds[-1], 200)
                angle, moment = (curves[name] for name in (joint, f"{joint}_moment"))
                colour = LINE_COLOURS.get(side, PEOPLE)
                ax.plot(*_curve_points(at, angle, moment), color=colour, lw=1.5, label=side)
                ax.plot(*_curve_points(bounds, angle, moment), "o", color=colour, ms=3.5)
            ax.set(title=f"{joint.capitalize()}, stance", xlabel="angle (deg)", ylabel="moment (N·m/kg)")
            _add_grid(ax)
        _legend(figure)
        figure.savefig(path, dpi=110, **PNG)


def _curve_points(at: NDArray, angle: NDArray, moment: NDArray) -> tuple[NDArray, NDArray]:
    """Return angle [deg] and moment at the stride phases `at`, interpolated on the curves `angle` [rad] and `moment`,
    (101,) each."""
    return np.degrees(np.interp(at, PERCENT / 100, angle)), np.interp(at, PERCENT / 100, moment)


def _add_grid(ax: Axes) -> None:
    """Give the axes a grid."""
    ax.grid(color="#ededed", lw=0.6)


def _legend(figure: Figure) -> None:
    """Give the figure one legend for all axes, below them."""
    entries = {}
    for ax in figure.axes:
        handles, names = ax.get_legend_handles_labels()
        entries |= dict(zip(names, handles, strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=len(entries), frameon=False)
