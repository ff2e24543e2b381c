"""What a command writes to: a pipe whose reader left, an output that was closed, a full disk, one column."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SPRINGFOOT = [sys.executable, "-c", "import sys; from springfoot.cli.main import main; sys.exit(main())"]


@pytest.mark.parametrize("words", [["--help"], ["evaluate", "--help"], ["study", "compare", "--help"]], ids=" ".join)
def test_help_whose_reader_left_ends_without_a_traceback(words):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*SPRINGFOOT, *words], stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


def test_output_that_was_closed_or_is_full_ends_without_a_traceback():
    closed = subprocess.run(["sh", "-c", '"$@" >&-', "sh", *SPRINGFOOT, "--help"], capture_output=True, text=True)
    assert (closed.returncode, closed.stderr) == (0, "")
    if Path("/dev/full").exists():
        with open("/dev/full", "w") as full:
            done = subprocess.run([*SPRINGFOOT, "--help"], stdout=full, stderr=subprocess.PIPE, text=True)
        said = "springfoot: error: cannot write the output: No space left on device\n"
        assert (done.returncode, done.stderr) == (2, said)


def test_what_is_closed_becomes_no_file_of_ours_and_no_process_of_ours_misses_it():
    said = "import os, subprocess, sys; from springfoot.terminal import at_terminal\n"
    said += "child = [sys.executable, '-c', 'import os; [os.fstat(handle) for handle in range(3)]']\n"
    said += "sys.exit(at_terminal(lambda: subprocess.run(child).returncode or open(os.devnull).fileno() < 3))"
    done = subprocess.run(["sh", "-c", '"$@" <&- >&- 2>&-', "sh", sys.executable, "-c", said])
    assert done.returncode == 0


def test_help_ends_in_a_terminal_of_one_column():
    words = [*SPRINGFOOT, "evaluate", "--help"]
    done = subprocess.run(words, env=os.environ | {"COLUMNS": "1"}, capture_output=True, text=True)
    assert done.returncode == 0 and "--speed" in done.stdout
