"""Ask what it buys to vary ankle and toe stiffness within the step, for a person who stays as it is.

    springfoot study when learned --keep runs/when

Four classes of stiffness, each within the next (`stiffness_classes`): constant, by phase, open loop, linear reflex. At
each link the inner and the outer class go on from the same stiffness with the same number of walks, by CMA-ES, so that
both have had equally many; then both walk from starts that no search has walked from, and are compared episode by
episode. There are two aims, each with its own searches: least fibre work a metre, and least distance from people.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from itertools import pairwise, product
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, get_args

import cma
import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure
from scipy.stats import norm

from springfoot.agents.policies import find_policy
from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.envs.settings import BipedSettings
from springfoot.errors import MOST_COUNT, SpringfootError, require_count, require_number
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import Episodes, Recording, planned_course, policy_and_settings, record_walk
from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, table
from springfoot.files.writing import csv_text

from ..base.columns import COMPARED_JOINTS
from ..base.intervals import LEVEL, mean_interval, paired_p, share_interval
from ..base.kept import Kept
from ..base.study import Answer, OnProgress, WalkingStudy
from ..searches.cma_search import generations
from .stiffness_classes import StiffnessClass, nested_classes, widened

Aim = Literal["fibre", "likeness"]
"""Aim of a search: least fibre work a metre; least mean over joints of the angles' rms from people's mean."""
UNIT_OF_AIM: dict[str, str] = dict(zip(get_args(Aim), ("J/kg/m", "°"), strict=True))
"""Aim -> unit of its number."""
FALL_COST = 4.0
"""Cost of a search if every episode falls, in the aim's unit; chosen: as much as the number itself."""
HELD_SPEED = 0.1
"""Difference from the commanded speed that costs as much as all falls, by its square [m/s]; chosen."""
NO_WALK = 3 * FALL_COST
"""Cost of a stiffness with which no stride could be measured."""
FIRST_SPREAD = 0.2
"""First spread of a search, in ln K and in gains; chosen."""
CHOOSING = 4
"""Walks on which a search's result is held against its beginning; chosen."""
TEST_SEED = 500_000
"""Difference of the first seed of the test from the first one of the searches."""
POWER = 0.8
"""Chance with which the smallest visible difference is seen."""
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
        return f"rough by {1000 * self.unevenness_m:g} mm" if self.unevenness_m else "undisturbed"


@dataclass(frozen=True, kw_only=True)
class Link:
    """Comparison of an outer class with the inner one on the same episodes, for one aim and condition."""

    aim: str
    """Aim of both searches."""
    inner: str
    """Name of the inner class."""
    outer: str
    """Name of the outer class."""
    condition: str
    """Condition in words."""
    episodes: int
    """Number of episodes."""
    inner_mean: float | None
    """Aim's number with the inner class, mean of the episodes in which both walk to the end; None without any."""
    difference: float | None
    """Outer less inner, mean of the same episodes; negative where the outer is better."""
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


def compared(aim: str, names: tuple[str, str], condition: str, inner: Any, outer: Any) -> Link:
    """Return the link of two classes called `names` from their episodes.

    `inner` and `outer` have, by name, lists of equal length: `fell`, `speed_m_s` and the number of each `Aim`, None
    where nothing could be measured.
    """
    both = [
        index
        for index, pair in enumerate(zip(inner[aim], outer[aim], strict=True))
        if None not in pair and not (inner["fell"][index] or outer["fell"][index])
    ]

    def values(walks: Any, name: str) -> NDArray:
        """Return the numbers of the episodes in which both walk to the end, (n,)."""
        return np.array([walks[name][index] for index in both], float)

    numbers: dict[str, float | None] = dict.fromkeys(
        ("inner_mean", "difference", "low", "high", "visible", "speed_m_s", "speed_difference_m_s")
    )
    if both:
        difference = values(outer, aim) - values(inner, aim)
        numbers |= zip(("low", "high"), mean_interval(difference), strict=True)
        numbers |= {
            "inner_mean": float(values(inner, aim).mean()),
            "difference": float(difference.mean()),
            "visible": visible(difference),
            "speed_m_s": float(values(inner, "speed_m_s").mean()),
            "speed_difference_m_s": float((values(outer, "speed_m_s") - values(inner, "speed_m_s")).mean()),
        }
    falls: dict[str, Any] = {}
    fell = {"inner": np.array(inner["fell"], bool), "outer": np.array(outer["fell"], bool)}
    for name, those in fell.items():
        low, high = share_interval(int(those.sum()), len(those))
        falls |= {f"{name}_falls": int(those.sum()), f"{name}_falls_low": low, f"{name}_falls_high": high}
    return Link(
        aim=aim,
        inner=names[0],
        outer=names[1],
        condition=condition,
        episodes=len(fell["inner"]),
        falls_p=paired_p(fell["inner"], fell["outer"]),
        **numbers,
        **falls,
    )


