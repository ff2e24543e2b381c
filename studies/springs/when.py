"""Tell the gain of varying ankle and toe stiffness within the step, for persons that stay as they are.

    springfoot study when learned learned-2 learned-3 --keep runs/when
    springfoot study when learned learned-2 learned-3 --owner foot --aims fibre

Four classes of stiffness, each within the next (`stiffness_classes`): constant, by phase, open loop, linear reflex. At
each link the inner and the outer class go on with the same number of walks, by CMA-ES, from the best stiffness found
for the inner one; so does the constant class, whose find the inner one, after it, already knows. In the end each class
takes, of all that any search found in it or in a class within it, the stiffness that costs least on walks that no
search had. All four walk a test from further starts, and are compared episode by episode, neighbours and each with the
constant class. There are two aims, each with its own searches: least fibre work a metre, and least distance from
people. At last the reflex walks the same test with errors that reach it late.

With the owner `foot` the stiffness is that of an adaptive right foot, whose constant class is a passive foot; the
person sets that of the left one. The reflex is left out, and effort and the foot's work are compared too: what it
gives more than it takes is not the person's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import count, pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, get_args

import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure

from springfoot.arrays import NDArray
from springfoot.envs.physics import ACTION_STEP
from springfoot.envs.settings import SPRING_NUMBERS, BipedSettings
from springfoot.errors import MOST_COUNT, SpringfootError, require_count, require_number
from springfoot.evaluation.report import STYLE
from springfoot.files.writing import csv_text

from ..base.intervals import POWER
from ..base.kept import Kept, known_as
from ..base.study import Answer, OnProgress, WalkingStudy
from .class_search import TEST_SEED, Candidate, Condition, Owner, PersonsSearch
from .links import BESIDE_AIM, Aim, Link, Pair, compared, fewest_falls, links_table, verdict
from .stiffness_classes import StiffnessClass, classes_of_foot, nested_classes, widened

REFLEX_DELAYS = (2, 4)
"""Steps of 20 ms by which a reflex is late; chosen: 40 and 80 ms."""
PHASES = np.arange(200) / 200
"""Stride phases of the picture and of its table."""
EVERYONE = "all"
"""Person of the comparisons over all persons."""
NOTES: dict[Owner, str] = {
    "person": "The search for a reflex moves its gains alone. A reflex plus a network is left out. A late reflex is "
    "the same one, whose errors are of 40 or 80 ms before.",
    "foot": "The stiffness is that of an adaptive right foot, at rest at 0°; constant, it is a passive foot. Foot "
    "work: net work of its ankle and toe in a stride, which is none of fibre work; above 0 the foot gives more than it "
    "takes. Foot takes: the part of it that is negative.",
}
"""Owner of the stiffness -> sentences of the report."""
LinkName = tuple[str, tuple[str, str], str]
"""Aim or one of `BESIDE_AIM`, names of both classes, and condition in words."""
WHOLE = slice(None)
"""All entries of a vector."""
Found = tuple[str, str, StiffnessClass, NDArray]
"""Person, aim, class, and its vector that was found."""


@dataclass(frozen=True, kw_only=True)
class When(WalkingStudy):
    """Search constant, phased, open-loop and reflexive stiffness, each within the next, and tell the gain of each."""

    persons: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="PERSON ...")] = ("learned",)
    """Policies that move the person, and stay as they are: run folders, files, or those such as `learned`."""
    episodes: int = 40
    """Episodes of each person, class and condition of the test."""
    seconds: float = 6.0
    """Length of each episode."""
    generations: int = 12
    """Generations of each search of the first link; the second has half as many more, the third twice as many."""
    population: int = 10
    """Candidates of each generation; each walks one episode, pushed."""
    choosing: int = 20
    """Walks, pushed likewise, by which a class takes one of the stiffnesses found."""
    aims: tuple[Aim, ...] = get_args(Aim)
    """Aims of the searches: least fibre work, likeness, or both apart."""
    owner: Owner = "person"
    """Owner of the stiffness: both ankles and toes of the person, or an adaptive right foot."""
    damping_time: float | None = None
    """Damping over stiffness of an adaptive foot's springs [s]; None for that of muscles, with which a foot gives back
    half of what it takes."""
    pushes: tuple[float, ...] = (100.0, 200.0, 300.0)
    """Sizes of the pushes [N]; the searches have the first."""
    roughness: tuple[float, ...] = (0.01,)
    """Unevenness of the rough ground of the test [m]."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder in which costs and numbers are kept, to go on after a stop."""

    QUICK: ClassVar[dict[str, Any]] = {
        "episodes": 2,
        "seconds": 5.0,
        "generations": 1,
        "population": 2,
        "choosing": 1,
        "aims": ("fibre",),
        "pushes": (100.0,),
        "roughness": (),
        "keep": None,
    }

    def check(self) -> None:
        """Refuse counts, lengths, pushes and unevenness out of range."""
        super().check()
        for name, least in (("generations", 1), ("population", 2), ("choosing", 1)):
            require_count(name, getattr(self, name), least, MOST_COUNT)
        require_count("pushes", len(self.pushes))
        for push in self.pushes:
            require_number("pushes", push, 0.0, 1000.0, above=True, unit="N")
        for rough in self.roughness:
            require_number("roughness", rough, 0.0, 0.1, above=True, unit="m")
        if self.damping_time is not None:
            if self.owner != "foot":
                raise SpringfootError(f"damping_time needs owner 'foot', got {self.owner!r}")
            allowed = SPRING_NUMBERS["damping_time"]
            require_number("damping_time", self.damping_time, allowed.low, allowed.high, unit=allowed.unit)
        if self.keep is not None and self.keep.is_file():
            raise SpringfootError(f"keep must be a folder, {self.keep} is a file")

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        links = len(self._classes) - 1
        searches = [0, 0, 0] + [link for link in range(1, links) for _ in range(3)]  # the link of each
        searched = sum(map(self._generations_of, searches)) * self.population + (len(searches) + 1) * self.choosing
        late = len(REFLEX_DELAYS) if self._classes[-1].gains else 0
        tested = (len(self._classes) + late) * len(self._conditions) * self.episodes
        return len(self.persons) * len(self.aims) * (searched + tested) * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """For every person and aim search both classes of every link, and walk the test with both; compare them for
        each person and, if there are several, over all."""
        found: list[Found] = []
        walks: dict[LinkName, list[Pair]] = {}
        links = []
        for person in self.persons:
            search = self._search_of(person, progress)
            best: dict[Aim, list[tuple[StiffnessClass, NDArray]]] = {
                aim: self._search_classes(search, aim) for aim in self.aims
            }
            found += [(person, aim, *one) for aim, of_aim in best.items() for one in of_aim]
            pairs = {name: pair for aim in self.aims for name, pair in self._test_links(search, aim, best[aim]).items()}
            if self.owner == "foot":
                pairs |= {
                    (number, (f"{inner} for {aim}", f"{outer} for {aim}"), words): pair
                    for number in BESIDE_AIM
                    for (aim, (inner, outer), words), pair in pairs.items()
                }
            if len(best) > 1:
                pairs |= self._price_of_likeness(search, best)
            for name, pair in pairs.items():
                walks.setdefault(name, []).append(pair)
                links.append(compared(person, *name, [pair]))
        if len(self.persons) > 1:
            links = [compared(EVERYONE, *name, pairs) for name, pairs in walks.items()] + links
        files = {
            "links.csv": csv_text(list(asdict(links[0])), [list(asdict(link).values()) for link in links]),
            "stiffness.csv": _stiffness_csv(found),
            "stiffness.png": partial(draw, found=found),
        }
        return Answer(text=self._text(links), files=files)

    def _search_of(self, person: str, progress: OnProgress) -> PersonsSearch:
        """Return the search of a person, with costs and numbers in a folder of its own in `keep`."""
        folder = None if self.keep is None else self.keep / known_as(person)[-1][:12]  # the beginning of its digest
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        return PersonsSearch(
            person=person,
            owner=self.owner,
            damping_time=self.damping_time,
            seconds=self.seconds,
            seed=self.seed,
            population=self.population,
            choosing=self.choosing,
            push_newton=self.pushes[0],
            threads=self.threads,
            folder=folder,
            kept=Kept(None if folder is None else folder / "numbers.json"),
            progress=progress,
        )

    def _search_classes(self, search: PersonsSearch, aim: str) -> list[tuple[StiffnessClass, NDArray]]:
        """Search the classes of each link for an aim; return each class with the best vector found in it.

        All that searches found is held against each other by the same walks; a class within has its find in each
        further class too."""
        numbers = count()
        classes = self._classes
        first, *_ = classes
        middle = (first, np.zeros(first.size))

        def went_on(of_class: StiffnessClass, begin: Candidate, link: int, free: slice = WHOLE) -> Candidate:
            """Search a class from a stiffness that it has, with the walks of a link; return the one found."""
            start = widened(begin[1], begin[0], of_class)
            return of_class, search.search(aim, of_class, start, next(numbers), self._generations_of(link), free)

        found: dict[str, list[Candidate]] = {of_class.name: [] for of_class in classes}
        found[first.name] = [middle, went_on(first, middle, 0)]

        def best_of(of_class: StiffnessClass) -> Candidate:
            """Return the best found so far in a class or in a class within it."""
            within = classes[: classes.index(of_class) + 1]
            return search.choose(aim, [one for each in within for one in found[each.name]])

        for link, (inner, outer) in enumerate(pairwise(classes)):
            begin = best_of(inner)
            for of_class in dict.fromkeys((first, inner)):
                found[of_class.name].append(went_on(of_class, best_of(of_class), link))
            reflex_alone = outer.reflex if outer.gains and not inner.gains else WHOLE
            found[outer.name].append(went_on(outer, begin, link, reflex_alone))
        best = [best_of(of_class) for of_class in classes]
        return [
            (of_class, widened(vector, own, of_class)) for of_class, (own, vector) in zip(classes, best, strict=True)
        ]

    def _test_links(
        self, search: PersonsSearch, aim: str, best: Sequence[tuple[StiffnessClass, NDArray]]
    ) -> dict[LinkName, Pair]:
        """Return the test's numbers with both classes of each link, by its name: links between neighbours, between the
        first class and each further one, and of a reflex and the same one late."""
        last, vector = best[-1]
        links = [*pairwise(best), *((best[0], outer) for outer in best[2:])]
        if last.gains:
            late = [
                replace(last, name=f"{1000 * steps * ACTION_STEP:.0f} ms late", late=steps) for steps in REFLEX_DELAYS
            ]
            links += [((last, vector), (one, vector)) for one in late]
        return {
            (aim, (inner[0].name, outer[0].name), condition.words): (
                search.test_numbers(*inner, condition, self.episodes),
                search.test_numbers(*outer, condition, self.episodes),
            )
            for inner, outer in links
            for condition in self._conditions
        }

    def _price_of_likeness(
        self, search: PersonsSearch, best: Mapping[Aim, Sequence[tuple[StiffnessClass, NDArray]]]
    ) -> dict[LinkName, Pair]:
        """Return the test's numbers with the constant class found for fibre work and with each class found for
        likeness, by name: they tell the fibre work that likeness costs."""
        cheapest, *_ = best["fibre"]
        return {
            ("fibre", (f"{cheapest[0].name} for fibre", f"{outer[0].name} for likeness"), condition.words): (
                search.test_numbers(*cheapest, condition, self.episodes),
                search.test_numbers(*outer, condition, self.episodes),
            )
            for outer in best["likeness"]
            for condition in self._conditions
        }

    def _generations_of(self, link: int) -> int:
        """Return the generations of each search of a link, counted from 0: each link has half the first one's more,
        as its classes have more numbers."""
        return self.generations * (2 + link) // 2

    def _text(self, links: Sequence[Link]) -> str:
        """Return the report: verdict, a table of links for each aim, and a note."""
        shown, *_ = links
        links = [link for link in links if link.person == shown.person]
        fewest = fewest_falls(shown.episodes)
        several = f"over {len(self.persons)} persons, links.csv has each" if len(self.persons) > 1 else "over episodes"
        seen = f"from {fewest} of them on" if fewest else "by no number of them"
        seeds = f"seeds {self.seed + TEST_SEED}–{self.seed + TEST_SEED + self.episodes - 1}"
        return "\n\n".join(
            [
                verdict([link for link in links if link.aim in self.aims]),
                *(
                    f"**{number}**\n\n{links_table([link for link in links if link.aim == number])}"
                    for number in dict.fromkeys(link.aim for link in links)
                ),
                "![Stiffness of each class over the stride](stiffness.png)",
                f"Persons: {', '.join(self.persons)}; {self.episodes} episodes × {self.seconds:g} s, {seeds}, of each "
                "at every link and condition. Outer less inner class: undisturbed, paired, with its 95 % interval "
                f"({several}), and in brackets the smallest difference seen with a chance of {100 * POWER:g} %. Falls "
                f"of inner, outer: episodes in which one alone falls show a difference {seen} (McNemar). Each search "
                f"walks {' or '.join(str(self._generations_of(link)) for link in range(len(self._classes) - 1))} × "
                f"{self.population} candidates, by link, pushed by ±{self.pushes[0]:g} N; {self.choosing} such walks "
                f"choose what a class takes. {NOTES[self.owner]} A difference of exactly 0: no search found better "
                "than the class within has, which says little of longer ones.",
            ]
        )

    @property
    def _conditions(self) -> list[Condition]:
        """Return the conditions of the test."""
        rough = [Condition(unevenness_m=height) for height in self.roughness]
        return [Condition(), *(Condition(push_newton=push) for push in self.pushes), *rough]

    @property
    def _classes(self) -> tuple[StiffnessClass, ...]:
        """Return the classes of stiffness for the default body, each within the next."""
        return {"person": nested_classes, "foot": classes_of_foot}[self.owner](BipedSettings())


