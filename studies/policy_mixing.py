"""Finds a weighted mean of related policies that meets more criteria than each: CMA-ES on the shares.

    springfoot study mix docs/mixed/*.safetensors

Policies that were trained on from a common one are near enough that the mean of their weights walks as well
(Wortsman et al. 2022, arXiv 2203.05482); shares may be negative. A candidate pays for what it misses undisturbed, and
for return that it loses against the first policy in the world they were trained in, its bodies, speeds and slopes, with
harder pushes. The mean of the search is then judged on walks from other starts.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import cma
import numpy as np
import tyro
from tqdm import tqdm

from springfoot.agents.policies.policy import Policy, read_policy, save_policy
from springfoot.agents.training.returns import evaluate_returns
from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.errors import SpringfootError, require_count, require_number
from springfoot.evaluation.numbers.criteria import Criterion, numbers, unmet
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import CONDITIONS
from springfoot.evaluation.recording.recording import record
from springfoot.files.markdown import table, text_of
from springfoot.files.writing import csv_text

from .base.study import Answer, OnProgress, Study
from .criteria_met import CRITERIA
from .front import beyond_percent

MARGIN_PERCENT = 0.5
"""Nearness to the end of a criterion's range that is paid for already [% of that end]; chosen: about as much as the
mean of a few walks differs from that of a hundred."""
FALL_COST = 2.0
"""Price of each undisturbed walk that falls, beside the misses and the lost return [%]; chosen."""
HARD_PUSH, TRAINED_SECONDS = 200.0, 8.0
"""How hard candidates are pushed in the world they were trained in [N], harder than in training, and how long they walk
there [s]."""
SEARCHED_FROM, JUDGED_FROM = 1_000_000, 2_000_000
"""What is added to the seeds of episodes that search and that judge: no evaluation's own."""


Walk = tuple[dict[str, Any], NDArray, NDArray]
"""Metrics of undisturbed walks; return of each walk in the world of the training, and whether it fell."""


def mean_policy(policies: Sequence[Policy], shares: NDArray) -> Policy:
    """The policy whose weights and statistics are the sum of `shares` (P,) times those of P `policies`; else the first.

    Raises `SpringfootError` for policies of other layers or of another kind.
    """
    first = policies[0]
    for other in policies:
        if (other.layer_sizes, other.activation, other.output, other.observation_clip, other.fingerprint) != (
            *(first.layer_sizes, first.activation, first.output, first.observation_clip),
            first.fingerprint,
        ):
            raise SpringfootError("only policies of equal layers, for the same body and legs, have a mean")

    def mean(arrays: Sequence[NDArray]) -> NDArray:
        return np.tensordot(shares, np.stack(arrays).astype(np.float64), axes=1).astype(arrays[0].dtype)

    layers = range(len(first.weights))
    return replace(
        first,
        weights=tuple(mean([policy.weights[layer] for policy in policies]) for layer in layers),
        biases=tuple(mean([policy.biases[layer] for policy in policies]) for layer in layers),
        observation_mean=mean([policy.observation_mean for policy in policies]),
        observation_variance=np.maximum(mean([policy.observation_variance for policy in policies]), 0.0),
    )


def missed_percent(values: Mapping[str, Any], criteria: Sequence[Criterion] = CRITERIA) -> float:
    """Sum of what `numbers` miss of the criteria, and of what they are nearer than `MARGIN_PERCENT` [% of each end]."""
    beyond = (beyond_percent(each, values) for each in criteria if each.name != "falls")
    return sum(max(percent + MARGIN_PERCENT, 0.0) for percent in beyond if percent is not None)


