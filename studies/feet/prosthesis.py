"""Compare right feet by the walk of the person who wears them: rigid, a passive spring, adaptive, intact.

    springfoot study prosthesis
    springfoot study prosthesis --train

The feet and the people who have adapted to them are the committed ones of `springfoot study adapt`, two independent
searches of each kind at the same budget. The search also moved stiffness and rest angles of the passive foot, and
schedule and rest angles of the adaptive one. With --train a policy learns on each foot, from several seeds, as factors
on the schedule that the search found; it sets the stiffness of the sound foot, and of the right foot if that is
adaptive. Walks without a trained policy are shown in groups of episodes, for their spread.
"""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from pathlib import Path
from typing import Annotated, Any, ClassVar

import matplotlib
import numpy as np
import tyro
from matplotlib.figure import Figure

from springfoot.agents.policies import BEST, SHIPPED, find_policy
from springfoot.agents.training import PRESETS, TrainingConfig
from springfoot.envs.control import TUNED_SPEED
from springfoot.envs.settings import ADAPTED, committed_feet, without_person
from springfoot.errors import SpringfootError, require_count
from springfoot.evaluation.report import STYLE
from springfoot.files.markdown import MISSING, table, text_of
from springfoot.files.text_table import read_bytes
from springfoot.files.writing import csv_text
from springfoot.gait.body import REFERENCE_HEIGHT, REFERENCE_MASS
from springfoot.gait.people import mean_sd

from ..base.intervals import t_interval
from ..base.kept import Kept
from ..base.study import Answer, OnProgress
from ..base.training_study import TrainingStudy
from .adapt import kept_name
from .foot_walks import ABOUT_STOPS, ASKED, NAMES, PUSH_NEWTON, SCHEDULE, TOLD, UNSEARCHED, Asked, for_body, walked

WORN = ("rigid", "passive", "adaptive")
"""Feet with people who have adapted to them."""
TRAINED = ("passive", "adaptive")
"""Feet on which policies learn."""
SEARCHES = (1, 2)
BODIES = ((REFERENCE_HEIGHT, REFERENCE_MASS), (1.55, 50.0), (1.85, 90.0))
"""Height [m] and mass [kg]."""
PLACES = (*((body, TUNED_SPEED) for body in BODIES), (BODIES[0], 0.8), (BODIES[0], 1.6))
"""Bodies and speeds [m/s] to walk at; searches and trainings were at the first."""
STEPS = 150_000
"""Environment steps of each training, which starts from the schedule of the search."""


