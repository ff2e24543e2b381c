"""Mutants: wrong signs, comparisons and indices of gait, envs and agents, each of which a test should notice.

`python -m benchmarks.mutants` (`make mutants`) draws mutants of the newest commit by a seed. Each runs in a copy of the
repository, never in the repository itself: first the test files that execute its line, the quickest first, until one
test fails; survivors get all others. Before, once a commit, each test file runs alone and tells its lines.
All is kept in build/mutants/COMMIT, and the same command goes on after a stop.

The same mutants before and after a change of the code, wherever its files lie afterwards:

    python -m benchmarks.mutants --tree BEFORE --list > drawn.jsonl
    python -m benchmarks.mutants --tree BEFORE --from drawn.jsonl
    python -m benchmarks.mutants --tree AFTER --from drawn.jsonl
"""

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from benchmarks.checkout import Checkout
from benchmarks.executed_lines import FOLDER, REPOSITORY
from benchmarks.mutation import Mutant, Site, find, sites_of_rooms
from benchmarks.processes import Ended, Processes

ROOMS = ("gait", "envs", "agents")
"""Rooms that mutants are drawn from."""
LONGEST = 10.0
"""Time limit of a mutant's tests, as a multiple of their usual time."""
COMPILING = 180.0
"""Added to the time limit [s]: a mutated kernel is compiled, and all that call it."""
PYTEST = ("-m", "pytest", "-q", "-x", "-m", "", "-p", "no:cacheprovider", "--tb=no", "--hypothesis-seed=0")
"""How Python runs tests: marked slow or not, until the first fails, with the same draws each time."""
PASSED = (0, 5)
"""Exit codes of pytest: all passed, or there was none to run."""
EXECUTING = "tests that execute it"
OTHERS = "all other tests"
"""Stages of a verdict, by the test files that run."""


@dataclass(frozen=True, kw_only=True)
class MeasuredFile:
    """A file of tests, as it runs without a mutant."""

    file: str
    seconds: float
    passes: bool
    lines: dict[str, list[int]]
    """Lines of each source file that its tests execute."""

    def executes(self, site: Site) -> bool:
        """Tell whether its tests execute a line of the mutated statement."""
        return not set(site.lines).isdisjoint(self.lines.get(site.mutant.file, ()))


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Verdict of the tests on a mutant."""

    mutant: Mutant
    stage: str
    """`EXECUTING` or `OTHERS`."""
    killed: bool
    by: str
    """The test that failed, or the time limit; empty where it survived."""
    seconds: float

    def __str__(self) -> str:
        word = "killed" if self.killed else "survived"
        return f"{word:8}  {self.mutant}  {self.by or self.stage}, {self.seconds:.0f} s"


class KeptLines:
    """A file of JSON lines that outlives a stop: a line cut short is left out."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._path.parent.mkdir(parents=True, exist_ok=True)

    def read(self) -> list[dict[str, Any]]:
        """Return the whole lines."""
        if not self._path.exists():
            return []
        whole, _, _ = self._path.read_text(encoding="utf-8").rpartition("\n")
        return [json.loads(line) for line in whole.splitlines()]

    def add(self, line: dict[str, Any]) -> None:
        """Add a line, in place of one that was cut short."""
        written = self._path.read_bytes() if self._path.exists() else b""
        with self._path.open("r+b" if written else "wb") as file:
            file.seek(written.rfind(b"\n") + 1)
            file.truncate()
            file.write(json.dumps(line).encode() + b"\n")


def measured_files(base: Checkout, kept: KeptLines, processes: Processes, jobs: int) -> list[MeasuredFile]:
    """Run each test file alone, unless it is kept, and return all, the quickest first."""
    found = {each.file: each for each in (MeasuredFile(**line) for line in kept.read())}
    tests = sorted((base.repository / "tests").rglob("test_*.py"))
    names = [path.relative_to(base.repository).as_posix() for path in tests]
    missing = [name for name in names if name not in found]
    for measured in processes.in_parallel(lambda name: _measure(base, name), missing, jobs):
        kept.add(asdict(measured))
        found[measured.file] = measured
        word = "passes" if measured.passes else "FAILS WITHOUT A MUTANT, left out"
        _say(f"{len(found)} of {len(names)}: {measured.file} {word}, {measured.seconds:.0f} s")
    return sorted((found[name] for name in names), key=lambda each: (each.seconds, each.file))


def _measure(base: Checkout, name: str) -> MeasuredFile:
    folder = base.folder / "lines" / name.replace("/", "-")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    begin = time.monotonic()
    done = base.python([*PYTEST, name], variables={FOLDER: str(folder), REPOSITORY: str(base.repository)})
    seconds = time.monotonic() - begin
    passes = done.code in PASSED or base.python([*PYTEST, name]).code in PASSED  # it may fail because of coverage
    lines: dict[str, set[int]] = {}
    for path in folder.glob("*.json"):
        for file, numbers in json.loads(path.read_text(encoding="utf-8")).items():
            lines.setdefault(file, set()).update(numbers)
    shutil.rmtree(folder)
    ordered = {file: sorted(numbers) for file, numbers in sorted(lines.items())}
    return MeasuredFile(file=name, seconds=round(seconds, 1), passes=passes, lines=ordered)


