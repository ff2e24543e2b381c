"""Comparisons: rows that differ in the policy and in nothing else, and what is concluded from them."""

import csv
import subprocess
import sys

import numpy as np
import pytest

from springfoot.agents.baselines import BASELINES, constant
from springfoot.envs.settings import BipedSettings, settings_from
from springfoot.evaluation.recording import prepare, record
from springfoot.studies import comparison, quantities
from springfoot.studies.command import study_main
from springfoot.studies.constant_search import best_constant
from springfoot.studies.seeds import seeds_table

SHORT = {"episode_seconds": 4.5, "push_newton": 150.0}


@pytest.fixture(scope="module")
def rows():
    return comparison.compare("schedule", SHORT, best=(200.0, 30.0), episodes=2, seed=3)


def test_every_baseline_is_a_row_with_its_springs(rows):
    assert [row.name for row in rows] == ["schedule", *BASELINES, "constant:200,30"]
    stiffness = rows[-1].metrics["stiffness_Nm_rad"]
    assert stiffness["ankle"]["mid_stance"] == pytest.approx(200.0)
    assert stiffness["toe"]["mid_stance"] == pytest.approx(30.0)


def test_rows_share_conditions_and_reward_and_the_thesis_has_its_own_equilibrium(rows):
    first = rows[0].metrics["environment"]
    for row in rows:
        own = {"equilibrium", "schedule"} if row.name == "thesis" else set()
        assert {key for key in first if row.metrics["environment"][key] != first[key]} == own
    assert first["push_newton"] == 150.0


def test_a_baseline_earns_the_reward_of_the_policy_it_is_held_against():
    weights = {"alive": 1.0, "speed": 0.0}
    given = SHORT | {"reward_weights": weights, "episode_seconds": 1.0}
    alone = settings_from(**given)
    (found,) = [row for row in comparison.compare("schedule", given, episodes=2, seed=3) if row.name == "constant"]
    assert np.array_equal(found.returns, record(constant(alone), alone, name="", episodes=2, seed=3).returns)
    plain = settings_from(**(given | {"reward_weights": {}}))
    assert not np.array_equal(found.returns, record(constant(plain), plain, name="", episodes=2, seed=3).returns)


def test_a_row_is_what_evaluate_would_find(rows):
    policy, settings = prepare("schedule", SHORT)
    assert np.array_equal(rows[0].returns, record(policy, settings, name="", episodes=2, seed=3).returns)


def test_a_residual_policy_stands_beside_baselines_that_act_absolutely():
    rows = comparison.compare("untrained", SHORT | {"action_mode": "residual"}, episodes=1)
    speed = {(index > 0, row.name): row.metrics["speed_m_s"]["mean"] for index, row in enumerate(rows)}
    assert speed[False, "untrained"] == pytest.approx(speed[True, "schedule"], rel=1e-3)  # no action: the schedule
    assert speed[True, "untrained"] != pytest.approx(speed[True, "schedule"], rel=1e-2)  # mid-range


def test_interval_is_that_of_a_normal_mean_and_covers_it_as_often_as_said():
    random = np.random.default_rng(1)
    low, high = comparison.mean_interval(random.normal(5.0, 2.0, 400))
    assert high - low == pytest.approx(2 * 1.96 * 2.0 / np.sqrt(400), rel=0.1)
    covered = 0
    for _ in range(200):
        low, high = comparison.mean_interval(random.normal(5.0, 2.0, 50))
        covered += low <= 5.0 <= high
    assert 0.88 < covered / 200 < 0.99
    assert comparison.mean_interval(np.full(7, 3.0)) == comparison.mean_interval(np.array([3.0])) == (3.0, 3.0)


def row_of(name, returns, rmse=2.0):
    """A row of given returns, all joints equally far off."""
    metrics = {
        "falls": 1,
        "episodes": len(returns),
        "speed_m_s": {"mean": 1.2},
        "joints": {joint: {"rmse_deg": rmse} for joint in quantities.COMPARED_JOINTS},
        "grf": {"vertical_peak1_bw": 1.05, "vertical_peak2_bw": None},
    }
    return comparison.Row(name=name, metrics=metrics, returns=np.array(returns, float))