@dataclass(frozen=True, kw_only=True)
class Prosthesis(TrainingStudy):
    """Walk on each foot: with legs that have not adapted, with legs that have, and with policies trained on them."""

    episodes: int = 20
    """Episodes of each walk, undisturbed, and as many pushed."""
    groups: int = 5
    """Groups of episodes that show the spread of walks without training."""
    seconds: float = 12.0
    """Length of each episode."""
    seed: int = UNSEARCHED
    """Seed of the first episode; no search has walked from these seeds."""
    seeds: int = 5
    """Seeds of the trainings."""
    episodes_elsewhere: int = 4
    """Episodes of each walk with another body or speed."""
    seeds_elsewhere: int = 1
    """Seeds of the trainings that walk there."""
    timesteps: int | None = STEPS
    """Steps of 20 ms of each training."""
    train: bool = False
    """Train missing policies and keep them in `policies`."""
    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/feet/trainings")
    """Folder of the trainings."""
    policies: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder of the trained policies, KIND-SEARCH-SEED.safetensors; by default those of the package."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File in which each row's numbers are kept, to go on after a stop."""

    QUICK: ClassVar[Mapping[str, Any]] = {
        **{"episodes": 1, "groups": 1, "seconds": 6.0, "seeds": 1, "train": False, "keep": None}
    }

    def check(self) -> None:
        """Refuse counts out of range, and groups of unequal size."""
        super().check()
        require_count("groups", self.groups)
        if self.train and self.policies is None:
            raise SpringfootError("--train keeps policies: give --policies a folder for them")
        if self.episodes % self.groups:
            raise SpringfootError(f"episodes must be a multiple of groups, got {self.episodes} and {self.groups}")

    @property
    def total(self) -> float:
        """Return the simulated time of all rows if none falls [s]."""
        return 2.0 * self.seconds * sum(self._how(row)["episodes"] for row, _, _ in self._rows())

    def ask(self, progress: OnProgress) -> Answer:
        """Train missing policies if asked to, and walk."""
        failed = self._train() if self.train else False
        kept = Kept(self.keep)
        rows = []
        for labels, policy, settings in self._rows():
            how = self._how(labels)
            # All that the numbers depend on; they do not on the threads.
            question = [labels, policy, _digest(policy, settings), settings, {**how, "threads": 0}, PUSH_NEWTON, NAMES]
            numbers = kept.get(question, lambda p=policy, s=settings, h=how: walked(p, s, progress=progress, **h))
            rows.append({**labels, **numbers})
        shares = share_rows(rows)
        columns = list(rows[0])
        elsewhere = f"{self.episodes_elsewhere} episodes of each, of {self.seeds_elsewhere} seeds of the trainings"
        learned = f"{self.timesteps or STEPS:,} steps of 20 ms"
        text = sections(rows, shares, (self.what_ran, elsewhere, learned))
        files = {
            "prosthesis.csv": csv_text(columns, [[row[name] for name in columns] for row in rows]),
            "recovered.csv": csv_text(list(shares[0]), [list(row.values()) for row in shares]) if shares else "",
            "prosthesis.png": partial(draw, rows=rows),
        }
        files = {name: content for name, content in files.items() if content}
        return Answer(text="\n\n".join(text.values()), files=files, failed=failed)

    def _how(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments of `record` for the episodes of a row; without a trained policy those of its group.

        `row` has the row's labels. Rows at other places have fewer episodes.
        """
        if not (_is_first_place(row) or row["asked_m_s"] == _speed_of_held_toe()):
            return {**self.how, "episodes": self.episodes_elsewhere}
        if row["person"] == WITH_POLICY:
            return self.how
        group_size = self.episodes // self.groups
        return {**self.how, "episodes": group_size, "seed": self.seed + group_size * row["seed"]}

    def _rows(self) -> Iterator[tuple[dict[str, Any], str, dict[str, Any]]]:
        """Yield the labels of each row, its policy and its environment settings.

        The label `seed` is that of the training or, without a trained policy, the number of the group of episodes.
        """
        feet = committed_feet()
        schedule, as_factors = SCHEDULE
        for (height, mass), speed in PLACES[:1] if self.quick else PLACES:
            settings = {"height": height, "mass": mass, "speed": speed, "episode_seconds": self.seconds}
            place = {"height_m": height, "mass_kg": mass, "asked_m_s": speed}
            groups = range(self.groups if _is_first_place(place) else 1)
            for group in groups:
                yield _labels("intact", NOT_ADAPTED, place, "", group), "pretrained", settings
            for kind in WORN:
                for search in SEARCHES:
                    name = kept_name(kind, search)
                    if name not in feet:
                        continue
                    foot = for_body(without_person(feet[name]), height, mass)
                    not_adapted = {**settings, "right_foot": foot}
                    adapted = {**settings, "right_foot": {**foot, ADAPTED: name}}
                    for group in groups:
                        yield _labels(kind, NOT_ADAPTED, place, search, group), "pretrained", not_adapted
                    for group in groups:
                        yield _labels(kind, ADAPTED_ALONE, place, search, group), schedule, {**adapted, **as_factors}
                    seeds = self.seeds if _is_first_place(place) else min(self.seeds, self.seeds_elsewhere)
                    for seed in range(seeds if kind in TRAINED else 0):
                        if policy := self._policy(f"{kind}-{search}-{seed}"):
                            yield _labels(kind, WITH_POLICY, place, search, seed), policy, adapted
        yield from self._rows_with_held_toe()

    def _policy(self, name: str) -> str:
        """Return the path of a trained policy, or its name if it is the package's; an empty text if there is none."""
        if self.policies is None:
            return name if name in SHIPPED else ""
        path = self.policies / f"{name}.safetensors"
        return str(path) if path.is_file() else ""

    def _rows_with_held_toe(self) -> Iterator[tuple[dict[str, Any], str, dict[str, Any]]]:
        """Yield, as `_rows` does, the rigid foot with a held toe and the passive feet, at the speed of the held toe's
        search."""
        if (speed := _speed_of_held_toe()) is None:
            return
        height, mass = BODIES[0]
        feet = committed_feet()
        schedule, as_factors = SCHEDULE
        place = {"height_m": height, "mass_kg": mass, "asked_m_s": speed}
        settings = {"speed": speed, "episode_seconds": self.seconds}
        for group in range(self.groups):
            yield _labels("intact", NOT_ADAPTED, place, "", group), "pretrained", settings
        passive = [("passive", search, kept_name("passive", search)) for search in SEARCHES]
        for kind, search, name in [(TOE_HELD, "", TOE_HELD), *passive]:
            foot = without_person(feet[name])
            not_adapted = {**settings, "right_foot": foot}
            adapted = {**settings, **as_factors, "right_foot": {**foot, ADAPTED: name}}
            for group in range(self.groups):
                yield _labels(kind, NOT_ADAPTED, place, search, group), "pretrained", not_adapted
            for group in range(self.groups):
                yield _labels(kind, ADAPTED_ALONE, place, search, group), schedule, adapted

    def _train(self) -> bool:
        """Train the missing policies and copy them into `policies`; return True if a training failed."""
        jobs = []
        for search in SEARCHES:
            for seed in range(self.seeds):
                for kind in TRAINED:
                    config = config_of(kept_name(kind, search), seed, self.timesteps or STEPS)
                    folder = self.runs / f"{kind}-{search}" / f"seed-{seed}"
                    jobs.append((config, folder, f"{kind} {search}, seed {seed}"))
        failed = self.train_missing(jobs)
        assert self.policies is not None  # `check` refuses None
        self.policies.mkdir(parents=True, exist_ok=True)
        for _, folder, _ in jobs:
            if (folder / BEST).is_file():
                seed_text = folder.name.removeprefix("seed-")
                shutil.copyfile(folder / BEST, self.policies / f"{folder.parent.name}-{seed_text}.safetensors")
        return failed


def _is_first_place(row: Mapping[str, Any]) -> bool:
    """Return True if a row has the body and the speed of the searches and trainings, the first of `PLACES`."""
    return (row["height_m"], row["mass_kg"], row["asked_m_s"]) == (*BODIES[0], TUNED_SPEED)


def _speed_of_held_toe() -> float | None:
    """Return the speed at which the person with a held toe was searched for [m/s]; None without that foot."""
    foot = committed_feet().get(TOE_HELD)
    return None if foot is None else float(next(iter(foot[ADAPTED])))  # its one speed


def _labels(foot: str, person: str, place: Mapping[str, float], search: int | str, seed: int) -> dict[str, Any]:
    """Return the labels of a row: its first columns in the CSV file.

    `place` has height [m], mass [kg] and speed [m/s] by the names of `WHERE`; `search` is "" for feet without a search.
    """
    return {"foot": foot, "person": person, "search": search, "seed": seed, **place}


def config_of(name: str, seed: int, timesteps: int) -> TrainingConfig:
    """Return the preset `walk` on the committed foot `name`, worn by the person who has adapted to it.

    Actions are factors on the stiffness schedule in that person's leg constants, which the search found.
    """
    if name not in committed_feet():
        raise SpringfootError(f"no adapted foot {name!r}; there are {', '.join(committed_feet())}")
    preset = PRESETS["walk"]
    # The person by name, in place of the whole dictionary of leg constants.
    worn = {**without_person(committed_feet()[name]), ADAPTED: name}
    return replace(
        preset,
        seed=seed,
        timesteps=timesteps,
        environment=replace(preset.environment, action_mode="residual", right_foot=worn),
    )


def _digest(policy: str, settings: Mapping[str, Any]) -> str:
    """Return a digest of the policy's file, and of the committed foot and person that `settings` name.

    Kept numbers of a row are of this digest, so that another file or another search has the row walked again.
    """
    path = find_policy(policy) if policy in SHIPPED else Path(policy)
    foot = settings.get("right_foot")
    name = foot.get(ADAPTED, "") if isinstance(foot, dict) else ""
    content = read_bytes(path) if path.is_file() else b""
    return hashlib.sha256(content + json.dumps(committed_feet().get(name)).encode()).hexdigest()


NOT_ADAPTED, ADAPTED_ALONE, WITH_POLICY = "not adapted", "adapted", "adapted, trained"
"""Kinds of rows: legs of sound feet, the sound side's stiffness by `pretrained`; adapted legs with their own schedule;
the same legs with a trained policy."""
TOE_HELD = "rigid, toe held"
"""Committed rigid foot whose person was searched for with a held toe, at a speed of its own."""
WHERE = ("height_m", "mass_kg", "asked_m_s")
"""Labels that make a row's place: body and speed."""
COLORS = {"intact": "#555555", "rigid": "#7a5195", "passive": "#c26a1b", "adaptive": "#0b6e8f"}
Row = Mapping[str, Any]


def share_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the changes that adaptive stiffness brings over the passive spring, by place, person, number and search.

    Pairs have the same seed of the trainings or, without training, the same episodes.

    `share` is the change over the gap between the passive and the intact foot. There is no share where the intact foot
    is not better, or better by no more than the gap's interval over the pairs. The intervals of `both` searches are
    over the means of each search, as searches differ more than seeds.
    """
    lines = []
    for place in dict.fromkeys(_place(row) for row in rows):
        at_place = [row for row in rows if _place(row) == place]
        for person in (ADAPTED_ALONE, WITH_POLICY):
            compared = [row for row in at_place if row["person"] == person or row["foot"] == "intact"]
            searches = sorted({row["search"] for row in compared if row["foot"] == "adaptive"})
            for asked in ASKED:
                labels = dict(zip(WHERE, place, strict=True)) | {"person": person, "number": asked.key}
                lines += [labels | change for change in _changes(compared, asked, searches)]
    return lines


def _changes(rows: Sequence[Row], asked: Asked, searches: Sequence[int]) -> list[dict[str, Any]]:
    """Return the change of one number from passive to adaptive feet, for each search by itself and for both."""
    known = [row[asked.key] for row in rows if row["foot"] == "intact" and row[asked.key] is not None]
    intact = float(np.mean(known)) if known else None
    by_search = {search: pairs_of(rows, (("passive", search), ("adaptive", search)), asked.key) for search in searches}
    changes = [
        {"search": search, "pairs": len(pairs)} | _change(pairs, intact, asked.better)
        for search, pairs in by_search.items()
    ]
    if len(searches) > 1:
        # Mean of each search that has pairs, (n, 2): passive, adaptive; (0, 2) if no search has any.
        means = np.array([pairs.mean(0) for pairs in by_search.values() if len(pairs)]).reshape(-1, 2)
        both = {"search": "both", "pairs": sum(map(len, by_search.values()))}
        changes.append(both | _change(means, intact, asked.better, few=True))
    return changes


def pairs_of(rows: Sequence[Row], feet: Sequence[tuple[str, Any]], key: str) -> np.ndarray:
    """Return the number `key` of two feet, (n, 2), from pairs of rows with the same seed; None leaves a pair out.

    `feet` are two pairs of foot and search.
    """
    first, second = (
        {row["seed"]: row[key] for row in rows if (row["foot"], row["search"]) == foot_and_search}
        for foot_and_search in feet
    )
    pairs = [(first[seed], second[seed]) for seed in first if seed in second]
    return np.array([pair for pair in pairs if None not in pair], float).reshape(-1, 2)


def _change(pairs: np.ndarray, intact: float | None, better: int, few: bool = False) -> dict[str, float | None]:
    """Return mean, interval and share of a change, as `share_rows` describes.

    Args:
        pairs: (n, 2) number of the passive and of the adaptive foot.
        intact: mean number of the intact foot; None if unknown.
        better: 1 if more is better, -1 if less is.
        few: the pairs are means of searches, too few for an interval of the gap: there is a share if each has a gap.
    """
    names = ("passive", "adaptive", "intact", "change", "change_low", "change_high", "share", "share_low", "share_high")
    result: dict[str, float | None] = dict.fromkeys(names)
    if not len(pairs):
        return result
    passive, adaptive = pairs.T
    change = adaptive - passive
    low, high = t_interval(change)
    result |= {"passive": float(passive.mean()), "adaptive": float(adaptive.mean()), "intact": intact}
    result |= {"change": float(change.mean()), "change_low": low, "change_high": high}
    if intact is not None:
        gap = intact - passive
        has_gap = (better * gap).min() > 0 if few else min(t_interval(better * gap)) > 0
        if has_gap:
            ends = sorted(value / float(gap.mean()) for value in (low, high))  # a negative gap changes their order
            result |= {"share": float(change.mean() / gap.mean()), "share_low": ends[0], "share_high": ends[1]}
    return result


def sections(rows: Sequence[Row], shares: Sequence[Row], ran: tuple[str, str, str]) -> dict[str, str]:
    """Return the sections of the report, by heading.

    `ran` describes, in words, the walks at the first place, the walks elsewhere, and the length of the trainings.
    """
    first = _place(rows[0])
    at_first = [row for row in rows if _place(row) == first]
    note = (
        f"{ran[0]} of each walk, undisturbed and, for the column `falls, pushed`, pushed by ±{PUSH_NEWTON:g} N; falls "
        "as shares of episodes; numbers of walks that fell are of the strides before. Mean ± SD over rows of the CSV: "
        "groups of the same episodes, or seeds of trainings. Not adapted: legs of two sound feet, stiffness by "
        "`pretrained`. Adapted: legs (and the foot's own numbers) of `springfoot study adapt`, stiffness as its search "
        f"left it. Trained: the same, stiffness by policies trained on it for {ran[2]}. Cost of "
        f"transport counts what a passive spring gives back as well. {ABOUT_STOPS}"
    )
    text = {"PROSTHESIS": f"![Feet](prosthesis.png)\n\n{_place_text(first)}\n\n{_walks_table(at_first)}\n\n{note}"}
    if comparison := _passive_against(at_first, "rigid"):
        text["PROSTHESIS"] += f"\n\n{comparison}"
    if held := [row for row in rows if row["foot"] == TOE_HELD]:
        place = _place(held[0])
        beside = [row for row in rows if _place(row) == place]
        text["TOE-HELD"] = f"{_place_text(place)}\n\n{_walks_table(beside)}\n\n{_passive_against(beside, TOE_HELD)}"
        rows = [row for row in rows if row not in beside]
    if shares:
        text["RECOVERED"] = _shares_text([row for row in shares if _place(row) == first])
    if len({_place(row) for row in rows}) > 1:
        text["PROSTHESIS-ELSEWHERE"] = _elsewhere(rows, ran[1])
    return text


def _place(row: Row) -> tuple[float, ...]:
    """Return height [m], mass [kg] and commanded speed [m/s] of a row."""
    return tuple(row[name] for name in WHERE)


def _walks_table(rows: Sequence[Row]) -> str:
    """Return the Markdown table of the walks at one place, mean ± SD over groups or seeds."""
    head = ["foot", "person", "search", "rows", *(number.label for number in TOLD)]
    lines = []
    for (foot, person, search), group in _groups(rows).items():
        cells = [_mean(group, number.key, number.pattern) for number in TOLD]
        lines.append([foot, person, str(search), str(len(group)), *cells])
    return table(head, lines)


def _groups(rows: Sequence[Row]) -> dict[tuple[str, str, Any], list[Row]]:
    """Return (foot, person, search) -> its rows."""
    groups: dict[tuple[str, str, Any], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["foot"], row["person"], row["search"]), []).append(row)
    return groups


def _mean(rows: Sequence[Row], key: str, pattern: str) -> str:
    """Return a number of several rows as "mean ± SD"; the mean alone for one row, a dash if no row has it."""
    values = [row[key] for row in rows if row[key] is not None]
    if not values:
        return MISSING
    spread = mean_sd(values)
    text = text_of(spread["mean"], pattern)
    return text if spread["sd"] is None or len(rows) < 2 else f"{text} ± {text_of(spread['sd'], pattern)}"


def _passive_against(rows: Sequence[Row], foot: str) -> str:
    """Return a sentence on the numbers in which the passive feet are better, worse or not told apart from `foot`.

    It has a part for each search, a run of `springfoot study adapt`. The person has adapted to both feet. Empty without
    rows of either foot.
    """
    adapted = [row for row in rows if row["person"] == ADAPTED_ALONE]
    searches_of_foot = {row["search"] for row in adapted if row["foot"] == foot}
    passive_searches = sorted({row["search"] for row in adapted if row["foot"] == "passive"})
    verdicts = []
    for search in passive_searches:
        numbers_by_verdict: dict[str, list[str]] = {"better": [], "worse": [], "not told apart": []}
        for asked in ASKED:
            compared = (foot, search if search in searches_of_foot else ""), ("passive", search)
            passive_minus_foot = np.diff(pairs_of(adapted, compared, asked.key), axis=1).ravel()
            low, high = t_interval(asked.better * passive_minus_foot)  # `better` is 1 or -1, the better direction
            if low > 0:
                verdict = "better"
            elif high < 0:
                verdict = "worse"
            else:
                verdict = "not told apart"
            numbers_by_verdict[verdict].append(asked.label)
        words = [
            f"{verdict} in {len(names)} ({'; '.join(names)})" for verdict, names in numbers_by_verdict.items() if names
        ]
        verdicts.append(f"search {search}: {', '.join(words)}")
    if not verdicts or not searches_of_foot:
        return ""
    return (
        f"Of {len(ASKED)} numbers the passive foot found is, against `{foot}`, the person adapted to each: "
        f"{'; '.join(verdicts)}; by 95 % intervals of the mean difference over the groups of episodes, Student's."
    )


def _shares_text(shares: Sequence[Row]) -> str:
    """Return the Markdown table of the changes by adaptive stiffness, and its note."""
    by_key = {asked.key: asked for asked in ASKED}
    lines = []
    for row in shares:
        asked = by_key[row["number"]]
        means = [text_of(row[name], asked.pattern) for name in ("passive", "adaptive", "intact")]
        change = _interval(row, "change", asked.pattern)
        share = _interval(row, "share", ".0%") if row["share"] is not None else "no gap"
        lines.append([asked.label, row["person"], str(row["search"]), str(row["pairs"]), *means, change, share])
    head = ["", "person", "search", "pairs", "passive, found", "adaptive", "intact", "change", "share of the gap"]
    return (
        f"{table(head, lines)}\n\nAdaptive less passive of the same search, and of the same seed of the training or "
        "the same episodes; 95 % intervals of the mean, Student's, over those pairs (`both`: over the means of the two "
        "searches). More push-off work, and less of all else, is better. No gap: the intact foot is not better, or not "
        "told apart."
    )


def _interval(row: Row, name: str, pattern: str) -> str:
    """Return a number and its interval, as in "0.12 [0.08, 0.16]"; a dash for None."""
    if row[name] is None:
        return MISSING
    low, high = (format(row[f"{name}_{end}"], pattern) for end in ("low", "high"))
    return f"{format(row[name], pattern)} [{low}, {high}]"


def _elsewhere(rows: Sequence[Row], ran: str) -> str:
    """Return the section on other bodies and speeds: of each foot the rows with policies, else with adapted legs."""
    keys = [("falls", ".2f"), ("speed_m_s", ".2f"), ("falls_pushed", ".2f")]
    keys += [(asked.key, asked.pattern) for asked in ASKED if asked.key != "falls_pushed"]
    lines = []
    for place in dict.fromkeys(_place(row) for row in rows):
        at_place = [row for row in rows if _place(row) == place]
        for foot in COLORS:
            group = [row for row in at_place if row["foot"] == foot]
            shown = [row for row in group if row["person"] == WITH_POLICY]
            shown = shown or [row for row in group if row["person"] == ADAPTED_ALONE] or group
            if shown:
                label = f"{foot}, {shown[0]['person']}"
                lines.append([_place_text(place), label, str(len(shown)), *(_mean(shown, *key) for key in keys)])
    labels = {asked.key: asked.label for asked in ASKED} | {"falls": "falls", "speed_m_s": "speed m/s"}
    head = ["where", "foot and person", "rows", *(labels[key] for key, _ in keys)]
    return (
        f"{table(head, lines)}\n\nMeans ± SD over searches, and seeds or groups of episodes; {ran}, but for the first "
        "place, which is that of the tables above. Legs were searched, and policies trained, at 1.2 m/s and 63 kg; at "
        "other speeds the legs are the committed ones of that speed, moved as far as the search moved them at 1.2 m/s; "
        "the passive foot's springs are as much stiffer as a body's mass × height is larger, the rigid foot's toe is "
        "the same on everybody."
    )


def _place_text(place: Sequence[float]) -> str:
    """Return a place in words."""
    height, mass, speed = place
    return f"{height:.2f} m, {mass:g} kg, {speed:g} m/s"


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Draw each number of each foot at the first place, a point for each row and a line for their mean."""
    first = _place(rows[0])
    at_first = [row for row in rows if _place(row) == first]
    columns = [
        ("intact", NOT_ADAPTED),
        *((foot, ADAPTED_ALONE) for foot in ("rigid", "passive", "adaptive")),
        *((foot, WITH_POLICY) for foot in ("passive", "adaptive")),
    ]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(14.0, 5.2), layout="constrained")
        axes = figure.subplots(2, ceil(len(ASKED) / 2)).flat
        for ax in axes[len(ASKED) :]:
            ax.remove()
        for ax, asked in zip(axes, ASKED, strict=False):
            for x, (foot, person) in enumerate(columns):
                group = [row for row in at_first if (row["foot"], row["person"]) == (foot, person)]
                values = [row[asked.key] for row in group if row[asked.key] is not None]
                ax.plot([x] * len(values), values, "o", color=COLORS[foot], ms=4, alpha=0.5)
                if values:
                    ax.plot(x, np.mean(values), "_", color=COLORS[foot], ms=18, mew=2)
            ax.set_title(asked.label)
            labels = [f"{foot}\n{'trained' if person == WITH_POLICY else ''}" for foot, person in columns]
            ax.set_xticks(range(len(columns)), labels, fontsize=7.5)
            ax.grid(axis="y", color="#ededed", lw=0.6)
        figure.savefig(path, dpi=110, facecolor="white", metadata={"Software": "springfoot"})
