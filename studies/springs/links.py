"""Compare two classes of stiffness, one within the other, on the same episodes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from springfoot.arrays import NDArray
from springfoot.files.markdown import MISSING, table, text_of

from ..base.intervals import LEVEL, interval_of_persons, of_persons, paired_p, share_interval, visible

Pair = tuple[Mapping[str, Sequence[Any]], Mapping[str, Sequence[Any]]]
"""Walks of one person's episodes with the inner and with the outer class: `fell`, `speed_m_s`, and by each `Aim` its
number, None where it could not be measured, as lists with an entry for each episode."""
Aim = Literal["fibre", "likeness"]
"""Aim of a search: least fibre work a metre; least mean over joints of the angles' rms from people's mean."""
FOOT_WORK = "foot work"
"""Net work of an adaptive right foot's ankle and toe in a stride, > 0 where it gives more than it takes."""
FOOT_TAKES = "foot takes"
"""Work that the same foot takes in a stride, the negative part."""
ALL_EFFORT = "effort"
"""All of the effort (`springfoot.gait.plan.Effort.total`)."""
BESIDE_AIM = (ALL_EFFORT, FOOT_WORK, FOOT_TAKES)
"""Numbers that are compared beside the aim where an adaptive foot has the stiffness."""
UNIT_OF_NUMBER: dict[str, str] = {
    **dict(zip(get_args(Aim), ("J/kg/m", "°"), strict=True)),
    **dict(zip(BESIDE_AIM, ("-", "J/kg", "J/kg"), strict=True)),
}
"""Aim, or one of `BESIDE_AIM` -> unit of its number."""
UNDISTURBED_WALK = "undisturbed"
"""Condition without pushes, on even ground, in words."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """Comparison of an outer class with the inner one on the same episodes, for one aim and condition."""

    person: str
    """Person, or persons in a word."""
    aim: str
    """Aim of both searches."""
    inner: str
    """Name of the inner class."""
    outer: str
    """Name of the outer class."""
    condition: str
    """Condition in words."""
    episodes: int
    """Number of episodes, of all persons."""
    inner_mean: float | None
    """Aim's number with the inner class, mean of the episodes in which both walk to the end, or of persons' means
    (`of_persons`); None without any."""
    difference: float | None
    """Outer less inner, mean of the same; negative where the outer is better."""
    low: float | None
    """Lower end of its 95 % interval."""
    high: float | None
    """Upper end."""
    visible: float | None
    """Smallest difference that such an interval sees with the chance `POWER`; None for a single episode."""
    speed_m_s: float | None
    """Mean speed of the inner class [m/s]."""
    speed_difference_m_s: float | None
    """Outer less inner [m/s]."""
    inner_falls: int
    """Episodes in which the inner class falls."""
    inner_falls_low: float
    """Lower end of the 95 % interval of its share of falls [0..1]."""
    inner_falls_high: float
    """Upper end."""
    outer_falls: int
    """The same of the outer class."""
    outer_falls_low: float
    outer_falls_high: float
    falls_p: float
    """p of McNemar's exact test that both fall equally often."""


def compared(person: str, aim: str, names: tuple[str, str], condition: str, pairs: Sequence[Pair]) -> Link:
    """Return the comparison of two classes with the `names` (inner, outer), from a pair of each person's walks of the
    same episodes.

    Numbers are of the episodes that both classes walk to the end; of several persons means count (`of_persons`).
    """
    inner, outer, inner_speed, outer_speed = zip(*(_walked_by_both(aim, *pair) for pair in pairs), strict=True)
    numbers: dict[str, float | None] = dict.fromkeys(
        ("inner_mean", "difference", "low", "high", "visible", "speed_m_s", "speed_difference_m_s")
    )
    if any(map(len, inner)):
        differences = [after - before for before, after in zip(inner, outer, strict=True)]
        numbers |= zip(("low", "high"), interval_of_persons(differences), strict=True)
        numbers |= {
            "inner_mean": float(of_persons(inner).mean()),
            "difference": float(of_persons(differences).mean()),
            "visible": visible(of_persons(differences)),
            "speed_m_s": float(of_persons(inner_speed).mean()),
            "speed_difference_m_s": float(of_persons(outer_speed).mean() - of_persons(inner_speed).mean()),
        }
    falls: dict[str, Any] = {}
    fell = {
        name: np.concatenate([np.array(pair[index]["fell"], bool) for pair in pairs])
        for index, name in enumerate(("inner", "outer"))
    }
    for name, of_class in fell.items():
        low, high = share_interval(int(of_class.sum()), len(of_class))
        falls |= {f"{name}_falls": int(of_class.sum()), f"{name}_falls_low": low, f"{name}_falls_high": high}
    return Link(
        person=person,
        aim=aim,
        inner=names[0],
        outer=names[1],
        condition=condition,
        episodes=len(fell["inner"]),
        falls_p=paired_p(fell["inner"], fell["outer"]),
        **numbers,
        **falls,
    )


