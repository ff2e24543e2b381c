"""Ask what it buys to vary ankle and toe stiffness within the step, for a person who stays as it is.

    springfoot study when learned --keep runs/when

Four classes of stiffness, each within the next (`stiffness_classes`): constant, by phase, open loop, linear reflex. At
each link the inner and the outer class go on from the same stiffness with the same number of walks, by CMA-ES, so that
both have had equally many; then both walk from starts that no search has walked from, and are compared episode by
episode. There are two aims, each with its own searches: least fibre work a metre, and least distance from people. At
last the reflex walks the same test with errors that reach it late.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from itertools import pairwise, product
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, get_args

import cma
import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure

from springfoot.agents.policies import find_policy
from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.envs.physics import ACTION_STEP
from springfoot.envs.settings import BipedSettings
from springfoot.errors import MOST_COUNT, SpringfootError, require_count, require_number
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import Episodes, Recording, planned_course, policy_and_settings, record_walk
from springfoot.evaluation.report import STYLE
from springfoot.files.writing import csv_text

from ..base.columns import COMPARED_JOINTS
from ..base.intervals import POWER
from ..base.kept import Kept, known_as
from ..base.study import Answer, OnProgress, WalkingStudy
from ..searches.cma_search import generations
from .links import UNDISTURBED_WALK, UNIT_OF_AIM, Aim, Link, compared, fewest_falls, links_table, verdict
from .stiffness_classes import StiffnessClass, nested_classes, widened

FALL_COST = 4.0
"""Cost of a search if every episode falls, in the aim's unit; chosen: as much as the number itself."""
HELD_SPEED = 0.1
"""Difference from the commanded speed that costs as much as all falls, by its square [m/s]; chosen."""
REFLEX_DELAYS = (2, 4)
"""Steps of 20 ms by which a reflex is late; chosen: 40 and 80 ms."""
NO_WALK = 3 * FALL_COST
"""Cost of a stiffness with which no stride could be measured."""
FIRST_SPREAD = 0.2
"""First spread of a search, in ln K and in gains; chosen."""
CHOOSING = 4
"""Walks on which a search's result is held against its beginning; chosen."""
TEST_SEED = 500_000
"""Difference of the first seed of the test from the first one of the searches."""
PHASES = np.arange(200) / 200
"""Stride phases of the picture and of its table."""


class Condition(NamedTuple):
    """Disturbance of a walk."""

    push_newton: float = 0.0
    """Size of pushes [N]."""
    unevenness_m: float = 0.0
    """Unevenness of the ground [m]."""

    @property
    def words(self) -> str:
        """Return the condition in words."""
        if self.push_newton:
            return f"±{self.push_newton:g} N"
        return f"rough by {1000 * self.unevenness_m:g} mm" if self.unevenness_m else UNDISTURBED_WALK


