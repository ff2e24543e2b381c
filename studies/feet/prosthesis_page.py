"""What `prosthesis` found, in tables and a picture: each foot's numbers, and what adaptive stiffness recovers."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, table, text_of
from springfoot.gait.people import mean_sd

from ..base.intervals import t_interval
from .foot_walks import ABOUT_STOPS, ASKED, PUSH_NEWTON, TOLD, Asked

NOT_ADAPTED, ADAPTED_ALONE, WITH_POLICY = "not adapted", "adapted", "adapted, trained"
"""Whose walk a row is: of legs as with sound feet, sound side by `pretrained`; of the legs found, by their own
schedule; the same by a trained policy."""
TOE_HELD = "rigid, toe held"
"""The committed rigid foot of a person who was made to hold its toe; they walk at a speed of their own."""
WHERE = ("height_m", "mass_kg", "asked_m_s")
COLORS = {"intact": "#555555", "rigid": "#7a5195", "passive": "#c26a1b", "adaptive": "#0b6e8f"}
Row = Mapping[str, Any]


def share_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the changes of adaptive stiffness against the passive spring found, by place, person, number and search.

    Pairs are of the same seed of the trainings, or of the same episodes where nobody learned.

    `share` is that change over the gap between the passive and the intact foot; where the intact one is not better,
    or by no more than the interval of the gap over the pairs, there is no gap to close and no share. Of `both` searches
    the intervals are over the means of each, as what a search finds differs more than what a seed does.
    """
    found = []
    for where in dict.fromkeys(_place(row) for row in rows):
        here = [row for row in rows if _place(row) == where]
        for person in (ADAPTED_ALONE, WITH_POLICY):
            own = [row for row in here if row["person"] == person or row["foot"] == "intact"]
            searches = sorted({row["search"] for row in own if row["foot"] == "adaptive"})
            for asked in ASKED:
                line = dict(zip(WHERE, where, strict=True)) | {"person": person, "number": asked.key}
                found += [line | change for change in _changes(own, asked, searches)]
    return found


def _changes(rows: Sequence[Row], asked: Asked, searches: Sequence[int]) -> list[dict[str, Any]]:
    """Return of each search by itself, and of both."""
    known = [row[asked.key] for row in rows if row["foot"] == "intact" and row[asked.key] is not None]
    intact = float(np.mean(known)) if known else None
    pairs = {each: pairs_of(rows, (("passive", each), ("adaptive", each)), asked.key) for each in searches}
    found = [
        {"search": search, "pairs": len(own)} | _change(own, intact, asked.better) for search, own in pairs.items()
    ]
    if len(searches) > 1:
        means = np.array([own.mean(0) for own in pairs.values() if len(own)]).reshape(-1, 2)
        both = {"search": "both", "pairs": sum(map(len, pairs.values()))}
        found.append(both | _change(means, intact, asked.better, few=True))
    return found


def pairs_of(rows: Sequence[Row], worn: Sequence[tuple[str, Any]], key: str) -> np.ndarray:
    """Return (n, 2) a number of two feet, each with its search, in pairs of the same `seed` in which both have it."""
    of = [{row["seed"]: row[key] for row in rows if (row["foot"], row["search"]) == each} for each in worn]
    pairs = [(of[0][seed], of[1][seed]) for seed in of[0] if seed in of[1]]
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


def sections(rows: Sequence[Row], shares: Sequence[Row], ran: tuple[str, str, str], policies: Path) -> dict[str, str]:
    """Sections of the page; `ran`: what was walked at the first place, at the others, how long was learned."""
    first = _place(rows[0])
    here = [row for row in rows if _place(row) == first]
    note = (
        f"{ran[0]} of each walk, undisturbed and, for the column `falls, pushed`, pushed by ±{PUSH_NEWTON:g} N; falls "
        "as shares of episodes; numbers of walks that fell are of the strides before. Mean ± SD over rows of the CSV: "
        "groups of the same episodes, or seeds of trainings. Not adapted: legs of two sound feet, stiffness by "
        "`pretrained`. Adapted: legs (and the foot's own numbers) of `springfoot study adapt`, stiffness as its search "
        f"left it. Trained: the same, stiffness by policies trained on it for {ran[2]} ({policies}). Cost of "
        f"transport counts what a passive spring gives back as well. {ABOUT_STOPS}"
    )
    text = {"PROSTHESIS": f"![Feet](prosthesis.png)\n\n{_where(first)}\n\n{_walks_table(here)}\n\n{note}"}
    if against := _passive_against(here, "rigid"):
        text["PROSTHESIS"] += f"\n\n{against}"
    if held := [row for row in rows if row["foot"] == TOE_HELD]:
        own = [row for row in rows if _place(row) == _place(held[0])]
        text["TOE-HELD"] = f"{_where(_place(held[0]))}\n\n{_walks_table(own)}\n\n{_passive_against(own, TOE_HELD)}"
        rows = [row for row in rows if row not in own]
    if shares:
        text["RECOVERED"] = _shares_text([row for row in shares if _place(row) == first])
    if len({_place(row) for row in rows}) > 1:
        text["PROSTHESIS-ELSEWHERE"] = _elsewhere(rows, ran[1])
    return text


