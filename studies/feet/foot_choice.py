"""Walk learned persons on feet of the user's choice, and tell which foot takes least.

    springfoot feet --height 1.80 --mass 80 --speed 1.1 --calf 0.25 --spring 0 2 4 6 9 12
    springfoot feet --side right --foot intact --foot rigid --foot my_foot.csv

All persons walk the same episodes on all feet, undisturbed at two commanded speeds, and pushed.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import ceil
from os.path import isfile, realpath
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure

from springfoot.agents.policies import SHIPPED, PolicyFunction
from springfoot.arrays import NDArray
from springfoot.envs import BipedSettings
from springfoot.envs.settings import FootSetting, body_of, foot_setting, settings_from
from springfoot.errors import SpringfootError, require_number, require_within
from springfoot.evaluation.numbers import Gait, effort_numbers, measure
from springfoot.evaluation.page import foot_words, write_page
from springfoot.evaluation.recording import WARM_UP, Recording, record_feet
from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, table, text_of
from springfoot.gait.plan import PLAN_SPEED_RANGE

from ..base.adapting_persons import person_and_settings
from ..base.flags import read_foot_flag
from ..base.study import QUICK_NOTE, Answer, OnProgress, WalkingStudy
from ..base.walked_speeds import TWO_PRICES, Row, rows_csv
from .foot_numbers import numbers_of_feet
from .orthosis import braced_calf
from .told_apart import MOST_ALIKE, common_speed, comparison, difference, gain_of, gain_words, price_at, verdict

MOST_FEET = 8
"""Feet that the colours of a report tell apart."""
LEAST_SECONDS = 2 * WARM_UP
"""Shortest episode [s]; chosen: the first `WARM_UP` seconds do not count, and strides must follow."""
SIDES_OF = {"left": ("left_foot",), "right": ("right_foot",), "both": ("left_foot", "right_foot")}
"""Side -> settings of its feet."""
OTHER_SPEED = 0.15
"""How much slower the second walk is asked for, as a share: walks with hindrances are slower than asked for."""
LEAST_SPEED = ceil(100.0 * PLAN_SPEED_RANGE[0] / (1.0 - OTHER_SPEED)) / 100.0
"""Least speed to ask for [m/s], rounded up: the slower walk is planned too."""
PRICE_NAMES = dict(zip(TWO_PRICES, ("fibre work", "effort"), strict=True))
"""Column of a price -> its name."""
WHICH_PRICE = "Where the two differ, follow fibre work: its changes are held against people's, effort's are not."
CANNOT_SAY = """What this cannot say:

- It is a body in a plane: nothing here is about comfort, pain, or balance to the side.
- The person has adapted to all feet at once; one who wears a single foot for weeks may walk cheaper on it.
- Read differences, not the price itself. A missing ankle may come out cheaper here than a sound one; people
  pay as much or more."""
"""Limits of the model."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Walk:
    """A person's walk on a foot."""

    recording: Recording
    gait: Gait

    @property
    def falls(self) -> float:
        """Return the share of episodes that fall."""
        return float((self.recording.fall_reason != "").mean())

    def prices(self, price: str) -> list[float]:
        """Return each episode's number in the column `price` of `TWO_PRICES`: fibre work [J/kg/m] or effort [-]."""
        key = {"fibre_J_kg_m": "fibre_J_kg_m", "effort": "total"}[price]
        body = body_of(self.recording.settings)
        return [effort_numbers([episode], body)[key] for episode in self.gait.tally.effort]


def _walked_speeds(walks: Sequence[Sequence[_Walk]]) -> NDArray | None:
    """Return the walked speeds (2, P, E) [m/s] of P persons in E episodes at two commanded speeds; None if an episode
    fell. `walks` has a list of persons' walks for each commanded speed."""
    if any(walk.falls for at_speed in walks for walk in at_speed):
        return None
    return np.array([[walk.gait.tally.speed for walk in at_speed] for at_speed in walks])


def _episode_prices(price: str, walks: Sequence[Sequence[_Walk]]) -> NDArray:
    """Return the prices (2, P, E) of `walks` in the column `price` of `TWO_PRICES`, axes as in `_walked_speeds`."""
    return np.array([[walk.prices(price) for walk in at_speed] for at_speed in walks])


