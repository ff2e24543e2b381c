"""The trade-off: the measure of stiffness is the reward's, the knee is found, finished trainings are kept."""

import csv
import shutil
from dataclasses import replace

import numpy as np
import pytest
from drawn import has_line, kept_figures

from springfoot.cli.main import study_main
from springfoot.envs.batch.biped_batch import Biped
from springfoot.evaluation.recording.policies import prepare
from springfoot.evaluation.recording.recording import WARM_UP, record
from springfoot.studies import stiffness_cost as tradeoff
from springfoot.studies.stiffness_cost import config_of, folder_of, knee, stiffness_cost


def test_the_stiffness_cost_is_the_rewards_term():
    policy, settings = prepare("schedule", {"episode_seconds": WARM_UP + 1.0})
    biped, costs = Biped(settings, 1), []
    biped.reset(np.arange(1), [0])
    observation = biped.observe()
    for _ in range(round(settings.episode_seconds / biped.dt)):
        result = biped.step(policy(observation))
        observation = result.observation
        costs.append(result.info["reward/stiffness"][0])
    expected = np.mean(costs[round(WARM_UP / biped.dt) :])
    assert stiffness_cost(record(policy, settings, name="schedule", episodes=1)) == pytest.approx(expected, rel=1e-5)


def test_the_knee_is_where_the_curve_is_farthest_below_the_line_between_its_ends():
    cost = np.linspace(0.1, 1.0, 10)
    loss = np.where(cost < 0.35, 10 - 30 * (cost - 0.1), 4 - 0.1 * (cost - 0.3))
    assert knee(cost, loss) == knee(100 * cost + 5, 3 * loss) == 2
    order = np.random.default_rng(0).permutation(10)
    assert order[knee(cost[order], loss[order])] == 2
    assert knee(cost, -cost) is None and knee(cost, -(cost**2)) is None and knee(cost[:2], loss[:2]) is None


def test_a_weight_changes_its_own_term_alone():
    config = config_of(0.2, 3, "stiffness_rate", 100)
    assert (config.seed, config.timesteps) == (3, 100)
    assert config.environment.reward_weights == {"stiffness_rate": -0.2}


def test_the_command_trains_what_is_missing_draws_and_keeps_what_is_finished(monkeypatch, capfd, tmp_path):
    few = replace(tradeoff.PRESETS["walk"], num_envs=8, update_steps=512, eval_episodes=2)
    monkeypatch.setitem(tradeoff.PRESETS, "walk", few)

    def main(*words):
        short = ["--seeds", "1", "--timesteps", "512", "--episodes", "1", "--seconds", "6", "--pushes", "150"]
        files = ["--runs", str(tmp_path / "runs"), "--out", str(out)]
        code = study_main(["stiffness-cost", "--weights", "0.4", "0", *short, *files, *words])
        shutil.rmtree(tmp_path / "before", ignore_errors=True)
        if out.exists():
            out.rename(tmp_path / "before")
        return code, *capfd.readouterr()

    out = tmp_path / "out"
    with kept_figures() as figures:
        code, said, error = main()
    assert code == 0 and "stiffness 0.4, seed 0: " in error
    likeness, robustness, agreement = figures["tradeoff.png"].axes
    with (tmp_path / "before" / "policies.csv").open(encoding="utf-8", newline="") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: float(row["stiffness_cost"]))
    cost = [float(row["stiffness_cost"]) for row in rows]
    assert has_line(likeness, cost, [float(row["rmse_deg"]) for row in rows], rel=1e-3)
    assert has_line(robustness, cost, [100 * float(row["falls_150_N"]) for row in rows], rel=1e-3)
    assert agreement.get_ylabel().startswith("CV of K")
    best = folder_of(tmp_path / "runs", "stiffness", 0.4, 0) / "best.safetensors"
    written = best.stat().st_mtime_ns
    assert main()[:2] == (0, said) and best.stat().st_mtime_ns == written
    code, _, error = main("--timesteps", "1024")
    assert code == 2 and "trained with other settings" in error
    code, _, error = main("--no-train", "--term", "stiffness_rate")
    assert code == 2 and "no finished training of stiffness_rate" in error


def test_a_bad_weight_is_refused_before_anything_is_trained(capsys, tmp_path):
    assert study_main(["stiffness-cost", "--weights", "-0.1", "--runs", str(tmp_path / "runs")]) == 2
    assert "must be a finite number <= 0" in capsys.readouterr().err and not (tmp_path / "runs").exists()
