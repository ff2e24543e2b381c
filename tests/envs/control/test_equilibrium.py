"""Rest angles: the springs of a body that is on its course give the moments that are fed forward, and no others."""

from dataclasses import replace

import numpy as np
import pytest

from springfoot.envs.control.constants import leg_constants
from springfoot.envs.control.equilibrium import foot_feed, planned, plateau_curve
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.physics.model import ANKLE, TOE, damping_times
from springfoot.envs.settings.settings import BipedSettings

NO_KNOTS = tuple(np.zeros(10))


def off_rest(constants, walk, joint, name):
    """theta_eq - theta - beta dtheta/dt over the stride, of a body on its course [rad]."""
    period = constants.period_factor * walk.plan.stride_time
    rate = walk.target.rate(name, GRID) / period
    return (
        planned(constants, walk)[:, joint - ANKLE]
        - walk.target.mean(name, GRID)
        - damping_times(walk.body)[joint] * rate
    )


@pytest.mark.parametrize("share", [0.0, 0.6, 1.0])
def test_a_body_on_its_course_with_k_ref_gets_the_share_of_the_moment_that_is_fed(share):
    settings = BipedSettings()
    walk = reference_walk_at(settings, 1.2)
    tuned = leg_constants("planned", "people", 1.2)
    constants = replace(tuned, ankle_knots_deg=NO_KNOTS, feedforward=(1.0, 1.0, share))
    people = walk.target.foot.ankle_quasi_stiffness
    assert people is not None
    K = plateau_curve(people, walk.target.foot.plateaus) * walk.body.stiffness_scale
    rate = walk.target.rate("ankle", GRID) / (constants.period_factor * walk.plan.stride_time)
    undamped = (1 - share) * damping_times(walk.body)[ANKLE] * rate
    torque = K * (off_rest(constants, walk, ANKLE, "ankle") + undamped)
    assert torque == pytest.approx(-share * walk.moments[:, ANKLE], abs=1e-9)
    assert np.ptp(walk.moments[:, ANKLE]) > 50.0  # plantarflexion positive: the spring pushes the toes down
    knots = replace(constants, ankle_knots_deg=tuple(np.full(10, 3.0)))
    assert planned(knots, walk)[:, 0] - planned(constants, walk)[:, 0] == pytest.approx(np.radians(3.0))


def test_a_body_on_its_plans_course_gets_no_torque_from_its_springs_whatever_their_k():
    settings = BipedSettings(guide="plan")
    walk = reference_walk_at(settings, 1.2)
    constants = replace(walk.constants[0], ankle_knots_deg=NO_KNOTS, toe_flat_deg=0.0)
    for joint, name in ((ANKLE, "ankle"), (TOE, "toe")):
        assert off_rest(constants, walk, joint, name) == pytest.approx(0.0, abs=1e-12)
    fed = foot_feed(settings, constants, walk)
    assert fed is not None
    assert fed[:, 0] == pytest.approx(-constants.feedforward[ANKLE] * walk.moments[:, ANKLE])