def visible(differences: NDArray) -> float | None:
    """Return the smallest mean that paired differences (n,) of this spread show with the chance `POWER`: the sum of the
    two normal quantiles times the standard error. None for a single one, and where both walk the same."""
    if len(differences) < 2 or not differences.any():
        return None
    error = np.std(differences, ddof=1) / np.sqrt(len(differences))
    return float((norm.ppf(0.5 + LEVEL / 2) + norm.ppf(POWER)) * error)


def fewest_falls(episodes: int) -> int | None:
    """Return the fewest falls of one class alone that McNemar's test shows in so many episodes; None if none do."""
    for alone in range(1, episodes + 1):
        fell = np.arange(episodes) < alone
        if paired_p(fell, np.zeros(episodes, bool)) < 1.0 - LEVEL:
            return alone
    return None


@dataclass(frozen=True, kw_only=True)
class When(WalkingStudy):
    """Search constant, phased, open-loop and reflexive stiffness, each within the next, and tell what each adds."""

    person: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="PERSON")] = "learned"
    """Policy that moves the person, and stays as it is: a run folder, a file, or `learned`."""
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
        tested = 2 * links * len(self._conditions) * self.episodes
        return len(self.aims) * (searched + tested) * self.seconds

    def ask(self, progress: OnProgress) -> Answer:
        """Search, test, and compare."""
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
            for condition in self._conditions:
                walks = [
                    self._tested(kept, of_class, vector, condition, progress)
                    for of_class, vector in ((inner, went_on), (outer, best[aim]))
                ]
                links.append(compared(aim, (inner.name, outer.name), condition.words, *walks))
        files = {
            "links.csv": csv_text(list(asdict(links[0])), [list(asdict(link).values()) for link in links]),
            "stiffness.csv": _stiffness_csv(found),
            "stiffness.png": partial(draw, found=found),
        }
        return Answer(text=self._text(links), files=files)

    def _search(
        self,
        kept: Kept,
        aim: str,
        of_class: StiffnessClass,
        start: NDArray,
        link: StiffnessClass,
        progress: OnProgress,
    ) -> NDArray:
        """Return the vector that a search of the link to the class `link` finds from `start`: its mean at the end, or
        the start itself if that costs no more on other walks."""

        def costs_of(generation: int, vectors: list[NDArray]) -> NDArray:
            """Return the costs of a generation, whose candidates all walk from the same start."""
            return self._costs(aim, of_class, vectors, self.seed + generation, 1, progress)

        options = {"popsize": self.population, "seed": self.seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(start, FIRST_SPREAD, options)
        question = [*self._asked, aim, of_class.name, link.name, start.tolist()]
        name = f"{aim}-{link.name}-{of_class.name}.json".replace(" ", "-")
        file = None if self.keep is None else self.keep / name
        for _ in generations(strategy, self.generations, costs_of, file, question):
            pass
        ends = [start, np.asarray(strategy.mean)]
        first_seed = self.seed + TEST_SEED // 2

        def chosen() -> dict[str, Any]:
            """Return the costs of start and mean on walks that the generations did not have."""
            return {"costs": self._costs(aim, of_class, ends, first_seed, CHOOSING, progress).tolist()}

        return ends[int(np.argmin(kept.get([*question, [end.tolist() for end in ends]], chosen)["costs"]))]

    def _costs(
        self,
        aim: str,
        of_class: StiffnessClass,
        vectors: Sequence[NDArray],
        seed: int,
        starts: int,
        progress: OnProgress,
    ) -> NDArray:
        """Return the cost of each vector, (V,), from `starts` pushed walks: the aim's number, the error of speed and
        the share that falls."""
        pushed = Condition(push_newton=self.pushes[0])
        costs = []
        for walked in self._walk(of_class, vectors, seed, starts, pushed, progress):
            numbers = numbers_of(walked)
            if numbers[aim] is None:
                costs.append(NO_WALK)
            else:
                error = (numbers["speed_m_s"] - walked.settings.speed) / HELD_SPEED
                costs.append(numbers[aim] + FALL_COST * ((walked.fall_reason != "").mean() + error**2))
        return np.array(costs)

    def _tested(
        self, kept: Kept, of_class: StiffnessClass, vector: NDArray, condition: Condition, progress: OnProgress
    ) -> dict[str, Any]:
        """Return the numbers of the test's episodes under a condition, a list of each."""

        def make() -> dict[str, Any]:
            """Walk; return the numbers of each episode."""
            (walked,) = self._walk(of_class, [vector], self.seed + TEST_SEED, self.episodes, condition, progress)
            rows = [numbers_of(_episode(walked, index)) for index in range(self.episodes)]
            return {
                "fell": (walked.fall_reason != "").tolist(),
                **{name: [row[name] for row in rows] for name in rows[0]},
            }

        return kept.get([*self._asked, self.episodes, of_class.name, vector.tolist(), condition], make)

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
        """Return the report."""
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
                "plus a network is left out. A difference of exactly 0: no search of the link found better than its "
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
        """Return the setting `person`."""
        return str(find_policy(self.person))

    @property
    def _classes(self) -> tuple[StiffnessClass, ...]:
        """Return the classes, each within the next."""
        return nested_classes(BipedSettings())

    @property
    def _asked(self) -> list[Any]:
        """Return what all costs and numbers depend on, as plain JSON values."""
        return [self.person, self.seconds, self.seed, self.population, self.pushes[0]]


@lru_cache(maxsize=8)
def _batch(person: str, seconds: float, condition: Condition, count: int, threads: int) -> Biped:
    """Return `count` environments, to be reset before each use."""
    given = {"person": person, "episode_seconds": seconds, **condition._asdict()}
    _, settings = policy_and_settings("constant", given)
    return Biped(settings, count, threads)


def _episode(recording: Recording, index: int) -> Recording:
    """Return the recording of one episode alone."""
    rows = slice(index, index + 1)
    return replace(
        recording,
        ticks=recording.ticks[rows],
        returns=recording.returns[rows],
        fall_reason=recording.fall_reason[rows],
        series={name: values[rows] for name, values in recording.series.items()},
    )


def numbers_of(recording: Recording) -> dict[str, Any]:
    """Return speed and the number of each `Aim` of a recording, from its metrics; None of all if one is missing."""
    metrics = measure(recording).metrics
    angles = [metrics["joints"][joint]["rmse_deg"] for joint in COMPARED_JOINTS]
    fibre = metrics["effort"]["fibre_J_kg_m"]
    speed = metrics["speed_m_s"]["mean"]
    if None in (*angles, fibre, speed):
        return {"speed_m_s": None, **dict.fromkeys(UNIT_OF_AIM)}
    return {"speed_m_s": speed, "fibre": fibre, "likeness": float(np.mean(angles))}


def verdict(links: Sequence[Link]) -> str:
    """Return, in sentences, at which links the outer class is better undisturbed, aim by aim, and at which falls
    differ."""
    sentences = []
    for aim in dict.fromkeys(link.aim for link in links):
        here = [link for link in links if link.aim == aim and link.condition == Condition().words]
        seen = [link for link in here if link.high is not None and link.high < 0.0]
        gains = [
            f"{link.outer} {link.difference:+.3f} [{link.low:.3f}, {link.high:.3f}] {UNIT_OF_AIM[aim]} "
            f"({100 * link.difference / link.inner_mean:+.1f} %)"
            for link in seen
            if link.difference is not None and link.inner_mean is not None
        ]
        others = [link.outer for link in here if link not in seen]
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
        lines.append([" ⊂ ".join(names), _number(level.inner_mean), _difference(level), *falls])
    unit = UNIT_OF_AIM[links[0].aim]
    return table(["classes", f"inner, {unit}", f"outer less inner, {unit}", *conditions], lines)


def _number(value: float | None) -> str:
    """Return a number of an aim as text."""
    return MISSING if value is None else f"{value:.2f}"


def _difference(link: Link) -> str:
    """Return the difference of a link with its interval and the smallest visible one as text."""
    if link.difference is None:
        return MISSING
    seen = MISSING if link.visible is None else f"{link.visible:.3f}"
    return f"{link.difference:+.3f} [{link.low:+.3f}, {link.high:+.3f}] ({seen})"


def _stiffness_csv(found: Sequence[tuple[str, StiffnessClass, NDArray]]) -> str:
    """Return the CSV of K over the stride of each found stiffness."""
    lines = [
        [aim, of_class.name, 100 * phase, *stiffness]
        for aim, of_class, vector in found
        for phase, stiffness in zip(PHASES, of_class.stiffness(vector, PHASES).tolist(), strict=True)
    ]
    return csv_text(["aim", "class", "percent", "ankle_N_m_rad", "toe_N_m_rad"], lines)


def draw(path: Path, found: Sequence[tuple[str, StiffnessClass, NDArray]]) -> None:
    """Draw K over the stride, without errors: a row of panels for each joint, a column for each aim."""
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