def named_feet(values: Sequence[str]) -> dict[str, Any]:
    """Return name -> setting of the feet of `values` of a flag: kinds, JSON or files, named by their words or file.

    Raises `SpringfootError` for a value that is no foot, and for two feet of one name.
    """
    named = {}
    for words in values:
        foot = read_foot_flag(words)
        checked = foot_setting("--foot", foot)
        name = Path(words).stem if isfile(words) else foot_words(checked)
        if named.get(name, foot) != foot:
            raise SpringfootError(f"--foot: two feet are called {name!r}; give each foot once, or rename a file")
        named[name] = foot
    return named


def _spring_name(stiffness: float) -> str:
    """Return the name of a spring of a `stiffness` [N m/deg]."""
    return f"{stiffness + 0.0:g} N·m/deg"  # -0 is 0


def _refuse_repeats(flag: str, names: Sequence[str]) -> None:
    """Raise `SpringfootError` for a name that stands twice among those of a `flag`."""
    for name, count in Counter(names).items():
        if count > 1:
            raise SpringfootError(f"{flag}: {name} is given {count} times; give each once")


@dataclass(frozen=True, kw_only=True)
class FootChoice(WalkingStudy):
    """Which foot for this person? Walks learned persons on every foot, and tells which takes least.

    Give springs of an orthosis (--spring), or two to eight feet (--foot). The first is that to compare with.
    """

    height: float = 1.7
    """Height of the body [m]."""
    mass: float = 63.0
    """Mass of the body [kg]."""
    speed: float = 1.2
    """Speed that is asked for, 0.48 to 2 [m/s]; in the slower walk 15 % less."""
    side: Literal["left", "right", "both"] = "both"
    """Side on which the springs or feet are worn; the other foot is sound."""
    calf: float | None = None
    """Strength of the calf beside the springs, as a share of a sound one's, with a largest moment of 0.19 x body weight
    x height in the simulation and 0.10 x in the price; 0.1 to 0.6, None for a sound calf."""
    spring: tuple[float, ...] = ()
    """Stiffness of orthoses at the ankle, 0 to 17.45 [N m/deg], at rest at --rest-deg; 0 is a slack one."""
    rest_deg: float = 0.0
    """Rest angle of the orthoses, dorsiflexion positive [deg]."""
    foot: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="FOOT")] = ()
    """A foot, as of --right-foot: a kind, JSON, or a file; once for each foot."""
    persons: Annotated[tuple[str, ...], tyro.conf.arg(metavar="PERSON ...")] = ("learned", "learned-2", "learned-3")
    """Persons that adapt to the feet: run folders, files, or those of the package, such as `learned`."""
    push_newton: float = 100.0
    """Size of the pushes in the pushed walks [N]."""
    episodes: int = 5
    """Episodes of each person on each foot, undisturbed, and as many pushed."""
    seconds: float = 12.0
    """Length of each episode, 6 or more [s]."""

    QUICK: ClassVar[Mapping[str, Any]] = {"persons": ("learned",), "episodes": 1, "seconds": 6.0}
    REPEATABLE: ClassVar[Collection[str]] = frozenset({"--foot"})

    def check(self) -> None:
        """Refuse feet that are missing, too many or alike, and numbers out of range."""
        super().check()
        require_within("speed", self.speed, (LEAST_SPEED, PLAN_SPEED_RANGE[1]), "m/s")
        require_number("seconds", self.seconds, LEAST_SECONDS, unit="s")
        require_number("push_newton", self.push_newton, 0.0, unit="N")
        if bool(self.spring) == bool(self.foot):
            raise SpringfootError(
                "give either --spring or --foot, such as --spring 0 2 4 6 or --foot intact --foot rigid"
            )
        if not self.persons:
            raise SpringfootError("--persons: give one person at least, such as learned")
        _refuse_repeats("--spring", [_spring_name(k) for k in self.spring])
        _refuse_repeats("--foot", self.foot)
        _refuse_repeats("--persons", [name if name in SHIPPED else realpath(name) for name in self.persons])
        if self.foot and (self.calf is not None or self.rest_deg):
            raise SpringfootError("--calf and --rest-deg go with --spring; a foot of --foot has numbers of its own")
        count = len(self.feet)
        if not 2 <= count <= MOST_FEET:
            raise SpringfootError(f"give 2 to {MOST_FEET} different springs or feet, got {count}")

    @cached_property
    def feet(self) -> dict[str, Any]:
        """Return name -> setting of each foot."""
        if self.spring:
            return {
                _spring_name(k): braced_calf(1.0 if self.calf is None else self.calf, k, self.rest_deg)
                for k in self.spring
            }
        return named_feet(self.foot)

    @property
    def _worn(self) -> Mapping[str, FootSetting]:
        """Return name -> foot."""
        return {name: settings_from(left_foot=foot).left_foot for name, foot in self.feet.items()}

    @property
    def _gains(self) -> Mapping[str, float]:
        """Return name -> the share of its price that a person may gain by further training on the foot alone."""
        return {name: gain_of(foot) for name, foot in self._worn.items()}

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        return 3 * len(self.persons) * len(self.feet) * self.episodes * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Walk every person on every foot, at two commanded speeds and pushed; compare prices at one walked speed."""
        names = list(self.feet)
        given = {"height": self.height, "mass": self.mass, "speed": self.speed, "episode_seconds": self.seconds}
        persons = [person_and_settings(name, given) for name in self.persons]
        walks, slower, pushed = (
            [self._walk(*person, progress, **changed) for person in persons]
            for changed in ({}, {"speed": self.other_speed}, {"push_newton": self.push_newton})
        )
        rows = []
        for person, *own in zip(self.persons, walks, slower, pushed, strict=True):
            for name, walk, other_walk, pushed_walk in zip(names, *own, strict=True):
                falls = {"falls_other_speed": other_walk.falls, "falls_pushed": pushed_walk.falls}
                rows.append({"person": person, "foot": name, **numbers_of_feet(walk.gait, self.side), **falls})
        pairs = [[[of[index] for of in at] for at in (walks, slower)] for index in range(len(names))]
        walked = [_walked_speeds(pair) for pair in pairs]
        speed = common_speed(self.speed, walked)
        prices = {
            price: [
                None if speeds is None else price_at(speed, speeds, _episode_prices(price, pair))
                for pair, speeds in zip(pairs, walked, strict=True)
            ]
            for price in TWO_PRICES
        }
        shown = [(walk.recording, walk.gait) for walk in walks[0]]
        where = comparison(self.speed, speed, dict(zip(names, walked, strict=True)), prices[TWO_PRICES[0]])
        answer = self._answer(names, rows, prices, where)
        first = next(iter(_priced(names, prices[TWO_PRICES[0]])), None)
        parts = [answer, self._how(first, speed), CANNOT_SAY, "![Price of the walk on each foot](feet.png)"]
        files = {
            "feet.csv": rows_csv(rows),
            "prices.csv": rows_csv(self._price_rows(prices, speed)),
            "feet.png": lambda path: _draw(path, names, self.spring, prices),
            "report.html": partial(
                write_page,
                walks=shown,
                command=self.command,
                words_of=self._words_of(),
                introduction=self.introduction(answer),
            ),
        }
        return Answer(text="\n\n".join(parts), files=files)

    @property
    def other_speed(self) -> float:
        """Return the second commanded speed [m/s]."""
        return self.speed * (1.0 - OTHER_SPEED)

    def introduction(self, answer: str) -> str:
        """Return Markdown to stand above the walks of report.html: the `answer` over all persons, its limits, and the
        person of the walks."""
        first, *others = self.persons
        whose = f"{first}, the first of {len(self.persons)} persons" if others else f"{first}, the one person"
        below = f"Curves and verdicts below: {whose}."
        return "\n\n".join([*([QUICK_NOTE] if self.quick else []), answer, CANNOT_SAY, below])

    def _walk(
        self, act: PolicyFunction, settings: BipedSettings, progress: OnProgress, **changed: float
    ) -> list["_Walk"]:
        """Return a person's walk on each of `feet`, in order; `changed` settings replace those of `settings`."""
        feet = [dict.fromkeys(SIDES_OF[self.side], foot) for foot in self.feet.values()]
        settings = replace(settings, **changed)
        recordings = record_feet(act, settings, feet, name="person", progress=progress, **self.how)
        named = [replace(recording, policy=name) for recording, name in zip(recordings, self.feet, strict=True)]
        return [_Walk(recording=recording, gait=measure(recording)) for recording in named]

    def _price_rows(self, prices: Mapping[str, Sequence[NDArray | None]], speed: float) -> list[Row]:
        """Return a row for each person, foot and episode, with both prices at the walked `speed` [m/s].

        `prices` has, by column, the prices (persons, episodes) on each foot; None on a foot without a price.
        """
        return [
            {"person": person, "foot": foot, "seed": self.seed + episode, "speed_m_s": speed}
            | {
                price: None if (values := of_feet[k]) is None else values[i, episode]
                for price, of_feet in prices.items()
            }
            for i, person in enumerate(self.persons)
            for k, foot in enumerate(self.feet)
            for episode in range(self.episodes)
        ]

    def _words_of(self) -> Callable[[FootSetting], str]:
        """Return a function that puts a foot of the report in words: a spring in N·m/deg, as in the flag `--spring`."""
        if not self.spring:
            return foot_words
        beside = "" if self.calf is None else f" beside a calf of {self.calf:.0%}"
        springs = {str(foot): name + beside for name, foot in self._worn.items()}
        return lambda foot: springs.get(str(foot)) or foot_words(foot)

    def _answer(
        self, names: Sequence[str], rows: Sequence[Row], prices: Mapping[str, Sequence[NDArray | None]], where: str
    ) -> str:
        """Return the sentences on the feet and the table; `where` tells the speed of the comparison, and feet without a
        price."""
        priced = {price: _priced(names, of_feet) for price, of_feet in prices.items()}
        first = next(iter(priced[TWO_PRICES[0]]), None)
        lines = []
        for name in names:
            here = [row for row in rows if row["foot"] == name]
            lines.append(
                [
                    name,
                    " / ".join(_share(here, key) for key in ("falls", "falls_other_speed", "falls_pushed")),
                    _mean(here, "speed_m_s", ".2f"),
                    *(cell for of_price in priced.values() for cell in price_cells(of_price, name)),
                    *(_mean(here, key, pattern) for key, pattern in _COLUMNS.values()),
                ]
            )
        head = [
            "foot",
            "falls / other speed / pushed",
            "walked, m/s",
            "fibre work, J/kg/m",
            "change",
            "effort",
            "change",
            *_COLUMNS,
        ]
        answer = f"**{where}**"
        if first:
            fibre_work, effort = (verdict(words, priced[price], self._gains) for price, words in PRICE_NAMES.items())
            answer = f"**{where} {fibre_work}** {effort} {WHICH_PRICE}"
        return f"{answer}\n\n{table(head, lines)}"

    def _how(self, first: str | None, speed: float) -> str:
        """Return the paragraph on how the table was made: prices at a walked `speed` [m/s], changes against the foot
        `first`, the first with a price; None if no foot has one."""
        calf = "" if self.calf is None else f", calves of {self.calf:.0%}"
        worn = "both feet" if self.side == "both" else f"the {self.side} foot"
        several = len(self.persons) > 1
        prices = (
            ""
            if first is None
            else f"Prices in this table are at {speed:.2f} m/s walked, the nearest to the asked speed that all walk on "
            "the feet that have a price; prices.csv has them by episode, feet.csv those of the speed that each walks. "
            f"Changes are against {first}{', with 95 % intervals over persons' if several else ''}. "
        )
        apart = (
            f"{gain_words(*dict.fromkeys(foot.kind for foot in self._worn.values()))} Told apart are such feet with an "
            f"interval without 0 and one sign of all persons; alike are those whose interval lies within "
            f"{100 * MOST_ALIKE:g} %, the others uncertain."
            if several
            else "One person has no interval, so that no feet are told apart."
        )
        return (
            f"{self.height:g} m, {self.mass:g} kg{calf}, on {worn}, asked for {self.speed:g} m/s. "
            f"Persons: {', '.join(self.persons)}. Each walks on each foot {self.what_ran}, as much at "
            f"{self.other_speed:.3g} m/s, and as much pushed by ±{self.push_newton:g} N. {prices}"
            f"{apart} A foot on which somebody falls or does not reach the speed has no price. "
            "Push-off, of ankle and toe, is of the side that wears the foot; the largest 10 ms of force "
            "in a stride and moments are of the other side, the left one if both wear it."
        )