def test_table_says_whether_intervals_are_apart_and_which_joints_are_closer():
    ours = row_of("ours", [10, 11, 12, 13])
    rows = [ours, row_of("worse", [1, 2, 3, 4]), row_of("alike", [9, 11, 12, 15], 1.75), row_of("better", [20, 21])]
    head, rule, *body = comparison.comparison_table(rows).splitlines()
    assert head.count("|") == rule.count("|") == body[0].count("|")
    ends = [line.split("|")[-2].strip() for line in body]
    assert ends == ["", "lower, intervals apart", "intervals overlap", "higher, intervals apart"]
    assert body[0].startswith("| `ours` | 1 of 4 | 11.5 [") and "1.05 / –" in body[0]
    verdict = comparison.verdict(rows)
    assert "than 1 of 3 rows" in verdict
    assert "alike knee by 0.25°" in verdict and "worse" not in verdict


def test_best_constant_is_at_least_as_good_as_the_ends_of_the_range():
    settings = BipedSettings(episode_seconds=0.6, ankle_stiffness_range=(20, 800), toe_stiffness_range=(20, 40))
    told = []
    pair, tried = best_constant(settings, grid=(2, 2), refinements=1, episodes=2, seed=5, progress=told.append)
    returns = tried[pair]
    assert sum(told) == 2 * 2 + 9
    assert returns.mean() == max(each.mean() for each in tried.values())
    assert len(returns) == 2 and 20 <= pair[0] <= 800 and 20 <= pair[1] <= 40
    for other in ((20.0, 20.0), (800.0, 40.0)):
        assert returns.mean() >= record(constant(settings, other), settings, name="", episodes=2, seed=5).returns.mean()
    again = record(constant(settings, pair), settings, name="", episodes=2, seed=5).returns
    assert np.array_equal(returns, again)


def test_seeds_table_has_the_spread_over_policies(rows):
    lines = seeds_table(rows[:1] + rows[-1:]).splitlines()
    cells = {line.split("|")[1].strip(): [cell.strip() for cell in line.split("|")[2:-1]] for line in lines}
    one, other = (row.metrics["stiffness_Nm_rad"]["ankle"]["push_off"] for row in (rows[0], rows[-1]))
    mean, sd = (one + other) / 2, abs(one - other) / np.sqrt(2)
    assert cells["ankle K push-off N·m/rad"] == [f"{one:.0f}", f"{other:.0f}", f"{mean:.0f} ± {sd:.0f}"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["compare", "nobody"], "no policy 'nobody'"),
        (["compare", "schedule", "--episodes", "0"], "episodes must be"),
        (["compare", "schedule", "--constant", "-1", "30"], "two positive stiffnesses"),
        (["seeds"], "one policy or more"),
        (["best-constant", "--policy", "untrained", "--mass", "-1"], "mass must be"),
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_written(words, said, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert study_main(words) == 2
    told = capsys.readouterr()
    assert said in told.err and told.err.count("\n") == 1 and not told.out
    assert not list(tmp_path.iterdir())


def test_studies_run_as_a_command_and_leave_their_numbers(tmp_path):
    words = ["seeds", "schedule", "--episodes", "1", "--seconds", "4.5"]
    command = [sys.executable, "-c", "from springfoot.studies.command import main; main()", "study", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert "| falls | 0 | 0.0 ± – |" in done.stdout
    assert "1 episodes × 4.5 s, seeds 0–0, no pushes." in done.stdout
    with (tmp_path / "runs" / "seeds-1" / "seeds.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert row["policy"] == "schedule" and row["falls"] == "0"
    assert f"| speed m/s | {float(row['speed_m_s_mean']):.3f} |" in done.stdout
