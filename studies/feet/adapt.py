"""Search how a person adapts to a foot: hips, knees and timing of both sides.

    springfoot study adapt --foot rigid
    springfoot study adapt --foot passive --design 1
    springfoot study adapt --foot '{"kind": "weak", "strength": 0.3}' --name "weak 30 %" --searches 1

The foot is the right one. With --design 1 the search also moves the numbers of its kind (stiffness, rest angles); the
stiffness of an adaptive foot starts as that of the passive one. CMA-ES on simulated walks, as in `leg_tuning`;
`person_cost` computes the cost of a candidate.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path
from typing import Annotated, Any, ClassVar

import cma
import numpy as np
import tyro
from tqdm import tqdm

from springfoot.arrays import NDArray
from springfoot.envs.control import TUNED_SPEED, leg_constants, person_constants
from springfoot.envs.physics import LEFT, RIGHT
from springfoot.envs.settings import LONGEST_EPISODE, SPRING_NUMBERS, BipedSettings, foot_setting, without_person
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.files.markdown import table, text_of
from springfoot.files.writing import csv_text, write_atomically

from ..base.flags import FootFlag, foot_given
from ..base.study import Answer, OnProgress, Study, without_places
from ..searches.cma_search import generations
from ..searches.constants_file import ADAPTED_FEET, read_feet
from . import person_cost
from .foot_walks import ABOUT_STOPS, PUSH_NEWTON, SCHEDULE, TOLD, walked
from .person_search import Person, PersonSearch


def kept_name(name: str, search: int) -> str:
    """Return the name under which the file of adapted feet keeps what a search found: `name` alone for the first
    one."""
    return name if search == 1 else f"{name}, search {search}"


def beginning(foot: str | dict[str, Any], speed: float) -> Person:
    """Return the person before the search: both legs as tuned for sound feet at `speed` [m/s].

    The leg of an adaptive foot without a schedule starts with the constant stiffness of a usual passive foot.
    """
    tuned = leg_constants("planned", "people", speed)
    other = tuned  # the leg on this foot; `sound` is the other one
    setting = foot_setting("foot", foot)
    if setting.kind == "adaptive" and setting.foot.schedule is None:
        ankle, toe = (float(SPRING_NUMBERS[f"{joint}_stiffness"].usual or 0.0) for joint in ("ankle", "toe"))
        other = replace(tuned, ankle_schedule=(ankle,) * 5, toe_schedule=toe)
    return Person(sound=tuned, other=other, foot=foot)


@dataclass(frozen=True, kw_only=True)
class Adapt(Study):
    """Search how a person adapts to a foot, and keep it in a file of adapted feet every ten generations."""

    foot: FootFlag = "rigid"
    """The right foot: a kind, JSON or a file, as `--right-foot`."""
    name: str = ""
    """Name of the foot in the file; empty: its kind, and the speed where it is not 1.2 m/s."""
    design: float = 0.0
    """Search the foot's numbers as well, in steps this many times those of the legs (a stiffness by 15 %, the ankle's
    rest angle by 1 degree, the toe's by 3); at 0 they stay."""
    speed: float = TUNED_SPEED
    """Walking speed [m/s]."""
    start: str = ""
    """Name of a foot of the file to start from, as its person walks at this speed, its numbers too where `foot` is but
    its kind; empty: the committed walk of sound feet."""
    searches: tuple[int, ...] = (1, 2)
    """Which independent searches; search k has the seed `seed` + 1,000,000 (k - 1)."""
    generations: int = 80
    """Generations of each."""
    population: int = 20
    """Candidates in each."""
    sigma: float = 0.5
    """First spread, in units of the search."""
    push_newton: float = 150.0
    """Size of the pushes of the pushed walks [N]."""
    bend_deg: float | None = None
    """Range of the right toe beyond which a candidate pays for it [deg]; none unless given."""
    bend_weight: float = 1.0
    """How many times it pays for that."""
    seed: int = 0
    """Seed of the first search and its walks."""
    threads: int = 1
    """Threads of the physics."""
    episodes: int = 20
    """Episodes of each reported walk: undisturbed and pushed, not adapted and adapted."""
    seconds: float = 20.0
    """Length of each."""
    feet: Annotated[Path, tyro.conf.arg(metavar="FILE")] = ADAPTED_FEET
    """File of adapted feet to read and to write."""

    QUICK: ClassVar[Mapping[str, Any]] = {
        **{"generations": 2, "population": 4, "searches": (1,), "episodes": 1, "seconds": 6.0}
    }
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse counts out of range."""
        for count, least in (("generations", 1), ("population", 2), ("threads", 1), ("seed", 0), ("episodes", 1)):
            require_count(count, getattr(self, count), least)
        for search in self.searches:
            require_count("searches", search, 1)
        require_number("design", self.design, 0)
        require_number("sigma", self.sigma, 0, above=True)
        require_number("seconds", self.seconds, 0, LONGEST_EPISODE, above=True, unit="s")
        require_number("push_newton", self.push_newton, 0, unit="N")
        if self.bend_deg is not None:
            require_number("bend_deg", self.bend_deg, 0, unit="deg")
        require_number("bend_weight", self.bend_weight, 0)

    @property
    def total(self) -> float:
        """Return the number of generations of all searches."""
        return self.generations * len(self.searches)

    def ask(self, progress: OnProgress) -> Answer:
        """Search, and compare the walks of the person before and after."""
        setting = foot_setting("foot", foot_given(self.foot))
        foot = without_person(setting.plain) if isinstance(setting.plain, dict) else setting.plain  # its kind alone
        name = self.name or (setting.kind if self.speed == TUNED_SPEED else f"{setting.kind}, {self.speed:g} m/s")
        begin = self._begin(foot)
        lines = []
        costs_text = []
        files = {}
        walks = []
        for search in self.searches:
            label = kept_name(name, search)
            person, of_generations = self._search(begin, search, label, progress)
            lines += [[search, *line] for line in of_generations]
            _, first_best, _ = of_generations[0]
            _, last_best, last_median = of_generations[-1]
            costs_text.append(f"`{label}`: best {first_best:.2f} to {last_best:.2f}, median {last_median:.2f}")
            walks.append([f"{label}, not adapted", *self._walked("pretrained", person.foot)])
            walks.append([label, *self._walked(SCHEDULE[0], person.setting(self.speed))])
            files[f"foot-{search}.json"] = json.dumps(person.setting(self.speed), indent=1) + "\n"
        head = ["", *(number.label for number in TOLD)]
        text = (
            f"{table(head, walks)}\n\n{self.episodes} episodes × {self.seconds:g} s; falls as shares, the last by "
            f"±{PUSH_NEWTON:g} N; not adapted by `pretrained` on the same foot, adapted by the schedule found. "
            f"{ABOUT_STOPS}\n\nPrices of candidates (studies/feet/person_cost.py): {'; '.join(costs_text)}.\n\n"
            "Walk with what was found:\n\n"
        )
        text += "\n".join(f"  --right-foot {self.out or 'FOLDER'}/{file}" for file in files)
        files["generations.csv"] = csv_text(["search", "generation", "best", "median"], lines)
        return Answer(text=text, files=files)

    def _walked(self, policy: str, foot: str | dict[str, Any]) -> list[str]:
        """Return the numbers `TOLD` of a policy's walk on the right `foot`, as cells of a table."""
        schedule, as_factors = SCHEDULE
        given = {"right_foot": foot, "speed": self.speed, "episode_seconds": self.seconds}
        given |= as_factors if policy == schedule else {}
        numbers = walked(policy, given, episodes=self.episodes, seed=self.seed, threads=self.threads)
        return [text_of(numbers[number.key], number.pattern) for number in TOLD]

    def _begin(self, foot: str | dict[str, Any]) -> Person:
        """Return the person from whom the search for `foot` starts, as the flag `start` says.

        Raises `SpringfootError` for a `start` that the file does not have.
        """
        if not self.start:
            return beginning(foot, self.speed)
        known = read_feet(self.feet)["feet"]
        if self.start not in known:
            raise SpringfootError(f"no foot {self.start!r} to start from in {self.feet}; there are {', '.join(known)}")
        if foot == known[self.start]["kind"]:  # a kind alone: the numbers are those of the foot to start from
            foot = without_person(known[self.start])
        settings = BipedSettings(speed=self.speed, right_foot=known[self.start])
        sound, other = (person_constants(settings, self.speed, side) for side in (LEFT, RIGHT))
        return Person(sound=sound, other=other, foot=foot)

    def _search(
        self, begin: Person, search: int, label: str, progress: OnProgress
    ) -> tuple[Person, list[tuple[int, float, float]]]:
        """Run search number `search` from the person `begin`, and keep the best person under `label`.

        Returns the person at the search's mean, and number, best and median cost of each generation.
        """
        settings = BipedSettings(speed=self.speed)
        space = PersonSearch(begin, self.speed, self.design)
        seed = self.seed + 1_000_000 * (search - 1)
        options = {"popsize": self.population, "seed": seed + 1, "CMA_diagonal": True, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(np.zeros(space.size), self.sigma, options)
        bend = None if self.bend_deg is None else radians(self.bend_deg)

        def costs_of(generation: int, vectors: list[NDArray]) -> NDArray:
            """Return the costs of a generation's candidates, which all walk from the same seeds."""
            people = [space.person(vector) for vector in vectors]
            first_seed = seed + 1000 * generation
            threads = self.threads
            return person_cost.cost(settings, people, first_seed, threads, self.push_newton, bend, self.bend_weight)

        lines = []
        for generation, _, costs in generations(strategy, self.generations, costs_of):
            lines.append((generation + 1, float(costs.min()), float(np.median(costs))))
            progress(1)
            last = generation == self.generations - 1
            if generation % 10 == 9 or last:
                self._keep(label, space.person(strategy.mean), last)
                _, best, median = lines[-1]
                tqdm.write(f"{label}: generation {generation + 1}: best {best:.2f}, median {median:.2f}")
        return space.person(strategy.mean), lines

    def _keep(self, label: str, found: Person, last: bool) -> None:
        """Write the best person so far and, at the `last` generation, this command; with --quick nothing."""
        if self.quick:
            return
        known = read_feet(self.feet)  # anew: another search may have written its own
        known["feet"][label] = found.setting(self.speed)
        known["found_by"].pop(label, None)
        known["found_by"] |= {label: without_places(self.command)} if last else {}
        write_atomically(self.feet, (json.dumps(known, indent=1) + "\n").encode())
