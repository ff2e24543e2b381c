"""A first start, in which kernels are compiled for a while, says so; a later one, which finds them, does not."""

import os
import subprocess
import sys

import pytest

from springfoot.compiling import NOTICE

TWO_KERNELS = """
from springfoot.compiling import tell_of_compiling
from springfoot.envs.physics.kernel import kernel

@kernel
def inner(x):
    return 2.0 * x

@kernel
def outer(x):
    return inner(x) + 1.0

tell_of_compiling()
print(outer(1.0), inner(1.0))
"""
COMMANDS = {
    "evaluate": "evaluate schedule --episodes 1 --seconds 4 --no-report --out walk",
    "live": "live schedule --seconds 0.5 --port 0",
    "train": "train --out run --timesteps 64 --num-envs 2 --update-steps 64 --eval-episodes 1 --episode-seconds 0.4",
}


def told(folder, *words):
    """Run Python on the words, with numba's cache in the folder; return its standard error."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}
    command = [sys.executable, "-B", *words]
    return subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True, text=True).stderr


@pytest.mark.slow
def test_compiling_is_told_once_and_not_where_the_kernels_are_kept(tmp_path):
    (tmp_path / "kernels.py").write_text(TWO_KERNELS, encoding="utf-8")
    assert told(tmp_path, "-c", "import kernels") == f"{NOTICE}\n"
    assert told(tmp_path, "-c", "import kernels") == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_the_first_start_of_a_command_says_that_it_compiles(tmp_path, name):
    """The line comes before all others; the command is ended there, as compiling all kernels takes half a minute."""
    start = "import sys; from springfoot.cli.main import main; sys.exit(main(sys.argv[1:]))"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-B", "-c", start, *COMMANDS[name].split()]
    pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
    with subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=nothing, stderr=pipe, text=True) as process:
        assert process.stderr is not None
        try:
            assert process.stderr.readline() == f"{NOTICE}\n"
        finally:
            process.kill()