@dataclass(frozen=True, kw_only=True)
class When(WalkingStudy):
    """Search constant, phased, open-loop and reflexive stiffness, each within the next, and tell the gain of each."""

    person: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="PERSON")] = "learned"
    """Policy that moves the person, and stays as it is: a run folder, a file, or one such as `learned`."""
    episodes: int = 12
    """Episodes of each class and condition of the test."""
    seconds: float = 6.0
    """Length of each episode."""
    generations: int = 10
    """Generations of each search."""
    population: int = 10
    """Candidates of each generation; each walks one episode, pushed."""
    aims: tuple[Aim, ...] = get_args(Aim)
    """What to search for: least fibre work, likeness, or both apart."""
    pushes: tuple[float, ...] = (100.0, 200.0, 300.0)
    """Sizes of the pushes [N]; the searches have the first."""
    roughness: tuple[float, ...] = (0.01,)
    """Unevenness of the rough ground of the test [m]."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder in which costs and numbers are kept, to go on after a stop."""

    QUICK: ClassVar[dict[str, Any]] = {
        "episodes": 2,
        "generations": 1,
        "population": 3,
        "aims": ("fibre",),
        "pushes": (100.0,),
        "roughness": (),
        "keep": None,
    }

    def check(self) -> None:
        """Refuse counts, lengths, pushes and unevenness out of range."""
        super().check()
        for name, least in (("generations", 1), ("population", 2)):
            require_count(name, getattr(self, name), least, MOST_COUNT)
        require_count("pushes", len(self.pushes))
        for push in self.pushes:
            require_number("pushes", push, 0.0, 1000.0, above=True, unit="N")
        for rough in self.roughness:
            require_number("roughness", rough, 0.0, 0.1, above=True, unit="m")
        if self.keep is not None and self.keep.is_file():
            raise SpringfootError(f"keep must be a folder, {self.keep} is a file")

    @property
    def total(self) -> float:
        """Return the simulated time of all walks if none falls [s]."""
        links = len(self._classes) - 1
        searched = (1 + 2 * links) * (self.generations * self.population + 2 * CHOOSING)
        tested = (2 * links + len(REFLEX_DELAYS)) * len(self._conditions) * self.episodes
        return len(self.aims) * (searched + tested) * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Search both classes of every link for every aim, walk the test with both, and compare them."""
        if self.keep is not None:
            self.keep.mkdir(parents=True, exist_ok=True)
        kept = Kept(None if self.keep is None else self.keep / "numbers.json")
        first, *_ = self._classes
        best = {aim: self._search(kept, aim, first, np.zeros(first.size), first, progress) for aim in self.aims}
        found = [(aim, first, best[aim]) for aim in self.aims]
        links = []
        for (inner, outer), aim in product(pairwise(self._classes), self.aims):
            went_on = self._search(kept, aim, inner, best[aim], outer, progress)
            best[aim] = self._search(kept, aim, outer, widened(best[aim], inner, outer), outer, progress)
            found.append((aim, outer, best[aim]))
            links += self._links(kept, aim, (inner, outer), (went_on, best[aim]), progress)
        *_, reflex = self._classes
        for steps, aim in product(REFLEX_DELAYS, self.aims):
            late = replace(reflex, name=f"{1000 * steps * ACTION_STEP:.0f} ms late", late=steps)
            links += self._links(kept, aim, (reflex, late), (best[aim], best[aim]), progress)
        files = {
            "links.csv": csv_text(list(asdict(links[0])), [list(asdict(link).values()) for link in links]),
            "stiffness.csv": _stiffness_csv(found),
            "stiffness.png": partial(draw, found=found),
        }
        return Answer(text=self._text(links), files=files)

    def _links(
        self,
        kept: Kept,
        aim: str,
        classes: tuple[StiffnessClass, StiffnessClass],
        vectors: tuple[NDArray, NDArray],
        progress: OnProgress,
    ) -> list[Link]:
        """Walk the test under each condition with two classes, each by its vector, and return the comparisons."""
        names = (classes[0].name, classes[1].name)
        links = []
        for condition in self._conditions:
            walks = [
                self._test_numbers(kept, of_class, vector, condition, progress)
                for of_class, vector in zip(classes, vectors, strict=True)
            ]
            links.append(compared(aim, names, condition.words, *walks))
        return links

    def _search(
        self,
        kept: Kept,
        aim: str,
        of_class: StiffnessClass,
        start: NDArray,
        link: StiffnessClass,
        progress: OnProgress,
    ) -> NDArray:
        """Search the class `of_class` from the vector `start`, for the link whose outer class is `link`; return the
        vector found: the search's mean at the end, or `start` if that costs no more on other walks.

        Costs in `kept` and in the folder `keep` are not computed again.
        """

        def costs_of(generation: int, vectors: list[NDArray]) -> NDArray:
            """Return the costs of a generation, whose candidates all walk from the same start."""
            return self._costs(aim, of_class, vectors, self.seed + generation, 1, progress)

        options = {"popsize": self.population, "seed": self.seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(start, FIRST_SPREAD, options)
        question = [*self._flags_in_question, aim, of_class.name, link.name, start.tolist()]
        name = f"{aim}-{link.name}-{of_class.name}.json".replace(" ", "-")
        file = None if self.keep is None else self.keep / name
        for _ in generations(strategy, self.generations, costs_of, file, question):
            pass
        ends = [start, np.asarray(strategy.mean)]
        first_seed = self.seed + TEST_SEED // 2

        def costs_of_ends() -> dict[str, Any]:
            """Return the costs of start and mean on walks that the generations did not have."""
            return {"costs": self._costs(aim, of_class, ends, first_seed, CHOOSING, progress).tolist()}

        return ends[int(np.argmin(kept.get([*question, [end.tolist() for end in ends]], costs_of_ends)["costs"]))]

    def _costs(
        self,
        aim: str,
        of_class: StiffnessClass,
        vectors: Sequence[NDArray],
        seed: int,
        starts: int,
        progress: OnProgress,
    ) -> NDArray:
        """Return the cost of each of V vectors, (V,), from `starts` pushed walks: the aim's number plus costs of the
        error of speed and of the share that falls; `NO_WALK` if no number could be measured."""
        pushed = Condition(push_newton=self.pushes[0])
        costs = []
        for walked in self._walk(of_class, vectors, seed, starts, pushed, progress):
            numbers = aim_numbers(walked)
            if numbers[aim] is None:
                costs.append(NO_WALK)
            else:
                error = (numbers["speed_m_s"] - walked.settings.speed) / HELD_SPEED
                costs.append(numbers[aim] + FALL_COST * ((walked.fall_reason != "").mean() + error**2))
        return np.array(costs)

    def _test_numbers(
        self, kept: Kept, of_class: StiffnessClass, vector: NDArray, condition: Condition, progress: OnProgress
    ) -> dict[str, Any]:
        """Return `fell` and the numbers of `aim_numbers` as lists over the test's episodes under a condition; they come
        from `kept` if it has them."""

        def make() -> dict[str, Any]:
            """Walk the test's episodes; return their lists."""
            (walked,) = self._walk(of_class, [vector], self.seed + TEST_SEED, self.episodes, condition, progress)
            rows = [aim_numbers(walked.of_episode(index)) for index in range(self.episodes)]
            return {
                "fell": (walked.fall_reason != "").tolist(),
                **{name: [row[name] for row in rows] for name in rows[0]},
            }

        return kept.get([*self._flags_in_question, self.episodes, of_class.name, vector.tolist(), condition], make)

    def _walk(
        self,
        of_class: StiffnessClass,
        vectors: Sequence[NDArray],
        seed: int,
        episodes: int,
        condition: Condition,
        progress: OnProgress,
    ) -> list[Recording]:
        """Record the same episodes with each of V vectors, side by side; return a recording for each."""
        biped = _batch(self._person, self.seconds, condition, len(vectors) * episodes, self.threads)
        settings = biped.settings
        seeds = [seed + episode for _ in vectors for episode in range(episodes)]
        biped.reset(np.arange(len(seeds)), seeds)
        kept = Episodes.of_length(settings, len(seeds))
        act = of_class.policy(np.repeat(np.stack(vectors), episodes, axis=0), settings)
        record_walk(biped, act, kept, progress=progress)
        course: dict[str, Any] = planned_course(biped.plan)
        return [
            Recording(
                policy=of_class.name,
                settings=settings,
                seed=seed,
                **kept.of(slice(index * episodes, (index + 1) * episodes)),
                **course,
            )
            for index in range(len(vectors))
        ]

    def _text(self, links: Sequence[Link]) -> str:
        """Return the report: verdict, a table of links for each aim, and a note."""
        fewest = fewest_falls(self.episodes)
        seen = f"from {fewest} of them on" if fewest else "by no number of them"
        seeds = f"seeds {self.seed + TEST_SEED}–{self.seed + TEST_SEED + self.episodes - 1}"
        return "\n\n".join(
            [
                verdict(links),
                *(f"**{aim}**\n\n{links_table([link for link in links if link.aim == aim])}" for aim in self.aims),
                "![Stiffness of each class over the stride](stiffness.png)",
                f"{self.episodes} episodes × {self.seconds:g} s, {seeds}, at every link "
                "and condition. Outer less inner class: undisturbed, paired, with its 95 % interval (bootstrap over "
                f"episodes), and in brackets the smallest difference seen with a chance of {100 * POWER:g} %. Falls of "
                f"inner, outer: episodes in which one alone falls show a difference {seen} (McNemar). Each search "
                f"walks {self.generations} × {self.population} candidates, pushed by ±{self.pushes[0]:g} N. A reflex "
                "plus a network is left out. A late reflex is the same one, whose errors are of 40 or 80 ms before. "
                "A difference of exactly 0: no search of the link found better than its "
                "start, which says little of what a longer one would find.",
            ]
        )

    @property
    def _conditions(self) -> list[Condition]:
        """Return the conditions of the test."""
        rough = [Condition(unevenness_m=height) for height in self.roughness]
        return [Condition(), *(Condition(push_newton=push) for push in self.pushes), *rough]

    @property
    def _person(self) -> str:
        """Return the path of the person's policy, the value of the setting `person`."""
        return str(find_policy(self.person))

    @property
    def _classes(self) -> tuple[StiffnessClass, ...]:
        """Return the classes of stiffness for the default body, each within the next."""
        return nested_classes(BipedSettings())

    @property
    def _flags_in_question(self) -> list[Any]:
        """Return the flags on which all costs and numbers depend, as plain JSON values."""
        return [known_as(self.person), self.seconds, self.seed, self.population, self.pushes[0]]


