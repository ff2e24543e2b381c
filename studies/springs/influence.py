"""Follow the thesis's chain link by link: stiffness of ankle and toe, torque, acceleration of the CoM, walk.

    springfoot study influence

K changes in one joint and one phase of the stride, and its rest angle stays. At the states of the unchanged walk this
changes torque and the CoM's acceleration exactly. Walks with the change then show its effect on movement, each compared
with the unchanged walk from the same start on the same ground.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import isfinite, sqrt
from pathlib import Path
from typing import Annotated, Any, ClassVar

import matplotlib
import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from springfoot.agents.policies import PolicyFunction, has_feedback
from springfoot.envs.settings import BipedSettings, reference_gait
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.evaluation.recording import WARM_UP, policy_and_settings
from springfoot.evaluation.report import MODEL, PEOPLE, PLAN, PNG, STYLE
from springfoot.files.markdown import MISSING, table
from springfoot.files.writing import csv_text
from springfoot.gait.body import REFERENCE_HEIGHT

from ..base.study import Answer, OnProgress, Study
from ..walks.ablations import phase_schedule
from .stiffness_responses import (
    ACCELERATION,
    CSV_HEAD,
    IMPULSE,
    LEAST_MOVEMENT,
    LINKS,
    LINKS_HEAD,
    MANY_STRIDES_SPEED,
    TORQUE,
    VELOCITY,
    Key,
    Response,
    csv_rows,
    link_rows,
    summarise,
)
from .stiffness_steps import CELLS, DURATIONS, PHASES, SPRINGS, paired_walks

FIGURE = "influence.png"
BODIES = {"1.55 m, 50 kg": (1.55, 50.0), "1.90 m, 95 kg": (1.90, 95.0)}
"""Height [m] and mass [kg] of other bodies, which walk at the policy's Froude speed."""
INFLUENCE_CONDITIONS = (
    "as it is",
    "opposite change",
    "level ground",
    "θ_eq by phase",
    "θ_eq neutral",
    *BODIES,
    "pretrained",
)
"""Conditions under which stiffness changes."""


def walk_under(
    condition: str, policy: str, change: float, unevenness: float, seed: int = 0
) -> tuple[PolicyFunction, BipedSettings, float]:
    """Return policy, settings and change of K (a fraction of it) for one of `INFLUENCE_CONDITIONS`.

    `policy`, `change` and `unevenness` [m] are those of the condition "as it is". Policies without feedback decide at
    100 Hz, as often as the body is controlled: at 50 Hz a walk on level ground falls into one of two rhythms with the
    decisions.
    """
    if condition not in INFLUENCE_CONDITIONS:
        raise SpringfootError(f"conditions must be of {', '.join(map(repr, INFLUENCE_CONDITIONS))}, got {condition!r}")
    name = condition if condition == "pretrained" else policy
    changes: dict[str, Any] = {"unevenness_m": 0.0 if condition == "level ground" else unevenness}
    if not has_feedback(name):
        changes["decisions"] = "100hz"
    if condition in BODIES:
        height, mass = BODIES[condition]
        speed = policy_and_settings(name, {})[1].speed * sqrt(height / REFERENCE_HEIGHT)
        changes |= {"height": height, "mass": mass, "speed": speed}
    elif condition == "θ_eq neutral":
        changes["equilibrium"] = "neutral"
    elif condition == "θ_eq by phase":
        of_schedule = policy_and_settings("schedule", {})[1]
        changes |= {"equilibrium": "phase", "schedule": phase_schedule(of_schedule).to_json()}
    return *policy_and_settings(name, changes, seed), -change if condition == "opposite change" else change


