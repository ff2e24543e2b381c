"""What stops a command before it begins: an address of another machine, a package that is not installed."""

import subprocess
import sys

import pytest

from springfoot.cli.main import main


@pytest.mark.parametrize("host", ["192.0.2.77", "999.1.1.1\x00", "a" * 80])
def test_live_refuses_an_address_of_another_machine(host, capsys):
    assert main(["live", "--host", host]) == 2
    error = capsys.readouterr().err
    start = (
        "springfoot live: error: host must be an address of this machine, as 127.0.0.1, or 0.0.0.0 for all of them, got"
    )
    assert error.startswith(start) and error.count("\n") == 1


@pytest.mark.parametrize(
    ("command", "extra"), [("live", "live"), ("datasets", "minari"), ("train", "train"), ("evaluate", "evaluate")]
)
def test_without_any_extra_a_command_names_its_own(command, extra):
    hidden = (
        "import sys; sys.modules['tyro'] = None\nfrom springfoot.cli.main import main\nsys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run([sys.executable, "-c", hidden, command], capture_output=True, text=True)
    told = f"springfoot {command}: error: the package tyro is missing: pip install 'springfoot[{extra}]'\n"
    assert (done.returncode, done.stderr) == (2, told)
