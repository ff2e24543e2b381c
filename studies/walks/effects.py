"""Hold a person against effects that laboratories measured in people: docs/effects.csv, a row an effect.

    springfoot study effects
    springfoot study effects learned runs/person --effects exo_saving rough_cost

Rows, signs, sizes and tolerances were written before they were walked here; the price of energy is fibre work, with all
of the effort beside it. Conditions of an effect walk the same episodes, so each episode gives a value of the effect.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import tyro

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, perhaps
from springfoot.files.markdown import MISSING, span_text, table
from springfoot.files.text_table import read_csv

from ..base.intervals import LEAST_AGREEING, interval_of_persons, known_sign, of_persons
from ..base.study import Answer, OnProgress, PersonsStudy
from ..base.walked_speeds import Row, at_walked_speeds, rows_csv
from .condition_effects import Measured, by_condition
from .effect_experiments import EXPERIMENTS, Experiment
from .effect_numbers import ALL_EFFORT, EFFECT_NUMBERS, FIBRE, episode_walks, walked_rows

PUBLISHED_EFFECTS = Path("docs", "effects.csv")
"""Table of published effects, in the repository and in the package."""
AROUND = (-0.15, 0.0, 0.15)
"""Commanded speeds less the walked one at which conditions are compared [m/s]; a learned person misses the command by
0.13 m/s in one walk of twenty."""
_RIGHT = "right"
UNCLEAR = "unclear"
"""Sign of an effect that is not known (`known_sign`)."""


@dataclass(frozen=True, kw_only=True)
class Effects(PersonsStudy):
    """Walk persons under the conditions of published effects, and hold sign and size against those in people."""

    effects: Annotated[tuple[str, ...], tyro.conf.arg(metavar="EFFECT ...")] = ()
    """Names of effects to walk, those of docs/effects.csv; none for all."""
    QUICK: ClassVar[Mapping[str, Any]] = {**PersonsStudy.QUICK, "effects": ("slope_up", "stay_propulsion")}

    def check(self) -> None:
        """Refuse counts and lengths out of range, and unknown effects."""
        super().check()
        for name in self.effects:
            if name not in EXPERIMENTS:
                raise SpringfootError(
                    f"no effect {name!r:.60}; docs/effects.csv lists them{perhaps(name, list(EXPERIMENTS))}"
                )

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        chosen = [EXPERIMENTS[name] for name in self.effects or EXPERIMENTS]
        walks = {str(given) for one in chosen if isinstance(one, Experiment) for _, given in walks_of(one)}
        return len(self.persons) * len(walks) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every person in the experiment of every effect; hold the measured effects against the published ones."""
        under = episode_walks(self)
        rows = []
        for published in published_effects():
            name = published["name"]
            if self.effects and name not in self.effects:
                continue
            experiment = EXPERIMENTS[name]
            walks = {}
            if isinstance(experiment, Experiment):
                walks = {person: walked_rows(under, person, walks_of(experiment), progress) for person in self.persons}
            rows.append(effect_row(published, experiment, walks))
        return Answer(text=self._text(rows), files={"effects.csv": rows_csv(rows)})

    def _text(self, rows: Sequence[Row]) -> str:
        """Return the report from rows of `effect_row`: verdict, table of the effects walked, reasons for the others."""
        not_run = [f"- {row['effect']}: {row['note'].removeprefix('not run: ')}." for row in rows if not row["run"]]
        without = [f"Not run:\n\n{chr(10).join(not_run)}"] if not_run else []
        return "\n\n".join(
            [
                f"**{verdict(rows)}**",
                effects_table([row for row in rows if row["run"]]),
                f"Persons: {', '.join(self.persons)}; {self.what_ran} of each condition. In brackets 95 % intervals "
                "over persons, of one person over its episodes. A sign is known where the interval leaves 0 out, or "
                f"where all persons, {LEAST_AGREEING} or more, have it; else it is unclear. "
                "Energy and work are compared "
                "where all conditions walk equally fast, all else at the commanded speed. effects.csv tells the rest.",
                *without,
            ]
        )