@lru_cache(maxsize=8)
def _batch(person: str, seconds: float, condition: Condition, count: int, threads: int) -> Biped:
    """Return `count` environments with the person and the condition, cached: reset them before each use."""
    given = {"person": person, "episode_seconds": seconds, **condition._asdict()}
    _, settings = policy_and_settings("constant", given)
    return Biped(settings, count, threads)


def aim_numbers(recording: Recording) -> dict[str, Any]:
    """Return speed and the number of each `Aim` of a recording, from its metrics; None of all if one is missing."""
    metrics = measure(recording).metrics
    angles = [metrics["joints"][joint]["rmse_deg"] for joint in COMPARED_JOINTS]
    fibre = metrics["effort"]["fibre_J_kg_m"]
    speed = metrics["speed_m_s"]["mean"]
    if None in (*angles, fibre, speed):
        return {"speed_m_s": None, **dict.fromkeys(UNIT_OF_AIM)}
    return {"speed_m_s": speed, "fibre": fibre, "likeness": float(np.mean(angles))}


def _stiffness_csv(found: Sequence[tuple[str, StiffnessClass, NDArray]]) -> str:
    """Return the CSV of K over the stride, without errors, for each (aim, class, vector) of `found`."""
    lines = [
        [aim, of_class.name, 100 * phase, *stiffness]
        for aim, of_class, vector in found
        for phase, stiffness in zip(PHASES, of_class.stiffness(vector, PHASES).tolist(), strict=True)
    ]
    return csv_text(["aim", "class", "percent", "ankle_N_m_rad", "toe_N_m_rad"], lines)


def draw(path: Path, found: Sequence[tuple[str, StiffnessClass, NDArray]]) -> None:
    """Draw K over the stride, without errors, for each (aim, class, vector) of `found`: a row of panels for each joint,
    a column for each aim."""
    aims = list(dict.fromkeys(aim for aim, _, _ in found))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(4.2 * len(aims), 5.2), layout="constrained")
        grid = figure.subplots(2, len(aims), squeeze=False, sharex=True)
        for column, aim in enumerate(aims):
            for row, joint in enumerate(("ankle", "toe")):
                ax = grid[row, column]
                for _, of_class, vector in (one for one in found if one[0] == aim):
                    ax.step(100 * PHASES, of_class.stiffness(vector, PHASES)[:, row], where="post", label=of_class.name)
                ax.set_yscale("log")
                ax.set_ylabel(f"{joint}, N·m/rad")
            grid[0, column].set_title(aim)
            grid[1, column].set_xlabel("% of the stride")
        grid[0, 0].legend()
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})
