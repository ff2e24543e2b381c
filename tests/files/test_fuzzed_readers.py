"""Every function that reads files is one that `make fuzz` tries: a new kind of file needs a reader there."""

import ast
import sys
from pathlib import Path
from types import FrameType

import pytest

from benchmarks.fuzz_files import readers

REPOSITORY = Path(__file__).resolve().parents[2]
ROOMS = ("gait", "envs", "agents", "evaluation", "studies", "cli", "package")
READING = {
    "read_object",
    "read_csv",
    "read_tensors",
    "read_arrays",
    "read_bytes",
    "text_lines",
    "existing",
    "open_file",
}
"""Functions of `files` that open a path."""
NOT_FUZZED = {
    ("agents/training/session.py", "_evaluate"): "keeps the bytes of the policy that it has just written",
    ("agents/policies/cards.py", "policy_card"): "takes a digest of a file of the package",
    (
        "agents/training/cluster/rllib_training.py",
        "resume",
    ): "reads a record beside Ray's pickles, in an environment of its own",
    ("cli/examples.py", "_first_line"): "reads files of the package alone",
    ("evaluation/benchmark/submission.py", "submit"): "copies the bytes of a policy that `read_policy` checks",
    ("gait/people/c3d_file.py", "_refuse_broken"): "runs in the child that the reader of C3D files starts",
    ("studies/walks/effects.py", "published_effects"): "reads a table of the package",
    ("studies/walks/score.py", "published_walks"): "reads a table of the package",
}


def room_and_file(path: str) -> str | None:
    """Name of a module below the repository; None for a module of no room."""
    place = Path(path)
    inside = place.relative_to(REPOSITORY) if place.is_relative_to(REPOSITORY) else Path("elsewhere")
    return inside.as_posix() if inside.parts[0] in (*ROOMS, "files") else None


def callers() -> set[tuple[str, str]]:
    """File and name of each function outside `files` that calls one of `READING`."""
    found = set()
    for room in ROOMS:
        for path in (REPOSITORY / room).rglob("*.py"):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            inner = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
            for node in ast.walk(tree):
                if isinstance(node, ast.Call) and ast.unparse(node.func) in READING:
                    around = [each for each in inner if each.lineno <= node.lineno <= (each.end_lineno or 0)]
                    innermost = max(around, key=lambda each: each.lineno)
                    found.add((path.relative_to(REPOSITORY).as_posix(), innermost.name))
    return found


class Seen:
    """Functions that called one of `READING`, as Python's profiler tells them."""

    def __init__(self) -> None:
        self.callers: set[tuple[str, str]] = set()

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        if event != "call" or frame.f_code.co_name not in READING:
            return
        caller = frame.f_back
        while caller is not None and (
            room_and_file(caller.f_code.co_filename) is None or caller.f_code.co_name.startswith("<")
        ):
            caller = caller.f_back  # the standard library that reads from a generator, or a comprehension
        if caller is not None and (name := room_and_file(caller.f_code.co_filename)):
            self.callers.add((name, caller.f_code.co_name))


@pytest.mark.slow
def test_every_function_that_reads_a_file_is_fuzzed(tmp_path):
    seen = Seen()
    for reader in readers(tmp_path).values():
        for base in reader.bases:
            path = tmp_path / f"whole{reader.suffix}"
            path.write_bytes(base)
            sys.setprofile(seen)
            try:
                reader.read(path)
            finally:
                sys.setprofile(None)
    assert callers() - seen.callers == set(NOT_FUZZED)
