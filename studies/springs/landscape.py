"""Walk persons with one stiffness at both ankles and another at both toes, over a grid of both and of speeds.

    springfoot study landscape learned

The stiffness stays the same over the whole stride and is set for the person. Knowing that, the person moves hips, knees
and the springs' rest angles. So the map tells where a walk lies if only its stiffness differs: its falls, undisturbed
and pushed, its cost of a metre at equal walked speed, and its distance from people's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from springfoot.agents.policies import find_policy
from springfoot.errors import require_number
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record_policies
from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, table

from ..base.columns import COMPARED_JOINTS
from ..base.kept import Kept, known_as
from ..base.study import Answer, OnProgress, PersonsStudy
from ..base.walked_speeds import ASKED_SPEEDS, TWO_PRICES, WALKED_SPEEDS, Row, at_walked_speeds, price_numbers, rows_csv

ANKLES = (50.0, 100.0, 150.0, 200.0, 300.0, 400.0)
"""Stiffness of both ankles [N m/rad] for 1.70 m and 63 kg, up to the tendon's in series."""
TOES = (7.0, 14.0, 28.0, 56.0, 84.0)
"""Stiffness of both toes [N m/rad], a quarter to three times that of toes in people."""
NOT_DEARER = 0.05
"""Share by which a price may exceed the least one and not be told apart from it; as `told_apart.GAIN` of feet."""
AGREEING = 3
"""Persons needed, all in agreement, for a direction to be known."""
BOTH_STIFFNESSES = ("ankle_N_m_rad", "toe_N_m_rad")
"""Columns of the two stiffnesses."""
ANGLES_RMSE = "angles_rmse_deg"
"""Column of the distance from people: rms of the angles' mean curves from theirs, mean over `COMPARED_JOINTS` [deg]."""
SEARCHED = {TWO_PRICES[0]: "fibre work", TWO_PRICES[1]: "effort", ANGLES_RMSE: "distance from people"}
"""Column with a least value that is looked for -> its name."""


