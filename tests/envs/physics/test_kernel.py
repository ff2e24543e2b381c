"""Compiled kernels: kept between processes, made anew when anything that they use has changed."""

import os
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from itertools import product
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from springfoot.envs.physics.kernel import _fingerprint

ENVS = Path(__file__).parents[3] / "envs"
KERNELS = {
    f"{path.stem}.{kernel.py_func.__name__}": kernel
    for path in sorted(ENVS.rglob("*.py"))
    if path.name != "__init__.py"
    for kernel in vars(
        import_module("springfoot.envs." + ".".join(path.relative_to(ENVS).with_suffix("").parts))
    ).values()
    if isinstance(kernel, Dispatcher)
}


@pytest.mark.parametrize("name", KERNELS)
def test_a_kernel_stands_below_all_that_it_uses_and_tells_its_ten_arguments_at_most(name):
    function = KERNELS[name].py_func
    assert function.__qualname__ == f"{function.__name__}_{_fingerprint(function)}"  # nothing came to be known since
    assert function.__code__.co_argcount <= 10
    assert function.__doc__


TABLE = np.arange(6.0)


def test_an_array_of_another_shape_is_another_kernel():
    def first(i):
        return TABLE[i].sum()

    tables = (TABLE.reshape(shape) for shape in ((2, 3), (3, 2), (6,)))
    assert len({_fingerprint(FunctionType(first.__code__, {"TABLE": table})) for table in tables}) == 3


CALLEE = """
from springfoot.envs.physics.kernel import kernel
FACTOR = {factor}

@kernel
def part(x):
    return FACTOR * x + {constant}
"""
CALLER = """
from callee import part
from springfoot.envs.physics.kernel import kernel

@kernel
def whole(x):
    return part(x)

print(whole(1.0), sum(whole.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_a_change_in_another_file_reaches_the_kernels_that_use_it(tmp_path):
    (tmp_path / "caller.py").write_text(CALLER, encoding="utf-8")

    def run(factor: float, constant: float) -> list[str]:
        (tmp_path / "callee.py").write_text(CALLEE.format(factor=factor, constant=constant), encoding="utf-8")
        command = [sys.executable, "-B", "caller.py"]
        return subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()

    assert run(2.0, 5.0) == ["7.0", "0"]
    assert run(2.0, 5.0) == ["7.0", "1"]  # from the cache
    assert run(3.0, 5.0) == ["8.0", "0"]
    assert run(3.0, 6.0) == ["9.0", "0"]


ALONE = """
import resource, sys, warnings
from pathlib import Path
from springfoot.envs.physics.kernel import kernel

@kernel
def whole(x):
    return 2.0 * x

@kernel
def other(x):
    return 3.0 * x

if sys.argv[1:] == ["full"]:
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))  # no file can grow, as on a full disk
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("default")
    assert (whole(1.0), other(1.0)) == (2.0, 3.0)
print(sum(whole.stats.cache_hits.values()), len(said))
"""


def alone(
    folder: Path, *words: str, modules: Sequence[str] = ("alone",), **environment: str
) -> subprocess.CompletedProcess[str]:
    for module in modules:
        if not (folder / f"{module}.py").exists():  # old numba takes a file written anew for a changed one
            (folder / f"{module}.py").write_text(ALONE, encoding="utf-8")
    variables = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"} | environment
    command = [sys.executable, "-B", "-c", f"import {', '.join(modules)}", *words]
    return subprocess.run(command, cwd=folder, env=variables, check=True, capture_output=True, text=True)


@pytest.mark.slow
def test_a_cache_cut_short_is_made_anew(tmp_path):
    cuts = {f"alone_{number}": cut for number, cut in enumerate(product(("nbi", "nbc"), (0.0, 0.01, 0.5, 0.99)))}
    assert alone(tmp_path, modules=[*cuts]).stdout == "0 0\n" * len(cuts)
    for name, (ending, part) in cuts.items():  # each in a module of its own, all modules in one process
        files = list((tmp_path / "__pycache__").glob(f"{name}.whole*.{ending}"))
        assert files
        for file in files:
            content = file.read_bytes()
            file.write_bytes(content[: int(part * len(content))])
    assert alone(tmp_path, modules=[*cuts]).stdout == "0 0\n" * len(cuts)
    assert alone(tmp_path, modules=[*cuts]).stdout == "1 0\n" * len(cuts)


@pytest.mark.slow
def test_a_cache_with_a_flipped_bit_does_not_run(tmp_path):
    assert alone(tmp_path).stdout == "0 0\n"
    (file,) = (tmp_path / "__pycache__").glob("alone.whole*.nbc")
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    assert alone(tmp_path).stdout == "0 0\n"
    assert alone(tmp_path).stdout == "1 0\n"


@pytest.mark.slow
def test_a_full_disk_costs_the_cache_alone_and_says_so_once(tmp_path):
    assert alone(tmp_path, "full").stdout == "0 1\n"
    assert alone(tmp_path).stdout == "0 0\n"


def test_an_installation_that_cannot_be_written_says_so_once(tmp_path):
    (tmp_path / "__pycache__").write_text("a file in the folder's place")
    done = alone(tmp_path, HOME="/dev/null", XDG_CACHE_HOME="/dev/null", PYTHONWARNINGS="default")
    assert done.stdout == "0 0\n"
    assert done.stderr.count("compiled kernels cannot be kept") == 1
    assert "no folder for them can be written; NUMBA_CACHE_DIR names another folder" in done.stderr
