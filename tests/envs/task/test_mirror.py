"""The mirror: left and right change places in observation and action, and a mirrored world walks alike."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.model import ACTIONS
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.mirror import OPPOSITE, mirror_of
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.errors import SpringfootError

NAMES = [entry.name for entry in OBSERVATION]


def test_the_image_of_an_observation_is_that_of_the_mirrored_world():
    biped = Biped(BipedSettings(), 2)
    mirror, random = mirror_of(biped.observation_names, biped.action_names), np.random.default_rng(0)
    biped.reset(np.array([0]), [0], start=0.2)
    biped.reset(np.array([1]), [0], start=0.7)
    largest = np.zeros(len(NAMES))
    for _ in range(50):
        action = random.uniform(-1, 1, len(ACTIONS))
        result = biped.step(np.stack([action, action[mirror.action_index]]))
        one, other = result.observation
        np.testing.assert_allclose(other, mirror.of(one), atol=2e-5)
        largest = np.maximum(largest, np.abs(one - mirror.of(one)))
    sided = [k for k, name in enumerate(NAMES) if mirror.index[k] != k or name in OPPOSITE]
    assert (largest[sided] > 0.01).all()  # the walk was no image of itself


def test_each_side_changes_places_and_nothing_else():
    names = ("slope", "strength_left", "phase_sin", "last_rest_hip_right", "phase_sin_2", "strength_right")
    names = (*names, "last_rest_hip_left", "leading_leg")
    actions = ("ankle_left", "ankle_right", "rest_hip_right", "rest_hip_left")
    mirror = mirror_of(names, actions)
    images = [names[index] for index in mirror.index]
    assert images == [
        *("slope", "strength_right", "phase_sin", "last_rest_hip_left", "phase_sin_2", "strength_left"),
        *("last_rest_hip_right", "leading_leg"),
    ]
    assert mirror.sign.tolist() == [1, 1, -1, 1, 1, 1, 1, -1]
    assert [actions[index] for index in mirror.action_index] == [
        *("ankle_right", "ankle_left", "rest_hip_left", "rest_hip_right")
    ]


@given(st.permutations([f"{joint}_{side}" for joint in ("hip", "knee", "toe") for side in ("left", "right")]))
def test_actions_of_both_legs_come_in_their_order_whatever_it_is(actions):
    mirror = mirror_of(NAMES, actions)
    left = [name for name in actions if name.endswith("_left")]
    right = [name.replace("_left", "_right") for name in left]
    assert mirror.both_legs(np.array(left), np.array(right)).tolist() == list(actions)
    action = np.arange(6.0)
    assert action[mirror.action_index][mirror.action_index].tolist() == action.tolist()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_image_of_an_image_is_the_observation_to_the_bit(dtype):
    mirror = mirror_of(NAMES, ACTIONS)
    rows = np.random.default_rng(0).normal(size=(3, 5, len(NAMES))).astype(dtype)
    rows[0] = -0.0
    assert mirror.of(rows).dtype == dtype
    assert mirror.of(mirror.of(rows)).tobytes() == rows.tobytes()


@pytest.mark.parametrize(
    ("names", "actions", "said"),
    [
        (["hip_left"], ["toe_left", "toe_right"], "hip_left has no mirror image: there is no hip_right"),
        ([], ["toe_right"], "toe_right has no mirror image: there is no toe_left"),
        ([], ["device"], "action device is of neither leg: its name must end in _left or _right"),
    ],
)
def test_names_without_an_image_are_refused(names, actions, said):
    with pytest.raises(SpringfootError) as refused:
        mirror_of(names, actions)
    assert str(refused.value) == said
