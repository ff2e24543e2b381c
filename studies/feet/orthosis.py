"""Find the spring beside the right ankle that helps a weak calf, and the one that holds a drop foot.

    springfoot study orthosis

Nobody adapts here: legs and the stiffness of both feet are those of sound feet (`pretrained`), so that only the muscle
and the spring change. The stiffness of an orthosis is in N m/deg, as Waterval et al. (2019) measured it. A weak calf
slows the walk, and each spring slows it by another amount, while the energy for a metre depends on speed. So each walk
is commanded several speeds, and energies are compared at equal walked speeds.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations, product, takewhile
from pathlib import Path
from typing import Annotated, Any, ClassVar

import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure
from scipy.stats import rankdata

from springfoot.errors import require_count
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record_feet
from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, table, text_of

from ..base.intervals import share_interval
from ..base.kept import Kept
from ..base.study import Answer, OnProgress, WalkingStudy
from .foot_numbers import FOOT_NUMBERS, numbers_of
from .walked_speeds import TWO_PRICES, Row, at_walked_speeds, rows_csv

PER_DEG = 180.0 / np.pi
"""N m/rad in 1 N m/deg."""
WEAK_SPRINGS = (0.0, 0.9, 1.8, 2.7, 3.6, 4.9, 6.2, 7.4, 8.7)
"""Stiffness of an orthosis for a weak calf [N m/deg]; Waterval et al. (2019) tried 0.9 to 8.7."""
STRENGTHS = (0.2, 0.25, 0.3)
"""Strength of the calf as a fraction of the model's sound one; a sound walk at 1.2 m/s uses 0.4."""
MASSES = (50.0, 63.0, 80.0)
"""Masses of the bodies [kg], all 1.70 m tall."""
ASKED_SPEEDS = (0.8, 1.0, 1.2, 1.4, 1.6, 1.8)
"""Commanded speeds of walks with a weak calf [m/s]."""
WALKED_SPEEDS = (0.9, 1.1, 1.3)
"""Walked speeds at which springs are compared [m/s]; energy is interpolated linearly between two walks."""
DROP_SPEEDS = (0.8, 1.2, 1.6)
"""Commanded speeds of walks with a drop foot [m/s]."""
SWING_SPRINGS = (0.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0, 40.0)
"""Stiffness of an orthosis for a drop foot [N m/rad]."""
SWING_RESTS = (-5.0, 0.0, 5.0, 10.0)
"""Rest angle of an orthosis for a drop foot, dorsiflexion positive [deg]."""


