"""Tell the effect of a toe joint on a walk: free, sprung, locked or absent, on both feet, for persons adapted to each.

    springfoot study toe
    springfoot study toe learned runs/person --keep runs/toe.json

With sound ankles springs are added to the toe's own muscles, as stiff insoles are (Takahashi et al. 2016); with passive
ankles the toe's spring is all it has, as in a prosthesis (McDonald et al. 2021). All walk the same starts. They are
compared where they walk equally fast, so a price is that of the kept speed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from springfoot.arrays import NDArray
from springfoot.files.markdown import MISSING, table, text_of

from ..base.intervals import interval_of_persons, known_sign, of_persons, visible
from ..base.study import Answer, OnProgress, PersonsStudy
from ..base.walked_speeds import ASKED_SPEEDS, WALKED_SPEEDS, Row, at_walked_speeds, rows_csv
from ..feet.both_feet import both, braced
from ..feet.told_apart import gain_words
from .condition_effects import Effect, Measured, by_condition, change, difference
from .effect_experiments import LOCKED_TOE
from .effect_numbers import EFFECT_NUMBERS, FIBRE, episode_walks, walked_rows
from .effects import published_effects, sign_is

TOE_FREE = "free"
TOE_LOCKED = "locked"
TOE_ABSENT = "absent"
ADDED = (28.0, 84.0, 168.0, LOCKED_TOE)
"""Stiffness of springs beside a sound toe [N m/rad]: its own 28 (Takahashi et al. 2016: × 2 to × 4), about the stiffest
that the package's person learned with, and one that all but locks it."""
PASSIVE = (0.0, 20.0, 60.0)
"""Stiffness of a passive foot's toe [N m/rad], up to the flexible one of McDonald et al. 2021."""


class Toe(NamedTuple):
    """A toe of both feet."""

    ankles: str
    """Ankles it is walked with: `SOUND_ANKLES` or `PASSIVE_ANKLES`."""
    toe: str
    """The toe in words."""


SOUND_ANKLES = "sound ankles"
PASSIVE_ANKLES = "passive ankles"
TOES: dict[Toe, Mapping[str, Any]] = {
    Toe(SOUND_ANKLES, TOE_FREE): {},
    **{Toe(SOUND_ANKLES, f"spring of {k:g}"): both(braced(toe_stiffness=k)) for k in ADDED},
    Toe(SOUND_ANKLES, TOE_LOCKED): both("rigid_toe"),
    Toe(SOUND_ANKLES, TOE_ABSENT): both("no_toe"),
    **{
        Toe(PASSIVE_ANKLES, f"spring of {k:g}" if k else TOE_FREE): both({"kind": "passive", "toe_stiffness": k})
        for k in PASSIVE
    },
    Toe(PASSIVE_ANKLES, TOE_LOCKED): both({"kind": "passive", "toe_stiffness": LOCKED_TOE}),
}
"""Toe -> settings that differ from the sound walk."""
AGAINST = {SOUND_ANKLES: TOE_FREE, PASSIVE_ANKLES: TOE_LOCKED}
"""Ankles -> toe that the others with them are compared with: on passive ones nobody walks with a free toe."""
FOOT_WORK = "ankle_toe_positive_J_kg"
"""Number: positive work of ankle and toe in a stride."""
NUMBERS = {
    "push_off_J_kg": ("CoM push-off, J/kg", ".3f"),
    FOOT_WORK: ("ankle and toe, positive work, J/kg", ".3f"),
    "collision_J_kg": ("collision, J/kg", ".3f"),
    FIBRE: ("fibre work, J/kg/m", ".2f"),
    "knee_loading_deg": ("knee, loading, °", ".1f"),
    "knee_swing_deg": ("knee, swing, °", ".1f"),
    "knee_moment_Nm_kg": ("knee moment, N·m/kg", ".2f"),
}
"""Number of the table -> its heading and format."""
BESIDE = {
    "toe_pushoff": change(FOOT_WORK, Toe(PASSIVE_ANKLES, "spring of 60"), Toe(PASSIVE_ANKLES, TOE_LOCKED)),
    "toe_com_pushoff": change("push_off_J_kg", Toe(PASSIVE_ANKLES, "spring of 60"), Toe(PASSIVE_ANKLES, TOE_LOCKED)),
    "stiff_foot_cost": change(FIBRE, Toe(SOUND_ANKLES, "spring of 84"), Toe(SOUND_ANKLES, TOE_FREE)),
    "stiff_foot_loss": change("toe_negative_J_kg", Toe(SOUND_ANKLES, "spring of 84"), Toe(SOUND_ANKLES, TOE_FREE)),
    "stiff_foot_force": change("ankle_moment_Nm_kg", Toe(SOUND_ANKLES, "spring of 84"), Toe(SOUND_ANKLES, TOE_FREE)),
}
"""Effect of docs/effects.csv on a toe on level ground -> the same of both feet here [%]."""
COMMAND = 1.2
"""Commanded speed of the walked speed that the table tells [m/s]."""