def published_effects() -> list[dict[str, str]]:
    """Return the rows of `PUBLISHED_EFFECTS`, column -> text."""
    effects = read_csv(Path(__file__).resolve().parents[2] / PUBLISHED_EFFECTS)
    return [dict(zip(effects.columns, cells, strict=True)) for _, cells in effects.rows]


def walks_of(experiment: Experiment) -> list[tuple[Any, dict[str, Any]]]:
    """Return the condition and the settings of each walk of an experiment: each condition at the commanded speed, or
    `AROUND` it where conditions are compared at one walked speed."""
    around = AROUND if experiment.walked else (0.0,)
    return [
        (condition, {"speed": round(experiment.speed + more, 6), **given})
        for (condition, given), more in product(experiment.conditions.items(), around)
    ]


def measured_of(experiment: Experiment, walks: Sequence[Row]) -> Measured:
    """Return the numbers of each condition and episode from one person's rows of `walked_rows`.

    With `experiment.walked` they are interpolated to one walked speed.
    """
    if experiment.walked:
        speed = experiment.speed if experiment.at is None else experiment.at
        walks = at_walked_speeds(walks, ("condition", "episode"), (speed,), EFFECT_NUMBERS)
    return by_condition(walks, experiment.conditions, EFFECT_NUMBERS)


def effect_row(
    published: Mapping[str, str], experiment: Experiment | str, walks: Mapping[str, Sequence[Row]]
) -> dict[str, Any]:
    """Return the row of an effect: published, measured, and how the two agree.

    `experiment` says how the effect is walked, or, as text, why it is not. `walks` is person -> rows of `walked_rows`,
    empty without a walk. An episode counts if no condition falls in it.
    """
    columns = ("seen", "people", "sign", "size", "unit", "tolerance")
    row: dict[str, Any] = {"effect": published["name"], **{name: published[name] or None for name in columns}}
    row |= {"run": int(not isinstance(experiment, str))}
    row |= dict.fromkeys(
        ("measured", "low", "high", "effort", "sign_is", "size_within", "pairs", "walked_m_s", "falls")
    )
    if isinstance(experiment, str):
        return row | {"beside": None, "note": experiment} | (dict.fromkeys(walks) if len(walks) > 1 else {})
    measured = {person: measured_of(experiment, own) for person, own in walks.items()}
    with np.errstate(invalid="ignore", divide="ignore"):
        values = {person: _finite_values(experiment.effect(numbers)) for person, numbers in measured.items()}
        efforts = {
            person: _finite_values(experiment.effect(_with_effort(numbers))) for person, numbers in measured.items()
        }
        beside = {
            name: _mean_text([_finite_values(effect(numbers)) for numbers in measured.values()])
            for name, effect in experiment.beside.items()
        }
    notes = [experiment.note, *_falls_by_condition(walks.values())]
    found = [person for person, own in values.items() if len(own)]
    if found:
        pairs = np.concatenate(list(values.values()))  # (pairs,), a person's episode under both conditions
        # Clauses of the published tolerance beside its range.
        clauses = {words: all(holds(measured[person]) for person in found) for words, holds in experiment.also.items()}
        row |= _agreement(published, list(values.values()), clauses)
        if len(found) < len(values):
            notes.append(f"of {len(found)} of {len(values)} persons, those with an episode that has all numbers")
        if len(pairs) < (episodes := sum(len({walk["episode"] for walk in own}) for own in walks.values())):
            notes.append(f"of {len(pairs)} of {episodes} episodes, in which all walk, and as fast")
        notes += [f"{words}: {'yes' if holds else 'no'}" for words, holds in clauses.items()]
        if any(not np.array_equal(values[person], efforts[person]) for person in values):  # the effect is of energy
            row["effort"] = _mean(list(efforts.values()))
    else:
        notes.append(
            ": ".join(["no episode has all numbers", *_conditions_without_numbers(measured.values(), walks.values())])
        )
    row |= {
        "walked_m_s": _walked_speed_range(measured.values()),
        "falls": _falls_text([one for own in walks.values() for one in own]),
    }
    row |= {"beside": "; ".join(f"{name} {text}" for name, text in beside.items()) or None}
    row |= {"note": "; ".join(filter(None, notes)) or None}
    return row | ({person: _mean([own]) for person, own in values.items()} if len(values) > 1 else {})


