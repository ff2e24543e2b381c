"""Mutants are all there, change one place each, and are found again; what is judged is kept."""

import ast
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.executed_lines import FOLDER, REPOSITORY
from benchmarks.mutants import EXECUTING, OTHERS, KeptLines, MeasuredFile, Verdict, draw, read_mutants, verdicts
from benchmarks.mutation import find, sites_of
from benchmarks.processes import Processes

ROOT = Path(__file__).parents[2]
SOURCE = '''\
TABLE = (-1.0, 2 + 3)


class Body:
    names: list[int] = []

    def mass(self, count: int, θ=-1.0) -> tuple[int, ...]:
        """Not + here."""
        if 0 < count <= 3:  # nor - here
            θ += -θ
        θ = (self.a
             - θ)  # π
        text = "a" + f"{1 + 1}"
        return self.rows[count, 0][-1:] if count == len(text) else [θ * i for i in range(3)][θ]
'''
CHANGES = [
    "0 < count <= 3 [< to <=]",
    "0 < count <= 3 [< to >]",
    "0 < count <= 3 [<= to <]",
    "0 < count <= 3 [<= to >=]",
    "θ += -θ [+= to -=]",
    "-θ [- dropped]",
    "self.a - θ [- to +]",
    "self.rows[count, 0] [[count] to [count - 1]]",
    "self.rows[count, 0] [[0] to [1]]",
    "self.rows[count, 0][-1:] [[-1] to [-2]]",
    "count == len(text) [== to !=]",
]


def test_signs_comparisons_and_indices_in_functions_and_nothing_else():
    sites = sites_of(SOURCE, "gait/body.py")
    assert [f"{site.mutant.expression} [{site.mutant.change}]" for site in sites] == CHANGES
    assert {site.mutant.function for site in sites} == {"Body.mass"}
    assert [site.mutant.line for site in sites] == [9, 9, 9, 9, 10, 10, 12, 14, 14, 14, 14]
    assert sites[0].lines == range(9, 10) and sites[6].lines == range(11, 13)


def test_a_mutant_differs_in_one_place():
    for site in sites_of(SOURCE, "gait/body.py"):
        mutated = site.applied(SOURCE)
        ast.parse(mutated)
        before, after = SOURCE[: site.start], SOURCE[site.end :]
        assert mutated == before + site.text + after != SOURCE
        old, new = site.mutant.change.replace("- dropped", "- to ").split(" to ")
        assert (SOURCE[site.start : site.end], site.text) == (old.strip("[]"), new.strip("[]"))


def test_a_mutant_is_found_where_its_function_went():
    lines = SOURCE.splitlines(keepends=True)
    moved = "".join(["import math\n\n\n", *lines[3:]]).replace("(self.a\n             - θ)", "self.a - θ")
    there = sites_of(moved, "gait/body/body.py")
    for site in sites_of(SOURCE, "gait/body.py"):
        found = find(site.mutant, there)
        assert found is not None
        assert (found.mutant.expression, found.mutant.change) == (site.mutant.expression, site.mutant.change)


def test_a_mutant_is_found_by_its_statement_only_where_that_is_alone():
    (site,) = sites_of("def f(x):\n    return -x\n", "a.py")
    assert find(site.mutant, sites_of("def g(x):\n    return -x\n", "b.py")) is not None
    assert find(site.mutant, sites_of("def g(x):\n    y = -x\n", "b.py")) is None
    assert find(site.mutant, sites_of("def g(x):\n    return -x\ndef h(x):\n    return -x\n", "b.py")) is None


def test_the_seed_decides_what_is_drawn():
    sites = sites_of(SOURCE, "gait/body.py")
    assert draw(sites, 5, 0) == draw(sites, 5, 0) != draw(sites, 5, 1)
    assert draw(sites, 100, 0) != sites and {*draw(sites, 100, 0)} == {*sites}