@dataclass(frozen=True, kw_only=True)
class Influence(Study):
    """Change stiffness in each joint and phase, and follow torque, CoM acceleration and movement."""

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")] = "schedule"
    """Policy with the stiffness that changes: any of evaluate.py."""
    change_percent: float = 10.0
    """Change of K [%]."""
    conditions: tuple[str, ...] = INFLUENCE_CONDITIONS
    """Conditions to walk under, all unless given; the report tells the first in full."""
    seeds: int = 16
    """Walks of each change, from other starts on other ground."""
    seed: int = 0
    """Seed of the first walk."""
    strides: int = 20
    """Strides of each walk; "many" is the second half."""
    unevenness_m: float = 0.002
    """Unevenness of the ground [m], footfall by footfall the same in the walks of a comparison."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""

    QUICK: ClassVar[Mapping[str, Any]] = {"seeds": 2, "strides": 4, "conditions": INFLUENCE_CONDITIONS[:1]}

    def check(self) -> None:
        """Refuse counts too small, a bad change and an unknown condition."""
        for name, least in (("seeds", 2), ("seed", 0), ("strides", 4), ("threads", 1), ("conditions", 1)):
            count = getattr(self, name)
            require_count(name, len(count) if name == "conditions" else count, least)
        require_number("change_percent", self.change_percent, -90.0, 900.0, "%")
        for condition in self.conditions:
            self._condition_walk(condition)

    def _condition_walk(self, condition: str) -> tuple[PolicyFunction, BipedSettings, float]:
        """Return policy, settings and change of K of `walk_under` for a condition, by the flags."""
        return walk_under(condition, self.policy, self.change_percent / 100, self.unevenness_m, self.seed)

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        walks = (1 + len(CELLS) * len(DURATIONS)) * self.seeds  # 1: unchanged
        stride = reference_gait(BipedSettings()).stride_time
        return len(self.conditions) * walks * (WARM_UP + (self.strides + 1) * stride)

    def ask(self, progress: OnProgress) -> Answer:
        """Walk under every condition, and follow the chain."""
        seeds = range(self.seed, self.seed + self.seeds)
        responses = {}
        for condition in self.conditions:
            policy, settings, change = self._condition_walk(condition)
            how = {"strides": self.strides, "threads": self.threads, "progress": progress}
            responses[condition] = summarise(paired_walks(policy, settings, change, seeds, **how), change)
        picture = f"![Stiffness, torque, CoM acceleration and movement]({FIGURE})"
        text = f"{picture}\n\n{headline(self, responses)}\n\n{tables(self, responses)}"
        return Answer(
            text=text,
            files={
                "influence.csv": csv_text(CSV_HEAD, csv_rows(responses)),
                "influence_links.csv": csv_text(LINKS_HEAD, link_rows(responses)),
                FIGURE: partial(save_influence_figure, responses=responses),
            },
        )


def headline(study: Influence, responses: Mapping[str, Response]) -> str:
    """Return, in words, the changes of stiffness that move the walk most under the first condition, and how well
    acceleration foretells the walk."""
    first = next(iter(responses.values()))
    mean = first.mean[MANY_STRIDES_SPEED]
    largest = [cell for cell in np.argsort(-np.abs(np.nan_to_num(mean))) if first.moved[cell]][:3]  # three at most
    largest_elsewhere = np.nanmax(np.abs(np.delete(mean, largest)))
    effects = [f"{_cell(cell)}, {_number(first, MANY_STRIDES_SPEED, cell, '+.1f', 1e3)} mm/s" for cell in largest]
    r, low, high, scrambled = first.links["∫Δa dt → Δspeed of many strides"]
    return (
        f"**{study.change_percent:+g} % of stiffness in one joint and phase of every stride, θ_eq kept, changes the "
        f"speed of `{study.policy}` ({first.speed:.3f} m/s) most here: {'; '.join(effects) or 'nowhere'}. Elsewhere by "
        f"at most {1e3 * largest_elsewhere:.1f} mm/s.** What it does to the CoM's forward acceleration at once "
        f"foretells this with r = {r:.2f} [{low:.2f}, {high:.2f}] over the {len(CELLS)} joints and phases "
        f"(a scrambled order of them does as well in {100 * scrambled:.1f} % of cases), and with the right sign in "
        f"{first.foretold.sum()} of the {first.moved.sum()} that change speed by {1e3 * LEAST_MOVEMENT:g} mm/s or more."
    )


def _cell(cell: int) -> str:
    """Return joint and phase of one of `CELLS`, in words."""
    joint, phase = CELLS[cell]
    begin, end = PHASES[phase]
    return f"{SPRINGS[joint]}, {phase} ({100 * begin:.0f}–{100 * end:.0f} %)"


def _number(response: Response, key: Key, cell: int, pattern: str, unit: float = 1.0, interval: bool = True) -> str:
    """Return mean and interval of the quantity `key` in one of `CELLS`, times `unit`, as in "+1.2 [+0.9, +1.5]"; the
    mean alone without `interval`, a dash for NaN."""
    values = (response.mean[key][cell], *response.interval[key][cell])
    mean, low, high = (_signed_text(unit * value, pattern) for value in values)
    return f"{mean} [{low}, {high}]" if interval and mean != MISSING else mean


def _signed_text(value: float, pattern: str) -> str:
    """Return a number by the format `pattern`, which gives it a sign; 0 has no sign, and NaN is a dash."""
    text = format(value, pattern)
    return MISSING if not isfinite(value) else text.lstrip("+-") if float(text) == 0 else text


def tables(study: Influence, responses: Mapping[str, Response]) -> str:
    """Return three Markdown tables and a note: the first condition link by link, the lasting speed under each
    condition, and the correlations of the links."""
    return "\n\n".join(
        [_chain_table(responses), _speed_table(responses), _links_table(responses), _note(study, responses)]
    )


def _chain_table(responses: Mapping[str, Response]) -> str:
    """Return the table of the first condition: a row for each cell, a column for each link of the chain."""
    first = next(iter(responses.values()))
    head = [
        *("joint", "phase %", "Δτ N·m", "Δa forward m/s²", "Δa up m/s²", "∫Δa dt forward mm/s"),
        *("Δv as the phase ends mm/s", "one stride: Δspeed 1 / 2 / many mm/s", "every stride: Δspeed 1 / 2 mm/s"),
        *("many mm/s", "Δstep length mm", "CoM ahead after 1 / 2 / all mm", "CoM higher mm"),
    ]
    rows = []
    for cell, (joint, phase) in enumerate(CELLS):
        begin, end = PHASES[phase]

        def several(duration: str, name: str, times: tuple[str, ...], pattern: str = "+.1f", cell: int = cell) -> str:
            """Return the means of a quantity at several times, in thousandths of its unit, as in "+1.2 / +0.9"."""
            return " / ".join(_number(first, (duration, name, time), cell, pattern, 1e3, False) for time in times)

        number = partial(_number, first, cell=cell)
        rows.append(
            [
                SPRINGS[joint],
                f"{100 * begin:.0f}–{100 * end:.0f} {phase}",
                number(TORQUE, pattern="+.2f", interval=False),
                number(ACCELERATION, pattern="+.3f"),
                number(("fixed state", "upward_m_s2", ""), pattern="+.3f", interval=False),
                number(IMPULSE, pattern="+.1f", unit=1e3, interval=False),
                number(VELOCITY, pattern="+.1f", unit=1e3),
                several("one stride", "speed_m_s", ("1", "2", "many")),
                several("every stride", "speed_m_s", ("1", "2")),
                number(MANY_STRIDES_SPEED, pattern="+.1f", unit=1e3),
                number(("every stride", "step_length_m", "many"), pattern="+.1f", unit=1e3),
                several("every stride", "com_ahead_m", ("1", "2", "many"), "+.0f"),
                several("every stride", "com_height_m", ("many",), "+.2f"),
            ]
        )
    return table(head, rows)


def _speed_table(responses: Mapping[str, Response]) -> str:
    """Return the table of the lasting change of speed: a row for each cell, a column for each condition."""
    rows = [
        [_cell(cell), *(_number(response, MANY_STRIDES_SPEED, cell, "+.1f", 1e3) for response in responses.values())]
        for cell in range(len(CELLS))
    ]
    rows.append(["unchanged m/s", *(f"{response.speed:.3f}" for response in responses.values())])
    rows.append(
        [
            "changed walks that fell or were too slow",
            *(str(response.unfinished.sum()) for response in responses.values()),
        ]
    )
    return table(["Δspeed of many strides, mm/s", *responses], rows)


def _links_table(responses: Mapping[str, Response]) -> str:
    """Return the table of the links' correlations over joints and phases: a column for each condition."""
    rows = []
    for name in LINKS:
        correlations = [response.links[name] for response in responses.values()]
        cells = (f"{r:.2f} [{low:.2f}, {high:.2f}]" if isfinite(r) else MISSING for r, low, high, _ in correlations)
        rows.append([name, *cells])
    signs = (f"{response.foretold.sum()} of {response.moved.sum()}" for response in responses.values())
    rows.append(["right sign of ∫Δa dt, where speed changes", *signs])
    return table(["r over joints and phases", *responses], rows)


