"""Trainings killed at random moments and resumed, held against the same trainings uninterrupted.

`python -m benchmarks.kills` (`make test-kills`) trains presets walk and any-body in turn, each from a seed of its own:
once in peace, and once ended several times, by SIGKILL, SIGTERM or SIGINT, and resumed on one thread or two. It prints
the differences, of which there should be none, and ends with 1 if there are any.
"""

import argparse
import os
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tensorboard.backend.event_processing.event_file_loader import LegacyEventFileLoader

from springfoot.agents.training import training  # noqa: F401 - here once, not in each process
from springfoot.agents.training.checkpoint import newest_checkpoint
from springfoot.agents.training.run_record import EVENTS, read_record
from springfoot.cli.train import train_main
from springfoot.terminal import at_terminal

SHORT = (
    *("--timesteps", "2500", "--num-envs", "8", "--update-steps", "256", "--eval-interval", "1024"),
    *("--eval-episodes", "2", "--episode-seconds", "1.5"),
)
"""Flags that make a preset's training one of seconds: 12 updates, and some episodes that end in each."""
CLOCKS = ("seconds",)
"""Entries of run.json that are wall time, at any level."""
CLOCK_SCALARS = ("time/fps",)
"""Scalars that are wall time."""


def begun(words: Sequence[str], log: Path) -> int:
    """Return the id of a new process that runs `train` with `words` and tells `log`; forked, as imports take longer."""
    if process := os.fork():
        return process
    code = 1
    try:
        told = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        for stream in (1, 2):
            os.dup2(told, stream)
        for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, signal.SIG_DFL)):
            signal.signal(number, handler)
        code = at_terminal(lambda: train_main(words))
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def ended(process: int) -> int:
    """Return the exit code of a process, -N where signal N ended it, once it has ended."""
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def killed(words: Sequence[str], folder: Path, written: float, delay: float, number: signal.Signals) -> bool:
    """Run `train` with `words` until its events in `folder` have `written` bytes, `delay` s more, and signal it.

    Returns whether it was still running then.
    """
    process = begun(words, folder.with_suffix(".log"))
    while _runs(process) and _written(folder) < written:
        time.sleep(0.01)
    time.sleep(delay)
    running = _runs(process)
    os.kill(process, number)
    ended(process)
    return running


def _runs(process: int) -> bool:
    return os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None


def _written(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.glob(EVENTS)) if (folder / "run.json").exists() else -1


def differences(one: Path, other: Path) -> list[str]:
    """Return the differences of two folders of finished runs, clocks left out."""
    for folder in (one, other):
        if not (folder / "run.json").is_file():
            return [f"no run in {folder}: {folder.with_suffix('.log').read_text(encoding='utf-8')[-500:]}"]
    found = [name for name in ("best.safetensors", "last.safetensors") if _bytes(one / name) != _bytes(other / name)]
    if _without_clocks(read_record(one)) != _without_clocks(read_record(other)):
        found.append("run.json")
    told, others_told = (Counter(map(repr, scalars(each))) for each in (one, other))
    found += [f"scalar {each}" for each in (told - others_told) + (others_told - told)]
    (head, arrays), (other_head, others) = _checkpoint(one), _checkpoint(other)
    found += [f"header {name}" for name in ("timesteps", "config", "learning") if head[name] != other_head[name]]
    found += [f"array {name}" for name in arrays.keys() ^ others.keys()]
    found += [
        f"array {name}"
        for name in arrays.keys() & others.keys()
        if not np.array_equal(arrays[name], others[name], equal_nan=arrays[name].dtype.kind == "f")
    ]
    return sorted(found)


def scalars(folder: Path) -> list[tuple[str, int, float]]:
    """All scalars in a run's events, sorted: tag, step and value, 0 for a clock's."""
    found: list[tuple[str, int, float]] = []
    for path in folder.glob(EVENTS):
        for event in LegacyEventFileLoader(str(path)).Load():
            for value in event.summary.value:
                if value.HasField("simple_value"):
                    clock = value.tag in CLOCK_SCALARS
                    found.append((value.tag, event.step, 0.0 if clock else value.simple_value))
    return sorted(found)


def _bytes(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def _checkpoint(folder: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    found = newest_checkpoint(folder)
    assert found is not None, folder
    return found


def _without_clocks(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _without_clocks(each) for name, each in value.items() if name not in CLOCKS}
    return [_without_clocks(each) for each in value] if isinstance(value, list) else value


def main() -> int:
    """Run the trainings; returns 0 if none differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trainings", type=int, default=20)
    parser.add_argument("--kills", type=int, default=4, help="ends of each")
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    parser.add_argument("--out", type=Path, help="folder to keep what was trained in")
    flags = parser.parse_args()
    random = np.random.default_rng(flags.seed)
    different = 0
    ends = dict.fromkeys(("SIGKILL", "SIGTERM", "SIGINT"), 0)
    with tempfile.TemporaryDirectory() as temporary:
        place = flags.out or temporary
        for index in range(flags.trainings):
            peace = Path(place, f"peace-{index}")
            war = Path(place, f"war-{index}")
            preset = ("walk", "any-body")[index % 2]
            first = ["--preset", preset, "--seed", str(index), *SHORT, "--threads", "2", "--out"]
            codes = [ended(begun([*first, str(peace)], peace.with_suffix(".log")))]
            size = _written(peace)
            for _ in range(flags.kills):
                words = _resume(war, random) if (war / "run.json").exists() else [*first, str(war)]
                number = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)[random.integers(4)]
                written = random.uniform(-0.1, 1.0) * size
                delay = random.uniform(0.0, 0.3)
                ends[number.name] += killed(words, war, written, delay, number)
            words = _resume(war, random) if (war / "run.json").exists() else [*first, str(war)]
            codes += [ended(begun(words, war.with_suffix(".log"))) for words in (words, ["--resume", str(war)])]
            found = differences(peace, war)
            if codes not in ([0, 0, 2], [0, 2, 2]):  # finished, or finished already; and then refused
                found.append(f"exit codes {codes}")
            different += bool(found)
            print(f"{preset}, seed {index}: {', '.join(found[:8]) or 'the same'}", flush=True)
    told = ", ".join(f"{count} {name}" for name, count in ends.items())
    print(f"{flags.trainings - different} of {flags.trainings} the same after {told}")
    return 1 if different else 0


def _resume(folder: Path, random: np.random.Generator) -> list[str]:
    return ["--resume", str(folder), "--threads", str(random.integers(1, 3))]


if __name__ == "__main__":
    sys.exit(main())