@dataclass(frozen=True, kw_only=True)
class Orthosis(WalkingStudy):
    """Walk with a weak calf, or a drop foot, and an orthosis of every stiffness."""

    episodes: int = 5
    """Episodes of each spring and speed with a weak calf."""
    episodes_drop: int = 10
    """Episodes of each spring and speed with a drop foot, undisturbed, and as many pushed."""
    seconds: float = 12.0
    """Length of each episode."""
    policy: str = "pretrained"
    """Policy that sets the stiffness of both feet."""
    push_newton: float = 150.0
    """Pushes of the walks with a drop foot [N]."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File in which the numbers of each body, speed and strength are kept, to go on after a stop."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "episodes_drop": 1, "seconds": 6.0, "keep": None}

    def check(self) -> None:
        """Refuse counts out of range."""
        super().check()
        require_count("episodes_drop", self.episodes_drop)

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        weak = len(list(self._weak_cells())) * len(WEAK_SPRINGS) * self.episodes
        drop = 2 * len(self._drop_speeds()) * len(SWING_SPRINGS) * len(SWING_RESTS) * self.episodes_drop
        return (weak + drop) * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk with every spring."""
        kept = Kept(self.keep)
        with_drop_foot = replace(self, episodes=self.episodes_drop)
        weak = self._weak(kept, progress)
        drop = with_drop_foot._drop(kept, progress)
        even = at_walked_speeds(weak, SPRING_OF_A_BODY, (1.1,) if self.quick else WALKED_SPEEDS)
        best = best_springs(even)
        by_effort = best_springs(even, "effort")
        as_asked = best_springs([row for row in weak if row["speed_m_s"] in DROP_SPEEDS])
        files = {
            "weak.csv": rows_csv(weak),
            "best.csv": rows_csv(best),
            "best-by-effort.csv": rows_csv(by_effort),
            "best-as-asked.csv": rows_csv(as_asked),
            "drop.csv": rows_csv(drop),
            "weak.png": partial(draw_weak, rows=even, best=best),
            "drop.png": partial(draw_drop, rows=drop),
        }
        weak_section = weak_text(weak, best, by_effort, as_asked, self.what_ran)
        drop_section = drop_text(drop, self.episodes_drop, with_drop_foot.what_ran, self.push_newton)
        return Answer(text=f"{weak_section}\n\n{drop_section}", files=files)

    def _weak(self, kept: Kept, progress: OnProgress) -> list[dict[str, Any]]:
        """Return a row for each weak calf, body, commanded speed and spring."""
        rows: list[dict[str, Any]] = []
        orthoses = [{"ankle_stiffness": round(spring * PER_DEG, 3), "ankle_deg": 0.0} for spring in WEAK_SPRINGS]
        for mass, speed, strength in self._weak_cells():
            where = {"mass_kg": mass, "speed_m_s": speed, "strength": strength}
            feet = [{"kind": "weak", "strength": strength, "orthosis": orthosis} for orthosis in orthoses]
            of_springs = self._walk(kept, {"mass": mass, "speed": speed}, feet, progress)
            pairs = zip(WEAK_SPRINGS, of_springs, strict=True)
            rows += [{**where, "spring_Nm_deg": spring, **_with_walked_speed(numbers)} for spring, numbers in pairs]
        return rows

    def _drop(self, kept: Kept, progress: OnProgress) -> list[dict[str, Any]]:
        """Return a row for each drop foot's speed, spring and rest angle."""
        rows = []
        springs = list(product(SWING_SPRINGS, SWING_RESTS))
        feet = [{"kind": "drop", "orthosis": {"ankle_stiffness": k, "ankle_deg": rest}} for k, rest in springs]
        for speed in self._drop_speeds():
            of_pushes = [
                self._walk(kept, {"speed": speed, "push_newton": push}, feet, progress)
                for push in (0.0, self.push_newton)
            ]
            for (stiffness, rest), undisturbed, pushed in zip(springs, *of_pushes, strict=True):
                line = {"speed_m_s": speed, "spring_Nm_rad": stiffness, "rest_deg": rest}
                line |= _with_walked_speed(undisturbed)
                rows.append({**line, "falls_pushed": pushed["falls"]})
        return rows

    def _weak_cells(self) -> Iterator[tuple[float, float, float]]:
        """Yield mass [kg], commanded speed [m/s] and strength of each weak calf."""
        if self.quick:
            return product((63.0,), (1.2, 1.4), (0.25,))
        return product(MASSES, ASKED_SPEEDS, STRENGTHS)

    def _drop_speeds(self) -> Sequence[float]:
        return (1.2,) if self.quick else DROP_SPEEDS

    def _walk(
        self, kept: Kept, given: Mapping[str, Any], feet: Sequence[dict[str, Any]], progress: OnProgress
    ) -> list[dict[str, Any]]:
        """Return the numbers of a walk on each of the right `feet`, all on the same episodes."""

        def make() -> dict[str, Any]:
            """Walk on all feet, and return their numbers under the key `walks`."""
            acting, settings = policy_and_settings(self.policy, {**given, "episode_seconds": self.seconds})
            recordings = record_feet(acting, settings, feet, name=self.policy, progress=progress, **self.how)
            return {"walks": [numbers_of(measure(recording)) for recording in recordings]}

        how = {**self.how, "threads": 0, "policy": self.policy, "seconds": self.seconds}
        return kept.get([how, given, feet, FOOT_NUMBERS], make)["walks"]


