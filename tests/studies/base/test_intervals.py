"""Intervals over persons."""

import numpy as np
import pytest

from springfoot.studies.base.intervals import interval_of_persons, known_sign, mean_interval, of_persons


def test_an_interval_of_persons_is_of_their_means_and_of_one_person_of_its_episodes():
    of_each = [np.array([0.0, 2.0]), np.array([3.0, 3.0, 3.0]), np.empty(0)]
    assert of_persons(of_each).tolist() == [1.0, 3.0]
    reach = 12.706205  # Student's t of one degree of freedom at 97.5 %, times the error of the mean, 1
    assert interval_of_persons(of_each) == pytest.approx((2.0 - reach, 2.0 + reach), rel=1e-6)
    one = np.random.default_rng(0).standard_normal(12)
    assert of_persons([one, np.empty(0)]).tolist() == one.tolist()
    assert interval_of_persons([one, np.empty(0)]) == mean_interval(one) == interval_of_persons([one])


def test_a_sign_is_known_outside_the_interval_or_by_five_persons_who_agree():
    def persons(*means):
        return [np.array([mean, mean]) for mean in means]

    assert known_sign(persons(1.0, 1.1, 1.2)) == 1 and known_sign(persons(-1.0, -1.1)) == -1
    assert interval_of_persons(persons(0.1, 0.2, 0.1, 0.2, 5.0))[0] < 0.0
    assert known_sign(persons(0.1, 0.2, 0.1, 0.2, 5.0)) == 1  # all five have it
    assert known_sign(persons(0.1, 0.2, 0.1, 5.0)) == known_sign(persons(-0.1, 0.2, 0.1, 0.2, 5.0)) == 0
    assert known_sign([*persons(0.1, 0.2, 0.1, 0.2, 5.0), np.empty(0)]) == 0  # the sixth has no number
    assert known_sign([np.array([3.0])]) == 0  # a single episode
