"""The target's curves against closed forms."""

import numpy as np
import pytest

from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.settings.settings import BipedSettings
from springfoot.envs.task.target import target_curves


def test_the_zmp_is_that_of_the_middle_of_the_step_of_time_as_seen_from_the_cart():
    """In the world the ZMP goes on by a step's length each step, and the origin of the target by the mean speed."""
    walk = reference_walk_at(BipedSettings(), 1.2)
    seconds = 0.02
    middle = 2 * GRID - 0.5 * seconds / walk.plan.step_time
    in_world = walk.plan.zmp(middle) + walk.plan.step_length * np.floor(middle)
    origin = walk.plan.step_length * 2 * GRID
    assert target_curves(walk.target, walk.plan, seconds)["zmp"] == pytest.approx(in_world - origin, abs=1e-12)
    assert middle[0] < 0.0  # of the step before
