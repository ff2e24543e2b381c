"""Time by turns: programs that are compared take turns, so that a machine that slows down slows all of it."""

import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

PACKAGES = ("springfoot", "mujoco", "numpy", "gymnasium", "stable-baselines3", "torch", "numba", "envpool")
"""Packages that decide the figures by their versions."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One thing to time: a block of environment steps that can be run again and again."""

    name: str
    samples: int
    """Environment steps in a block, all environments together."""
    seconds: float
    """Simulated time of one environment step [s]."""
    run: Callable[[], object]
    """The block."""
    prepare: Callable[[], object] = lambda: None
    """Before each block, untimed: puts everything back to the start."""
    close: Callable[[], object] = lambda: None
    """After the last block."""
    workers: Sequence[int] = ()
    """Process ids; their CPU time counts too."""


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Medians over the blocks of a case, per environment step."""

    wall_us: float
    cpu_us: float
    wall_quartiles_us: tuple[float, float]
    samples_per_second: float
    """By wall time."""
    sim_seconds_per_core_second: float
    """By CPU time: comparable between environments of different time steps."""


def measure(cases: Sequence[Case], repeats: int) -> dict[str, Figures]:
    """Run the blocks of all cases in turn, `repeats` times after one warm-up round."""
    wall, cpu = np.empty((2, len(cases), repeats + 1))
    for repeat in range(repeats + 1):
        for index, case in enumerate(cases):
            case.prepare()
            cpu_before = _cpu_seconds(case.workers)
            wall_before = time.perf_counter()
            case.run()
            wall[index, repeat] = (time.perf_counter() - wall_before) / case.samples
            cpu[index, repeat] = (_cpu_seconds(case.workers) - cpu_before) / case.samples
    return {case.name: _figures(case, wall[i, 1:], cpu[i, 1:]) for i, case in enumerate(cases)}


def _figures(case: Case, wall: NDArray, cpu: NDArray) -> Figures:
    low, middle, high = (float(value) for value in np.quantile(wall, (0.25, 0.5, 0.75)))
    spent = float(np.median(cpu))
    return Figures(
        wall_us=1e6 * middle,
        cpu_us=1e6 * spent,
        wall_quartiles_us=(1e6 * low, 1e6 * high),
        samples_per_second=1 / middle,
        sim_seconds_per_core_second=case.seconds / spent,
    )


def _cpu_seconds(workers: Sequence[int]) -> float:
    """Return the CPU time [s] of this process with all its threads, and of its workers."""
    # The number of another process's clock, as the C library's clock_getcpuclockid makes it on Linux.
    return time.process_time() + sum(time.clock_gettime((~pid << 3) | 2) for pid in workers)


def clock_cost() -> float:
    """Return the CPU time [s] that reading the CPU clock twice adds to the work in between."""
    costs = np.empty(1000)
    for index in range(len(costs)):
        begin = time.process_time()
        costs[index] = time.process_time() - begin
    return float(np.median(costs))


def machine() -> dict[str, Any]:
    """Return processor, number of processors, system, and versions of the packages; never the machine's name."""
    model = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        lines = information.read_text(encoding="utf-8", errors="replace").splitlines()
        model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), model)
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return {"processor": model, "processors": processors(), "system": platform.system(), "versions": versions}


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def load() -> float:
    """Return processes that wanted a processor over the last minute, on average; NaN where the system does not say."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
