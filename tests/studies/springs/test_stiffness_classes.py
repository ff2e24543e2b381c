"""Classes of stiffness: each has the stiffness of the class before it to the bit, within the settings' bounds."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from springfoot.envs.batch import Biped
from springfoot.envs.control import stiffness_of, stiffness_ranges
from springfoot.envs.settings import BipedSettings, body_of
from springfoot.envs.task import PERSON_OBSERVATION
from springfoot.evaluation.recording import policy_and_settings, record_feet
from springfoot.gait.springs.stiffness import StiffnessSchedule, thesis_schedule
from springfoot.studies.springs.stiffness_classes import (
    CENTRE,
    ERRORS,
    LONGEST_PART,
    classes_of_foot,
    nested_classes,
    widened,
)

SETTINGS = BipedSettings()
CLASSES = nested_classes(SETTINGS)
OF_FOOT = classes_of_foot(SETTINGS)
NAMES = [entry.name for entry in PERSON_OBSERVATION]


def observations(count, seed=0):
    """Return observations (count, D) all over the stride, with errors of any sign."""
    generator = np.random.default_rng(seed)
    seen = generator.normal(0.0, 0.1, (count, Biped(SETTINGS, 1).observe().shape[1])).astype(np.float32)
    phase = np.arange(count) / count
    seen[:, NAMES.index("phase_sin")] = np.sin(2 * np.pi * phase)
    seen[:, NAMES.index("phase_cos")] = np.cos(2 * np.pi * phase)
    return seen


@pytest.mark.parametrize(("inner", "outer"), list(pairwise(CLASSES)), ids=lambda one: one.name)
def test_an_outer_class_with_the_inner_ones_vector_acts_the_same_to_the_bit(inner, outer):
    seen = observations(500)
    vector = np.random.default_rng(1).normal(0.0, 0.4, inner.size)
    within = widened(vector, inner, outer)
    assert outer.size > inner.size == len(vector) and len(within) == outer.size
    of_inner, of_outer = (
        one.policy(np.tile(numbers, (len(seen), 1)), SETTINGS)(seen)
        for one, numbers in ((inner, vector), (outer, within))
    )
    assert of_inner.tobytes() == of_outer.tobytes()
    # The outer class has more: moving its last entry changes some action.
    within[-1] += 0.5
    assert (outer.policy(np.tile(within, (len(seen), 1)), SETTINGS)(seen) != of_inner).any()


def test_a_constant_is_one_stiffness_at_every_phase_and_error():
    actions = CLASSES[0].policy(np.tile([0.1, -0.2], (50, 1)), SETTINGS)(observations(50)).reshape(50, 2, 2)
    stiffness = stiffness_of(actions.astype(float), SETTINGS, body_of(SETTINGS))
    expected = np.array(CENTRE) * np.exp([0.1, -0.2])
    np.testing.assert_allclose(stiffness, np.broadcast_to(expected, stiffness.shape), rtol=1e-5)


def test_the_phases_are_the_thesiss_lines_and_no_part_of_open_loop_is_longer_than_asked():
    lines = thesis_schedule(body_of(SETTINGS), SETTINGS.speed)
    assert CLASSES[1].ankle == tuple(segment.start for segment in lines.ankle)
    assert CLASSES[1].toe[-1] == CLASSES[1].ankle[-1]  # toe-off
    for starts in (CLASSES[2].ankle, CLASSES[2].toe):
        assert starts[0] == 0.0
        assert min(np.diff([*starts, 1.0])) > 0 and max(np.diff([*starts, 1.0])) <= LONGEST_PART + 1e-9


def test_each_leg_has_the_stiffness_of_its_own_phase():
    open_loop = CLASSES[2]
    vector = np.linspace(-0.5, 0.5, open_loop.size)
    seen = observations(200)
    actions = open_loop.policy(np.tile(vector, (200, 1)), SETTINGS)(seen).reshape(200, 2, 2)
    np.testing.assert_array_equal(actions[:, 1], np.roll(actions[:, 0], 100, axis=0))  # half a stride later


def test_a_gain_acts_on_its_error_in_its_phase_on_the_ankle_alone():
    reflex = CLASSES[3]
    size = ERRORS["com_x_error"]
    ankle, toe, gains = np.split(np.zeros(reflex.size), np.cumsum([len(reflex.ankle), len(reflex.toe)]))
    gains = gains.reshape(len(ERRORS), -1)
    gains[list(ERRORS).index("com_x_error"), 1] = 0.4  # from foot flat to maximum dorsiflexion
    vector = np.concatenate([ankle, toe, gains.ravel()])
    seen = np.zeros((2, observations(1).shape[1]), np.float32)
    phase = 2 * np.pi * 0.2  # left in that part, right in swing
    seen[:, NAMES.index("phase_sin")], seen[:, NAMES.index("phase_cos")] = np.sin(phase), np.cos(phase)
    seen[1, NAMES.index("com_x_error")] = size
    actions = reflex.policy(np.tile(vector, (2, 1)), SETTINGS)(seen).reshape(2, 2, 2).astype(float)
    without, with_error = stiffness_of(actions, SETTINGS, body_of(SETTINGS))
    np.testing.assert_allclose(with_error / without, [[np.exp(0.4), 1.0], [1.0, 1.0]], rtol=1e-5)


def test_a_late_reflex_acts_as_the_reflex_did_on_the_errors_of_some_steps_before():
    reflex = CLASSES[3]
    vectors = np.random.default_rng(0).normal(0, 0.2, (1, reflex.size))
    late = replace(reflex, late=2).policy(vectors, SETTINGS)
    seen = np.repeat(observations(1), 6, axis=0)
    columns = [NAMES.index(name) for name in ERRORS]
    seen[:, columns] = 0.05 * np.random.default_rng(1).normal(size=(6, len(columns)))
    acted = [late(row[None]) for row in seen]
    at_once = reflex.policy(vectors, SETTINGS)
    for step, action in enumerate(acted):
        assert action.tobytes() == at_once(seen[max(step - 2, 0), None]).tobytes()  # the phase is the same throughout


def test_stiffness_stays_within_the_bounds_of_the_settings_and_the_tendon():
    low, high = stiffness_ranges(SETTINGS, body_of(SETTINGS))
    high = np.minimum(high, [400.0, np.inf])
    vectors = np.array([[9.0, 9.0], [-9.0, -9.0]])
    actions = CLASSES[0].policy(vectors, SETTINGS)(observations(2)).reshape(2, 2, 2)
    np.testing.assert_allclose(stiffness_of(actions[0], SETTINGS, body_of(SETTINGS)), [high, high], rtol=1e-6)
    np.testing.assert_allclose(stiffness_of(actions[1], SETTINGS, body_of(SETTINGS)), [low, low], rtol=1e-6)


def test_the_ankle_is_no_stiffer_than_its_tendon():
    constant, *_ = nested_classes(BipedSettings())
    assert constant.stiffness([9.0, 9.0], np.zeros(1)).tolist() == [[400.0, 200.0]]
    assert constant.stiffness([-9.0, -9.0], np.zeros(1)).tolist() == [[20.0, 5.0]]


def test_the_ankle_of_a_foot_has_no_tendon():
    constant, *_ = OF_FOOT
    assert constant.stiffness([9.0, 9.0], np.zeros(1)).tolist() == [[1500.0, 200.0]]
    assert constant.stiffness([-9.0, -9.0], np.zeros(1)).tolist() == [[150.0, 15.0]]


@pytest.mark.parametrize(("inner", "outer"), list(pairwise(OF_FOOT)), ids=lambda one: one.name)
def test_a_foot_of_an_outer_class_with_the_inner_ones_vector_has_the_same_springs(inner, outer):
    phase = np.arange(500) / 500
    vector = np.random.default_rng(1).normal(0.0, 0.4, inner.size)
    within = widened(vector, inner, outer)

    def springs(of_class, numbers):
        """Return K and rest angles over the stride of the foot that settings make of a vector."""
        foot = StiffnessSchedule.from_json(of_class.foot(numbers)["schedule"])
        stiffness, rest = foot.at(phase)
        assert stiffness.tolist() == of_class.stiffness(numbers, phase).tolist() and not rest.any()
        return stiffness

    assert springs(inner, vector).tobytes() == springs(outer, within).tobytes()
    within[-1] += 0.5
    assert (springs(outer, within) != springs(inner, vector)).any()


@pytest.mark.parametrize("walker", ["schedule", "learned"])  # a person senses the stiffness
@pytest.mark.parametrize("time", [None, 0.005])
def test_a_foot_of_constant_stiffness_is_a_passive_foot_to_the_bit(walker, time):
    constant, *_ = OF_FOOT
    ankle, toe = constant.stiffness([0.3, 0.4], np.zeros(1))[0]
    passive = {"kind": "passive", "ankle_stiffness": ankle, "toe_stiffness": toe, "ankle_deg": 0.0, "toe_deg": 0.0}
    passive |= {} if time is None else {"damping_time": time}
    acting, settings = policy_and_settings(walker, {"episode_seconds": 1.0})
    feet = [{"right_foot": foot} for foot in (constant.foot([0.3, 0.4], time), passive, "passive")]
    varied, fixed, other = record_feet(acting, settings, feet, name=walker, episodes=1)
    assert varied.series["angle"].tobytes() == fixed.series["angle"].tobytes() != other.series["angle"].tobytes()


def test_the_stiffness_of_a_foot_that_changes_in_the_air_is_one_from_heel_strike_to_toe_off():
    _, in_the_air, per_phase, _ = OF_FOOT
    stance = np.linspace(0.0, per_phase.ankle[-1] - 1e-9, 50)
    found = in_the_air.stiffness([0.1, 0.5, -0.2, 0.3], np.append(stance, 0.9))
    assert (found[:50] == found[0]).all() and (found[50] != found[0]).all()