@dataclass(frozen=True, kw_only=True)
class ToeJoint(PersonsStudy):
    """Walk persons with toes free, sprung, locked and absent, and compare work, price and knee at equal speed."""

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return len(self.persons) * len(TOES) * len(self._commanded_speeds()) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every person on every toe at every commanded speed; compare the toes at equal walked speed."""
        under = episode_walks(self)
        asked = [
            (toe, {**given, "speed": speed}) for (toe, given), speed in product(TOES.items(), self._commanded_speeds())
        ]
        walks = {person: list(map(with_foot, walked_rows(under, person, asked, progress))) for person in self.persons}
        speeds = (0.9,) if self.quick else WALKED_SPEEDS
        even = {speed: {person: toes_at_speed(speed, own) for person, own in walks.items()} for speed in speeds}
        compared = [row for speed, measured in even.items() for row in compared_rows(speed, measured)]
        shown = speeds[len(speeds) // 2]
        beside = [row for speed, measured in even.items() for row in beside_rows(speed, measured)]
        command = COMMAND if COMMAND in self._commanded_speeds() else max(self._commanded_speeds())
        files = {
            "toe.csv": rows_csv(compared),
            "published.csv": rows_csv(beside),
            "walks.csv": rows_csv([_csv_row(person, row) for person, own in walks.items() for row in own]),
        }
        everyone = [row for own in walks.values() for row in own]
        parts = [
            f"**{verdict(compared, beside, shown)}**",
            toe_table(compared, everyone, shown, command),
            beside_table([row for row in beside if row["speed_m_s"] == shown]),
            self._note(shown),
        ]
        return Answer(text="\n\n".join(parts), files=files)

    def _note(self, shown: float) -> str:
        """Return the paragraph below the tables, which show the toes at the walked speed `shown` [m/s]."""
        asked = ", ".join(f"{speed:g}" for speed in self._commanded_speeds())
        return (
            f"Both feet, walking {shown:g} m/s; in brackets the difference from the free toe, with passive ankles from "
            "the locked one, and its 95 % interval over persons: of one person over its starts, which "
            "say nothing of others. Springs in N·m/rad, at a sound toe beside its muscles. "
            f"Persons: {', '.join(self.persons)}; {self.what_ran} of each toe and commanded speed, {asked} m/s; falls "
            "are of all. People's effects are of docs/effects.csv; McDonald's people had one such foot. Persons of the "
            "package learned with locked and absent toes, passive feet, and springs of 10 to 180 beside the toe: where "
            f"locked is far from a spring of 1000, suspect the person, not the toe. {gain_words('rigid_toe', 'no_toe')}"
        )

    def _commanded_speeds(self) -> Sequence[float]:
        """Return the commanded speeds [m/s]."""
        return ASKED_SPEEDS[:2] if self.quick else ASKED_SPEEDS


def with_foot(row: Row) -> dict[str, Any]:
    """Return a row of `walked_rows` with the number `FOOT_WORK` added; None if the work of ankle or toe is."""
    parts = [row[f"{joint}_positive_J_kg"] for joint in ("ankle", "toe")]
    return {**row, FOOT_WORK: None if None in parts else sum(parts)}


def toes_at_speed(speed: float, walks: Sequence[Row]) -> Measured:
    """Return a person's numbers by toe and episode, interpolated between its walks to a walked `speed` [m/s]."""
    names = (*EFFECT_NUMBERS, FOOT_WORK)
    return by_condition(at_walked_speeds(walks, ("condition", "episode"), (speed,), names), TOES, names)