def _walked_by_both(
    aim: str, inner: Mapping[str, Sequence[Any]], outer: Mapping[str, Sequence[Any]]
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Return the aim's number with the inner and with the outer class, and both speeds, each (n,), of the n episodes of
    a `Pair` that both walk to the end."""
    both = [
        index
        for index, pair in enumerate(zip(inner[aim], outer[aim], strict=True))
        if None not in pair and not (inner["fell"][index] or outer["fell"][index])
    ]

    def values(walks: Mapping[str, Sequence[Any]], name: str) -> NDArray:
        """Return the numbers `name` (n,) of these episodes."""
        return np.array([walks[name][index] for index in both], float)

    return values(inner, aim), values(outer, aim), values(inner, "speed_m_s"), values(outer, "speed_m_s")


def fewest_falls(episodes: int) -> int | None:
    """Return the least number of `episodes` that McNemar's test shows as a difference if one class alone falls in them;
    None if it shows none."""
    for alone in range(1, episodes + 1):
        fell = np.arange(episodes) < alone
        if paired_p(fell, np.zeros(episodes, bool)) < 1.0 - LEVEL:
            return alone
    return None


def verdict(links: Sequence[Link]) -> str:
    """Return sentences: for each aim the links at which the outer class is better undisturbed, and the links at which
    falls differ."""
    sentences = []
    for aim in dict.fromkeys(link.aim for link in links):
        here = [link for link in links if link.aim == aim and link.condition == UNDISTURBED_WALK]
        seen = [link for link in here if link.high is not None and link.high < 0.0]
        gains = [
            f"{link.inner} → {link.outer} {link.difference:+.3f} [{link.low:.3f}, {link.high:.3f}] "
            f"{UNIT_OF_NUMBER[aim]} ({100 * link.difference / link.inner_mean:+.1f} %)"
            for link in seen
            if link.difference is not None and link.inner_mean is not None
        ]
        others = [f"{link.inner} → {link.outer}" for link in here if link not in seen]
        better = f"better than the class within: {', '.join(gains)}" if gains else "none is better"
        rest = f"; not better: {', '.join(others)}" if gains and others else ""
        sentences.append(f"For {aim}, undisturbed, {better}{rest}.")
    fewer = [
        f"{link.outer} ({link.aim}, {link.condition}: {link.inner_falls} to {link.outer_falls} of {link.episodes})"
        for link in links
        if link.falls_p < 1.0 - LEVEL
    ]
    sentences.append(f"Falls differ {'with ' + ', '.join(fewer) if fewer else 'at no link'}.")
    return " ".join(sentences)


def links_table(links: Sequence[Link]) -> str:
    """Return the Markdown table of one aim's links, a line each, with a column of falls for each condition."""
    conditions = list(dict.fromkeys(link.condition for link in links))
    lines = []
    for names in dict.fromkeys((link.inner, link.outer) for link in links):
        here = {link.condition: link for link in links if (link.inner, link.outer) == names}
        level = here[conditions[0]]
        falls = [f"{here[name].inner_falls}, {here[name].outer_falls} of {here[name].episodes}" for name in conditions]
        lines.append([" → ".join(names), text_of(level.inner_mean, ".2f"), _difference(level), *falls])
    unit = UNIT_OF_NUMBER[links[0].aim]
    return table(["classes", f"inner, {unit}", f"outer less inner, {unit}", *conditions], lines)


def _difference(link: Link) -> str:
    """Return the difference of a link with its interval and the smallest visible one as text."""
    if link.difference is None:
        return MISSING
    seen = text_of(link.visible, ".3f")
    return f"{link.difference:+.3f} [{link.low:+.3f}, {link.high:+.3f}] ({seen})"