def price_figure(
    names: Sequence[str], springs: Sequence[float], prices: Mapping[str, Sequence[NDArray | None]]
) -> Figure:
    """Return a drawing of both prices of every foot: pale for each person, and their mean; words where no foot has one.

    Args:
        names: names of the feet.
        springs: their springs [N m/deg]; none for other feet.
        prices: column of a price -> prices (persons, episodes) on each foot; None on a foot without a price.
    """
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    places = np.array(springs) if springs else np.arange(len(names))
    for ax, (price, words) in zip(figure.subplots(1, len(PRICE_NAMES)), PRICE_NAMES.items(), strict=True):
        walked = [(x, values) for x, values in zip(places, prices[price], strict=True) if values is not None]
        if walked:
            x = [place for place, _ in walked]
            by_person = np.array([values.mean(1) for _, values in walked]).T
            line = "-" if springs else "none"  # feet are in no order
            for values in by_person:
                ax.plot(x, values, "o", ls=line, color="#0b6e8f", ms=3, lw=0.8, alpha=0.4)
            ax.plot(x, by_person.mean(0), "o", ls=line, color="#0b6e8f", ms=5, lw=1.6)
        else:
            ax.text(0.5, 0.5, "no foot has a price", transform=ax.transAxes, ha="center", va="center")
            ax.set(xticks=[], yticks=[])
        ax.set_title(f"{words}, {'J/kg/m' if price == TWO_PRICES[0] else 'dimensionless'}")
        if springs:
            ax.set_xlabel("spring (N·m/deg)")
        else:
            ax.set_xticks(places, names, rotation=20, ha="right")
        ax.grid(color="#ededed", lw=0.6)
    return figure