def _agreement(published: Mapping[str, str], values: Sequence[NDArray], clauses: Mapping[str, bool]) -> dict[str, Any]:
    """Return the effect measured, `values` (E,) of each person in its episodes: its mean, its 95 % interval, whether
    its sign is that published (`sign_is`), and whether its size is within the published tolerance (`size_within`) with
    its `clauses`."""
    sample = of_persons(values)
    low, high = interval_of_persons(values) if len(sample) > 1 else (None, None)
    mean = float(sample.mean())
    return {
        "measured": mean,
        "low": low,
        "high": high,
        "pairs": sum(map(len, values)),
        "sign_is": sign_is(published["sign"], known_sign(values)),
        "size_within": size_within(published, mean, clauses),
    }


def _with_effort(measured: Measured) -> Measured:
    """Return the numbers with all of the effort as their fibre work, so that an effect of it is one of the effort."""
    return {key: {**numbers, FIBRE: numbers[ALL_EFFORT]} for key, numbers in measured.items()}


def _finite_values(values: NDArray) -> NDArray:
    """Return the values that are finite."""
    return values[np.isfinite(values)]


def _mean(values: Sequence[NDArray]) -> float | None:
    """Return the mean of all persons' values together; None without any."""
    together = np.concatenate(values)
    return float(together.mean()) if len(together) else None


def _mean_text(values: Sequence[NDArray]) -> str:
    """Return the mean of `of_persons` as text, of several persons with its interval; a dash without any."""
    sample = of_persons(values)
    if not len(sample):
        return MISSING
    mean = _number_text(float(sample.mean()))
    if sum(1 for own in values if len(own)) < 2:
        return mean
    return f"{mean} ({' to '.join(map(_number_text, interval_of_persons(values)))})"


def _walked_speed_range(measured: Iterable[Measured]) -> str:
    """Return the least and the largest of the conditions' mean walked speeds [m/s], as in "1.10 to 1.24"; a dash
    without any. `measured` has an entry for each person."""
    of_conditions = [_finite_values(numbers["walked_m_s"]) for of_person in measured for numbers in of_person.values()]
    speeds = [float(np.mean(of_episodes)) for of_episodes in of_conditions if len(of_episodes)]
    return span_text(speeds, ".2f") if speeds else MISSING


def _conditions_without_numbers(measured: Iterable[Measured], walks: Iterable[Sequence[Row]]) -> list[str]:
    """Return a list of one sentence: the conditions in which some person has no episode with a fibre work, and the
    speeds that they walk. The list is empty without such a condition.

    `measured` and `walks` have an entry for each person.
    """
    together = [row for of_person in walks for row in of_person]
    missing = dict.fromkeys(
        condition
        for of_person in measured
        for condition, numbers in of_person.items()
        if not len(_finite_values(numbers[FIBRE]))
    )
    clauses = []
    for condition in missing:
        rows = [row for row in together if row["condition"] == condition]
        speeds = [row["walked_m_s"] for row in rows if row["walked_m_s"] is not None]
        how = f"walks {min(speeds):.2f} to {max(speeds):.2f} m/s" if speeds else "always falls"
        clauses.append(f"{_label(condition)} {how}")
    return [", ".join(clauses)] if clauses else []


def _falls_text(walks: Sequence[Row]) -> str:
    """Return the number of rows with a fall, as in "2 of 20"."""
    return f"{sum(int(walk['falls']) for walk in walks)} of {len(walks)}"