def _stiffness_csv(found: Sequence[Found]) -> str:
    """Return the CSV of K over the stride, without errors."""
    lines = [
        [person, aim, of_class.name, 100 * phase, *stiffness]
        for person, aim, of_class, vector in found
        for phase, stiffness in zip(PHASES, of_class.stiffness(vector, PHASES).tolist(), strict=True)
    ]
    return csv_text(["person", "aim", "class", "percent", "ankle_N_m_rad", "toe_N_m_rad"], lines)


def draw(path: Path, found: Sequence[Found]) -> None:
    """Draw K over the stride, without errors: a row of panels for each joint, a column for each aim, a colour for each
    class with a line for each person, the first one's thick."""
    first = found[0][0]
    aims = list(dict.fromkeys(aim for _, aim, *_ in found))
    classes = list(dict.fromkeys(of_class.name for *_, of_class, _ in found))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(4.2 * len(aims), 5.2), layout="constrained")
        grid = figure.subplots(2, len(aims), squeeze=False, sharex=True)
        for column, aim in enumerate(aims):
            for row, joint in enumerate(("ankle", "toe")):
                ax = grid[row, column]
                for person, _, of_class, vector in (one for one in found if one[1] == aim):
                    stiffness = of_class.stiffness(vector, PHASES)[:, row]
                    ax.step(
                        100 * PHASES,
                        stiffness,
                        where="post",
                        color=f"C{classes.index(of_class.name)}",
                        linewidth=1.5 if person == first else 0.5,
                        label=of_class.name if person == first else None,
                    )
                ax.set_yscale("log")
                ax.set_ylabel(f"{joint}, N·m/rad")
            grid[0, column].set_title(aim)
            grid[1, column].set_xlabel("% of the stride")
        grid[0, 0].legend()
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})
