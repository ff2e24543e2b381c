"""Lines of our source that a process executes, written at its end: Python's by coverage, compiled kernels' by call.

`benchmarks.mutants` copies this file beside the packages of the Python that runs the tests, so that every process of a
test tells its lines. Coverage does not see compiled code. A kernel that numba has compiled or loaded was called; all
lines of it and of the kernels in it count as executed. Python instead of compiled kernels (NUMBA_DISABLE_JIT=1) would
tell them line by line, but the kernels need numba: of `test_stiffness_control` 4 of 7 tests fail without.
"""

import atexit
import json
import os
import sys
import uuid
from collections import defaultdict
from pathlib import Path
from types import CodeType
from typing import Any

FOLDER = "EXECUTED_LINES"
"""Environment variable: the folder that takes one JSON file a process."""
REPOSITORY = "EXECUTED_LINES_OF"
"""Environment variable: the repository with the lines that count."""


def start() -> None:
    """Begin to watch this process if the environment asks for it."""
    if FOLDER not in os.environ:
        return
    from coverage import Coverage

    repository = Path(os.environ[REPOSITORY])
    # In memory, and silent: a test reads the same from the process as without coverage.
    within = [f"{repository}/*"]
    without = [f"{repository}/tests/*"]
    coverage = Coverage(data_file=None, config_file=False, include=within, omit=without, messages=False)
    coverage.set_option("run:disable_warnings", ["no-data-collected", "module-not-measured", "already-imported"])
    coverage.start()

    def write() -> None:
        coverage.stop()
        lines: dict[str, set[int]] = defaultdict(set)
        data = coverage.get_data()
        for file in data.measured_files():
            lines[file].update(data.lines(file) or ())
        for code in _called_kernels():
            lines[code.co_filename].update(_lines_of(code))
        inside = {
            Path(file).relative_to(repository).as_posix(): sorted(numbers)
            for file, numbers in lines.items()
            if Path(file).is_relative_to(repository)
        }
        path = Path(os.environ[FOLDER], f"{uuid.uuid4()}.json")
        written = path.with_suffix(".part")
        written.write_text(json.dumps(inside), encoding="utf-8")
        written.replace(path)  # a process that a test kills leaves no half-written file

    atexit.register(write)


def _called_kernels() -> list[CodeType]:
    """Return the code of every kernel that ran."""
    if "numba.core.dispatcher" not in sys.modules:
        return []
    from numba.core.dispatcher import Dispatcher

    ours = ("springfoot", "parts")  # tests call parts of kernels by kernels of tests/parts.py
    modules = [module for name, module in sys.modules.copy().items() if name.partition(".")[0] in ours]
    values = [value for module in modules for value in vars(module).values()]
    waiting: list[Any] = [value for value in values if isinstance(value, Dispatcher) and value.overloads]
    called: dict[int, CodeType] = {}
    while waiting:
        function = waiting.pop().py_func
        if id(function) in called:
            continue
        called[id(function)] = function.__code__
        used = (function.__globals__.get(name) for name in function.__code__.co_names)
        waiting += [value for value in used if isinstance(value, Dispatcher)]
    return list(called.values())


def _lines_of(code: CodeType) -> set[int]:
    """Return the lines of a function and of the functions in it."""
    lines = {line for _, _, line in code.co_lines() if line is not None}
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            lines |= _lines_of(constant)
    return lines
