"""Join a Ray cluster, and run independent commands on its nodes; if a node dies, its command runs again on another.

Every node needs springfoot, and the same folders, as commands read and write files.
"""

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import ray  # pyright: ignore[reportMissingImports]

MOST_RETRIES = 10
"""Nodes that may die under a command before it counts as failed; chosen."""
NEWS = 2.0
"""Time within which a cluster knows that a processor has become free [s]; chosen."""


@contextmanager
def joined(processors: int | None = None) -> Iterator[None]:
    """Connect to the Ray cluster of the environment variable RAY_ADDRESS until the block ends.

    Without that variable, start a cluster on this machine alone, with `processors` processors (None: all). A process
    that is connected already stays so.
    """
    if ray.is_initialized():
        yield
        return
    for name in ("ray", "ray.rllib", "ray.tune"):
        logging.getLogger(name).setLevel(logging.ERROR)
    os.environ.setdefault("RAY_BACKEND_LOG_LEVEL", "fatal")
    address = os.environ.get("RAY_ADDRESS")
    alone: dict[str, Any] = {} if address else {"include_dashboard": False, "num_cpus": processors}
    sigterm_handler = signal.getsignal(signal.SIGTERM)
    ray.init(address=address or "local", log_to_driver=False, logging_level="ERROR", **alone)
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, sigterm_handler)  # Ray's own handler would end Python at once
    try:
        yield
    finally:
        ray.shutdown()


def tell_of_wait(needed: int, purpose: str) -> None:
    """Print a line if fewer processors of the cluster are free than are `needed` for the `purpose`; Ray waits for them
    without a word."""
    end = time.monotonic() + NEWS
    while (free := int(ray.available_resources().get("CPU", 0))) < needed:
        if time.monotonic() > end:
            total = int(ray.cluster_resources().get("CPU", 0))
            processors = f"{needed} processor{'s' * (needed > 1)}"
            print(
                f"waiting for {processors} of the Ray cluster, for {purpose}: {free} of its {total} are free",
                file=sys.stderr,
                flush=True,
            )
            return
        time.sleep(0.1)


@contextmanager
def ending_waits() -> Iterator[None]:
    """Have SIGTERM end a wait inside Ray too, which heeds only KeyboardInterrupt, and then act as before."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    asked = False

    def interrupt(_number: int, _frame: object) -> None:
        nonlocal asked
        asked = True
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt:
        signal.signal(signal.SIGTERM, before)
        if asked:
            signal.raise_signal(signal.SIGTERM)
        raise
    finally:
        signal.signal(signal.SIGTERM, before)


def run_on_ray(commands: Sequence[tuple[str, list[str]]]) -> None:
    """Run commands (name, words), each on one processor of the cluster; print the standard error of each as it ends,
    its name before every line.

    Raises `KeyboardInterrupt` after a signal, with the commands ended.
    """
    with joined():
        tell_of_wait(1, f"{commands[0][0]}, the first of {len(commands)}")
        task = ray.remote(num_cpus=1, max_retries=MOST_RETRIES)(_run)
        names = {task.remote(words, os.getcwd()): name for name, words in commands}
        waiting = list(names)
        try:
            while waiting:
                (done,), waiting = ray.wait(waiting)
                try:
                    output = ray.get(done)
                except ray.exceptions.RayError as error:
                    output = f"lost with its node: {str(error).splitlines()[0]}\n"
                for line in output.splitlines():
                    print(f"{names[done]}: {line}", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            for running in waiting:
                ray.cancel(running)
            raise


def _run(words: list[str], folder: str) -> str:
    """Run a command in a folder on this node; return its standard error."""
    done = subprocess.run(
        words,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )
    return done.stderr
