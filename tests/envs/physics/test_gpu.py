"""The GPU bench runs where its extra is, on the CPU if need be, and says in one line what is missing."""

import re
import sys

import pytest

from benchmarks import gpu


def main(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["gpu", *words])
    return gpu.main()


def test_what_is_missing_is_said_in_one_line(monkeypatch, capsys):
    assert main(monkeypatch, "--device", "nowhere") == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("gpu: error: no device 'nowhere'") or "pip install 'springfoot[gpu]'" in last


def test_it_walks_as_c_mujoco_does(monkeypatch, capsys):
    pytest.importorskip("mujoco_warp", reason="needs the extra gpu")
    assert main(monkeypatch, "--device", "cpu", "--sizes", "3", "--steps", "1", "--repeats", "1") == 0
    told = capsys.readouterr().out
    found = re.search(r"N = +3: [\d,]+ .* within (\S+) of C MuJoCo, forces of the floor within (\S+) of body", told)
    assert found and float(found.group(1)) < 1e-4
    assert float(found.group(2)) < 1e-3