def compared_rows(speed: float, measured: Mapping[str, Measured]) -> list[dict[str, Any]]:
    """Return a row for each toe and number of `NUMBERS` at a walked `speed` [m/s].

    `measured` is person -> numbers of `toes_at_speed`. A row has the number's mean, and the numbers of
    `_paired_numbers` for the difference from the toe that it is compared with (`AGAINST`), also in percent; None
    without an episode in which both have the number.
    """
    rows = []
    for toe, number in product(TOES, NUMBERS):
        against = toe._replace(toe=AGAINST[toe.ankles])
        apart = difference(number, toe, against)
        relative = change(number, toe, against)
        row = {**toe._asdict(), "speed_m_s": speed, "number": number}
        row |= {"mean": _mean_over_persons(lambda numbers, toe=toe, number=number: numbers[toe][number], measured)}
        percent = _mean_over_persons(relative, measured)
        rows.append(row | _paired_numbers(apart, measured) | {"percent": percent})
    return rows


def beside_rows(speed: float, measured: Mapping[str, Measured]) -> list[dict[str, Any]]:
    """Return a row for each published effect that stands beside those compared (`BESIDE`), at a walked `speed` [m/s]:
    as published, as here [%], and the agreement of the signs (`sign_is`). `measured` as in `compared_rows`."""
    published = {row["name"]: row for row in published_effects()}
    rows = []
    for name, effect in BESIDE.items():
        paired = _paired_numbers(effect, measured)
        of_people = {key: published[name][key] or None for key in ("source", "sign", "size", "unit")}
        sign = sign_is(published[name]["sign"], known_sign([_finite_values(effect, own) for own in measured.values()]))
        rows.append(
            {"effect": name, **of_people, "speed_m_s": speed, **paired, "sign_is": sign if paired["pairs"] else None}
        )
    return rows


def _paired_numbers(effect: Effect, measured: Mapping[str, Measured]) -> dict[str, Any]:
    """Return the mean of an effect over persons (of one person over its pairs, an episode under both conditions), its
    95 % interval, the smallest effect that so many would show (`visible`), the number of pairs, and for several persons
    the mean of each."""
    values = {person: _finite_values(effect, numbers) for person, numbers in measured.items()}
    sample = of_persons(list(values.values()))
    low, high = interval_of_persons(list(values.values())) if len(sample) > 1 else (None, None)
    row = {"difference": _mean(sample), "low": low, "high": high, "visible": visible(sample)}
    own = {person: _mean(of_person) for person, of_person in values.items()}
    return row | {"pairs": sum(map(len, values.values()))} | (own if len(own) > 1 else {})


def _mean_over_persons(effect: Effect, measured: Mapping[str, Measured]) -> float | None:
    """Return the mean over persons of an effect's finite values; None without any."""
    return _mean(of_persons([_finite_values(effect, numbers) for numbers in measured.values()]))


def _finite_values(effect: Effect, numbers: Measured) -> NDArray:
    """Return the finite values (pairs,) of an effect over a person's episodes; the others are left out."""
    with np.errstate(invalid="ignore", divide="ignore"):  # a number that is 0, such as the work of a locked toe
        values = effect(numbers)
    return values[np.isfinite(values)]


