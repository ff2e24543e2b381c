"""Search a class of stiffness for one person, and walk the test with the stiffness found."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import cma
import numpy as np

from springfoot.agents import read_policy
from springfoot.agents.policies import find_policy
from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording import (
    Episodes,
    Recording,
    planned_course,
    policy_and_settings,
    record_feet,
    record_walk,
)
from springfoot.gait.body import ANKLE_TENDON
from springfoot.gait.springs import SPRINGS

from ..base.columns import COMPARED_JOINTS
from ..base.kept import Kept, known_as
from ..base.study import OnProgress
from ..searches.cma_search import generations
from .links import BESIDE_AIM, UNDISTURBED_WALK, UNIT_OF_NUMBER
from .stiffness_classes import StiffnessClass

FALL_COST = 4.0
"""Cost of a search if every episode falls, in the aim's unit; chosen: as much as the number itself."""
HELD_SPEED = 0.1
"""Difference from the commanded speed that costs as much as all falls, by its square [m/s]; chosen."""
NO_WALK = 3 * FALL_COST
"""Cost of a stiffness with which no stride could be measured."""
FIRST_SPREAD = 0.2
"""First spread of a search, in ln K and in gains; chosen."""
CHOOSING_SEED, TEST_SEED = 250_000, 500_000
"""Difference of the first seed of the walks that choose, and of the test, from the first one of the searches."""
SEEDS_OF_A_SEARCH = 1000
"""Seeds that each search has for its own starts; chosen, more than its generations."""


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


Candidate = tuple[StiffnessClass, NDArray]
"""Class of stiffness, and one of its vectors."""
Owner = Literal["person", "foot"]
"""Owner of the stiffness: both ankles and toes of the person, or an adaptive right foot."""


