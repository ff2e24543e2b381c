"""Comparisons: rows that differ in the policy and in nothing else, and what is concluded from them."""

import csv
import dataclasses
import subprocess
import sys

import numpy as np
import pytest

from springfoot.agents.policies.baselines import BASELINES, constant
from springfoot.cli.main import study_main
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.metrics import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.studies.base import columns, intervals
from springfoot.studies.base.flags import RecordedFlags
from springfoot.studies.walks import comparison
from springfoot.studies.walks.laboratory import LABORATORY

SHORT = {"episode_seconds": 4.5, "push_newton": 150.0}
THESIS = {"thesis", "thesis_printed"}


@pytest.fixture(scope="module")
def rows():
    found = comparison.contenders("schedule", SHORT, constant=(200.0, 30.0), factor=1.2, seed=3)
    return [comparison.run_row(*each, episodes=2, seed=3, threads=1) for each in found]


def test_every_spring_that_needs_no_learning_is_a_row(rows):
    names = [row.name for row in rows]
    assert names[:4] == ["schedule", "untrained", "schedule", "schedule:1.2"]  # as a policy, and among the springs
    assert set(BASELINES) < set(names) and "quasi_stiffness, commanded 1.35 m/s" in names
    stiffness = {row.name: row.metrics["stiffness_Nm_rad"] for row in rows}
    assert stiffness["constant:200,30"]["ankle"]["mid_stance"] == pytest.approx(200.0)
    assert stiffness["constant:200,30"]["toe"]["mid_stance"] == pytest.approx(30.0)
    own, factor = (stiffness[name]["ankle"]["mid_stance"] for name in ("schedule", "schedule:1.2"))
    assert factor == pytest.approx(1.2 * own, rel=0.02)


def test_rows_share_conditions_and_reward_but_for_what_makes_them_other_springs(rows):
    first = rows[0].metrics["environment"]
    for row in rows:
        own = {"equilibrium", "schedule"} if row.name in THESIS else set()
        own |= {"speed"} if "commanded" in row.name else set()
        assert {key for key in first if row.metrics["environment"][key] != first[key]} == own
    assert first["push_newton"] == 150.0


def test_a_baseline_earns_the_reward_of_the_policy_it_is_held_against():
    weights = {"alive": 1.0, "speed": 0.0}
    given = {"reward_weights": weights, "episode_seconds": 1.0}
    alone = settings_from(**given)
    (found,) = [each for each in comparison.contenders("schedule", given) if each.name == "constant"]
    returns = comparison.run_row(*found, episodes=2, seed=3, threads=1).returns
    assert np.array_equal(returns, record(constant(alone), alone, name="", episodes=2, seed=3, threads=1).returns)
    plain = settings_from(**(given | {"reward_weights": {}}))
    assert not np.array_equal(returns, record(constant(plain), plain, name="", episodes=2, seed=3, threads=1).returns)


def test_a_row_is_what_evaluate_would_find(rows):
    policy, settings = policy_and_settings("schedule", SHORT)
    assert np.array_equal(rows[0].returns, record(policy, settings, name="", episodes=2, seed=3, threads=1).returns)


def test_untrained_is_where_the_policys_own_training_starts():
    found = {each.name: each for each in comparison.contenders("pretrained", {"episode_seconds": 1.0}, threads=1)}
    assert found["untrained"].settings.action_mode == found["pretrained"].settings.action_mode == "absolute"
    own = found["untrained"]
    returns = comparison.run_row(*own, episodes=1).returns
    middle = [np.sqrt(np.prod(getattr(own.settings, f"{joint}_stiffness_range"))) for joint in ("ankle", "toe")]
    held = record(constant(own.settings, middle), own.settings, name="", episodes=1)
    assert returns[0] == pytest.approx(held.returns[0], rel=1e-6)


def test_a_trained_policy_is_held_against_its_open_loop_copy():
    own, copy, *_ = comparison.contenders("pretrained", {"episode_seconds": 1.0}, threads=1)
    assert copy.name == "frozen:pretrained"
    assert copy.settings == dataclasses.replace(own.settings, action_mode="absolute")


