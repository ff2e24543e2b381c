"""Draw the gait cycle of the model over that of people (gait.png), and the stiffness of both feet (stiffness.png)."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from springfoot.arrays import NDArray
from springfoot.envs.physics import SIDES
from springfoot.envs.settings.settings import reference_gait
from springfoot.gait import HumanGait
from springfoot.gait.people.gait_events import PERCENT

from ..numbers.curves import StrideCurves
from ..numbers.metrics import MOMENT_CURVES, Gait
from ..numbers.per_leg import ANGLE_COLUMNS, feet_differ, kinds_of
from ..recording.recording import Recording

# Colours of the model's curves (of the left leg where the feet differ), of its right leg, of plan and of people.
MODEL = "#0b6e8f"
OTHER_LEG = "#c77800"
PLAN = "#d1495b"
PEOPLE = "#8a8a8a"
Legs = tuple[tuple[StrideCurves, str], ...]
"""Drawn curves of the model and their colours: both feet together or, if they differ, left and right."""
PNG: dict[str, Any] = {"facecolor": "white", "metadata": {"Software": "springfoot"}}
"""Arguments of `savefig`. Matplotlib would put its version into the file: the same picture, but other bytes."""
STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.8,
    "axes.labelcolor": "#333333",
    "axes.axisbelow": True,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "text.color": "#222222",
}


def save_gait_figure(path: Path, recording: Recording, gait: Gait) -> None:
    """Draw the mean curves of a gait into the picture `path`: angles, moments, forces, CoM and stiffness, with people's
    mean ± SD behind them."""
    settings = recording.settings
    metrics = gait.metrics
    human = reference_gait(settings)
    legs: Legs = ((gait.both, MODEL),)
    if feet_differ(settings):
        legs = tuple(zip(gait.feet, (MODEL, OTHER_LEG), strict=True))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(12.5, 10.2), dpi=130, layout="constrained")
        grid = figure.subplots(4, 4)  # rows: angles; moments; two forces, two of the CoM; springs
        for ax, (joint, column) in zip(grid[0], ANGLE_COLUMNS.items(), strict=True):
            _draw_angle(ax, legs, human, joint, column, metrics["joints"][joint])
        for ax, (joint, column) in zip(grid[1], MOMENT_CURVES.items(), strict=True):
            _draw_moment(ax, legs, human, joint, column, metrics["moments"][joint])
        _draw_force(grid[2, 0], legs, human, "vertical", "Vertical force", metrics["grf"])
        _draw_force(grid[2, 1], legs, human, "forward", "Fore-aft force", metrics["grf"])
        _draw_com(grid[2, 2:], recording, gait)
        _draw_springs(grid[3], legs, human)
        for ax in [*grid[0], *grid[1], *grid[2, :2], *grid[3]]:
            _stride_axis(ax, metrics["toe_off_percent"], 100 * human.toe_off)
        _write_header(figure, recording, gait, human)
        _lay_out(figure)
        figure.savefig(path, dpi="figure", **PNG)


def save_stiffness_figure(path: Path, gait: Gait) -> None:
    """Draw the stiffness K of ankles and toes over the stride into the picture `path`, each foot by itself."""
    legs: Legs = tuple(zip(gait.feet, (MODEL, OTHER_LEG), strict=True))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.2), dpi=130, layout="constrained")
        axes = figure.subplots(1, 2)
        _draw_stiffness(axes, legs)
        for ax in axes:
            _stride_axis(ax, gait.metrics["toe_off_percent"], None)
        handles: dict[str, Any] = {
            f"{name} foot, mean ± SD over strides": _legend_sign(colour)
            for name, (_, colour) in zip(SIDES, legs, strict=True)
        }
        figure.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=2, frameon=False)
        _lay_out(figure)
        figure.savefig(path, dpi="figure", **PNG)


def _lay_out(figure: Figure) -> None:
    """Give the panels of a figure their places for good: `savefig` would draw all of it twice, once for the layout."""
    layout = figure.get_layout_engine()
    if layout is not None:
        layout.execute(figure)
    figure.set_layout_engine(None)


def _draw_angle(ax: Axes, legs: Legs, human: HumanGait, joint: str, column: str, numbers: dict) -> None:
    """Draw the angle of one joint over the stride, people's behind it; `numbers` are the joint's entry in
    metrics.json."""
    positive = {"ankle": "dorsiflexion", "toe": "up"}.get(joint, "flexion")
    ax.set(title=f"{joint.capitalize()} angle", ylabel=f"{positive} (deg)")
    phase = PERCENT / 100
    _draw_people(ax, np.degrees(human.mean(joint, phase)), np.degrees(human.sd(joint, phase)))
    _draw_model(ax, legs, column)
    _write_note(ax, numbers["rmse_deg"], "RMSE {:.1f}°", numbers["r"])


def _draw_moment(ax: Axes, legs: Legs, human: HumanGait, joint: str, column: str, numbers: dict) -> None:
    """Draw the moment of one joint over the stride, people's behind it; `numbers` are the joint's entry in
    metrics.json."""
    positive = "extension" if joint in ("hip", "knee") else "plantarflexion"
    ax.set(title=f"{joint.capitalize()} moment", ylabel=f"{positive} (N·m/kg)")
    if joint != "toe":
        _draw_people(ax, human.mean(f"{joint}_moment", PERCENT / 100), human.sd(f"{joint}_moment", PERCENT / 100))
    _draw_model(ax, legs, column)
    _write_note(ax, numbers["peak_Nm_kg"], "peak {:.2f}", numbers["r"])


def _draw_force(ax: Axes, legs: Legs, human: HumanGait, direction: str, title: str, numbers: dict) -> None:
    """Draw a component of the ground reaction force over the stride, people's behind it; `direction` is "vertical" or
    "forward", `numbers` are `grf` of metrics.json."""
    ax.set(title=title, ylabel=f"{'up' if direction == 'vertical' else 'forward'} (body weights)")
    name = f"grf_{direction}"
    _draw_people(ax, human.mean(name, PERCENT / 100), human.sd(name, PERCENT / 100))
    _draw_model(ax, legs, f"{name}_bw")
    peaks = {
        "vertical": ("vertical_peak1_bw", "vertical_peak2_bw"),
        "forward": ("braking_peak_bw", "forward_peak_bw"),
    }
    first_peak, second_peak = (numbers[name] for name in peaks[direction])
    if first_peak is not None:
        text = f"{first_peak:.2f} / {second_peak:.2f}"
        _write_note(ax, numbers[f"{direction}_r"], text + ", r {:.2f}", None)


def _draw_com(axes: NDArray, recording: Recording, gait: Gait) -> None:
    """Draw the CoM over the step into two panels, x from the ankle and height, the plan's behind them."""
    for ax, name, title, ylabel, column in (
        (axes[0], "x", "CoM ahead of ankle", "forward (m)", 0),
        (axes[1], "z", "CoM height", "above the floor (m)", 1),
    ):
        ax.plot(PERCENT, recording.plan_com[:, column], color=PLAN, lw=1.3, ls=(0, (4, 2)))
        _draw_model(ax, ((gait.com, MODEL),), name)
        ax.set(title=title, ylabel=ylabel, xlabel="% of step", xlim=(0, 100), xticks=range(0, 101, 25))
        ax.grid(color="#ededed", lw=0.6)
        numbers = gait.metrics["com"]
        error = numbers[f"{name}_rmse_m"]
        r = numbers["z_r"] if name == "z" else None  # x is nearly a straight line: r would say nothing
        _write_note(ax, None if error is None else 1000 * error, "RMSE {:.0f} mm", r)
    low, high = axes[1].get_ylim()
    middle = (low + high) / 2
    half_height = max(0.04, (high - low) / 2)  # at least 8 cm high, so that a flat CoM looks flat
    axes[1].set_ylim(middle - half_height, middle + half_height)


