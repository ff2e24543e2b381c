"""The worth of a right foot to the person who wears it: rigid, a passive spring, adaptive, intact.

    springfoot study prosthesis
    springfoot study prosthesis --train

The feet and the people who have adapted to them are the committed ones of `springfoot study adapt`, two independent
searches of each kind at the same budget: of the passive foot stiffness and rest angles too, of the adaptive one its
schedule and rest angles. With --train a policy learns on each, from several seeds, as factors on the schedule that
the search found; it sets the stiffness of the sound foot, and of the right one where that is adaptive. Walks for which
nothing was trained are told in groups of episodes, for their spread.
"""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import tyro

from springfoot.agents.policies import BEST
from springfoot.agents.training import PRESETS, TrainingConfig
from springfoot.envs.control import TUNED_SPEED
from springfoot.envs.settings import ADAPTED, committed_feet, without_person
from springfoot.errors import SpringfootError, require_count
from springfoot.files.writing import csv_text
from springfoot.gait.body import REFERENCE_HEIGHT, REFERENCE_MASS

from ..base.kept import Kept
from ..base.study import Answer, OnProgress
from ..base.trainings import TrainingStudy
from .adapt import kept_name
from .foot_walks import NAMES, PUSH_NEWTON, SCHEDULE, UNSEARCHED, for_body, walked
from .prosthesis_page import ADAPTED_ALONE, NOT_ADAPTED, TOE_HELD, WITH_POLICY, draw, sections, share_rows

WORN = ("rigid", "passive", "adaptive")
"""Feet that were adapted to."""
TRAINED = ("passive", "adaptive")
"""Those on which policies learn."""
SEARCHES = (1, 2)
BODIES = ((REFERENCE_HEIGHT, REFERENCE_MASS), (1.55, 50.0), (1.85, 90.0))
"""Height [m] and mass [kg]."""
PLACES = (*((body, TUNED_SPEED) for body in BODIES), (BODIES[0], 0.8), (BODIES[0], 1.6))
"""Bodies, and speeds [m/s]; the first was searched for and trained on."""
STEPS = 150_000
"""Environment steps of each training, from the schedule of the search on."""