def test_interval_is_that_of_a_normal_mean_and_covers_it_as_often_as_said():
    random = np.random.default_rng(1)
    low, high = intervals.mean_interval(random.normal(5.0, 2.0, 400))
    assert high - low == pytest.approx(2 * 1.96 * 2.0 / np.sqrt(400), rel=0.1)
    covered = 0
    for _ in range(200):
        low, high = intervals.mean_interval(random.normal(5.0, 2.0, 50))
        covered += low <= 5.0 <= high
    assert 0.88 < covered / 200 < 0.99
    assert intervals.mean_interval(np.full(7, 3.0)) == intervals.mean_interval(np.array([3.0])) == (3.0, 3.0)


def row_of(name, returns, fell=(), speed=1.2):
    """A row of given returns, all joints equally far off, in which the episodes `fell` fell."""
    metrics = {
        "falls": len(fell),
        "episodes": len(returns),
        "speed_m_s": {"mean": 1.2},
        "environment": {"speed": speed},
        "joints": {joint: {"rmse_deg": 2.0} for joint in columns.COMPARED_JOINTS},
    }
    fallen = np.isin(np.arange(len(returns)), fell)
    return comparison.Row(name=name, metrics=metrics, returns=np.array(returns, float), fell=fallen)


def test_intervals_of_shares_are_wilsons():
    # Newcombe 1998, Statistics in Medicine 17, 857: 81 of 263, 0 of 20, 1 of 29.
    for count, total, low, high in ((81, 263, 0.2553, 0.3662), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)):
        assert intervals.share_interval(count, total) == pytest.approx((low, high), abs=1e-4)


def test_falls_of_paired_rows_are_told_apart_by_the_episodes_that_differ():
    fell = np.arange(20) < 10
    assert intervals.paired_p(fell, fell) == 1.0
    assert intervals.paired_p(np.zeros(20, bool), fell) == pytest.approx(2 * 0.5**10)
    assert intervals.paired_p(fell, np.zeros(20, bool)) == pytest.approx(2 * 0.5**10)
    assert intervals.paired_p(fell, ~fell) == 1.0


def test_table_and_verdict_say_what_the_policy_is_ahead_of_and_what_not():
    noise = np.array([0.0, 1.0, -1.0, 0.5] * 5)
    ours = row_of("ours", 10 + noise)
    rows = [
        ours,
        row_of("worse", 8 + noise[::-1], fell=range(12)),
        row_of("alike", 10 + noise[::-1], fell=[3]),
        row_of("elsewhere", 1 + noise, speed=1.4),
    ]
    head, rule, *body = comparison.comparison_table(rows).splitlines()
    assert head.count("|") == rule.count("|") == body[0].count("|")
    assert body[0].startswith("| `ours` | 0 of 20 [0, 16 %] |  | 10.1 |  | 1.200 |")
    assert body[1].startswith("| `worse` | 12 of 20 [39, 78 %] | 0.00049 | 8.1 | 2.0 [")
    assert "| – |" in body[3]
    assert comparison.verdict(rows) == (
        "ours earns more than 1 of 2 rows (interval above 0); not more than alike. It falls less often than 1 of 3 "
        "(p < 0.05); not less than alike, elsewhere."
    )
    assert comparison.verdict([ours, rows[3]]) == (
        "No return compares with that of ours. It falls less often than 0 of 1 (p < 0.05); not less than elsewhere."
    )


def test_returns_of_other_rewards_or_targets_do_not_compare():
    themes = {field.name: field.metadata.get("theme") for field in dataclasses.fields(BipedSettings)}
    judged = {name for name in themes if themes[name] in (themes["guide"], themes["reward_weights"])}
    assert judged | {"speed", "step_time_ratio"} == set(comparison.COMPARABLE) and len(judged) > 5
    for name in comparison.COMPARABLE:
        ours, other = row_of("ours", np.arange(20.0)), row_of("other", np.zeros(20))
        assert other.difference(ours) is not None
        other.metrics["environment"][name] = "another"
        assert other.difference(ours) is None