def test_tests_are_chosen_by_the_lines_they_execute():
    header, shift = sites_of(SOURCE, "gait/body.py")[0], sites_of(SOURCE, "gait/body.py")[6]
    measured = MeasuredFile(file="tests/test_a.py", seconds=1.0, passes=True, lines={"gait/body.py": [9, 12]})
    assert measured.executes(header) and measured.executes(shift)
    assert not replace(measured, lines={"gait/body.py": [10]}).executes(header)
    assert not replace(measured, lines={"gait/leg.py": [9, 12]}).executes(header)


def test_kept_verdicts_are_not_asked_for_again(tmp_path):
    sites = sites_of(SOURCE, "gait/body.py")
    path = tmp_path / "out" / "verdicts.jsonl"
    judged = []

    def judge(site):
        if len(judged) == 4:
            raise KeyboardInterrupt
        judged.append(site)
        return Verdict(mutant=site.mutant, stage=EXECUTING, killed=True, by="a test", seconds=1.0)

    with pytest.raises(KeyboardInterrupt):
        verdicts(sites, EXECUTING, KeptLines(path), judge, Processes(), 1)
    kept = path.read_text()
    path.write_text(kept + kept.splitlines()[-1][:50])  # a stop while a line is written
    begun, judged = judged, []
    for _ in range(3):
        judged.clear()
        found = verdicts(sites[:6], EXECUTING, KeptLines(path), judge, Processes(), 1)
        assert [each.mutant for each in found] == [site.mutant for site in sites[:6]]
    assert begun == sites[:4] and judged == []
    assert [json.loads(line)["mutant"]["change"] for line in path.read_text().splitlines()] == [
        site.mutant.change for site in sites[:6]
    ]
    assert read_mutants(path) == [site.mutant for site in sites[:6]]
    verdicts(sites[:1], OTHERS, KeptLines(path), judge, Processes(), 1)
    assert judged == sites[:1]


def test_a_stop_a_limit_and_a_failure_beside_it_end_a_process(tmp_path):
    processes = Processes()
    sleep = [sys.executable, "-c", "import time; print('begun', flush=True); time.sleep(600)"]
    done = processes.run(sleep, tmp_path, limit=2.0)
    assert done.timed_out and done.code != 0
    ended = []

    def sleep_or_fail(sleeps):
        if not sleeps:
            sys.exit("failed")
        with pytest.raises(KeyboardInterrupt):
            processes.run(sleep, tmp_path)
        ended.append("stopped")

    with pytest.raises(SystemExit, match="failed"):
        list(processes.in_parallel(sleep_or_fail, [True, False], 2))
    assert ended == ["stopped"]
    with pytest.raises(KeyboardInterrupt):
        processes.run(sleep, tmp_path)


@pytest.mark.slow
def test_lines_of_compiled_kernels_count_where_they_are_called(tmp_path):
    code = """
from benchmarks import executed_lines
executed_lines.start()
import numpy as np
from springfoot.envs.control import stiffness_control
from springfoot.envs.control.phase_table import SAMPLES, PhaseTable
PhaseTable(np.zeros((SAMPLES, 2))).at(np.array([0.5]))
"""
    environment = os.environ | {FOLDER: str(tmp_path), REPOSITORY: str(ROOT)}
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=environment, check=True)
    (path,) = tmp_path.glob("*.json")
    lines = json.loads(path.read_text())

    def executed(file, function):
        sites = [site for site in sites_of((ROOT / file).read_text(), file) if site.mutant.function == function]
        return [not set(site.lines).isdisjoint(lines[file]) for site in sites]

    table, springs = "envs/control/phase_table.py", "envs/control/stiffness_control.py"
    assert all(executed(table, "PhaseTable.__init__")) and all(executed(table, "_read_all"))
    assert all(executed(table, "read"))  # which is called by a kernel alone
    assert executed(springs, "move") and not any(executed(springs, "move"))
