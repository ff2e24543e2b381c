"""Run the same training from several seeds at once: one process for each processor, one thread each.

Seed k is trained in the folder `seed-k`, with the bits of `train.py --seed k` alone; `seeds.json` holds the spread of
the results.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from springfoot.command_line import end_in_order, exit_code, stopped_by
from springfoot.errors import SpringfootError, require_count
from springfoot.extras import naming_extras
from springfoot.files.locks import owned
from springfoot.files.markdown import MISSING, plus_minus, table, text_of
from springfoot.files.writing import require_new, write_atomically
from springfoot.gait.people.scores import mean_sd
from springfoot.terminal import ENDING, restore_signals, take_signals

from ..policies.policy import RUN
from .config import TrainingConfig, config_from_json, config_to_json, processors
from .run_record import read_record

SEEDS = "seeds.json"
"""Name of the file with the results of all seeds."""
Engine = Literal["here", "ray"]
"""Where several trainings run: in processes on this machine, or on the nodes of a Ray cluster."""
SPREAD = ("seconds", "return_mean", "falls", "best_timesteps")
"""Results in `seeds.json` with mean and standard deviation (n - 1) over the seeds."""


def train_seeds(config: TrainingConfig, out: str | Path, seeds: int) -> dict[str, Any]:
    """Train from the seeds `config.seed`, `config.seed` + 1, …, each into a new folder in `out`; return `seeds.json`.

    As many processes run at a time as there are processors, each on one thread. At the first SIGINT or SIGTERM the
    running ones save a usable policy and stop, and no more are started. Raises `SpringfootError`, with nothing written,
    if `out` exists and is not an empty folder.
    """
    from springfoot.envs import Biped  # not above: help needs no simulator

    require_count("seeds", seeds)
    require_count("seed", config.seed + seeds - 1, 0, 2**31 - 1)  # the last one
    out = require_new(out)
    Biped(config.environment, 1)  # raises for settings that nobody can walk in, before anything is written
    configs = [replace(config, seed=config.seed + k) for k in range(seeds)]
    with owned(out):
        require_new(out)
        rows, signalled = train_all(
            [(seeded, out / f"seed-{seeded.seed}", f"seed {seeded.seed}") for seeded in configs]
        )
        record = {"config": config_to_json(config), "status": _status(rows, signalled), "seeds": rows}
        record |= {"spread": spread(rows)} | ({"signal": signalled.name} if signalled else {})
        write_atomically(out / SEEDS, (json.dumps(record, indent=2) + "\n").encode())
    return record


def train_all(
    jobs: Sequence[tuple[TrainingConfig, Path, str]], engine: Engine = "here"
) -> tuple[list[dict[str, Any]], signal.Signals | None]:
    """Train several configurations at once; return a row of results for each, and the signal that stopped them, if any.

    Args:
        jobs: configuration, folder and name of each training. An unfinished run in the folder is continued; the name
            precedes every message of the training.
        engine: `here` for one process per processor of this machine, `ray` for the nodes of a Ray cluster
            (`cluster.nodes`).
    """
    if engine == "ray":
        return _train_on_ray(jobs)
    at_once = min(max(len(jobs), 1), processors())
    with _Trainings() as trainings, ThreadPoolExecutor(at_once) as pool:
        print(f"{len(jobs)} seeds, {at_once} at a time, one thread each", file=sys.stderr, flush=True)
        rows = list(pool.map(lambda job: trainings.run(*job), jobs))
    return rows, trainings.stopping


def _train_on_ray(
    jobs: Sequence[tuple[TrainingConfig, Path, str]],
) -> tuple[list[dict[str, Any]], signal.Signals | None]:
    """Train `jobs` (configuration, folder, name) on the nodes of a Ray cluster.

    Returns a row of results for each, and the signal that stopped them, if any, as `train_all` does.
    """
    with naming_extras():
        from .cluster.nodes import run_on_ray  # not above: an extra
    stopping = None
    try:
        run_on_ray([(name, _command(config, folder.absolute())) for config, folder, name in jobs])
    except KeyboardInterrupt:
        stopping = signal.SIGINT
    if_incomplete = "interrupted" if stopping else "failed"
    return [_result_row(config, folder, if_incomplete) for config, folder, _ in jobs], stopping


def _command(config: TrainingConfig, folder: Path) -> list[str]:
    """Return the words of the command line that trains or continues one seed in `folder`, on one thread."""
    values = config_to_json(replace(config, threads=1))
    return [sys.executable, "-m", __name__, str(folder), json.dumps(values)]


def _status(rows: Sequence[dict[str, Any]], signalled: signal.Signals | None) -> str:
    """Return the status of all seeds together: `failed` if one failed, else `interrupted` after a signal, else
    `finished`."""
    if any(row["status"] == "failed" for row in rows):
        return "failed"
    return "interrupted" if signalled else "finished"


def train_missing(jobs: Sequence[tuple[TrainingConfig, Path, str]], engine: Engine = "here") -> str:
    """Train the jobs (configuration, folder, name) without a finished run in their folder; continue unfinished runs.

    Returns the status of all: `finished`, `failed` or `interrupted`. Raises `SpringfootError`, with nothing changed,
    if a folder holds a run of another configuration.
    """
    for config, folder, _ in jobs:
        if (folder / RUN).is_file():
            done = config_from_json(read_record(folder)["config"])
            if replace(done, threads=config.threads) != config:
                raise SpringfootError(f"{folder} was trained with other settings; choose another folder")
    missing = [job for job in jobs if not is_finished(job[1])]
    return _status(*train_all(missing, engine)) if missing else "finished"


def is_finished(folder: Path) -> bool:
    """Return True if the folder holds a training that ran to its end."""
    return (folder / RUN).is_file() and read_record(folder).get("status") == "finished"


def spread(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, float | None]]:
    """Return mean and standard deviation (n - 1) of each result of `SPREAD` over the finished seeds.

    `rows` are the seeds' rows of results. None stands for a mean without a seed, and for a deviation of fewer than two.
    """
    finished = [row for row in rows if row["status"] == "finished"]
    return {name: mean_sd([row[name] for row in finished]) for name in SPREAD}


def training_table(record: dict[str, Any]) -> str:
    """Return the Markdown table of `seeds.json`: a line for each seed, and the mean ± SD over the finished ones."""
    head = ["seed", "status", "steps", "seconds", "best return", "falls", "after steps"]
    lines = []
    for row in record["seeds"]:
        falls = MISSING if row["falls"] is None else f"{row['falls']} of {row['episodes']}"
        patterns = {"timesteps": ",d", "seconds": ".0f", "return_mean": ".1f", "best_timesteps": ",d"}
        steps, seconds, best, after = (text_of(row[name], pattern) for name, pattern in patterns.items())
        lines.append([str(row["seed"]), row["status"], steps, seconds, best, falls, after])
    seconds, best, falls, after = (plus_minus(record["spread"][name], ",.1f", alone=False) for name in SPREAD)
    lines.append(["mean ± SD", "", "", seconds, best, falls, after])
    return table(head, lines)


class _Trainings:
    """Run trainings in processes of their own, and pass SIGINT and SIGTERM on to them; a context manager."""

    def __init__(self) -> None:
        self.stopping: signal.Signals | None = None  # the signal that came, if one did
        self._lock = threading.RLock()  # reentrant: a second signal may interrupt the passing on of the first
        self._running: list[subprocess.Popen[str]] = []
        self._handlers_before: dict[int, Any] = {}

    def run(self, config: TrainingConfig, folder: Path, name: str) -> dict[str, Any]:
        """Train in a process of its own, print its messages after its `name`, and return its row of results."""
        command = _command(config, folder)
        # The new process inherits this, and unblocks after its imports; this thread only waits for it.
        _block_signals(True)
        with self._lock:
            if self.stopping:
                return _result_row(config, folder, "not begun")
            # In a session of its own it does not get the terminal's Ctrl-C; this process passes it on, once.
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                start_new_session=True,
                env=os.environ | {"OMP_NUM_THREADS": "1"},
            )
            self._running.append(process)
        with process:
            assert process.stderr is not None
            for line in process.stderr:
                print(f"{name}: {line}", end="", file=sys.stderr, flush=True)
        with self._lock:
            self._running.remove(process)
        if process.returncode < 0 and not self.stopping:  # below 0: a signal ended it
            ended = signal.Signals(-process.returncode).name
            saved = "it had saved nothing yet"
            if (folder / RUN).is_file():
                saved = f"springfoot train --resume {folder} goes on from what it has saved"
            print(f"{name}: its process was ended by {ended}; {saved}", file=sys.stderr, flush=True)
        return _result_row(config, folder, "interrupted" if self.stopping else "failed")

    def _stop(self, number: int, _frame: Any) -> None:
        """Handle a signal: note it as the reason to stop, and pass it on to the running trainings."""
        with self._lock:
            self.stopping = signal.Signals(number)
            for process in self._running:
                process.send_signal(number)

    def __enter__(self) -> "_Trainings":
        """Handle the signals."""
        self._handlers_before = take_signals(self._stop)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the signal handlers; terminate processes that still run, as they do only after an error."""
        restore_signals(self._handlers_before)
        for process in self._running:
            process.terminate()


