"""Find the spring beside the right ankle that holds a drop foot.

    springfoot study drop-foot learned

Muscles of a drop foot are slack in swing, so that the toe hangs; the spring is there always.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product, takewhile
from pathlib import Path
from typing import Annotated, Any, ClassVar

import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure

from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record_feet
from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, table

from ..base.intervals import share_interval
from ..base.study import Answer, OnProgress, WalkingStudy
from ..base.walked_speeds import Row, rows_csv
from .foot_numbers import numbers_of_feet
from .spring_map import with_walked_speed

DROP_SPEEDS = (0.8, 1.2, 1.6)
"""Commanded speeds [m/s]."""
SWING_SPRINGS = (0.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0, 40.0)
"""Stiffness of the orthosis [N m/rad]."""
SWING_RESTS = (-5.0, 0.0, 5.0, 10.0)
"""Rest angle of the orthosis, dorsiflexion positive [deg]."""


@dataclass(frozen=True, kw_only=True)
class DropFoot(WalkingStudy):
    """Walk with a drop foot and a spring beside it, undisturbed and pushed."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")] = ("learned",)
    """Policies to walk with, each with a table of its own."""
    episodes: int = 10
    """Episodes of each spring and speed, undisturbed, and as many pushed."""
    seconds: float = 12.0
    """Length of each episode."""
    push_newton: float = 150.0
    """Size of the pushes [N]."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 6.0}

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        walks = 2 * len(self.policies) * len(self._speeds()) * len(SWING_SPRINGS) * len(SWING_RESTS)
        return walks * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with every policy on every spring, undisturbed and pushed; tabulate and draw each policy's walks."""
        rows = [row for policy in self.policies for row in self._walks(policy, progress)]
        texts = []
        files: dict[str, Any] = {"drop.csv": rows_csv(rows)}
        for number, policy in enumerate(self.policies, 1):
            own = [row for row in rows if row["policy"] == policy]
            picture = f"drop-{number}.png"
            files[picture] = partial(draw_drop, rows=own)
            texts.append(f"## {policy}\n\n![Drop foot]({picture})\n\n{drop_text(own, self.episodes)}")
        _, most = share_interval(0, self.episodes)
        note = (
            f"Share that falls, undisturbed / pushed by ±{self.push_newton:g} N, and median toe clearance of the right "
            f"foot in mid-swing [mm]. {self.what_ran} of each; clearance of walks that fell is of the strides before. "
            "Weakest: none fell with it, nor with any stiffer one of its rest angle; where 0 of "
            f"{self.episodes} fell, up to {most:.0%} may fall (95 %, Wilson)."
        )
        return Answer(text="\n\n".join([*texts, note]), files=files)

    def _walks(self, policy: str, progress: OnProgress) -> list[dict[str, Any]]:
        """Walk with a policy, undisturbed and pushed; return a row for each speed, stiffness and rest angle.

        A row has the numbers of the undisturbed walk, and of the pushed one the falls.
        """
        rows = []
        springs = list(product(SWING_SPRINGS, SWING_RESTS))
        feet = [
            {"right_foot": {"kind": "drop", "orthosis": {"ankle_stiffness": k, "ankle_deg": rest}}}
            for k, rest in springs
        ]
        for speed in self._speeds():
            of_pushes = []
            for push in (0.0, self.push_newton):
                given = {"speed": speed, "push_newton": push, "episode_seconds": self.seconds}
                acting, settings = policy_and_settings(policy, given)
                recordings = record_feet(acting, settings, feet, name=policy, progress=progress, **self.how)
                of_pushes.append([numbers_of_feet(measure(recording)) for recording in recordings])
            for (stiffness, rest), undisturbed, pushed in zip(springs, *of_pushes, strict=True):
                row = {"policy": policy, "speed_m_s": speed, "spring_Nm_rad": stiffness, "rest_deg": rest}
                row |= with_walked_speed(undisturbed)
                rows.append({**row, "falls_pushed": pushed["falls"]})
        return rows

    def _speeds(self) -> Sequence[float]:
        """Return the commanded speeds [m/s]."""
        return (1.2,) if self.quick else DROP_SPEEDS