def _draw_springs(axes: NDArray, legs: Legs, human: HumanGait) -> None:
    """Draw K of ankle and toe, the ankle's angle with its rest angle, and its power.

    People's angle and power are behind them.
    """
    _draw_stiffness(axes[:2], legs)
    ax = axes[2]
    ax.set(title="Ankle and its rest angle", ylabel="dorsiflexion (deg)")
    _draw_people(ax, np.degrees(human.mean("ankle", PERCENT / 100)), np.degrees(human.sd("ankle", PERCENT / 100)))
    _draw_model(ax, legs, "ankle_dorsiflexion_deg")
    for curves, colour in legs:
        ax.plot(PERCENT, curves.mean("ankle_equilibrium_deg"), color=colour, lw=1.2, ls=(0, (1, 1.2)))
    axes[3].set(title="Ankle power", ylabel="generation (W/kg)")
    _draw_people(axes[3], human.mean("ankle_power", PERCENT / 100), human.sd("ankle_power", PERCENT / 100))
    _draw_model(axes[3], legs, "ankle_power_W_per_kg")


def _draw_stiffness(axes: NDArray, legs: Legs) -> None:
    """Draw K of ankle and toe over the stride into the two panels `axes`, from 0 up."""
    for ax, name in zip(axes, ("ankle", "toe"), strict=True):
        ax.set(title=f"{name.capitalize()} stiffness K", ylabel="N·m/rad")
        _draw_model(ax, legs, f"{name}_stiffness_Nm_per_rad")
        ax.set_ylim(0, 1.05 * ax.get_ylim()[1])


