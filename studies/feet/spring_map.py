"""Walk persons with springs of rising stiffness in each of several cases, and find the best spring of each case.

A case is a calf's strength or a body's mass. Springs are compared where they walk equally fast (`walked_speeds`). The
same map under a policy that does not adapt (`beside`) tells how much of an answer is the person's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from pathlib import Path
from typing import Any, ClassVar

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import policy_and_settings, record_feet
from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, span_text, table

from ..base.kept import Kept, known_as
from ..base.study import Answer, OnProgress, PersonsStudy
from ..base.walked_speeds import ASKED_SPEEDS, TWO_PRICES, WALKED_SPEEDS, Row, at_walked_speeds, lowest, rows_csv
from .foot_numbers import FOOT_NUMBERS, numbers_of_feet
from .told_apart import gain_words

COLORS = ("#0b6e8f", "#c26a1b", "#7a5195", "#4a8f3c", "#555555")


@dataclass(frozen=True, kw_only=True)
class SpringMap(PersonsStudy):
    """Walk persons with every spring in every case; a subclass says which springs and cases."""

    beside: str | None = "pretrained"
    """Policy that does not adapt, walked beside them; None for none."""

    CASE: ClassVar[str]
    """Name of the quantity that makes a case, with its unit."""
    CASES: ClassVar[Sequence[float]]
    """Values of the cases, ascending."""
    SPRINGS: ClassVar[Sequence[float]]
    """Stiffness of the springs, ascending."""
    UNIT: ClassVar[str] = "N·m/rad"
    """Unit of the stiffness."""
    KINDS: ClassVar[Sequence[str]]
    """Kinds of the feet."""

    def settings_of(self, case: float) -> Mapping[str, Any]:
        """Return the settings of the body in a case; its value `case` is one of `CASES`."""
        raise NotImplementedError

    def feet_of(self, case: float, spring: float) -> Mapping[str, Any]:
        """Return the settings of the feet in a case, with a spring of stiffness `spring` [`UNIT`]."""
        raise NotImplementedError

    @property
    def walkers(self) -> tuple[str, ...]:
        """Return all policies: the persons, and the one that does not adapt."""
        return self.persons if self.beside is None else (*self.persons, self.beside)

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        maps = len(self.walkers) * len(self._cases()) * len(self._commanded_speeds())
        return maps * len(self.SPRINGS) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every policy with every spring in every case; find the best springs where all walk equally fast."""
        walks = self._walks(progress)
        even = at_walked_speeds(walks, ("policy", "case", "spring"), (0.9,) if self.quick else WALKED_SPEEDS)
        best = best_springs(even)
        files = {
            "walks.csv": rows_csv(walks),
            "equal_speeds.csv": rows_csv(even),
            "best_springs.csv": rows_csv(best),
            "map.png": partial(self._draw, even=even),
        }
        return Answer(text=self._text(walks, best), files=files)

    def _walks(self, progress: OnProgress) -> list[dict[str, Any]]:
        """Return a row for each policy, case, commanded speed and spring."""
        kept = Kept(self.keep)
        rows = []
        for policy in self.walkers:
            for case in self._cases():
                feet = [self.feet_of(case, spring) for spring in self.SPRINGS]
                for speed in self._commanded_speeds():
                    of_springs = self._walk(kept, policy, {**self.settings_of(case), "speed": speed}, feet, progress)
                    for spring, numbers in zip(self.SPRINGS, of_springs, strict=True):
                        row = {"policy": policy, "case": case, "spring": spring, "speed_m_s": speed}
                        rows.append(row | with_walked_speed(numbers))
        return rows

    def _walk(
        self,
        kept: Kept,
        policy: str,
        given: Mapping[str, Any],
        feet: Sequence[Mapping[str, Any]],
        progress: OnProgress,
    ) -> list[dict[str, Any]]:
        """Return `FOOT_NUMBERS` of a policy's walk on each of the `feet`, all in the same episodes; they come from
        `kept` if it has them."""

        def make() -> dict[str, Any]:
            """Walk on all feet, and return their numbers under the key `walks`."""
            acting, settings = policy_and_settings(policy, {**given, "episode_seconds": self.seconds})
            recordings = record_feet(acting, settings, feet, name=policy, progress=progress, **self.how)
            return {"walks": [numbers_of_feet(measure(recording)) for recording in recordings]}

        how = {**self.how, "threads": 0, "policy": known_as(policy), "seconds": self.seconds}
        return kept.get([how, given, list(feet), FOOT_NUMBERS], make)["walks"]

    def _cases(self) -> Sequence[float]:
        """Return the values of the cases to walk: the first alone with --quick."""
        return self.CASES[:1] if self.quick else self.CASES

    def _commanded_speeds(self) -> Sequence[float]:
        """Return the commanded speeds [m/s]."""
        return (0.8, 1.0) if self.quick else ASKED_SPEEDS

    def _text(self, walks: Sequence[Row], best: Sequence[Row]) -> str:
        """Return the report from rows of `_walks` and of `best_springs`: a picture, a table and sentences."""
        groups = {"": self.persons, f", {self.beside} (not adapted)": self.walkers[len(self.persons) :]}
        parts = [
            "![Fibre work over the stiffness of the spring](map.png)",
            best_table(best, groups, f"{self.CASE}; best spring, {self.UNIT} (worst spring)"),
        ]
        for suffix, policies in groups.items():
            if policies:
                of_group = [row for row in best if row["policy"] in policies]
                ways = (direction(of_group, "case"), direction(of_group, "speed_m_s"))
                parts.append(f"Stiffer with more {self.CASE}: {ways[0]}; with more speed: {ways[1]}{suffix}.")
        fallen = sum(row["falls"] > 0 for row in walks)
        springs = f"{len(self.SPRINGS)} springs of {self.SPRINGS[0]:g} to {self.SPRINGS[-1]:g} {self.UNIT}"
        parts.append(
            f"Somebody falls in {fallen} of {len(walks)} walks. {self.what_ran} of each of {springs}, of each case and "
            f"of each commanded speed. Best: least fibre work for a metre where all walk equally fast, by the parabola "
            f"through the cheapest spring and its neighbours. {gain_words(*self.KINDS)}"
        )
        return "\n\n".join(parts)

    def _draw(self, path: Path, even: Sequence[Row]) -> None:
        """Draw fibre work over stiffness: a panel for each walked speed, a line for each case, pale for the policy that
        does not adapt."""
        speeds = sorted({row["speed_m_s"] for row in even})
        with matplotlib.rc_context(STYLE):
            figure = Figure(figsize=(11.0, 3.4), layout="constrained")
            panels = np.ravel(figure.subplots(1, len(speeds), sharey=True, squeeze=False))
            for ax, speed in zip(panels, speeds, strict=True):
                for case, color in zip(self._cases(), COLORS * 9, strict=False):
                    for policy in self.walkers:
                        rows = [r for r in even if (r["policy"], r["case"], r["speed_m_s"]) == (policy, case, speed)]
                        walked = [(row["spring"], row[TWO_PRICES[0]]) for row in rows if row[TWO_PRICES[0]] is not None]
                        adapts = policy in self.persons
                        label = f"{case:g}" if policy == self.persons[0] else None
                        ax.plot(*np.reshape(walked, (-1, 2)).T, "o-", ms=3.5, lw=1.3, color=color, label=label)
                        ax.lines[-1].set(alpha=1.0 if adapts else 0.35, linestyle="-" if adapts else ":")
                ax.set(title=f"walking {speed:g} m/s", xlabel=f"spring ({self.UNIT})")
                ax.grid(color="#ededed", lw=0.6)
            figure.axes[0].set_ylabel("fibre work (J/kg/m)")
            figure.axes[0].legend(frameon=False, title=self.CASE)
            figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})