def _with_walked_speed(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Return the numbers of a walk with its speed as `walked_m_s`, as a row's `speed_m_s` is the commanded one."""
    return {("walked_m_s" if key == "speed_m_s" else key): value for key, value in numbers.items()}


OF_A_CELL = ("mass_kg", "speed_m_s", "strength")
"""Columns whose values make a cell: body, speed and strength of the calf."""
SPRING_OF_A_BODY = ("mass_kg", "strength", "spring_Nm_deg")
COLORS = ("#0b6e8f", "#c26a1b", "#7a5195", "#555555")


def best_springs(rows: Sequence[Row], price: str = TWO_PRICES[0]) -> list[dict[str, Any]]:
    """Return the best spring without a fall for each body, speed and strength, by one of `TWO_PRICES`.

    A row has the spring of the least price, the percentage that the worst one costs more, and the spring that slows the
    walk least.
    """
    lines = []
    for cell in _cells(rows):
        walking = [row for row in _of(rows, cell) if not row.get("falls") and row[price] is not None]
        line = {**dict(zip(OF_A_CELL, cell, strict=True)), "springs_without_falls": len(walking)}
        names = ("best_Nm_deg", price, "walked_m_s", "worst_Nm_deg", "worst_more_percent", "fastest_Nm_deg")
        line |= dict.fromkeys(names)
        if walking:
            best = min(walking, key=lambda row: row[price])
            worst = max(walking, key=lambda row: row[price])
            line |= {"best_Nm_deg": best["spring_Nm_deg"], "worst_Nm_deg": worst["spring_Nm_deg"]}
            line |= {price: best[price], "walked_m_s": best["walked_m_s"]}
            line["fastest_Nm_deg"] = max(walking, key=lambda row: row["walked_m_s"])["spring_Nm_deg"]
            line["worst_more_percent"] = 100 * (worst[price] / best[price] - 1)
        lines.append(line)
    return lines


def _cells(rows: Sequence[Row]) -> list[tuple[float, ...]]:
    return list(dict.fromkeys(tuple(row[name] for name in OF_A_CELL) for row in rows))


def _of(rows: Sequence[Row], cell: tuple[float, ...]) -> list[Row]:
    return [row for row in rows if tuple(row[name] for name in OF_A_CELL) == cell]


def weak_text(
    rows: Sequence[Row], best: Sequence[Row], by_effort: Sequence[Row], as_asked: Sequence[Row], what_ran: str
) -> str:
    """Return the report's section on the weak calf.

    `rows` are the walks, `best` the springs of least fibre work at equal walked speeds, `by_effort` those of least
    effort, `as_asked` those of least fibre work at equal commanded speeds, and `what_ran` tells the numbers of walks.
    """
    speeds = sorted({row["speed_m_s"] for row in best})
    lines = []
    for strength in sorted({row["strength"] for row in best}):
        for mass in sorted({row["mass_kg"] for row in best}):
            cells = []
            for speed in speeds:
                (row,) = _of(best, (mass, speed, strength))
                if row["best_Nm_deg"] is None:
                    cells.append("none")
                    continue
                more = text_of(row["worst_more_percent"], ".0f")
                cells.append(f"{row['best_Nm_deg']:g} (+{more} %, {row['springs_without_falls']})")
            lines.append([f"{100 * strength:.0f} %", f"{mass:g}", *cells])
    head = ["calf", "kg", *(f"N·m/deg, walking {speed:g} m/s" for speed in speeds)]
    springs, asked = (sorted({row[name] for row in rows}) for name in ("spring_Nm_deg", "speed_m_s"))
    alone = [row for row in rows if row["spring_Nm_deg"] == springs[0]]
    fallen = sum(1 for row in alone if row["falls"] > 0)
    return (
        f"![The best orthosis](weak.png)\n\n{table(head, lines)}\n\nIn each cell, of the springs that walk that fast "
        "without a fall, that with which muscle fibres work least for a metre; in brackets, by how much the worst "
        "takes more, and how many they are. It is the stiffest of the map and the weakest, where a best one may lie "
        f"beyond, in {at_the_ends(best, springs)}.\n\n"
        f"The spring of least fibre work where all walk equally fast, against {directions(best, 'best_Nm_deg')}.\n\n"
        f"The spring of least effort there, activation counted, against {directions(by_effort, 'best_Nm_deg')}.\n\n"
        "The same where all are asked for the same speed, and walk the slower the more a spring slows them, against "
        f"{directions(as_asked, 'best_Nm_deg')}.\n\n"
        f"The spring that slows the walk asked for least, against {directions(as_asked, 'fastest_Nm_deg')}.\n\n"
        "ρ is Spearman's correlation over the cells, in brackets the mean at each level [N·m/deg] and, of pairs of "
        "cells that differ in nothing else, in how many the spring is stiffer, softer or the same with more weakness, "
        "mass or speed. Waterval et al. (2023) found more with weakness, mass and speed in a planar simulation of both "
        "calves; in their people (2019) stiffness had no effect on the group's energy. With mass and every device "
        "scaled alike a walk is the same, so mass is an identity. Without a spring someone falls in "
        f"{fallen} of {len(alone)} cells. "
        f"{what_ran} of each of {len(springs)} springs of 0 to {springs[-1]:g} N·m/deg at rest at 0°, and each of "
        f"{len(asked)} speeds asked for, {asked[0]:g} to {asked[-1]:g} m/s, between which prices are linear in the "
        "speed walked; legs and stiffness of both feet as of sound feet. A calf's strength is a share of the largest "
        "moment that the model's calf can give, of which a sound walk at 1.2 m/s needs 40 %."
    )


def directions(best: Sequence[Row], column: str) -> str:
    """Return, in words, whether the best stiffness rises with weakness, mass and speed.

    Counted over all cells (body, speed and strength), and in pairs of cells that differ in that quantity alone.
    """
    known = [row for row in best if row[column] is not None]
    texts = []
    for name, label, sign in (("strength", "weakness", -1), ("mass_kg", "mass", 1), ("speed_m_s", "speed", 1)):
        # `sign` -1: a weaker calf has less strength.
        levels = sorted({row[name] for row in known}, key=lambda value: sign * value)
        means = [np.mean([row[column] for row in known if row[name] == level]) for level in levels]
        pairs = np.array([(sign * row[name], row[column]) for row in known]).reshape(-1, 2)
        varies = len(levels) > 1 and np.ptp(pairs[:, 1]) > 0
        ranks = np.apply_along_axis(rankdata, 0, pairs)  # Spearman's rho is Pearson's r of ranks
        rho = f"ρ {np.corrcoef(ranks.T)[0, 1]:+.2f}" if varies else "ρ –"
        steps = ", ".join(f"{level:g}: {mean:.1f}" for level, mean in zip(levels, means, strict=True))
        others = [other for other in OF_A_CELL if other != name]
        alike = [
            np.sign(more[column] - less[column])
            for less, more in permutations(known, 2)
            if sign * less[name] < sign * more[name] and all(less[other] == more[other] for other in others)
        ]
        counts = f"stiffer {alike.count(1)}, softer {alike.count(-1)}, same {alike.count(0)}"
        texts.append(f"{label} {rho} ({steps}; {len(alike)} pairs: {counts})")
    return "; ".join(texts)


def at_the_ends(best: Sequence[Row], springs: Sequence[float]) -> str:
    """Return, in words, in how many cells of each speed the best spring is the stiffest, and the weakest, of `springs`.

    `springs` are the stiffnesses of the map, ascending.
    """
    texts = []
    for speed in sorted({row["speed_m_s"] for row in best}):
        at_speed = [row["best_Nm_deg"] for row in best if row["speed_m_s"] == speed]
        stiffest = at_speed.count(springs[-1])
        weakest = at_speed.count(springs[0])
        texts.append(f"{stiffest} and {weakest} of {len(at_speed)} at {speed:g} m/s")
    return "; ".join(texts)


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


def drop_text(rows: Sequence[Row], episodes: int, what_ran: str, push_newton: float) -> str:
    """Return the report's section on the drop foot; each cell has this many `episodes`."""
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
    _, most = share_interval(0, episodes)
    return (
        "![Drop foot](drop.png)\n\n"
        + "\n\n".join(parts)
        + (
            f"\n\nShare that falls, undisturbed / pushed by ±{push_newton:g} N, and median toe clearance of the right "
            f"foot in mid-swing [mm]. {what_ran} of each, legs and stiffness of both feet as of sound feet; muscles "
            "of the right ankle are slack in swing, the spring is there always; clearance of walks that fell is of the "
            "strides before. Weakest: none fell with it, nor with "
            f"any stiffer one of its rest angle; where 0 of {episodes} fell, up to {most:.0%} may fall (95 %, Wilson)."
        )
    )


def _cell(row: Row) -> str:
    """Return falls, undisturbed / pushed, and toe clearance of a walk, as a cell of a table."""
    clearance = MISSING if row["clearance_m"] is None else f"{1000 * row['clearance_m']:.0f} mm"
    return f"{row['falls']:.0%} / {row['falls_pushed']:.0%}, {clearance}"


def draw_weak(path: Path, rows: Sequence[Row], best: Sequence[Row]) -> None:
    """Draw energy over stiffness: a panel for each walked speed at the middle mass, a line for each strength."""
    masses = sorted({row["mass_kg"] for row in rows})
    mass = masses[len(masses) // 2]
    speeds = sorted({row["speed_m_s"] for row in rows})
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 3.4), layout="constrained")
        for ax, speed in zip(
            np.ravel(figure.subplots(1, len(speeds), sharey=True, squeeze=False)), speeds, strict=True
        ):
            for strength, color in zip(sorted({row["strength"] for row in rows}), COLORS * 9, strict=False):
                walking = [row for row in _of(rows, (mass, speed, strength)) if row["fibre_J_kg_m"] is not None]
                x = [row["spring_Nm_deg"] for row in walking]
                y = [row["fibre_J_kg_m"] for row in walking]
                ax.plot(x, y, "o-", color=color, ms=3.5, lw=1.3, label=f"a calf of {100 * strength:.0f} %")
                for row in _of(best, (mass, speed, strength)):
                    if row["best_Nm_deg"] is not None:
                        ax.plot(row["best_Nm_deg"], row["fibre_J_kg_m"], "o", color=color, ms=9, mfc="none")
            ax.set(title=f"walking {speed:g} m/s, {mass:g} kg", xlabel="orthosis (N·m/deg)")
            ax.grid(color="#ededed", lw=0.6)
        figure.axes[0].set_ylabel("fibre work (J/kg/m)")
        figure.axes[0].legend(frameon=False)
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})


def draw_drop(path: Path, rows: Sequence[Row]) -> None:
    """Draw maps of toe clearance over stiffness and rest angle, a panel for each speed, crosses where an episode
    falls."""
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
