"""Figures 6 to 10 of the thesis: as printed, as planned here and of people, over the same stretch of a stride."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from springfoot.arrays import NDArray
from springfoot.evaluation.report.gait_figure import PEOPLE, PLAN, STYLE
from springfoot.gait import GRAVITY, Body, HumanGait, WalkPlan, human_gait
from springfoot.gait.body.body import ANGLES
from springfoot.gait.body.leg import joint_positions, segment_turns
from springfoot.gait.people.human import human_cop
from springfoot.gait.plan import thesis as printed_thesis
from springfoot.gait.plan.kinetics import foot_force
from springfoot.gait.plan.thesis import ThesisWalk

PRINTED = "#7a5195"
PHASE = 0.5 + np.arange(751) / 1000
"""The thesis's 0.75 s: from the other foot's heel strike (0.5) over this foot's (1) to a quarter of the next stride."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnWalk:
    """A walk over `PHASE`, x from this foot's last standing place [m]; arrays (2, n) are (x, z)."""

    title: str
    color: str
    step_length: float
    step_time: float
    double_support: float
    """Part of a step."""
    com: NDArray
    """[m]."""
    ankle: NDArray
    """[m]."""
    toe_joint: NDArray
    """[m]."""
    force: NDArray
    """Of both feet, forward and up [body weights]."""
    foot: NDArray | None
    """Of this foot [body weights]; the thesis does not share it."""
    zmp: NDArray
    """(n,) [m]."""
    support: tuple[NDArray, NDArray] | None
    """Rear and front end of the feet on the ground [m]; None where not known."""
    knots: dict[str, tuple[NDArray, NDArray]] = field(default_factory=dict)
    """Phases and (x, z) of the via-points."""

    @property
    def com_wave(self) -> NDArray:
        """CoM against the walk's mean motion (2, n) [m]."""
        ahead = self.com[0] - 2 * self.step_length * (PHASE - 0.5)
        step = slice(0, 500)
        return np.stack([ahead - ahead[step].mean(), self.com[1] - self.com[1][step].mean()])


def as_printed(walk: ThesisWalk) -> DrawnWalk:
    """The thesis's walk."""
    stride_time = 2 * walk.step_time
    origin = walk.k * walk.step_length
    time = (walk.k + 1) * walk.step_time + (PHASE - 1) * stride_time
    rear, front = walk.support(time)
    forward, up = walk.ground_reaction(time)
    phases = 1 + (walk.knot_times - (walk.k + 1) * walk.step_time) / stride_time

    def moved(xz: tuple[NDArray, NDArray]) -> NDArray:
        return np.stack([xz[0] - origin, xz[1]])

    return DrawnWalk(
        title="as printed",
        color=PRINTED,
        step_length=walk.step_length,
        step_time=walk.step_time,
        double_support=walk.double_support / walk.step_time,
        com=moved(walk.com(time)),
        ankle=moved(walk.ankle(time)),
        toe_joint=moved(walk.toe_joint(time)),
        force=np.stack([forward, up]) / (walk.body.mass * printed_thesis.GRAVITY),
        foot=None,
        zmp=walk.zmp(time) - origin,
        support=(rear - origin, front - origin),
        knots={"ankle": (phases, moved(walk.ankle_knots)), "toe_joint": (phases, moved(walk.toe_joint_knots))},
    )


def as_planned(plan: WalkPlan) -> DrawnWalk:
    """A plan of ours."""
    step_phase = np.mod(2 * PHASE, 1.0)
    stance_foot = plan.step_length * np.floor(2 * PHASE + 1e-9)
    this_foot = 2 * plan.step_length * np.floor(PHASE)
    rear, front = plan.support(step_phase)
    weight = plan.body.mass * GRAVITY

    def moved(xz: tuple[NDArray, NDArray], by: NDArray) -> NDArray:
        return np.stack([xz[0] + by, xz[1]])

    foot, other = (foot_force(plan, phase)[0].T / weight for phase in (PHASE, PHASE + 0.5))
    return DrawnWalk(
        title="corrected plan",
        color=PLAN,
        step_length=plan.step_length,
        step_time=plan.step_time,
        double_support=plan.double_support / plan.step_time,
        com=moved(plan.com(step_phase), stance_foot),
        ankle=moved(plan.ankle_position(PHASE), this_foot),
        toe_joint=moved(plan.toe_joint_position(PHASE), this_foot),
        force=foot + other,
        foot=foot,
        zmp=plan.zmp(step_phase) + stance_foot,
        support=(rear + stance_foot, front + stance_foot),
    )