def _draw(path: Path, *which: Any) -> None:
    """Save the drawing of `price_figure`, with its arguments `which`, as a picture."""
    with matplotlib.rc_context(STYLE):
        price_figure(*which).savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})


_COLUMNS = {
    "push-off, J/kg": ("push_off_J_kg", ".2f"),
    "largest force, BW": ("sound_peak_bw", ".2f"),
    "hip, N·m/kg": ("hip_moment_Nm_kg", ".2f"),
    "knee, N·m/kg": ("knee_moment_Nm_kg", ".2f"),
    "step asymmetry": ("step_asymmetry", ".0%"),
}
"""Heading -> column and format of the numbers that are told without an interval."""


def _priced(names: Sequence[str], prices: Sequence[NDArray | None]) -> dict[str, NDArray]:
    """Return name -> prices (persons, episodes) of the feet that have some."""
    return {name: values for name, values in zip(names, prices, strict=True) if values is not None}


def price_cells(priced: Mapping[str, NDArray], name: str) -> tuple[str, str]:
    """Return the mean price of the foot `name`, and its change against the first of those `priced`, in words; dashes
    without one."""
    if name not in priced:
        return MISSING, MISSING
    first = next(iter(priced))
    change = MISSING if name == first else difference(priced[name], priced[first]).text
    return f"{priced[name].mean():.2f}", change


def _mean(rows: Sequence[Row], key: str, pattern: str) -> str:
    """Return the mean of the column `key` over `rows`, one for each person; a dash if a value is None."""
    values = [row[key] for row in rows]
    return text_of(None if None in values else float(np.mean(values)), pattern)


def _share(rows: Sequence[Row], key: str) -> str:
    """Return the mean of the share in the column `key` over `rows`, one for each person, in percent."""
    return f"{float(np.mean([row[key] for row in rows])):.0%}"