def _note(study: Influence, responses: Mapping[str, Response]) -> str:
    """Return the note below the tables: the meaning of their columns, how many walks there are, and which changes the
    range of the actions cut short."""
    cut_short = "".join(
        f" The range of the actions cuts up to {response.cut.max():.0%} of a cell's changes short in `{name}`."
        for name, response in responses.items()
        if response.cut.any()
    )
    return (
        f"First table: `{next(iter(responses))}`. Δτ (plantarflexion positive) and Δa (of the CoM), means over the "
        f"phase: by `mj_forward` at each 10 ms of a stride of the unchanged walk, K alone changed; ∫Δa dt: over the "
        f"phase of one leg. All else: a walk less the unchanged one from the same start on the same ground; "
        f"{study.seeds} starts, ground uneven by ±{1e3 * study.unevenness_m:g} mm. K changes in the left leg's first "
        f"stride alone, or in every stride of both; strides 1, 2 and {study.strides // 2 + 1}–{study.strides} (many). "
        f"[95 % intervals]: bootstrap over starts. θ_eq is planned where nothing else is said; bodies walk at the "
        f"Froude-equal speed.{cut_short}"
    )


UP: Key = ("fixed state", "upward_m_s2", "")
DRAWN_STRIDES = {
    "first stride": ("1", "#9cc5d3", 0.26),
    "second": ("2", "#4d97b0", 0.0),
    "many": ("many", MODEL, -0.26),
}
"""Strides with a change of speed that is drawn -> colour, and offset from the middle of the row."""
ROWS = -np.array([cell + 1.2 * joint for cell, (joint, _) in enumerate(CELLS)])
"""Position of each joint and phase on the vertical axis, with a gap between the joints."""
LABELLED = 3e-3
"""Change of speed from which the last panel names joint and phase [m/s]."""