@dataclass(frozen=True, kw_only=True)
class Landscape(PersonsStudy):
    """Walk persons over a grid of ankle and toe stiffness, the same over the stride, at five speeds."""

    push_newton: float = 100.0
    """Size of the pushes [N]."""

    def check(self) -> None:
        """Refuse counts, lengths and pushes out of range."""
        super().check()
        require_number("push_newton", self.push_newton, 0.0, 1000.0, above=True, unit="N")

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return 2.0 * len(self.persons) * len(self._cells()) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every person in every cell (ankle, toe, commanded speed); find at each walked speed the cells that have
        the least of each number of `SEARCHED`."""
        kept = Kept(self.keep)
        policies = {(ankle, toe): f"constant:{ankle:g},{toe:g}" for ankle, toe, _ in self._cells()}
        speeds = dict.fromkeys(speed for _, _, speed in self._cells())
        numbers: dict[tuple[Any, ...], dict[str, Any]] = {}
        for person, speed in product(self.persons, speeds):
            of_cells = self._walk(kept, person, list(policies.values()), speed, progress)
            numbers |= {(person, *cell, speed): own for cell, own in zip(policies, of_cells, strict=True)}
        walks = [
            {"person": person, **dict(zip(BOTH_STIFFNESSES, cell, strict=True)), "speed_m_s": speed}
            | numbers[person, *cell, speed]
            for person, (*cell, speed) in product(self.persons, self._cells())
        ]
        speeds_walked = (0.9,) if self.quick else WALKED_SPEEDS
        even = at_walked_speeds(walks, ("person", *BOTH_STIFFNESSES), speeds_walked, tuple(SEARCHED))
        least = cells_of_least(even)
        files = {
            "walks.csv": rows_csv(walks),
            "equal_speeds.csv": rows_csv(even),
            "least.csv": rows_csv(least),
            "landscape.png": partial(draw, walks=walks, even=even),
        }
        return Answer(text=self._text(walks, least), files=files)

    def _walk(
        self, kept: Kept, person: str, cells: Sequence[str], speed: float, progress: OnProgress
    ) -> list[dict[str, Any]]:
        """Return `_cell_numbers` of a person's walks at a commanded `speed` [m/s] with each of `cells`, which are
        baselines `constant:ANKLE,TOE`; those in `kept` are not walked again."""
        given = {"person": str(find_policy(person)), "speed": speed, "episode_seconds": self.seconds}

        def metrics_of(baselines: Sequence[str], push: float) -> list[dict[str, Any]]:
            """Return the metrics of walks with several of `cells`, side by side, under pushes of `push` [N]."""
            found = {name: policy_and_settings(name, {**given, "push_newton": push}) for name in baselines}
            acts = {name: act for name, (act, _) in found.items()}
            _, settings = found[baselines[0]]
            recordings = record_policies(acts, settings, progress=progress, **self.how)
            return [measure(recording).metrics for recording in recordings]

        def make(missing: list[int]) -> list[dict[str, Any]]:
            """Walk with the cells of the indices `missing`, undisturbed and pushed; return their numbers."""
            baselines = [cells[index] for index in missing]
            pairs = zip(metrics_of(baselines, 0.0), metrics_of(baselines, self.push_newton), strict=True)
            return [_cell_numbers(metrics, pushed) for metrics, pushed in pairs]

        question = [known_as(person), self.walked, self.push_newton, self.seconds, speed]
        return kept.get_all([[*question, cell] for cell in cells], make)

    def _cells(self) -> Sequence[tuple[float, float, float]]:
        """Return the stiffness of ankles and of toes [N m/rad] and the commanded speed [m/s] of each cell."""
        if self.quick:
            return list(product(ANKLES[1::2], TOES[1:4:2], (0.8, 1.0)))
        return list(product(ANKLES, TOES, ASKED_SPEEDS))

    def _text(self, walks: Sequence[Row], least: Sequence[Row]) -> str:
        """Return the report: picture, table of the cheapest cells, and sentences on falls and on the speed."""
        columns = {"undisturbed": "falls", f"pushed by ±{self.push_newton:g} N": "falls_pushed"}
        falls = ", ".join(f"{_count_with_falls(walks, column)} {name}" for name, column in columns.items())
        ways = [
            f"least {name}: ankle {direction(least, BOTH_STIFFNESSES[0], number)}, "
            f"toe {direction(least, BOTH_STIFFNESSES[1], number)}"
            for number, name in SEARCHED.items()
        ]
        return "\n\n".join(
            [
                "![Fibre work, effort and distance from people over ankle and toe stiffness](landscape.png)",
                least_table(least),
                f"Of {len(walks)} cells somebody falls in {falls}. From the slowest to the fastest walk the springs of "
                f"the least become: {'; '.join(ways)}.",
                f"{self.what_ran} of each cell. Prices are for a metre, and the distance is the angles' rms from "
                "people's mean, where all cells walk equally fast; in brackets "
                f"the cells that have at most {100 * NOT_DEARER:g} % more than the least.",
            ]
        )


def _cell_numbers(metrics: Mapping[str, Any], pushed: Mapping[str, Any]) -> dict[str, float | None]:
    """Return falls, walked speed, prices and RMSE of the joints from the metrics of a cell's undisturbed walk, and the
    falls of its `pushed` one."""
    numbers = price_numbers(metrics)
    of_joints = {f"{joint}_rmse_deg": metrics["joints"][joint]["rmse_deg"] for joint in COMPARED_JOINTS}
    return {
        "falls": numbers["falls"],
        "falls_pushed": price_numbers(pushed)["falls"],
        **numbers,
        **of_joints,
        ANGLES_RMSE: None if None in of_joints.values() else float(np.mean(list(of_joints.values()))),
    }


def _count_with_falls(walks: Sequence[Row], column: str) -> int:
    """Return the number of rows with a fall in the `column` of falls, undisturbed or pushed."""
    return sum(row[column] > 0 for row in walks)


def cells_of_least(even: Sequence[Row]) -> list[dict[str, Any]]:
    """Return for each of `SEARCHED`, person and walked speed a row with the cell of the least number in `even`, rows of
    `at_walked_speeds`.

    It has that cell's stiffness of ankle and toe, its number, and the range of each stiffness over the cells that
    have at most `NOT_DEARER` more; None where no cell has the number.
    """
    rows = []
    for price in SEARCHED:
        for person, speed in dict.fromkeys((row["person"], row["speed_m_s"]) for row in even):
            here = [row for row in even if (row["person"], row["speed_m_s"]) == (person, speed)]
            walked = [row for row in here if row[price] is not None]
            row: dict[str, Any] = {"person": person, "speed_m_s": speed, "number": price, "cells": len(walked)}
            bounds = tuple(f"{column}_{end}" for column in BOTH_STIFFNESSES for end in ("from", "to"))
            row |= dict.fromkeys((*BOTH_STIFFNESSES, "least", *bounds))
            if walked:
                best = min(walked, key=lambda one: one[price])
                near = [one for one in walked if one[price] <= (1.0 + NOT_DEARER) * best[price]]
                row |= {"least": best[price]}
                for column in BOTH_STIFFNESSES:
                    values = [one[column] for one in near]
                    row |= {column: best[column], f"{column}_from": min(values), f"{column}_to": max(values)}
            rows.append(row)
    return rows


def least_table(least: Sequence[Row]) -> str:
    """Return the Markdown table of the cells of least, a line for each person and walked speed; `least` are rows of
    `cells_of_least`."""
    lines = []
    for person, speed in dict.fromkeys((row["person"], row["speed_m_s"]) for row in least):
        here = [row for row in least if (row["person"], row["speed_m_s"]) == (person, speed)]
        lines.append([f"{person}, {speed:g} m/s", *(_cell(row) for row in here)])
    return table(["walking", *(f"least {name}: ankle, toe, N·m/rad" for name in SEARCHED.values())], lines)


def _cell(row: Row) -> str:
    """Return the two stiffnesses of a row of `cells_of_least`, each with its range in brackets; a dash if None."""
    if row["least"] is None:
        return MISSING
    return ", ".join(f"{row[name]:g} ({row[f'{name}_from']:g} to {row[f'{name}_to']:g})" for name in BOTH_STIFFNESSES)


def direction(least: Sequence[Row], column: str, number: str) -> str:
    """Return in words whether the stiffness `column` of the least `number` is stiffer or softer at the fastest walked
    speed than at the slowest: known if all persons agree and are `AGREEING` or more, else with their counts."""
    changes = []
    for person in dict.fromkeys(row["person"] for row in least):
        rows = [row for row in least if (row["person"], row["number"]) == (person, number) and row["least"] is not None]
        rows.sort(key=lambda row: row["speed_m_s"])
        changes.append(rows[-1][column] - rows[0][column] if rows else 0.0)
    counts = {"stiffer": sum(change > 0.0 for change in changes), "softer": sum(change < 0.0 for change in changes)}
    for word, count in counts.items():
        if count == len(changes) >= AGREEING:
            return word
    return f"not known ({counts['stiffer']} stiffer, {counts['softer']} softer)"


def draw(path: Path, walks: Sequence[Row], even: Sequence[Row]) -> None:
    """Draw the mean over persons: a row of panels for each number of `SEARCHED`, one for each walked speed, with a
    cross on the cells in which somebody falls."""
    speeds = sorted({row["speed_m_s"] for row in even})
    ankles, toes = (sorted({row[column] for row in even}) for column in BOTH_STIFFNESSES)
    fallen = {tuple(row[column] for column in BOTH_STIFFNESSES) for row in walks if row["falls"]}
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(3.6 * len(speeds), 2.8 * len(SEARCHED)), layout="constrained")
        grid = figure.subplots(len(SEARCHED), len(speeds), squeeze=False)
        units = ("J/kg/m", "–", "°")
        for axes, (price, name), unit in zip(grid, SEARCHED.items(), units, strict=True):
            for ax, speed in zip(axes, speeds, strict=True):
                prices = np.full((len(toes), len(ankles)), np.nan)
                for (row, toe), (column, ankle) in product(enumerate(toes), enumerate(ankles)):
                    here = [
                        one[price]
                        for one in even
                        if (*map(one.get, BOTH_STIFFNESSES), one["speed_m_s"]) == (ankle, toe, speed)
                    ]
                    if None not in here:
                        prices[row, column] = np.mean(here)
                _draw_panel(ax, prices, ankles, toes, fallen)
                ax.set_title(f"{name}, {unit}, walking {speed:g} m/s")
        for ax in grid[-1]:
            ax.set_xlabel("ankle, N·m/rad")
        for ax in grid[:, 0]:
            ax.set_ylabel("toe, N·m/rad")
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})


def _draw_panel(
    ax: Axes, prices: Any, ankles: Sequence[float], toes: Sequence[float], fallen: set[tuple[float, ...]]
) -> None:
    """Draw one panel: prices (toes, ankles) as colours with their values, the least one bold; cells without a price
    have × if an episode falls (`fallen`, (ankle, toe) of cells), else a dash."""
    ax.imshow(prices, origin="lower", aspect="auto", cmap="viridis_r")
    for (row, toe), (column, ankle) in product(enumerate(toes), enumerate(ankles)):
        value = prices[row, column]
        has_price = np.isfinite(value)
        text = f"{value:.2f}" if has_price else "×" if (ankle, toe) in fallen else "–"
        bold = has_price and value == np.nanmin(prices)
        dark = has_price and value > np.mean([np.nanmin(prices), np.nanmax(prices)])
        weight, color = "bold" if bold else "normal", "white" if dark else "black"
        ax.text(column, row, text, ha="center", va="center", fontsize=7, fontweight=weight, color=color)
    ax.set_xticks(range(len(ankles)), [f"{k:g}" for k in ankles])
    ax.set_yticks(range(len(toes)), [f"{k:g}" for k in toes])