def _block_signals(blocked: bool) -> None:
    """Block or unblock SIGINT and SIGTERM in this thread and in the processes it starts."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK if blocked else signal.SIG_UNBLOCK, ENDING)


def _result_row(config: TrainingConfig, folder: Path, if_incomplete: str) -> dict[str, Any]:
    """Return one seed's row of results, a seed of `seeds.json`, from the run.json in `folder`.

    Its status is `if_incomplete` if that file is missing or still says `running`: the training was cut off. Numbers
    that the file lacks are None.
    """
    record = read_record(folder) if (folder / RUN).is_file() else {}
    status = record.get("status", "running")
    best = record.get("best") or {}
    return {
        "seed": config.seed,
        "folder": folder.name,
        "status": if_incomplete if status == "running" else status,
        "timesteps": record.get("timesteps"),
        "seconds": record.get("seconds"),
        "return_mean": best.get("return_mean"),
        "falls": best.get("falls"),
        "episodes": best.get("episodes"),
        "best_timesteps": best.get("timesteps"),
    }


def _main() -> int:
    """Train one seed in this process, as `_command` asks; return the exit code.

    The words of the command line are a folder and a configuration as JSON text.
    """
    folder, config = sys.argv[1:]
    return exit_code("train.py", lambda: _train(config_from_json(json.loads(config)), folder))


def _train(config: TrainingConfig, folder: str) -> int:
    """Train or continue one seed in this process; return the exit code."""
    from springfoot.compiling import tell_of_compiling

    from .training import resume, train  # not above: torch takes seconds, and the parent process does not need it

    tell_of_compiling()
    _block_signals(False)  # a signal that came during the imports is delivered here, where `exit_code` catches it
    end_in_order()
    record = resume(folder, threads=config.threads) if (Path(folder) / RUN).is_file() else train(config, folder)
    return stopped_by(record) if record["status"] == "interrupted" else 0


if __name__ == "__main__":
    sys.exit(_main())