@dataclass(frozen=True, kw_only=True)
class PersonsSearch:
    """Searches and tests of one person, with kept costs and numbers."""

    person: str
    """Policy that moves the person, and beside an adaptive foot sets the other foot's stiffness."""
    owner: Owner
    """Owner of the stiffness."""
    damping_time: float | None
    """Damping over stiffness of an adaptive foot's springs [s]; None for that of muscles."""
    seconds: float
    """Length of each episode."""
    seed: int
    """Generation g of search n walks from the start of seed + `SEEDS_OF_A_SEARCH` n + g, the test's episode i from that
    of seed + `TEST_SEED` + i."""
    population: int
    """Candidates of each generation; each walks one episode, pushed."""
    choosing: int
    """Walks by which one of several vectors is chosen, pushed likewise."""
    push_newton: float
    """Size of these pushes [N]."""
    threads: int
    """Threads of the physics."""
    folder: Path | None
    """Folder in which the searches' costs are kept, to go on after a stop."""
    kept: Kept
    """Numbers kept so far."""
    progress: OnProgress
    """Function called with the simulated time [s] of each step."""

    def search(
        self, aim: str, of_class: StiffnessClass, start: NDArray, number: int, generations_: int, free: slice
    ) -> NDArray:
        """Search the class `of_class` from the vector `start`; return the vector found, the search's mean at the end.

        Entries beside `free` stay. `number` tells the searches for an aim apart: each has its own starts and random
        numbers. Costs in `folder` are not computed again.
        """

        def whole(entries: NDArray) -> NDArray:
            """Return the vector with these entries in `free`."""
            vector = start.copy()
            vector[free] = entries
            return vector

        first_seed = self.seed + SEEDS_OF_A_SEARCH * number

        def costs_of(generation: int, vectors: list[NDArray]) -> NDArray:
            """Return the costs of a generation; its candidates all walk from the same start."""
            return self._costs(aim, of_class, list(map(whole, vectors)), first_seed + generation, 1)

        options = {"popsize": self.population, "seed": first_seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(start[free], FIRST_SPREAD, options)
        question = [*self._in_question, aim, of_class.name, number, start.tolist()]
        file = None if self.folder is None else self.folder / f"{aim}-{number}.json"
        for _ in generations(strategy, generations_, costs_of, file, question):
            pass
        return whole(np.asarray(strategy.mean))

    def choose(self, aim: str, candidates: Sequence[Candidate]) -> Candidate:
        """Return the candidate that costs least on `choosing` walks that no search has; of equal ones the first."""
        costs = []
        for of_class, vector in candidates:

            def cost_of(of_class: StiffnessClass = of_class, vector: NDArray = vector) -> dict[str, Any]:
                """Return the cost of one candidate."""
                cost = self._costs(aim, of_class, [vector], self.seed + CHOOSING_SEED, self.choosing)
                return {"cost": float(cost[0])}

            asked = [*self._in_question, aim, of_class.name, vector.tolist(), self.choosing]
            costs.append(self.kept.get(asked, cost_of)["cost"])
        return candidates[int(np.argmin(costs))]

    def test_numbers(
        self, of_class: StiffnessClass, vector: NDArray, condition: Condition, episodes: int
    ) -> dict[str, Any]:
        """Return `fell` and the numbers of `aim_numbers` as lists over the test's episodes under a condition; they come
        from `kept` if it has them."""

        def make() -> dict[str, Any]:
            """Walk the test's episodes; return their lists."""
            (walked,) = self._walk(of_class, [vector], self.seed + TEST_SEED, episodes, condition)
            rows = [aim_numbers(walked.of_episode(index)) for index in range(episodes)]
            return {
                "fell": (walked.fall_reason != "").tolist(),
                **{name: [row[name] for row in rows] for name in rows[0]},
            }

        return self.kept.get([*self._in_question, episodes, of_class.name, vector.tolist(), condition], make)

    def _costs(self, aim: str, of_class: StiffnessClass, vectors: Sequence[NDArray], seed: int, starts: int) -> NDArray:
        """Return the cost of each of V vectors, (V,), from `starts` pushed walks: the aim's number plus costs of the
        error of speed and of the share that falls; `NO_WALK` if no number could be measured."""
        pushed = Condition(push_newton=self.push_newton)
        costs = []
        for walked in self._walk(of_class, vectors, seed, starts, pushed):
            numbers = aim_numbers(walked)
            if numbers[aim] is None:
                costs.append(NO_WALK)
            else:
                error = (numbers["speed_m_s"] - walked.settings.speed) / HELD_SPEED
                costs.append(numbers[aim] + FALL_COST * ((walked.fall_reason != "").mean() + error**2))
        return np.array(costs)

    def _walk(
        self, of_class: StiffnessClass, vectors: Sequence[NDArray], seed: int, episodes: int, condition: Condition
    ) -> list[Recording]:
        """Record the same episodes with each of V vectors, side by side; return a recording for each."""
        if self.owner == "foot":
            given = {"episode_seconds": self.seconds, **condition._asdict()}
            acting, settings = policy_and_settings(self.person, given)
            feet = [{"right_foot": of_class.foot(vector, self.damping_time)} for vector in vectors]
            how: dict[str, Any] = {"threads": self.threads, "progress": self.progress}
            return record_feet(acting, settings, feet, name=of_class.name, episodes=episodes, seed=seed, **how)
        person = str(find_policy(self.person))
        biped = _batch(person, self.seconds, condition, len(vectors) * episodes, self.threads)
        settings = biped.settings
        seeds = [seed + episode for _ in vectors for episode in range(episodes)]
        biped.reset(np.arange(len(seeds)), seeds)
        kept = Episodes.of_length(settings, len(seeds))
        act = of_class.policy(np.repeat(np.stack(vectors), episodes, axis=0), settings)
        record_walk(biped, act, kept, progress=self.progress)
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

    @property
    def _in_question(self) -> list[Any]:
        """Return the parts of every question, on which all costs and numbers depend."""
        owner = [] if self.owner == "person" else [self.owner, self.damping_time]
        return [known_as(self.person), self.seconds, self.seed, self.population, self.push_newton, *owner]


@lru_cache(maxsize=8)
def _batch(person: str, seconds: float, condition: Condition, count: int, threads: int) -> Biped:
    """Return `count` environments with the person, its guide and the condition, cached: reset them before each use. The
    ankle's K is at most that of its tendon, as when the person learned."""
    given = {"person": person, "guide": read_policy(person).settings.guide, "ankle_tendon": ANKLE_TENDON}
    given |= {"episode_seconds": seconds, **condition._asdict()}
    _, settings = policy_and_settings("constant", given)
    return Biped(settings, count, threads)


def aim_numbers(recording: Recording) -> dict[str, Any]:
    """Return speed, the number of each `Aim`, and those of `BESIDE_AIM`, None on like feet, of a recording, from its
    metrics; None of all if one is missing."""
    metrics = measure(recording).metrics
    angles = [metrics["joints"][joint]["rmse_deg"] for joint in COMPARED_JOINTS]
    fibre = metrics["effort"]["fibre_J_kg_m"]
    speed = metrics["speed_m_s"]["mean"]
    of_legs = metrics["per_leg"]  # None on like feet
    work = [] if of_legs is None else [of_legs["right"]["joint_work_J_kg"][joint] for joint in SPRINGS]
    numbers = {"speed_m_s": None, **dict.fromkeys(UNIT_OF_NUMBER)}
    if None in (*angles, fibre, speed, *(joint["positive"] for joint in work)):
        return numbers
    numbers |= {"speed_m_s": speed, "fibre": fibre, "likeness": float(np.mean(angles))}
    if work:
        given, taken = (sum(joint[part] for joint in work) for part in ("positive", "negative"))
        numbers |= zip(BESIDE_AIM, (metrics["effort"]["total"], given - taken, taken), strict=True)
    return numbers