def _place(row: Row) -> tuple[float, ...]:
    return tuple(row[name] for name in WHERE)


def _walks_table(rows: Sequence[Row]) -> str:
    head = ["foot", "person", "search", "rows", *(each.label for each in TOLD)]
    lines = []
    for (foot, person, search), group in _groups(rows).items():
        cells = [_mean(group, each.key, each.pattern) for each in TOLD]
        lines.append([foot, person, str(search), str(len(group)), *cells])
    return table(head, lines)


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


def _passive_against(rows: Sequence[Row], foot: str) -> str:
    """In which numbers the passive feet found are better, person adapted to both; a foot with searches by search."""
    own = [row for row in rows if row["person"] == ADAPTED_ALONE]
    told = []
    theirs = {row["search"] for row in own if row["foot"] == foot}
    for search in sorted({row["search"] for row in own if row["foot"] == "passive"}):
        said: dict[str, list[str]] = {"better": [], "worse": [], "not told apart": []}
        for asked in ASKED:
            worn = (foot, search if search in theirs else ""), ("passive", search)
            low, high = t_interval(asked.better * np.diff(pairs_of(own, worn, asked.key), axis=1).ravel())
            said["better" if low > 0 else "worse" if high < 0 else "not told apart"].append(asked.label)
        words = [f"{word} in {len(names)} ({'; '.join(names)})" for word, names in said.items() if names]
        told.append(f"search {search}: {', '.join(words)}")
    if not told or not theirs:
        return ""
    return (
        f"Of {len(ASKED)} numbers the passive foot found is, against `{foot}`, the person adapted to each: "
        f"{'; '.join(told)}; by 95 % intervals of the mean difference over the groups of episodes, Student's."
    )


def _shares_text(shares: Sequence[Row]) -> str:
    lines = []
    for row in shares:
        asked = next(each for each in ASKED if each.key == row["number"])
        means = [text_of(row[name], asked.pattern) for name in ("passive", "adaptive", "intact")]
        change = _interval(row, "change", asked.pattern)
        share = _interval(row, "share", ".0%") if row["share"] is not None else "no gap"
        lines.append([asked.label, row["person"], str(row["search"]), str(row["pairs"]), *means, change, share])
    head = ["", "person", "search", "pairs", "passive, found", "adaptive", "intact", "change", "share of the gap"]
    return (
        f"{table(head, lines)}\n\nAdaptive less passive of the same search, and of the same seed of the training or "
        "the same episodes; 95 % intervals of the mean, Student's, over those pairs (`both`: over the means of the two "
        "searches). More push-off work, and less of all else, is better. No gap: the intact foot is not better, or not "
        "told apart."
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
    for where in dict.fromkeys(_place(row) for row in rows):
        here = [row for row in rows if _place(row) == where]
        for foot in COLORS:
            group = [row for row in here if row["foot"] == foot]
            best = [row for row in group if row["person"] == WITH_POLICY]
            best = best or [row for row in group if row["person"] == ADAPTED_ALONE] or group
            if best:
                label = f"{foot}, {best[0]['person']}"
                lines.append([_where(where), label, str(len(best)), *(_mean(best, *key) for key in keys)])
    labels = {each.key: each.label for each in ASKED} | {"falls": "falls", "speed_m_s": "speed m/s"}
    head = ["where", "foot and person", "rows", *(labels[key] for key, _ in keys)]
    return (
        f"{table(head, lines)}\n\nMeans ± SD over searches, and seeds or groups of episodes; {ran}, but for the first "
        "place, which is that of the tables above. Legs were searched, and policies trained, at 1.2 m/s and 63 kg; at "
        "other speeds the legs are the committed ones of that speed, moved as far as the search moved them at 1.2 m/s; "
        "the passive foot's springs are as much stiffer as a body's mass × height is larger, the rigid foot's toe is "
        "the same on everybody."
    )


def _where(where: Sequence[float]) -> str:
    height, mass, speed = where
    return f"{height:.2f} m, {mass:g} kg, {speed:g} m/s"


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Write the picture: each number of each foot at the first place, a point a walk."""
    first = tuple(rows[0][name] for name in WHERE)
    here = [row for row in rows if _place(row) == first]
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