def weakest_cure(rows: Sequence[Row], column: str) -> Row | None:
    """Return the weakest spring with which nobody falls, nor with any stiffer spring of the same rest angle.

    `column` is that of the falls, undisturbed or pushed. None if somebody falls with the stiffest spring of every
    angle.
    """
    cures = []
    for rest in sorted({row["rest_deg"] for row in rows}):
        stiffest_first = sorted((row for row in rows if row["rest_deg"] == rest), key=lambda row: -row["spring_Nm_rad"])
        without_falls = list(takewhile(lambda row: row[column] == 0, stiffest_first))
        cures += without_falls[-1:]  # the weakest of them, if there is one
    return min(cures, key=lambda row: row["spring_Nm_rad"], default=None)


def drop_text(rows: Sequence[Row], episodes: int) -> str:
    """Return the tables of one policy, for each speed one; each cell has this many `episodes`."""
    parts = []
    for speed in dict.fromkeys(row["speed_m_s"] for row in rows):
        here = [row for row in rows if row["speed_m_s"] == speed]
        rests = sorted({row["rest_deg"] for row in here})
        lines = []
        for stiffness in sorted({row["spring_Nm_rad"] for row in here}):
            by_rest = {row["rest_deg"]: row for row in here if row["spring_Nm_rad"] == stiffness}
            lines.append([f"{stiffness:g}", *(_cell(by_rest[rest]) for rest in rests)])
        head = [f"K N·m/rad at {speed:g} m/s", *(f"rest {rest:g}°" for rest in rests)]
        cures = [weakest_cure(here, column) for column in ("falls", "falls_pushed")]
        undisturbed, pushed = [
            "no spring of the map" if cure is None else f"{cure['spring_Nm_rad']:g} N·m/rad at {cure['rest_deg']:g}°"
            for cure in cures
        ]
        parts.append(
            f"{table(head, lines)}\n\nWeakest with which 0 of {episodes} fell: {undisturbed}; under pushes: {pushed}."
        )
    return "\n\n".join(parts)


def _cell(row: Row) -> str:
    """Return, as a cell, the share of falls, undisturbed / pushed, and the toe clearance [mm]."""
    clearance = MISSING if row["clearance_m"] is None else f"{1000 * row['clearance_m']:.0f} mm"
    return f"{row['falls']:.0%} / {row['falls_pushed']:.0%}, {clearance}"


def draw_drop(path: Path, rows: Sequence[Row]) -> None:
    """Draw maps of toe clearance over stiffness and rest angle, a panel for each speed: x where an episode falls, +
    where one falls only when pushed."""
    speeds = list(dict.fromkeys(row["speed_m_s"] for row in rows))
    stiffness, rests = (sorted({row[name] for row in rows}) for name in ("spring_Nm_rad", "rest_deg"))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 3.4), layout="constrained")
        image = None
        for ax, speed in zip(
            np.ravel(figure.subplots(1, len(speeds), sharey=True, squeeze=False)), speeds, strict=True
        ):
            grid = np.full((len(rests), len(stiffness)), np.nan)
            for row in (row for row in rows if row["speed_m_s"] == speed):
                y = rests.index(row["rest_deg"])
                x = stiffness.index(row["spring_Nm_rad"])
                grid[y, x] = np.nan if row["clearance_m"] is None else 1000 * row["clearance_m"]
                if row["falls"]:
                    mark = "x"
                elif row["falls_pushed"]:
                    mark = "+"
                else:
                    mark = ","  # a pixel
                ax.plot(x, y, mark, color="#a03030", ms=7)
            image = ax.imshow(grid, origin="lower", aspect="auto", cmap="viridis", vmin=0.0, vmax=35.0)
            ax.set_xticks(range(len(stiffness)), [f"{value:g}" for value in stiffness])
            ax.set_yticks(range(len(rests)), [f"{value:g}" for value in rests])
            ax.set(title=f"{speed:g} m/s", xlabel="swing K (N·m/rad)")
        figure.axes[0].set_ylabel("rest angle (deg)")
        if image is not None:
            figure.colorbar(image, ax=figure.axes, label="toe clearance (mm); x falls, + falls when pushed")
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})