def _draw_people(ax: Axes, mean: NDArray, sd: NDArray) -> None:
    """Draw people's `mean` ± `sd`, (101,) each over percent of the stride."""
    ax.fill_between(PERCENT, mean - sd, mean + sd, color=PEOPLE, alpha=0.25, lw=0)
    ax.plot(PERCENT, mean, color=PEOPLE, lw=1.3)


def _draw_model(ax: Axes, legs: Legs, name: str) -> None:
    """Draw mean ± SD over strides of the curve `name`, for each of the `legs` in its colour."""
    for curves, colour in legs:
        mean = curves.mean(name)
        sd = curves.sd(name)
        ax.fill_between(PERCENT, mean - sd, mean + sd, color=colour, alpha=0.22, lw=0)
        ax.plot(PERCENT, mean, color=colour, lw=1.8)


def _write_note(ax: Axes, value: float | None, pattern: str, r: float | None) -> None:
    """Write numbers above a panel, flush right: `value` as `pattern` says, and the correlation `r`; None writes
    nothing."""
    parts = [] if value is None else [pattern.format(value)]
    parts += [] if r is None else [f"r {r:.2f}"]
    ax.text(1.0, 1.02, ", ".join(parts), transform=ax.transAxes, ha="right", va="bottom", fontsize=8, color="#666666")


def _stride_axis(ax: Axes, toe_off: float | None, people_toe_off: float | None) -> None:
    """Make percent of the stride the axis of a panel; mark the toe-offs [%] of model and people that are not None."""
    ax.set(xlim=(0, 100), xticks=range(0, 101, 20), xlabel="% of stride")
    ax.grid(color="#ededed", lw=0.6)
    ax.axhline(0, color="#bbbbbb", lw=0.7, zorder=0.5)
    for percent, colour in ((people_toe_off, PEOPLE), (toe_off, MODEL)):
        if percent is not None:
            ax.axvline(percent, color=colour, lw=0.8, ls=(0, (2, 2)), zorder=0.6)


def _legend_sign(colour: str) -> tuple[Patch, Line2D]:
    """Return the band and the line that stand in a legend for a curve of this colour and its spread."""
    return Patch(color=colour, alpha=0.22, lw=0), Line2D([], [], color=colour, lw=1.8)


def _write_header(figure: Figure, recording: Recording, gait: Gait, human: HumanGait) -> None:
    """Write the figure's heading: policy, falls, speed, step, reference."""
    settings = recording.settings
    metrics = gait.metrics
    falls = f"{metrics['falls']} fall{'s' * (metrics['falls'] != 1)}"
    feet = ", ".join(dict.fromkeys(kinds_of(settings).values()))
    figure.suptitle(
        f"{recording.policy}    {settings.height:.2f} m, {settings.mass:g} kg, {settings.speed:.2f} m/s commanded, "
        f"feet {feet}    "
        f"{metrics['episodes']} episodes, {falls}, {metrics['strides']['count']} strides",
        x=0.01,
        ha="left",
        fontsize=12,
        fontweight="bold",
    )
    reference = "people" if settings.human is None else human.condition
    note = " (end of the measured range)" if human.clamped else ""
    names = {"model": MODEL}
    if feet_differ(settings):
        kinds = kinds_of(settings)
        names = {f"left, {kinds['left']}": MODEL, f"right, {kinds['right']}": OTHER_LEG}
    handles: dict[str, Any] = {
        f"{name}, mean ± SD over strides": _legend_sign(colour) for name, colour in names.items()
    }
    handles |= {
        f"{reference} at {human.speed:.2f} m/s{note}, mean ± SD": (
            Patch(color=PEOPLE, alpha=0.25, lw=0),
            Line2D([], [], color=PEOPLE, lw=1.3),
        ),
        "plan": Line2D([], [], color=PLAN, lw=1.3, ls=(0, (4, 2))),
        "rest angle": Line2D([], [], color=MODEL, lw=1.2, ls=(0, (1, 1.2))),
        "toe-off": Line2D([], [], color="#777777", lw=0.8, ls=(0, (2, 2))),
    }
    figure.legend(
        list(handles.values()), list(handles), loc="outside lower center", ncols=len(handles), frameon=False, fontsize=9
    )