@dataclass(frozen=True, kw_only=True)
class Prosthesis(TrainingStudy):
    """Walk on each foot, with legs that have not adapted, legs that have, and policies trained on them."""

    episodes: int = 20
    """Episodes of each walk, undisturbed, and as many pushed."""
    groups: int = 5
    """Groups in which those of a walk without training are told, in place of seeds of trainings."""
    seconds: float = 12.0
    """Length of each."""
    seed: int = UNSEARCHED
    """Seed of the first episode; no search has walked these."""
    seeds: int = 5
    """Seeds of the trainings."""
    episodes_elsewhere: int = 4
    """Episodes of each walk of other bodies and speeds."""
    seeds_elsewhere: int = 1
    """Seeds of the trainings that walk there."""
    timesteps: int | None = STEPS
    """Steps of 20 ms of each training."""
    train: bool = False
    """Train what is missing and keep it in `policies`."""
    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/feet/trainings")
    """Folder of the trainings."""
    policies: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("docs/feet")
    """Folder of their policies, KIND-SEARCH-SEED.safetensors."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File in which each row's numbers are kept, to go on after a stop."""

    QUICK: ClassVar[Mapping[str, Any]] = {
        **{"episodes": 1, "groups": 1, "seconds": 6.0, "seeds": 1, "train": False, "keep": None}
    }

    def check(self) -> None:
        """Refuse counts out of range, and groups of unequal size."""
        super().check()
        require_count("groups", self.groups)
        if self.episodes % self.groups:
            raise SpringfootError(f"episodes must be a multiple of groups, got {self.episodes} and {self.groups}")

    @property
    def total(self) -> float:
        """Simulated seconds without falls, of what is not kept."""
        return 2.0 * self.seconds * sum(self._how(row)["episodes"] for row, _, _ in self._rows())

    def ask(self, progress: OnProgress) -> Answer:
        """Train what is asked for and missing, and walk."""
        failed = self._train() if self.train else False
        kept = Kept(self.keep)
        rows = []
        for row, policy, given in self._rows():
            how = self._how(row)
            asked = [row, policy, _digest(policy, given), given, {**how, "threads": 0}, PUSH_NEWTON, NAMES]
            found = kept.get(asked, lambda p=policy, g=given, h=how: walked(p, g, progress=progress, **h))
            rows.append({**row, **found})
        shares = share_rows(rows)
        columns = list(rows[0])
        elsewhere = f"{self.episodes_elsewhere} episodes of each, of {self.seeds_elsewhere} seeds of the trainings"
        learned = f"{self.timesteps or STEPS:,} steps of 20 ms"
        text = sections(rows, shares, (self.what_ran, elsewhere, learned), self.policies)
        files = {
            "prosthesis.csv": csv_text(columns, [[row[name] for name in columns] for row in rows]),
            "recovered.csv": csv_text(list(shares[0]), [list(each.values()) for each in shares]) if shares else "",
            "prosthesis.png": partial(draw, rows=rows),
        }
        files = {name: content for name, content in files.items() if content}
        return Answer(text="\n\n".join(text.values()), files=files, failed=failed)

    def _how(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """Return how the episodes of a row are recorded."""
        if not (_here(row) or row["asked_m_s"] == _held_speed()):
            return {**self.how, "episodes": self.episodes_elsewhere}
        if row["person"] == WITH_POLICY:
            return self.how
        each = self.episodes // self.groups
        return {**self.how, "episodes": each, "seed": self.seed + each * row["seed"]}

    def _rows(self) -> Iterator[tuple[dict[str, Any], str, dict[str, Any]]]:
        """Return the labels of a row, its policy, and its settings.

        `seed` is that of a training, or a group of episodes.
        """
        feet = committed_feet()
        quick = self.quick
        for (height, mass), speed in PLACES[: 1 if quick else None]:
            given = {"height": height, "mass": mass, "speed": speed, "episode_seconds": self.seconds}
            where = {"height_m": height, "mass_kg": mass, "asked_m_s": speed}
            groups = range(self.groups if _here(where) else 1)
            for group in groups:
                yield _row("intact", NOT_ADAPTED, where, "", group), "pretrained", given
            for kind in WORN:
                for search in SEARCHES:
                    name = kept_name(kind, search)
                    if name not in feet:
                        continue
                    bare = for_body(without_person(feet[name]), height, mass)
                    worn = {**bare, ADAPTED: name}
                    own = {**given, "right_foot": bare}
                    for group in groups:
                        yield _row(kind, NOT_ADAPTED, where, search, group), "pretrained", own
                    own = {**given, **SCHEDULE[1], "right_foot": worn}
                    for group in groups:
                        yield _row(kind, ADAPTED_ALONE, where, search, group), SCHEDULE[0], own
                    seeds = self.seeds if _here(where) else min(self.seeds, self.seeds_elsewhere)
                    for seed in range(seeds if kind in TRAINED else 0):
                        policy = self.policies / f"{kind}-{search}-{seed}.safetensors"
                        if policy.is_file():
                            its = {**given, "right_foot": worn}
                            yield _row(kind, WITH_POLICY, where, search, seed), str(policy), its
        yield from self._held()

    def _held(self) -> Iterator[tuple[dict[str, Any], str, dict[str, Any]]]:
        """Return the rigid foot whose toe is held, and the passive feet, at the speed at which it was found."""
        if (speed := _held_speed()) is None:
            return
        (height, mass), feet = BODIES[0], committed_feet()
        where = {"height_m": height, "mass_kg": mass, "asked_m_s": speed}
        found = [(TOE_HELD, "", TOE_HELD), *(("passive", search, kept_name("passive", search)) for search in SEARCHES)]
        given = {"speed": speed, "episode_seconds": self.seconds}
        for group in range(self.groups):
            yield _row("intact", NOT_ADAPTED, where, "", group), "pretrained", given
        for foot, search, name in found:
            bare = without_person(feet[name])
            own = {**given, "right_foot": bare}, {**given, **SCHEDULE[1], "right_foot": {**bare, ADAPTED: name}}
            for group in range(self.groups):
                yield _row(foot, NOT_ADAPTED, where, search, group), "pretrained", own[0]
            for group in range(self.groups):
                yield _row(foot, ADAPTED_ALONE, where, search, group), SCHEDULE[0], own[1]

    def _train(self) -> bool:
        jobs = []
        for search in SEARCHES:
            for seed in range(self.seeds):
                for kind in TRAINED:
                    config = config_of(kept_name(kind, search), seed, self.timesteps or STEPS)
                    folder = self.runs / f"{kind}-{search}" / f"seed-{seed}"
                    jobs.append((config, folder, f"{kind} {search}, seed {seed}"))
        failed = self.train_missing(jobs)
        self.policies.mkdir(parents=True, exist_ok=True)
        for _, folder, _ in jobs:
            if (folder / BEST).is_file():
                shutil.copyfile(folder / BEST, self.policies / f"{folder.parent.name}-{folder.name[5:]}.safetensors")
        return failed


def _here(where: Mapping[str, Any]) -> bool:
    """Return whether a row is of the body and the speed that was searched for and trained on."""
    return (where["height_m"], where["mass_kg"], where["asked_m_s"]) == (*BODIES[0], TUNED_SPEED)


def _held_speed() -> float | None:
    held = committed_feet().get(TOE_HELD)
    return None if held is None else float(next(iter(held[ADAPTED])))


def _row(foot: str, person: str, where: Mapping[str, float], search: int | str, seed: int) -> dict[str, Any]:
    return {"foot": foot, "person": person, "search": search, "seed": seed, **where}


def config_of(name: str, seed: int, timesteps: int) -> TrainingConfig:
    """Preset `walk` on the adapted foot of that name, its stiffness factors on the schedule of the search."""
    if name not in committed_feet():
        raise SpringfootError(f"no adapted foot {name!r}; there are {', '.join(committed_feet())}")
    preset = PRESETS["walk"]
    worn = {**without_person(committed_feet()[name]), ADAPTED: name}
    return replace(
        preset,
        seed=seed,
        timesteps=timesteps,
        environment=replace(preset.environment, action_mode="residual", right_foot=worn),
    )


def _digest(policy: str, given: Mapping[str, Any]) -> str:
    """Return of the policy's file, and of the legs and the foot that go by a name."""
    path = Path(policy)
    foot = given.get("right_foot")
    name = foot.get(ADAPTED, "") if isinstance(foot, dict) else ""
    content = path.read_bytes() if path.is_file() else b""
    return hashlib.sha256(content + json.dumps(committed_feet().get(name)).encode()).hexdigest()
