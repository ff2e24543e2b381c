"""The bench: what it compares is the same walk, and it writes what it promises. No limit on any time."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.timing import Case, measure
from benchmarks.walking import STEP, Physics, batch_case, record_walk, step_over_physics, study_model
from springfoot.envs.physics.model import build_model
from springfoot.envs.physics.timing import PHYSICS_STEP
from springfoot.gait.body.body import Body

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def walk():
    return record_walk(4, 5)


def test_physics_alone_walks_as_the_full_step_does(walk):
    spent, apart = step_over_physics(walk, 3, rounds=1)
    assert spent.shape == (3, len(walk.actions)) and np.isfinite(spent).all()
    assert apart < 1e-12
    physics = Physics(build_model(Body()), 2)
    physics.place(walk, 0)
    physics.step(walk, 0)
    for index, data in enumerate(physics.bodies):
        assert data.time == pytest.approx(STEP)
        assert data.qpos == pytest.approx(walk.position[1, index], abs=1e-12)


def test_a_smaller_batch_repeats_the_same_walk(walk):
    alone = record_walk(1, 5)
    for name in ("actions", "position", "velocity", "controls"):
        assert np.array_equal(getattr(alone, name), getattr(walk, name)[..., :1, :])


def test_the_studys_settings_are_a_millisecond_with_islands():
    ours, study = build_model(Body()), study_model()
    assert study.opt.timestep == 0.001 < ours.opt.timestep == PHYSICS_STEP
    assert study.opt.integrator == ours.opt.integrator and study.opt.cone == ours.opt.cone
    assert study.opt.disableflags == 0 != ours.opt.disableflags


def test_figures_are_per_step_and_cases_take_turns(walk):
    calls = []
    cases = [
        Case(
            name=name,
            samples=10,
            seconds=STEP,
            run=lambda name=name: calls.append(name),
            prepare=lambda: calls.append("-"),
        )
        for name in "ab"
    ]
    figures = measure([*cases, batch_case(walk, 2, 2)], repeats=2)
    assert calls == ["-", "a", "-", "b"] * 3
    for each in figures.values():
        assert each.samples_per_second == pytest.approx(1e6 / each.wall_us)
        assert each.sim_seconds_per_core_second == pytest.approx(1e6 * STEP / each.cpu_us)


@pytest.mark.slow
def test_bench_writes_the_figures_it_promises(tmp_path):
    out = tmp_path / "new" / "bench.json"
    command = [sys.executable, "-m", "benchmarks.bench", "--quick", "--out", out]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    figures = json.loads(out.read_text())
    overheads = [figures["overhead_of_study"], figures["overhead_of_physics"]]
    assert [set(each) for each in overheads] == [{"1", "8", "64"}] * 2
    names = ["thread_speedup_64", "vs_dummy", "vs_subproc", "ppo_vs_study", "leg_kinematics_over_sine", "load"]
    names += ["sim_seconds_per_core_second", "study_sim_seconds_per_core_second", "planning_share_of_training"]
    names += ["start_over_walker2d"]
    for value in [*(figures[name] for name in names), *(value for each in overheads for value in each.values())]:
        assert math.isfinite(value)
    assert figures["machine"]["versions"]["mujoco"] in done.stdout
    for name in ("springfoot, N = 64, 2 threads", "DummyVecEnv, N = 2", "SubprocVecEnv, N = 2", "PPO, ours"):
        assert figures["cases"][name]["wall_us"] > 0 and name in done.stdout
