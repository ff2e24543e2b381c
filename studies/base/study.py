"""Define a study once: its flags, its progress, its printed answer, its files and its report.

A study is a frozen dataclass of flags and a question: a subclass of `Study` (of `WalkingStudy` where policies walk
episodes) gives the flags, their defaults and their `QUICK` values, and answers in `ask`. A line in
`springfoot.cli.main.STUDIES` gives it its name on the command line. Nothing else is needed.
"""

import shlex
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import tyro
from tqdm import tqdm

from springfoot.envs.settings import LONGEST_EPISODE
from springfoot.errors import MOST_COUNT, MOST_THREADS, SpringfootError, require_count, require_number
from springfoot.files.writing import is_taken, whole_folder

OnProgress = Callable[[float], object]
"""Function that a study calls with each advance of its progress: simulated seconds, or the unit `Study.UNIT`."""
REPORT_FILE = "report.md"
"""File of a study's text, in its folder."""
QUICK_NOTE = "Made with --quick, only to see that it runs: these figures mean nothing."


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The answer of a study."""

    text: str
    """Markdown that the command prints and keeps as `REPORT_FILE`; its pictures are among `files`."""
    files: Mapping[str, str | Callable[[Path], object]] = field(default_factory=dict)
    """Name of a file in the study's folder -> its text, or a function that writes it at a path."""
    failed: bool = False
    """True if a part of the study failed; the exit code is then 1."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """A question asked of walks, with the flags that every study has; a subclass answers it in `ask`."""

    quick: tyro.conf.FlagCreatePairsOff[bool] = False
    """See that it runs, in a minute at most: tiny counts in place of flagged ones; its figures then mean nothing."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER", help_behavior_hint="(default: runs/NAME-N)")] = None
    """New folder for its CSV files and pictures."""
    command: tyro.conf.Suppress[tyro.conf.Fixed[str]] = ""
    """The command line that runs it; its report names it."""

    QUICK: ClassVar[Mapping[str, Any]] = {}
    """Name of a flag -> its value with `--quick`."""
    UNIT: ClassVar[str] = "s"
    """Unit of its progress."""
    REPEATABLE: ClassVar[Collection[str]] = frozenset()
    """Flags that may be given more than once."""

    def check(self) -> None:
        """Raise `SpringfootError` for a bad flag; called before anything else."""

    @property
    def total(self) -> float | None:
        """Progress at the end; None if unknown."""
        return None

    def ask(self, progress: OnProgress) -> Answer:
        """Do the study and return its answer; call `progress` with each advance."""
        raise NotImplementedError

    def run(self, name: str) -> int:
        """Do the study, print its answer and write its files; `name` is the study's name on the command line.

        Returns the exit code: 0, or 1 if a part of the study failed. Raises `SpringfootError`, with nothing written,
        for a bad flag and for an `out` that exists.
        """
        self.check()  # flags that --quick replaces, too
        study = replace(self, **self.QUICK) if self.quick else self
        study.check()
        if study.out is not None and is_taken(study.out):
            raise SpringfootError(f"{study.out} exists already: out must be a new folder")
        with whole_folder(study.out, Path("runs", name)) as (folder, out):
            with tqdm(
                total=study.total, desc=name, unit=study.UNIT, unit_scale=True, leave=False, disable=None, delay=0.5
            ) as bar:
                answer = study.ask(bar.update)
            if study.quick and study.QUICK:
                answer = replace(answer, text=f"{QUICK_NOTE}\n\n{answer.text}")
            made_by = f"\n\nMade by `{without_places(self.command)}`." if self.command else ""
            files = {REPORT_FILE: f"{answer.text}{made_by}\n", **answer.files}
            for file, content in files.items():
                _write(folder / file, content)
        print(answer.text)  # after its files: a pipe that closes early loses none of them
        print(f"\nResults: {out} ({', '.join(files)})")
        return 1 if answer.failed else 0


def episodes_words(episodes: int, seconds: float, seed: int) -> str:
    """Return number, length [s] and seeds of episodes in words; the first has the seed `seed`."""
    if episodes == 1:
        return f"1 episode × {seconds:g} s, seed {seed}"
    return f"{episodes} episodes × {seconds:g} s, seeds {seed}–{seed + episodes - 1}"


def without_places(command: str) -> str:
    """Return a command line without the flags that name the folders and files it writes, and their values."""
    words = shlex.split(command)
    for flag in ("--out", "--keep", "--feet"):
        if flag in words:
            index = words.index(flag)
            del words[index : index + 2]  # flag and value
    return shlex.join(words)


def _write(path: Path, content: str | Callable[[Path], object]) -> None:
    """Write a file of an answer, from its text or its function."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if callable(content):
        content(path)
    else:
        path.write_text(content, encoding="utf-8", newline="")


@dataclass(frozen=True, kw_only=True)
class WalkingStudy(Study):
    """A study with a row for each policy or condition in its tables, all walked from the same seeds."""

    episodes: int = 20
    """Episodes of each row."""
    seconds: float = 20.0
    """Length of each episode."""
    seed: int = 0
    """Episode i is seeded with seed + i, in every row."""
    threads: int = 2
    """Threads of the physics; the results are the same with any number."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 6.0}

    def check(self) -> None:
        """Refuse counts and lengths out of range."""
        for name, least, most in (("episodes", 1, MOST_COUNT), ("seed", 0, MOST_COUNT), ("threads", 1, MOST_THREADS)):
            require_count(name, getattr(self, name), least, most)
        require_number("seconds", self.seconds, 0, LONGEST_EPISODE, above=True, unit="s")

    @property
    def how(self) -> dict[str, Any]:
        """Return the arguments of `springfoot.evaluation.recording.recording.record` that the flags decide."""
        return {"episodes": self.episodes, "seed": self.seed, "threads": self.threads}

    @property
    def what_ran(self) -> str:
        """Return number, length and seeds of each row's episodes, in words."""
        return episodes_words(self.episodes, self.seconds, self.seed)

    @property
    def walked(self) -> dict[str, Any]:
        """Return `how` as JSON values, a part of the question under which a walk's numbers are kept; with threads 0, as
        their number does not change the walk."""
        return {**self.how, "threads": 0}


@dataclass(frozen=True, kw_only=True)
class PersonsStudy(WalkingStudy):
    """A study that walks learned persons, and keeps the numbers of each walk."""

    persons: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="PERSON ...")] = ("learned",)
    """Policies that move the person: run folders, files, or those of the package, such as `learned`."""
    episodes: int = 5
    """Episodes of each condition and commanded speed."""
    seconds: float = 12.0
    """Length of each episode."""
    keep: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File in which the numbers of each walk are kept, to go on after a stop."""

    QUICK: ClassVar[Mapping[str, Any]] = {"episodes": 1, "seconds": 6.0, "keep": None}
