"""Compiled kernels: kept between processes, made anew when anything that they use has changed."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from springfoot.envs.physics.kernel import _fingerprint

ENVS = Path(__file__).parents[1] / "envs"
KERNELS = {
    kernel.py_func.__name__: kernel
    for path in sorted(ENVS.rglob("*.py"))
    if path.name != "__init__.py"
    for kernel in vars(
        import_module("springfoot.envs." + ".".join(path.relative_to(ENVS).with_suffix("").parts))
    ).values()
    if isinstance(kernel, Dispatcher)
}


@pytest.mark.parametrize("name", KERNELS)
def test_a_kernel_stands_below_all_that_it_uses_and_takes_ten_arguments_at_most(name):
    function = KERNELS[name].py_func
    assert function.__qualname__ == f"{name}_{_fingerprint(function)}"  # nothing came to be known since
    assert function.__code__.co_argcount <= 10


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
