"""Scores of learners: 0 for random stiffness, 1 for the best constant springs, interquartile means over the seeds."""

from pathlib import Path

import numpy as np
import pytest

from springfoot.evaluation.benchmark.judged import JudgedRow
from springfoot.evaluation.benchmark.learner_scores import SCHEDULE, interval, interval_text, learner_scores, profile
from springfoot.evaluation.benchmark.submission import Submission
from springfoot.evaluation.benchmark.task_walks import EPISODES, TaskWalks
from springfoot.tasks import STIFFNESS_TASKS, VERSION

WALK, PUSHED = f"Walk-{VERSION}", f"Pushed-{VERSION}"


def row(name, task, policy, return_mean, drawn=0.0):
    """Return a judged submission, with the numbers that scores read."""
    walks = TaskWalks(returns=np.full(EPISODES, return_mean), fell=np.zeros(EPISODES, bool))
    submission = Submission(folder=Path(), name=name, task=task, policy=policy, digest="", walks=walks)
    return JudgedRow(submission=submission, return_mean=return_mean, falls=0, drawn_return_mean=drawn, drawn_falls=0)


def trainings(name, task, *returns):
    """Return the judged submissions of a learner, one for each seed."""
    return [row(f"{name}, seed {seed}", task, "policy", value) for seed, value in enumerate(returns)]


ENDS = [
    row("random", WALK, "random", 100.0),
    row("soft", WALK, "constant:50,10", 200.0),
    row("best", WALK, "constant:300,40", 300.0),
]


def test_a_score_is_linear_between_random_and_the_best_constant_springs():
    scores = learner_scores([*ENDS, *trainings("ours", WALK, 100.0, 300.0, 500.0)])
    assert scores.keys() == {"ours"}
    np.testing.assert_allclose(scores["ours"][WALK], [0.0, 1.0, 2.0], atol=1e-12)


def test_drawn_returns_have_scores_of_their_own_and_none_where_both_baselines_return_the_same():
    ends = [row("random", WALK, "random", 1.0, 10.0), row("springs", WALK, "constant:50,10", 2.0, 20.0)]
    ours = [row(f"ours, seed {seed}", WALK, "policy", 1.5, drawn) for seed, drawn in enumerate((10.0, 40.0))]
    np.testing.assert_allclose(learner_scores([*ends, *ours], "drawn_return_mean")["ours"][WALK], [0.0, 3.0])
    assert learner_scores([*ENDS, *trainings("ours", WALK, 100.0, 300.0)], "drawn_return_mean") == {}


def test_the_best_constant_springs_are_those_of_the_highest_public_return():
    ends = [row("random", WALK, "random", 1.0, 10.0), row("best", WALK, "constant:50,10", 3.0, 20.0)]
    lucky = row("lucky when drawn", WALK, "constant:60,10", 2.0, 30.0)
    ours = [row(f"ours, seed {seed}", WALK, "policy", 3.0, 20.0) for seed in range(2)]
    for order in ([*ends, lucky], [lucky, *ends]):
        np.testing.assert_allclose(learner_scores([*order, *ours], "drawn_return_mean")["ours"][WALK], [1.0, 1.0])


def test_one_training_has_no_spread_and_a_task_without_baselines_no_score():
    assert learner_scores([*ENDS, *trainings("once", WALK, 400.0), *trainings("ours", PUSHED, 1.0, 2.0)]) == {}


def test_the_schedule_has_a_score_whatever_it_is_called():
    scores = learner_scores([*ENDS, row("the thesis's", WALK, "schedule", 250.0)])
    assert {name: by_task[WALK].tolist() for name, by_task in scores.items()} == {SCHEDULE: [0.75]}


def test_another_baseline_has_none_as_it_does_not_learn():
    springs = [row(f"constant, seed {seed}", WALK, f"constant:{seed},40", 250.0 + seed) for seed in range(5)]
    assert learner_scores([*ENDS, *springs]) == {}


def test_the_outer_quarters_do_not_count():
    middle, low, high = interval([np.array([-1000.0, 1.0, 2.0, 3.0, 1000.0])])
    assert middle == 2.0
    assert low < middle < high


def test_trainings_are_drawn_anew_within_their_task():
    # Were they drawn over all tasks together, a resample could miss one of the tasks, and the mean would spread.
    assert interval([np.zeros(2), np.ones(2)]) == (0.5, 0.5, 0.5)


@pytest.mark.parametrize(("values", "text"), [([2.5], "2.5"), ([2.0, 2.0], "2.0 (2.0 to 2.0)")])
def test_a_single_training_is_told_without_an_interval(values, text):
    assert interval_text([np.array(values)], ".1f") == text
    assert interval_text([np.array(values)] * 2, ".1f") == text


def test_a_profile_is_the_fraction_of_trainings_above_with_each_task_alike():
    samples = [np.array([0.0, 2.0]), np.array([2.0, 2.0, 2.0, 2.0])]
    np.testing.assert_array_equal(profile(samples, np.array([-1.0, 1.0, 2.0])), [1.0, 0.75, 0.0])


def test_an_interval_covers_the_truth_as_often_as_a_bootstrap_of_five_does():
    # 35 draws of a normal distribution, 7 tasks of 5 seeds: 95 % is asked of many, some 90 of so few.
    generator = np.random.default_rng(1)
    tasks = len(STIFFNESS_TASKS)
    covered = 0
    for _ in range(100):
        _, low, high = interval(list(generator.normal(1.0, 0.1, (tasks, 5))))
        covered += low <= 1.0 <= high
    assert 80 <= covered <= 100