def _mean(values: NDArray) -> float | None:
    """Return the mean of values; None without any."""
    return float(values.mean()) if len(values) else None


def _csv_row(person: str, row: Row) -> dict[str, Any]:
    """Return a row of `walked_rows` for walks.csv: person and toe first, then the rest."""
    return {"person": person, **row["condition"]._asdict(), **{k: v for k, v in row.items() if k != "condition"}}


def verdict(compared: Sequence[Row], beside: Sequence[Row], speed: float) -> str:
    """Return a sentence with the changes by locked and absent toes at a walked `speed` [m/s], and with the number of
    published effects with the same sign here.

    `compared` are rows of `compared_rows`, `beside` of `beside_rows`.
    """
    told = []
    for toe in (TOE_LOCKED, TOE_ABSENT):
        here = {row["number"]: row for row in compared if _is_toe(row, Toe(SOUND_ANKLES, toe), speed)}
        changes = [
            f"{words} {text_of(here[number]['percent'], '+.0f')} %"
            for number, words in (("push_off_J_kg", "push-off"), ("collision_J_kg", "collision"), (FIBRE, "fibre work"))
        ]
        told.append(f"a toe that is {toe} changes {', '.join(changes)}")
    signs = [row["sign_is"] for row in beside if row["speed_m_s"] == speed]
    return (
        f"Walking {speed:g} m/s, {'; '.join(told)}, against the free toe; of {len(signs)} published effects "
        f"{signs.count('right')} have the same sign here."
    )


def _is_toe(row: Row, toe: Toe, speed: float) -> bool:
    """Return True for a row of `compared_rows` of this toe and walked speed."""
    return (row["ankles"], row["toe"], row["speed_m_s"]) == (*toe, speed)


def toe_table(compared: Sequence[Row], walks: Sequence[Row], speed: float, command: float) -> str:
    """Return the Markdown table of the toes: falls, the mean speed walked at `command` [m/s], and `NUMBERS` at a walked
    `speed` [m/s] with their differences.

    `compared` are rows of `compared_rows`, `walks` rows of `with_foot` of all persons.
    """
    lines = []
    for toe in TOES:
        own = [row for row in walks if row["condition"] == toe]
        falls = f"{sum(int(row['falls']) for row in own)} of {len(own)}"
        walked = [row["walked_m_s"] for row in own if row["speed_m_s"] == command and row["walked_m_s"] is not None]
        here = {row["number"]: row for row in compared if _is_toe(row, toe, speed)}
        cells = [_cell(here[number], form) for number, (_, form) in NUMBERS.items()]
        lines.append([", ".join(toe), falls, text_of(_mean(np.array(walked)), ".2f"), *cells])
    return table(["toe", "falls", f"walked at {command:g} m/s", *(words for words, _ in NUMBERS.values())], lines)


def _cell(row: Row, form: str) -> str:
    """Return the mean of a row of `compared_rows`, and in brackets its difference from the toe that it is compared
    with, with the interval."""
    if row["toe"] == AGAINST[row["ankles"]] or row["difference"] is None:
        return text_of(row["mean"], form)
    ends = "" if row["low"] is None else f" [{row['low']:+{form}}, {row['high']:+{form}}]"
    return f"{text_of(row['mean'], form)} ({row['difference']:+{form}}{ends})"


def beside_table(beside: Sequence[Row]) -> str:
    """Return the Markdown table of published effects beside those here, from rows of `beside_rows`."""
    lines = []
    for row in beside:
        ends = "" if row["low"] is None else f" ({row['low']:+.1f} to {row['high']:+.1f})"
        people = f"{row['size']} {row['unit']}" if row["size"] else row["sign"]
        here = f"{text_of(row['difference'], '+.1f')}{ends}"
        lines.append([row["effect"], row["source"], people, here, row["sign_is"] or MISSING])
    return table(["effect", "measured by", "people", "here, %", "sign"], lines)