def with_walked_speed(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Return the numbers of a walk with its speed as `walked_m_s`, as a row's `speed_m_s` is the commanded one."""
    return {("walked_m_s" if key == "speed_m_s" else key): value for key, value in numbers.items()}


def best_springs(rows_at_speeds: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the best stiffness for each policy, case, walked speed and price, from rows of `at_walked_speeds`.

    A row has the stiffness where a parabola through the cheapest springs is lowest (`lowest`), which need not be a
    walked one, and the price there; the share by which the dearest spring costs more, and the share saved against the
    softest spring. All are None where fewer than two springs have a price.
    """
    rows = []
    for price in TWO_PRICES:
        for policy, case, speed in dict.fromkeys(
            (row["policy"], row["case"], row["speed_m_s"]) for row in rows_at_speeds
        ):
            here = [
                row for row in rows_at_speeds if (row["policy"], row["case"], row["speed_m_s"]) == (policy, case, speed)
            ]
            prices = {row["spring"]: row[price] for row in here}
            walked = {spring: value for spring, value in prices.items() if value is not None}
            row = {"policy": policy, "case": case, "speed_m_s": speed, "price": price, "springs": len(walked)}
            row |= dict.fromkeys(("best", "least", "worst_more", "saving"))
            if len(walked) > 1:
                best, least = lowest(walked)
                row |= {"best": best, "least": least, "worst_more": max(walked.values()) / least - 1.0}
                softest = prices[min(prices)]
                row["saving"] = None if softest is None else 1.0 - least / softest
            rows.append(row)
    return rows


def best_table(best: Sequence[Row], groups: Mapping[str, Sequence[str]], head: str) -> str:
    """Return the Markdown table of the springs of least fibre work: a line for each case and group of policies.

    `best` are rows of `best_springs`, `groups` the policies of each group by its label behind the case, and `head` is
    the heading of the first column.
    """
    of_fibre_work = [row for row in best if row["price"] == TWO_PRICES[0]]
    speeds = sorted({row["speed_m_s"] for row in best})
    lines = []
    for case in sorted({row["case"] for row in best}):
        for suffix, policies in groups.items():
            if policies:
                alike = [row for row in of_fibre_work if row["case"] == case and row["policy"] in policies]
                cells = [_span([row for row in alike if row["speed_m_s"] == speed]) for speed in speeds]
                lines.append([f"{case:g}{suffix}", *cells])
    return table([head, *(f"walking {speed:g} m/s" for speed in speeds)], lines)


def _span(rows: Sequence[Row]) -> str:
    """Return, as a cell, the best stiffness and the share by which the worst spring costs more: the least and largest
    of `rows` of `best_springs`, a dash if one has no best spring."""
    if any(row["best"] is None for row in rows):
        return MISSING
    return (
        f"{span_text([row['best'] for row in rows], '.3g')} ({span_text([row['worst_more'] for row in rows], '+.0%')})"
    )


def direction(best: Sequence[Row], along: str) -> str:
    """Return, in words, whether the best spring by fibre work is stiffer with more of the column `along`, `case` or
    `speed_m_s`.

    Counted over pairs of rows of `best_springs` that differ in nothing else, and over policies.
    """
    other = "speed_m_s" if along == "case" else "case"
    known = [row for row in best if row["price"] == TWO_PRICES[0] and row["best"] is not None]
    stiffer: dict[str, list[bool]] = {}
    for less, more in permutations(known, 2):
        if less["policy"] == more["policy"] and less[other] == more[other] and less[along] < more[along]:
            stiffer.setdefault(less["policy"], []).append(more["best"] > less["best"])
    pairs = [one for of_policy in stiffer.values() for one in of_policy]
    mostly = sum(2 * sum(of_policy) > len(of_policy) for of_policy in stiffer.values())
    return f"{sum(pairs)} of {len(pairs)} pairs, most pairs of {mostly} of {len(stiffer)} policies"