def of_people(speed: float, body: Body) -> DrawnWalk:
    """People's mean walk: CoM from their forces, integrated twice; feet from their angles below the hip."""
    human = human_gait(speed, body.height)
    n = 1000
    phase = np.arange(n) / n
    stride = human.speed * human.stride_time
    foot = np.stack([human.mean(name, phase) for name in ("grf_forward", "grf_vertical")])
    force = foot + np.roll(foot, n // 2, axis=-1)
    # Mean curves carry 4 % too much weight and a trace of net impulse; a periodic walk has neither.
    acceleration = GRAVITY * np.stack([force[0] - force[0].mean(), force[1] / force[1].mean() - 1])
    wave = _integrated_twice(acceleration, human.stride_time)
    hip = np.stack([stride * phase, 0 * phase]) + wave
    joints = joint_positions(body, segment_turns({name: human.mean(name, phase) for name in ANGLES}), hip.T)
    flat = (phase > 0.12) & (phase < 0.40)
    off = joints["ankle"][flat].mean(axis=0)[:, None] - [[0.0], [body.ankle_height]]
    over = np.round(n * PHASE).astype(int)
    index, later = over % n, stride * (over // n)

    def moved(path: NDArray) -> NDArray:
        return (path - off)[:, index] + np.stack([later, 0 * later])

    return DrawnWalk(
        title=f"people, {human.speed:.1f} m/s",
        color=PEOPLE,
        step_length=stride / 2,
        step_time=human.stride_time / 2,
        double_support=2 * human.toe_off - 1,
        com=moved(hip),
        ankle=moved(joints["ankle"].T),
        toe_joint=moved(joints["toe"].T),
        force=force[:, index],
        foot=foot[:, index],
        zmp=_both_feet(human, body),
        support=None,
    )


def _both_feet(human: HumanGait, body: Body) -> NDArray:
    """People's ZMP (n,) [m]: the centres of pressure of the feet on the ground, weighed by their vertical forces."""
    moment, load = 0.0, 0.0
    for start in (0.0, 0.5, 1.0):  # heel strikes of this foot, the other one, this one again
        since = PHASE - start
        force = np.where((since >= 0) & (since < 1), human.mean("grf_vertical", since), 0.0)
        place = start * human.speed * human.stride_time + body.foot_length * human_cop(since / human.toe_off)
        moment, load = moment + place * force, load + force
    return moment / load


def _integrated_twice(acceleration: NDArray, period: float) -> NDArray:
    """The periodic motion of zero mean with this acceleration (..., n)."""
    n = acceleration.shape[-1]
    rate = 2 * np.pi * np.fft.rfftfreq(n, period / n)
    rate[0] = np.inf
    return np.fft.irfft(-np.fft.rfft(acceleration) / rate**2, n)


# The pictures ------------------------------------------------------------------------------------------------

Draw = Callable[[Axes, DrawnWalk], None]


def save_figure(number: int, walks: Sequence[DrawnWalk], path: Path) -> None:
    """Write one of `FIGURES`: a column a walk, a row a quantity, one scale a row."""
    rows = FIGURES[number]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 1.0 + 1.75 * len(rows)), layout="constrained")
        grid = figure.subplots(len(rows), len(walks), sharex=True, sharey="row", squeeze=False)
        for axes, (ylabel, draw) in zip(grid, rows, strict=True):
            axes[0].set_ylabel(ylabel)
            for ax, walk in zip(axes, walks, strict=True):
                _contact(ax, walk)
                draw(ax, walk)
        for ax, walk in zip(grid[0], walks, strict=True):
            ax.set_title(walk.title)
        for ax in grid[-1]:
            ax.set_xlabel("% of this foot's stride")
        _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    """In 64 colours: lines on white need no more, and the page stays light."""
    buffer = BytesIO()
    figure.savefig(buffer, dpi=100, facecolor="white")
    Image.open(buffer).convert("RGB").quantize(64).save(path, optimize=True)


def _contact(ax: Axes, walk: DrawnWalk) -> None:
    """Double support grey; 100 % is this foot's heel strike."""
    for start in (50, 100):
        ax.axvspan(start, start + 50 * walk.double_support, color="#eeeeee", lw=0)
    ax.set(xlim=(50, 125), xticks=(50, 75, 100, 125))
    ax.axhline(0, color="#bbbbbb", lw=0.7, zorder=0.5)


def _line(ax: Axes, walk: DrawnWalk, values: NDArray) -> None:
    ax.plot(100 * PHASE, values, color=walk.color, lw=1.8)


def _path(ax: Axes, walk: DrawnWalk, name: str, row: int) -> None:
    _line(ax, walk, getattr(walk, name)[row])
    if name in walk.knots:
        phase, knots = walk.knots[name]
        ax.plot(100 * phase, knots[row], "o", color=walk.color, ms=4)


def _forces(ax: Axes, walk: DrawnWalk, row: int) -> None:
    _line(ax, walk, walk.force[row])
    if walk.foot is not None:
        ax.plot(100 * PHASE, walk.foot[row], color=walk.color, lw=1.2, ls=(0, (3, 1.5)))


def _zmp(ax: Axes, walk: DrawnWalk) -> None:
    if walk.support is not None:
        ax.fill_between(100 * PHASE, *walk.support, color="#f1d9a7", alpha=0.6, lw=0)
    _line(ax, walk, walk.zmp)
    ax.plot(100 * PHASE, walk.com[0], color="#777777", lw=0.9, ls=(0, (1, 1.2)))


FIGURES: dict[int, list[tuple[str, Draw]]] = {
    6: [
        ("CoM x against\nmean motion (cm)", lambda ax, walk: _line(ax, walk, 100 * walk.com_wave[0])),
        ("CoM z about\nits mean (cm)", lambda ax, walk: _line(ax, walk, 100 * walk.com_wave[1])),
    ],
    7: [
        ("ankle x (m)", lambda ax, walk: _path(ax, walk, "ankle", 0)),
        ("ankle z (m)", lambda ax, walk: _path(ax, walk, "ankle", 1)),
    ],
    8: [
        ("toe joint x (m)", lambda ax, walk: _path(ax, walk, "toe_joint", 0)),
        ("toe joint z (m)", lambda ax, walk: _path(ax, walk, "toe_joint", 1)),
    ],
    9: [
        ("fore-aft force (BW)", lambda ax, walk: _forces(ax, walk, 0)),
        ("vertical force (BW)", lambda ax, walk: _forces(ax, walk, 1)),
    ],
    10: [("ZMP x (m)", _zmp)],
}
"""Number in the thesis -> rows: what is drawn, and how."""
