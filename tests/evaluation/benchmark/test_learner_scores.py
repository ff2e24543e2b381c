"""Scores of learners: 0 for random stiffness, 1 for the best constant springs, interquartile means over the seeds."""

from types import SimpleNamespace

import numpy as np
import pytest

from springfoot.evaluation.benchmark.learner_scores import interval, interval_text, learner_scores, profile
from springfoot.tasks import STIFFNESS_TASKS, VERSION

WALK, PUSHED = f"Walk-{VERSION}", f"Pushed-{VERSION}"


def row(entry, task, policy, return_mean):
    """Return a judged row as far as scores read it."""
    return SimpleNamespace(entry=entry, submission=SimpleNamespace(task=task, policy=policy), return_mean=return_mean)


ENDS = [
    row("random", WALK, "random", 100.0),
    row("soft", WALK, "constant:50,10", 200.0),
    row("best", WALK, "constant:300,40", 300.0),
]


def test_a_score_is_linear_between_random_and_the_best_constant_springs():
    learners = [row("ours", WALK, "policy", value) for value in (100.0, 300.0, 500.0)]
    scores = learner_scores([*ENDS, *learners])
    assert scores.keys() == {"ours"}
    np.testing.assert_allclose(scores["ours"][WALK], [0.0, 1.0, 2.0], atol=1e-12)


def test_one_training_has_no_spread_and_a_task_without_baselines_no_score():
    rows = [*ENDS, row("once", WALK, "policy", 400.0), *(row("ours", PUSHED, "policy", each) for each in (1.0, 2.0))]
    assert learner_scores(rows) == {}


def test_the_outer_quarters_do_not_count():
    middle, low, high = interval([np.array([-1000.0, 1.0, 2.0, 3.0, 1000.0])])
    assert middle == 2.0
    assert low < middle < high


def test_trainings_are_drawn_anew_within_their_task():
    # Were they drawn over all tasks together, a resample could miss one of the tasks, and the mean would spread.
    assert interval([np.zeros(2), np.ones(2)]) == (0.5, 0.5, 0.5)


@pytest.mark.parametrize(("trainings", "text"), [([2.5], "2.5"), ([2.0, 2.0], "2.0 (2.0 to 2.0)")])
def test_a_single_training_is_told_without_an_interval(trainings, text):
    assert interval_text([np.array(trainings)], ".1f") == text


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
