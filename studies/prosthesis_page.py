"""What `prosthesis` found, in tables and a picture: each foot's numbers, and what adaptive stiffness recovers."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from springfoot.agents.markdown import MISSING, table, text_of
from springfoot.evaluation.gait_figure import STYLE
from springfoot.gait.scores import mean_sd

from .foot_walks import ASKED, PUSH_NEWTON, better_in, told_numbers
from .intervals import t_interval

NOT_ADAPTED, ADAPTED_ALONE, WITH_POLICY = "not adapted", "adapted", "adapted, trained"
"""Whose walk a row is: of legs as with sound feet, sound side by `pretrained`; of the legs found, by their own
schedule; the same by a trained policy."""
WHERE = ("height_m", "mass_kg", "asked_m_s")
COLORS = {"intact": "#555555", "rigid": "#7a5195", "passive": "#c26a1b", "adaptive": "#0b6e8f"}
Row = Mapping[str, Any]


def share_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """What adaptive stiffness changes against the best passive spring, by place, number and search, seeds paired.

    `share` is that change over the gap between the passive and the intact foot; where the intact one is not better,
    or by no more than the interval of the gap over the seeds, there is no gap to close and no share. Of `both` searches
    the intervals are over the means of each, as what a search finds differs more than what a seed does.
    """
    found = []
    for where in dict.fromkeys(tuple(row[name] for name in WHERE) for row in rows):
        here = [row for row in rows if tuple(row[name] for name in WHERE) == where]
        intact = next(row for row in here if row["foot"] == "intact")
        searches = sorted({row["search"] for row in here if row["person"] == WITH_POLICY})
        groups = [(search, [search]) for search in searches]
        groups += [("both", searches)] if len(searches) > 1 else []
        for asked in ASKED:
            for label, of in groups:
                pairs = _pairs(here, asked.key, of)
                line = dict(zip(WHERE, where, strict=True)) | {"number": asked.key, "search": label}
                if label == "both":
                    means = [own.mean(0) for each in of if len(own := _pairs(here, asked.key, [each]))]
                    change = _change(np.array(means).reshape(-1, 2), intact[asked.key], asked.better, few=True)
                else:
                    change = _change(pairs, intact[asked.key], asked.better)
                found.append(line | {"pairs": len(pairs)} | change)
    return found


def _pairs(rows: Sequence[Row], key: str, searches: Sequence[int]) -> np.ndarray:
    """(n, 2) passive and adaptive of the same search and seed, where both have a number."""
    values = {(row["foot"], row["search"], row["seed"]): row[key] for row in rows if row["person"] == WITH_POLICY}
    pairs = [
        (own, values[("adaptive", search, seed)])
        for (foot, search, seed), own in values.items()
        if foot == "passive" and search in searches and ("adaptive", search, seed) in values
    ]
    return np.array([pair for pair in pairs if None not in pair], float).reshape(-1, 2)


def _change(pairs: np.ndarray, intact: float | None, better: int, few: bool = False) -> dict[str, float | None]:
    """As `share_rows` tells; of `few` pairs, the means of searches, each must have a gap, as no interval can tell."""
    names = ("passive", "adaptive", "intact", "change", "change_low", "change_high", "share", "share_low", "share_high")
    found: dict[str, float | None] = dict.fromkeys(names)
    if not len(pairs):
        return found
    passive, adaptive = pairs.T
    change = adaptive - passive
    low, high = t_interval(change)
    found |= {"passive": float(passive.mean()), "adaptive": float(adaptive.mean()), "intact": intact}
    found |= {"change": float(change.mean()), "change_low": low, "change_high": high}
    if intact is not None:
        gap = intact - passive
        sure = (better * gap).min() > 0 if few else min(t_interval(better * gap)) > 0
        if sure:
            ends = sorted(value / float(gap.mean()) for value in (low, high))
            found |= {"share": float(change.mean() / gap.mean()), "share_low": ends[0], "share_high": ends[1]}
    return found


def sections(rows: Sequence[Row], shares: Sequence[Row], ran: tuple[str, str], policies: Path) -> dict[str, str]:
    """Sections of the page; `ran` says what was walked at the first place and at the others."""
    first = tuple(rows[0][name] for name in WHERE)
    here = [row for row in rows if tuple(row[name] for name in WHERE) == first]
    head = ["foot", "person", "search", "seeds", "falls", "speed m/s", *(each.label for each in ASKED)]
    lines = []
    for (foot, person, search), group in _groups(here).items():
        cells = [_mean(group, key, pattern) for key, pattern in told_numbers()]
        seeds = str(len(group)) if person == WITH_POLICY else ""
        lines.append([foot, person, str(search), seeds, *cells])
    note = (
        f"{ran[0]} of each row (and seed), undisturbed and, for the last column, pushed by ±{PUSH_NEWTON:g} N; falls "
        "as shares of episodes; numbers of walks that fell are of the strides before. Not adapted: legs of two sound "
        "feet, stiffness by `pretrained`. Adapted: legs (and the foot's own numbers) of `springfoot study adapt`, "
        "stiffness as its search left it. Trained: the same, stiffness by policies trained for a short time on it "
        f"({policies}), mean ± SD over seeds. Cost of transport counts what a passive spring gives back as well."
    )
    text = {"PROSTHESIS": f"{_where(first)}\n\n{table([*head, 'ankle °', 'toe °'], lines)}\n\n{note}"}
    if against := _passive_against_rigid(here):
        text["PROSTHESIS"] += f"\n\n{against}"
    if shares:
        text["RECOVERED"] = _shares_text([row for row in shares if tuple(row[name] for name in WHERE) == first])
    if len({tuple(row[name] for name in WHERE) for row in rows}) > 1:
        text["PROSTHESIS-ELSEWHERE"] = _elsewhere(rows, ran[1])
    return {name: f"![Feet](prosthesis.png)\n\n{own}" if name == "PROSTHESIS" else own for name, own in text.items()}


def _groups(rows: Sequence[Row]) -> dict[tuple[str, str, Any], list[Row]]:
    groups: dict[tuple[str, str, Any], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["foot"], row["person"], row["search"]), []).append(row)
    return groups


def _mean(rows: Sequence[Row], key: str, pattern: str) -> str:
    values = [row[key] for row in rows if row[key] is not None]
    if not values:
        return MISSING
    spread = mean_sd(values)
    text = text_of(spread["mean"], pattern)
    return text if spread["sd"] is None or len(rows) < 2 else f"{text} ± {text_of(spread['sd'], pattern)}"


def _passive_against_rigid(rows: Sequence[Row]) -> str:
    told = []
    for search in sorted({row["search"] for row in rows if row["person"] == ADAPTED_ALONE}):
        pair = [
            next(
                (row for row in rows if (row["foot"], row["person"], row["search"]) == (foot, ADAPTED_ALONE, search)),
                None,
            )
            for foot in ("passive", "rigid")
        ]
        if pair[0] and pair[1]:
            better = better_in(pair[0], pair[1])
            told.append(f"search {search}: in {len(better)} of {len(ASKED)} ({', '.join(better) or 'none'})")
    return f"The best passive spring is better than the rigid foot, both adapted to, {'; '.join(told)}." if told else ""


def _shares_text(shares: Sequence[Row]) -> str:
    lines = []
    for row in shares:
        asked = next(each for each in ASKED if each.key == row["number"])
        means = [text_of(row[name], asked.pattern) for name in ("passive", "adaptive", "intact")]
        change = _interval(row, "change", asked.pattern)
        share = _interval(row, "share", ".0%") if row["share"] is not None else "no gap"
        lines.append([asked.label, str(row["search"]), str(row["pairs"]), *means, change, share])
    head = ["", "search", "pairs", "best passive", "adaptive", "intact", "change", "share of the gap closed"]
    return (
        f"{table(head, lines)}\n\nTrained policies, adaptive less best passive of the same search and seed; 95 % "
        "intervals of the mean, Student's, over seeds (`both`: over the means of the two searches). "
        "More push-off work, and less of all else, is better. No gap: the intact foot is not better, or not told apart."
    )


def _interval(row: Row, name: str, pattern: str) -> str:
    if row[name] is None:
        return MISSING
    low, high = (format(row[f"{name}_{end}"], pattern) for end in ("low", "high"))
    return f"{format(row[name], pattern)} [{low}, {high}]"


def _elsewhere(rows: Sequence[Row], ran: str) -> str:
    keys = [("falls", ".2f"), ("speed_m_s", ".2f"), ("falls_pushed", ".2f")]
    keys += [(each.key, each.pattern) for each in ASKED if each.key != "falls_pushed"]
    lines = []
    for where in dict.fromkeys(tuple(row[name] for name in WHERE) for row in rows):
        here = [row for row in rows if tuple(row[name] for name in WHERE) == where]
        for foot in COLORS:
            group = [row for row in here if row["foot"] == foot]
            best = [row for row in group if row["person"] == WITH_POLICY]
            best = best or [row for row in group if row["person"] == ADAPTED_ALONE] or group
            if best:
                label = f"{foot}, {best[0]['person']}"
                lines.append([_where(where), label, str(len(best)), *(_mean(best, *key) for key in keys)])
    labels = {each.key: each.label for each in ASKED} | {"falls": "falls", "speed_m_s": "speed m/s"}
    head = ["where", "foot and person", "walks", *(labels[key] for key, _ in keys)]
    return (
        f"{table(head, lines)}\n\nMeans ± SD over searches and seeds, {ran} but for the first place. Legs were "
        "searched, and policies trained, at 1.2 m/s and 63 kg; at other speeds the legs are the committed ones of that "
        "speed, moved as far as the search moved them at 1.2 m/s; other bodies wear springs as much stiffer as their "
        "mass × height is larger."
    )


def _where(where: Sequence[float]) -> str:
    height, mass, speed = where
    return f"{height:.2f} m, {mass:g} kg, {speed:g} m/s"


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Write the picture: each number of each foot at the first place, a point a walk."""
    first = tuple(rows[0][name] for name in WHERE)
    here = [row for row in rows if tuple(row[name] for name in WHERE) == first]
    places = [
        ("intact", NOT_ADAPTED),
        *((foot, ADAPTED_ALONE) for foot in ("rigid", "passive", "adaptive")),
        *((foot, WITH_POLICY) for foot in ("passive", "adaptive")),
    ]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11.0, 5.2), layout="constrained")
        axes = figure.subplots(2, 3)
        for ax, asked in zip(axes.flat, ASKED, strict=True):
            for place, (foot, person) in enumerate(places):
                group = [row for row in here if (row["foot"], row["person"]) == (foot, person)]
                values = [row[asked.key] for row in group if row[asked.key] is not None]
                ax.plot([place] * len(values), values, "o", color=COLORS[foot], ms=4, alpha=0.5)
                if values:
                    ax.plot(place, np.mean(values), "_", color=COLORS[foot], ms=18, mew=2)
            ax.set_title(asked.label)
            labels = [f"{foot}\n{'trained' if person == WITH_POLICY else ''}" for foot, person in places]
            ax.set_xticks(range(len(places)), labels, fontsize=7.5)
            ax.grid(axis="y", color="#ededed", lw=0.6)
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})
