"""Fuzzing of every reader of files: valid files, changed at random, are read or refused in one line, and nothing else.

    python -m benchmarks.fuzz_readers --seconds 600

`make fuzz` does this; the tests do it for 6 s. Bases are without digests, so that changes reach the code behind them.
Memory is that of this process at its peak, beyond its memory when the files were made.
"""

import json
import re
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from springfoot.command_line import exit_code
from springfoot.errors import SpringfootError, require_number

from .fuzz_files import Reader, readers

MOST_MEGABYTES, MOST_SECONDS = 500, 30
"""Memory beyond the imports [MB] and processor time of one reading [s] that are no failure."""
ROUND = 100
"""Examples between two looks at the clock."""
_NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][+-]?\d+)?")
_TOKENS = [b"nan", b"inf", b"-1", b"0", b"1e308", b"-1e308", b"1e-320", b"9" * 400, b"null", b"[]", b"{}", b'"x"', b""]


@dataclass(kw_only=True)
class Found:
    """Outcome of one reader."""

    read: int = 0
    refused: int = 0
    slowest: float = 0.0
    """Longest reading [s of the processor]."""
    failures: Counter[str] = field(default_factory=Counter)


def changed(content: bytes, random: np.random.Generator) -> bytes:
    """Return the content after one to eight changes: bits, bytes, numbers, pieces lost, moved, doubled, an end."""
    data = bytearray(content)
    for _ in range(random.integers(1, 9)):
        if not data:
            break
        at = int(random.integers(len(data)))
        piece = slice(at, at + int(random.integers(1, 64)))
        match random.integers(8):
            case 0:
                data[at] ^= 1 << int(random.integers(8))
            case 1:
                data[at] = int(random.integers(256))
            case 2:
                del data[piece]
            case 3:
                data[at:at] = data[piece]
            case 4:
                data[at:at] = bytes(random.integers(0, 256, random.integers(1, 16), np.uint8))
            case 5:
                del data[at:]
            case _:  # twice as often: readers are about numbers
                found = _NUMBER.search(data, at)
                if found:
                    data[found.start() : found.end()] = _TOKENS[random.integers(len(_TOKENS))]
    return bytes(data)


def fuzz(reader: Reader, folder: Path, seconds: float, first_seed: int) -> Found:
    """Read changed files with one reader for so long by the clock, one at least, once it has read the whole ones."""
    found = Found()
    path = folder / f"fuzzed{reader.suffix}"

    @settings(
        max_examples=ROUND,
        deadline=None,
        database=None,
        phases=(Phase.generate,),
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
        print_blob=False,
    )
    @given(st.integers(0, len(reader.bases) - 1), st.integers(0, 2**32 - 1), st.none() | st.binary(max_size=512))
    def one(base: int, drawn: int, alone: bytes | None) -> None:
        if time.monotonic() < until or not (found.read + found.refused or found.failures):
            other = alone is not None and drawn % 8 == 0  # mostly a file that was whole
            content = alone if other else changed(reader.bases[base], np.random.default_rng(drawn))
            path.write_bytes(content or b"")
            _attempt(reader, path, found)

    for base in reader.bases:
        path.write_bytes(base)
        reader.read(path)
    until = time.monotonic() + seconds
    number = first_seed
    while time.monotonic() < until:
        seed(number)(one)()
        number += 1
    return found


def _attempt(reader: Reader, path: Path, found: Found) -> None:
    began = time.process_time()
    try:
        reader.read(path)
        found.read += 1
    except SpringfootError as error:
        found.refused += 1
        if not str(error).isprintable():
            found.failures[f"not printable: {str(error)!r:.200}"] += 1
    except Exception as error:
        found.failures[f"{type(error).__name__}: {error}"[:200]] += 1
        path.with_name(f"failed-{type(error).__name__}{path.suffix}").write_bytes(path.read_bytes())
    took = time.process_time() - began
    found.slowest = max(found.slowest, took)
    if took > MOST_SECONDS:
        found.failures[f"took {took:.0f} s"] += 1


def peak() -> float:
    """Most memory that this process has had [MB]."""
    import resource  # not on every system

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Fuzz every reader, each for the same time."""

    seconds: float = 600.0
    """Time on the clock, of all readers together, without their start."""
    seed: int = 0
    """Of the first round."""
    keep: Path | None = None
    """Folder for files that failed."""
    only: tuple[str, ...] = ()
    """Readers by name; all of them without."""


def run(flags: Flags, say: Callable[[str], Any] = print) -> int:
    """Fuzz, tell the faults found; 1 for a crash, a hang, a message that is no line, or too much memory."""
    require_number("seconds", flags.seconds, 0.0, above=True, unit="s")
    failed = False
    warnings.simplefilter("error", RuntimeWarning)  # a second line, beside the message
    with tempfile.TemporaryDirectory() as made:
        folder = Path(flags.keep or made)
        folder.mkdir(parents=True, exist_ok=True)
        todo = {name: reader for name, reader in readers(Path(made)).items() if not flags.only or name in flags.only}
        before = peak()
        each = flags.seconds / max(len(todo), 1)
        for name, reader in todo.items():
            found = fuzz(reader, folder, each, flags.seed)
            failed |= bool(found.failures)
            say(f"{name}: {found.refused:,} refused, {found.read:,} read, slowest {found.slowest:.2f} s")
            for failure, times in found.failures.most_common():
                say(f"  FAILED {times} times: {json.dumps(failure)}")
    grown = peak() - before
    say(f"memory: {grown:.0f} MB beyond the imports")
    return 1 if failed or grown > MOST_MEGABYTES else 0


if __name__ == "__main__":
    sys.exit(exit_code("fuzz_readers", lambda: run(tyro.cli(Flags, prog="python -m benchmarks.fuzz_readers"))))