def _falls_by_condition(walks: Iterable[Sequence[Row]]) -> list[str]:
    """Return a sentence on the falls in each condition and commanded speed in which an episode falls; `walks` are rows
    of `walked_rows` for each person."""
    by_walk: dict[tuple[Any, float], list[Row]] = {}
    for own in walks:
        for walk in own:
            by_walk.setdefault((walk["condition"], walk["speed_m_s"]), []).append(walk)
    return [
        f"falls {_falls_text(rows)} in {_label(key)} at {speed:g} m/s"
        for (key, speed), rows in by_walk.items()
        if any(row["falls"] for row in rows)
    ]


def _label(key: Any) -> str:
    """Return a condition in words."""
    return " ".join(map(_label, key)) if isinstance(key, tuple) else f"{key:g}" if isinstance(key, float) else key


# Agreement ----------------------------------------------------------------------------------------------------


def sign_is(sign: str, known: int) -> str | None:
    """Return "right", "wrong" or `UNCLEAR` for an effect with the sign `known` (`known_sign`), held against the
    published `sign` + or -; None without a published sign."""
    if not sign:
        return None
    if not known:
        return UNCLEAR
    return _RIGHT if (known > 0) == (sign == "+") else "wrong"


def size_within(published: Mapping[str, str], measured: float, also: Mapping[str, bool]) -> int | None:
    """Return 1 if a measured effect is within the published tolerance, else 0; None if that is "sign only".

    `also` is, for each further clause of the tolerance, True if it holds. Raises `SpringfootError` for a clause that is
    not understood.
    """
    first, *clauses = published["tolerance"].split("; ")
    if set(clauses) != set(also):
        raise SpringfootError(f"{published['name']}: the tolerance {published['tolerance']!r} is not understood")
    if first == "sign only":
        return None
    if factor := re.fullmatch(r"within a factor of ([\d.]+)", first):
        ratio = measured / float(published["size"])
        within = 1.0 / float(factor[1]) <= ratio <= float(factor[1])
    elif ends := re.fullmatch(r"(-?[\d.]+) to (-?[\d.]+)", first):
        within = min(map(float, ends.groups())) <= measured <= max(map(float, ends.groups()))
    else:
        raise SpringfootError(f"{published['name']}: the tolerance {published['tolerance']!r} is not understood")
    return int(within and all(also.values()))


def verdict(rows: Sequence[Row]) -> str:
    """Return a sentence with the numbers of right signs and of sizes within, of effects seen before and of the others.

    An effect that was walked and has no number counts as missed.
    """
    parts = []
    for seen, words in (("yes", "seen before"), ("no", "not seen before")):
        own = [row for row in rows if row["seen"] == seen]
        walked = [row for row in own if row["run"]]
        signs = [row["sign_is"] for row in walked if row["sign"]]
        sizes = [row["size_within"] for row in walked if row["tolerance"] != "sign only"]
        parts.append(
            f"of {len(own)} effects {words}, {len(walked)} walked, signs are right in {signs.count(_RIGHT)} of "
            f"{len(signs)} (unclear {signs.count(UNCLEAR)}), sizes within in {sizes.count(1)} of {len(sizes)}"
        )
    sentence = "; ".join(parts)
    return f"{sentence[:1].upper()}{sentence[1:]}."


def effects_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table of the effects that were walked."""
    lines = []
    for row in rows:
        published = f"{row['sign'] or ''} {row['size'] or ''} {row['unit'] or ''}".strip()
        if row["size"]:
            published = f"{row['size']} {row['unit']}"
        interval = "" if row["low"] is None else f" ({_number_text(row['low'])} to {_number_text(row['high'])})"
        lines.append(
            [
                row["effect"],
                row["seen"],
                published,
                f"{_number_text(row['measured'])}{interval}",
                row["sign_is"] or MISSING,
                {1: "yes", 0: "no"}.get(row["size_within"], MISSING),
                _number_text(row["effort"]),
                row["walked_m_s"],
                row["falls"],
            ]
        )
    head = ["effect", "seen", "people", "here", "sign", "within", "by effort", "walked, m/s", "falls"]
    return table(head, lines)


def _number_text(value: float | None) -> str:
    """Return a number with three significant digits; a dash for None."""
    return MISSING if value is None else f"{value:.3g}".replace("-", "−")