def test_spread_table_has_mean_and_sd_over_policies(rows):
    lines = comparison.spread_table([rows[0], rows[4]]).splitlines()
    cells = {line.split("|")[1].strip(): [cell.strip() for cell in line.split("|")[2:-1]] for line in lines}
    one, other = (row.metrics["stiffness_Nm_rad"]["ankle"]["push_off"] for row in (rows[0], rows[4]))
    mean, sd = (one + other) / 2, abs(one - other) / np.sqrt(2)
    assert cells["ankle K push-off N·m/rad"] == [f"{one:.0f}", f"{other:.0f}", f"{mean:.0f} ± {sd:.0f}"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["compare", "nobody"], "no policy 'nobody'"),
        (["compare", "schedule", "--episodes", "0"], "episodes must be"),
        (["compare", "schedule", "--constant", "-1", "30"], "two positive stiffnesses"),
        (["compare", "untrained", "--mass", "-1"], "mass must be"),
        (["compare", "untrained", "--pushes"], "pushes must be"),
    ],
)
def test_bad_input_is_one_line_exit_code_2_and_nothing_written(words, said, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert study_main(words) == 2
    told = capsys.readouterr()
    assert said in told.err and told.err.count("\n") == 1 and not told.out
    assert not list(tmp_path.iterdir())


def test_studies_run_as_a_command_and_leave_their_numbers(tmp_path):
    words = ["compare", "schedule", "constant", "--no-springs", "--pushes", "0", "--episodes", "1", "--seconds", "4.5"]
    command = [sys.executable, "-c", "from springfoot.cli.main import main; main()", "study", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert "| falls | 0 | 0 | 0.0 ± 0.0 |" in done.stdout
    assert "1 episode × 4.5 s, seed 0, no pushes." in done.stdout
    with (tmp_path / "runs" / "compare-1" / "compare.csv").open(encoding="utf-8", newline="") as file:
        first, second = csv.DictReader(file)
    assert first["policy"] == "schedule" and second["policy"] == "constant" and first["falls"] == "0"
    speeds = [float(row["speed_m_s_mean"]) for row in (first, second)]
    assert f"| speed m/s | {speeds[0]:.3f} | {speeds[1]:.3f} |" in done.stdout


def test_elsewhere_every_condition_is_a_row_of_what_evaluate_would_find(monkeypatch):
    monkeypatch.setattr(comparison, "WORLD", ({}, {"slope_deg": 5.0}))
    how = {"springs": False, "pushes": (0.0,), "world": True, "episodes": 1, "seconds": 4.5}
    study = comparison.Compare(policies=("schedule",), environment=RecordedFlags(), **how)
    files = study.ask(lambda seconds: None).files
    lines = list(csv.DictReader(files["world.csv"].splitlines()))
    assert [line["conditions"] for line in lines] == ["", "slope_deg 5.0"]
    policy, settings = policy_and_settings("schedule", {"slope_deg": 5.0, "episode_seconds": 4.5})
    uphill = measure(record(policy, settings, name="", episodes=1)).metrics
    assert float(lines[1]["speed_m_s_mean"]) == pytest.approx(uphill["speed_m_s"]["mean"], rel=1e-5)
    assert lines[0] != lines[1]


def test_in_the_laboratory_a_load_costs_more_and_is_told_beside_the_usual_walk(monkeypatch):
    load = "load of 40 % on the back"
    assert LABORATORY[load] == {"carried_ratio": 0.4}
    monkeypatch.setattr(comparison, "LABORATORY", {name: LABORATORY[name] for name in ("usual", load)})
    how = {"springs": False, "pushes": (0.0,), "laboratory": True, "episodes": 1, "seconds": 5.0}
    answer = comparison.Compare(policies=("schedule",), environment=RecordedFlags(), **how).ask(lambda seconds: None)
    assert "earns more than" not in answer.text  # one row is ahead of none
    usual, loaded = csv.DictReader(answer.files["laboratory.csv"].splitlines())
    assert (usual["conditions"], loaded["conditions"]) == ("usual", load)
    before, after = (float(row["effort_fibre_J_kg_m"]) for row in (usual, loaded))
    assert 1.1 * before < after < 3.0 * before  # for each kg of body
    assert f"| {after:.2f} ({after / before - 1.0:+.0%}) |" in answer.text


def test_every_condition_of_the_laboratory_has_valid_settings_that_differ():
    settings = [settings_from(**given) for given in LABORATORY.values()]
    assert len({str(settings_to_json(one)) for one in settings}) == len(LABORATORY) == 12


def test_a_policy_that_moves_the_legs_walks_without_copy_and_springs(capsys):
    (alone,) = comparison.with_copy("learned", {"episode_seconds": 1.0})
    assert alone.name == "learned" and alone.settings.acts == "both"
    with pytest.raises(SpringfootError, match="learned has no open-loop copy: it moves the legs too"):
        policy_and_settings("frozen:learned", {})
    assert study_main(["compare", "learned", "--quick"]) == 2
    assert capsys.readouterr().err == (
        "springfoot study compare: error: learned moves the legs too, which springs cannot: give --no-springs\n"
    )
