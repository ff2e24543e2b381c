"""Falls at their limits, and divergence."""

import numpy as np
import pytest
from planned_body import Setup

from springfoot.envs.task.episode_end import TOO_LOW, TOO_TILTED, falls_of


@pytest.mark.parametrize("height", [1.7, 1.2])
def test_a_fall_is_a_low_hip_or_a_tilted_trunk(height):
    setup = Setup(height=height, mass=50, speed=1.0)
    limit = 0.65 * height / 1.7
    measured = setup.measurement(np.full(6, 0.2))
    measured.base[:, 1] = [limit * 1.001, limit * 0.999, 1.0, 1.0, np.nan, 1.0]
    measured.base[:, 2] = [0.0, 0.0, 0.799, -0.801, 0.0, np.nan]
    expected = [0, TOO_LOW, 0, TOO_TILTED, TOO_LOW, TOO_TILTED]
    min_hip_height = setup.task(6).rows["scales"]["min_hip_height"]
    assert list(falls_of(measured, min_hip_height)) == expected
    alive = setup.terms(measured, np.full(6, 0.2))["alive"]
    np.testing.assert_array_equal(alive, [code == 0 for code in expected])


def test_a_diverged_simulation_is_not_alive():
    setup = Setup()
    measured = setup.measurement([0.2, 0.2], diverged=np.array([-1, 2]))
    np.testing.assert_array_equal(setup.terms(measured, [0.2, 0.2])["alive"], [1.0, 0.0])
