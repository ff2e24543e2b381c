"""Files changed at random, and steps at the ends of every setting: no crash, no hang, no growth, all finite.

For longer: `make fuzz`, `make extremes`.
"""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(module, *words):
    command = [sys.executable, "-m", f"benchmarks.{module}", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_files_changed_at_random_are_read_or_refused_in_one_line():
    said = run("fuzz_readers", "--seconds", "6")
    assert "FAILED" not in said and " MB beyond the imports" in said
    assert sum(": " in line and " refused, " in line for line in said.splitlines()) >= 13
    assert ": 0 refused, 0 read" not in said


@pytest.mark.slow
def test_twenty_thousand_extreme_steps_are_finite_and_the_memory_stays():
    said = run("extreme_steps", "--steps", "20000", "--settings", "6")
    assert "not finite or not in its space: nothing" in said