def cheapest_shares(
    pays: Callable[[NDArray], float],
    count: int,
    generations: int,
    population: int,
    sigma: float,
    seed: int,
    progress: OnProgress,
) -> NDArray:
    """(count,) shares whose sum is 1: where CMA-ES on what they pay, begun from equal ones, ends."""
    options = {"popsize": population, "seed": seed, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(np.full(count - 1, 1 / count), sigma, options)
    for generation in range(generations):
        found = strategy.ask()
        paid = [pays(np.append(each, 1.0 - each.sum())) for each in found]
        strategy.tell(found, paid)
        tqdm.write(f"generation {generation + 1}: best {min(paid):.2f}, median {np.median(paid):.2f}")
        progress(1)
    return np.append(strategy.mean, 1.0 - strategy.mean.sum())


@dataclass(frozen=True, kw_only=True)
class Mix(Study):
    """Find the weighted mean of policies that misses least of the criteria, and write it as a policy."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POLICY ...")]
    """Two or more trained policies, trained on from a common one; the mean has the settings of the first."""
    generations: int = 30
    """Generations of the search."""
    population: int = 12
    """Candidates in each."""
    sigma: float = 0.1
    """First spread of the shares."""
    episodes: int = 4
    """Undisturbed walks of a candidate."""
    seconds: float = 12.0
    """Length of each [s]."""
    trained: int = 48
    """Walks of a candidate in the world of its training, pushed harder, of 8 s."""
    judged: int = 20
    """Undisturbed walks that judge what was found, and five times as many in that world."""
    seed: int = 0
    """Seed of the search and of the walks."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""

    QUICK: ClassVar[Mapping[str, Any]] = {
        "generations": 1,
        "population": 4,
        "episodes": 1,
        "seconds": 6.0,
        "trained": 2,
        "judged": 1,
    }
    PAGED: ClassVar[bool] = False
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse numbers out of range, and fewer than two policies."""
        least = {"generations": 1, "population": 4, "episodes": 1, "trained": 1, "judged": 1, "seed": 0, "threads": 1}
        for name, smallest in least.items():
            require_count(name, getattr(self, name), smallest)
        require_number("sigma", self.sigma, 0, above=True)
        require_number("seconds", self.seconds, 0, above=True, unit="s")
        if len(self.policies) < 2:
            raise SpringfootError(f"mix takes two or more policies, got {len(self.policies)}")

    @property
    def total(self) -> float:
        """Generations."""
        return self.generations

    def ask(self, progress: OnProgress) -> Answer:
        """Search, judge, and hand out the mean as `mix.safetensors`."""
        policies = [read_policy(name) for name in self.policies]
        first = self._walk(policies[0], self.episodes, self.trained, SEARCHED_FROM)

        def pays(shares: NDArray) -> float:
            return price(self._walk(mean_policy(policies, shares), self.episodes, self.trained, SEARCHED_FROM), first)

        how = (self.generations, self.population, self.sigma, self.seed + 1, progress)
        shares = cheapest_shares(pays, len(policies), *how).round(4)
        mean = mean_policy(policies, shares)
        walked = [self._walk(each, self.judged, 5 * self.judged, JUDGED_FROM) for each in (*policies, mean)]
        lines = []
        for name, share, walk in zip([*self.policies, "mix"], [*shares, None], walked, strict=True):
            missed = "; ".join(unmet(walk[0], CRITERIA))
            lines.append([Path(name).stem, share, price(walk, walked[0]), walk[1].mean(), int(walk[2].sum()), missed])
        head = ["policy", "share", "pays", "return as trained", "falls", "misses"]
        cells = [
            [f"`{name}`", text_of(share, "+.4f"), f"{price:.2f}", f"{earned:.0f}", str(falls), misses]
            for name, share, price, earned, falls, misses in lines
        ]
        text = (
            f"{table(head, cells)}\n\nMisses of {self.judged} walks of {self.seconds:g} s; return and falls of "
            f"{5 * self.judged} of {TRAINED_SECONDS:g} s in the world of the training, pushed by ±{HARD_PUSH:g} N."
        )
        files = {"mix.csv": csv_text(head, lines), "mix.safetensors": lambda path: save_policy(path, mean)}
        return Answer(text=text, files=files)

    def _walk(self, policy: Policy, episodes: int, trained: int, first: int) -> Walk:
        """Walk undisturbed, and in the world of the training."""
        alone = replace(policy.settings, **(CONDITIONS | {"episode_seconds": self.seconds}))
        seed, threads = self.seed + first, self.threads
        walk = record(policy, alone, name="mix", episodes=episodes, seed=seed, threads=threads)
        there = replace(policy.settings, episode_seconds=TRAINED_SECONDS, push_newton=HARD_PUSH)
        returns, _, fell = evaluate_returns(Biped(there, trained, threads), policy, seed)
        return measure(walk).metrics, returns, fell


def price(walk: Walk, first: Walk) -> float:
    """What a candidate pays: misses, falls, and return lost against the first policy [%]."""
    lost = 100.0 * (1.0 - walk[1].mean() / first[1].mean())
    return missed_percent(numbers(walk[0])) + FALL_COST * walk[0]["falls"] + max(lost, 0.0)