def judge(site: Site, stage: str, files: Sequence[MeasuredFile], copy: Checkout, base: Checkout) -> Verdict:
    """Apply a mutant in a fresh copy and run test files there until a test fails."""
    if not files:
        return Verdict(mutant=site.mutant, stage=stage, killed=False, by="", seconds=0.0)
    copy.restore(base)
    path = copy.repository / site.mutant.file
    path.write_text(site.applied(path.read_text(encoding="utf-8")), encoding="utf-8")
    begin = time.monotonic()
    limit = LONGEST * sum(each.seconds for each in files) + COMPILING
    done = copy.python([*PYTEST, *(each.file for each in files)], limit)
    killed = done.timed_out or done.code not in PASSED
    return Verdict(
        mutant=site.mutant,
        stage=stage,
        killed=killed,
        by=_killer(done, limit) if killed else "",
        seconds=round(time.monotonic() - begin, 1),
    )


def _killer(done: Ended, limit: float) -> str:
    if done.timed_out:
        return f"more than {limit:.0f} s"
    failed = [line for line in done.output.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    return failed[0].split()[1] if failed else f"exit code {done.code}"


def verdicts(
    sites: Sequence[Site],
    stage: str,
    kept: KeptLines,
    judge: Callable[[Site], Verdict],
    processes: Processes,
    jobs: int,
) -> list[Verdict]:
    """Judge each mutant in one stage, unless its verdict is kept, and return all in order."""
    told = [Verdict(**{**line, "mutant": Mutant(**line["mutant"])}) for line in kept.read()]
    found = {verdict.mutant: verdict for verdict in told if verdict.stage == stage}
    missing = [site for site in sites if site.mutant not in found]
    for verdict in processes.in_parallel(judge, missing, jobs):
        kept.add(asdict(verdict))
        found[verdict.mutant] = verdict
        _say(str(verdict))
    return [found[site.mutant] for site in sites]


def draw(sites: Sequence[Site], count: int, seed: int) -> list[Site]:
    """Draw mutants, each as likely as any other, in the order of their drawing."""
    return random.Random(seed).sample(sites, min(count, len(sites)))


def read_mutants(path: Path) -> list[Mutant]:
    """Read mutants that `--list` wrote, or those of a file of results."""
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return list(dict.fromkeys(Mutant(**line.get("mutant", line)) for line in lines))


def every_room(tree: Path) -> list[str]:
    """Return the folders of all packages, where lines drawn in one room may lie in another version."""
    project = tomllib.loads((tree / "pyproject.toml").read_text(encoding="utf-8"))
    return sorted({Path(folder).parts[0] for folder in project["tool"]["setuptools"]["package-dir"].values()})


def _say(text: str) -> None:
    print(text, flush=True)


def main() -> None:
    """Draw mutants or find them again, run the tests on each, and tell the survivors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, help="mutants at most (default: 60, with --from all)")
    parser.add_argument("--seed", type=int, default=0, help="of the drawing (default: 0)")
    parser.add_argument("--tree", type=Path, default=Path(), help="repository whose newest commit is mutated")
    parser.add_argument("--from", type=Path, dest="source", help="file of mutants to find again, instead of drawing")
    parser.add_argument("--list", action="store_true", help="only print the mutants, as --from reads them")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="mutants at a time (default: cores)")
    parser.add_argument("--out", type=Path, help="folder of copies and results (default: build/mutants/COMMIT)")
    flags = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    commit = subprocess.run(
        ["git", "-C", flags.tree, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True
    ).stdout.strip()
    out = flags.out or Path("build", "mutants", commit)
    processes = Processes()
    base = Checkout(out / "base", processes)
    base.clone(flags.tree)
    if flags.source is None:
        drawn = draw(sites_of_rooms(base.repository, ROOMS), 60 if flags.count is None else flags.count, flags.seed)
        lost = []
    else:
        sites = sites_of_rooms(base.repository, every_room(base.repository))
        pairs = [(mutant, find(mutant, sites)) for mutant in read_mutants(flags.source)]
        drawn = [site for _, site in pairs if site is not None][: flags.count]
        lost = [mutant for mutant, site in pairs if site is None]
    for mutant in lost:
        print(f"not found  {mutant}", file=sys.stderr)
    if flags.list:
        for site in drawn:
            _say(json.dumps(asdict(site.mutant)))
        return
    base.install()
    tests = measured_files(base, KeptLines(out / "tests.jsonl"), processes, flags.jobs)
    copies: SimpleQueue[Checkout] = SimpleQueue()
    for number in range(flags.jobs):
        copy = Checkout(out / f"copy-{number}", processes)
        copy.copy(base)
        copy.install()
        copies.put(copy)

    def judge_in_a_copy(stage: str, site: Site) -> Verdict:
        executing = stage == EXECUTING
        files = [each for each in tests if each.passes and each.executes(site) == executing]
        copy = copies.get()
        try:
            return judge(site, stage, files, copy, base)
        finally:
            copies.put(copy)

    kept = KeptLines(out / "verdicts.jsonl")
    surviving = drawn
    for stage in (EXECUTING, OTHERS):
        found = verdicts(surviving, stage, kept, partial(judge_in_a_copy, stage), processes, flags.jobs)
        surviving = [site for site, verdict in zip(surviving, found, strict=True) if not verdict.killed]
    _say(f"{len(drawn) - len(surviving)} of {len(drawn)} mutants of {commit} killed, {len(lost)} not found")
    for site in surviving:
        _say(f"survived  {site.mutant}")
    for each in tests:
        if not each.passes:
            _say(f"left out, as it fails without a mutant: {each.file}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("stopped; the same command goes on")