def save_influence_figure(path: Path, responses: Mapping[str, Response]) -> None:
    """Draw the first response link by link, and for all responses the last link over the first."""
    first = next(iter(responses.values()))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(13.5, 4.9), layout="constrained")
        axes = figure.subplots(1, 6, width_ratios=(1, 1, 1, 1, 1.35, 2.0))
        for ax in axes[1:5]:
            ax.sharey(axes[0])
            ax.tick_params(labelleft=False, left=False)
        _draw_bars(axes[0], first, TORQUE, "Δ torque (N·m)", "1  Torque")
        _draw_bars(axes[1], first, ACCELERATION, "Δ CoM acceleration,\nforward (m/s²)", "2  Acceleration")
        _draw_bars(axes[2], first, UP, "Δ CoM acceleration,\nup (m/s²)", "")
        _draw_bars(axes[3], first, VELOCITY, "Δ CoM velocity as the\nphase ends (mm/s)", "3  Movement", 1e3)
        _draw_speeds(axes[4], first)
        names = [f"{100 * PHASES[p][0]:.0f}–{100 * PHASES[p][1]:.0f} %  {p}" for _, p in CELLS]
        axes[0].set_yticks(ROWS, names)
        beside = axes[0].get_yaxis_transform()
        for joint, name in enumerate(SPRINGS):
            top = ROWS[CELLS.index((joint, "loading"))]
            axes[0].text(-0.02, top + 0.6, name, transform=beside, ha="right", weight="bold")
        for ax in axes[:5]:
            ax.axvline(0, color="#555555", lw=0.8)
            ax.set_ylim(ROWS.min() - 0.6, ROWS.max() + 1.1)
        _draw_prediction(axes[5], responses)
        figure.savefig(path, dpi=130, **PNG)


def _draw_bars(ax: Axes, response: Response, key: Key, label: str, title: str, unit: float = 1.0) -> None:
    """Draw the quantity `key`, times `unit`: for each joint and phase a bar with its interval."""
    mean = unit * response.mean[key]
    ax.barh(
        ROWS,
        mean,
        0.62,
        color=np.where(mean < 0, PLAN, MODEL),
        xerr=_whiskers(response, key, unit),
        error_kw={"lw": 0.9},
    )
    ax.set(xlabel=label, title=title)


def _draw_speeds(ax: Axes, response: Response) -> None:
    """Draw, for each joint and phase changed in every stride, the change of speed in the strides of `DRAWN_STRIDES`."""
    for label, (time, color, shift) in DRAWN_STRIDES.items():
        key: Key = ("every stride", "speed_m_s", time)
        ax.errorbar(
            1e3 * response.mean[key],
            ROWS + shift,
            xerr=_whiskers(response, key, 1e3),
            fmt="o",
            ms=3.2,
            lw=0.9,
            color=color,
            label=label,
        )
    ax.set(xlabel="Δ speed, changed in\nevery stride (mm/s)")
    ax.legend(frameon=False, fontsize=7.5, loc="center right", bbox_to_anchor=(1.0, 0.33))


def _whiskers(response: Response, key: Key, unit: float) -> np.ndarray:
    """Return (2, len(CELLS)) the distances from the mean of the quantity `key` to the low and the high end of its
    interval, times `unit`."""
    return np.abs(unit * (response.interval[key].T - response.mean[key]))


def _draw_prediction(ax: Axes, responses: Mapping[str, Response]) -> None:
    """Draw, for each change of K, the lasting change of speed (y) against its prediction from the unchanged walk (x).

    The prediction integrates the change of the CoM's acceleration over the phase in which K changes, with the angles
    and rates of the unchanged walk. The first condition of `responses` is drawn large, with labels.
    """
    (name, first), *others = responses.items()
    for number, (_, response) in enumerate(others):
        ax.plot(
            1e3 * response.mean[IMPULSE],
            1e3 * response.mean[MANY_STRIDES_SPEED],
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
            label_right = x[cell] < 0.5 * x.max()  # to the right of the point, where there is room
            ax.annotate(
                f"{SPRINGS[joint]}, {phase}",
                (x[cell], y[cell]),
                xytext=(6 if label_right else -6, 0),
                textcoords="offset points",
                ha="left" if label_right else "right",
                va="center",
                fontsize=7.5,
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
