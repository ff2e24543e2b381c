"""The price of muscles: closed forms of work, activation, tendon and tissue."""

import numpy as np
import pytest

from springfoot.gait import Body
from springfoot.gait.body.body import GRAVITY
from springfoot.gait.body.leg_dynamics import JOINTS
from springfoot.gait.body.tissue import (
    RELAXED_STIFFNESS,
    ankle_tissue_stiffness,
    charged_calf_stiffness,
    passive_moments,
)
from springfoot.gait.plan.effort import (
    ACTIVATION_TIME,
    MUSCLE_EFFICIENCY,
    PRICES,
    STRENGTH,
    TENDON_GIVE,
    VOLUME,
    Muscle,
    effort_of_stride,
    interval_work,
    muscle_use,
    strengths,
)

BODY = Body()
BARE = Muscle(tissue=0.0, tendon=0.0, toe_tendon=0.0)
ANKLE, TOE = JOINTS.index("ankle"), JOINTS.index("toe")


def test_a_moment_at_rest_costs_its_squared_activation_and_rate():
    phase, time = np.arange(1000) / 1000, 1.1
    angle, moment = np.zeros((1000, 4)), np.zeros((1000, 4))
    share = 0.3 + 0.2 * np.sin(2 * np.pi * phase)
    moment[:, JOINTS.index("knee")] = share * STRENGTH["knee"][0] * BODY.mass * GRAVITY * BODY.height
    found = effort_of_stride(BODY, angle, angle, moment, time, 1.3, BARE)
    weight = VOLUME["knee"][0] / np.mean(list(VOLUME.values()))
    assert found.work == found.acceleration == found.beyond_range == 0.0
    assert found.activation == pytest.approx(2 * weight * (0.3**2 + 0.2**2 / 2), rel=1e-9)
    assert found.rate == pytest.approx(2 * weight * (ACTIVATION_TIME * 0.2 * 2 * np.pi / time) ** 2 / 2, rel=1e-4)


def test_work_costs_its_metabolic_energy_over_weight_and_distance():
    # A constant moment against a swinging hip: as much positive as negative work, moment x twice the swing each.
    phase, time, distance, moment = np.arange(2000) / 2000, 1.1, 1.3, 20.0
    angle, torque = np.zeros((2000, 4)), np.zeros((2000, 4))
    angle[:, 0] = 0.4 * np.sin(2 * np.pi * phase)
    torque[:, 0] = moment
    rate = np.zeros((2000, 4))
    rate[:, 0] = 0.4 * 2 * np.pi / time * np.cos(2 * np.pi * phase)
    found = effort_of_stride(BODY, angle, rate, torque, time, distance, BARE)
    spent = moment * 0.8 * (1 / MUSCLE_EFFICIENCY[0] + 1 / MUSCLE_EFFICIENCY[1])
    assert found.work == pytest.approx(2 * spent / (BODY.mass * GRAVITY * distance), rel=1e-4)
    expected = (0.4 * (ACTIVATION_TIME * 2 * np.pi / time) ** 2) ** 2  # both legs, half of the peak's square each
    assert found.acceleration == pytest.approx(expected, rel=1e-4)
    assert found.total == pytest.approx(np.dot(PRICES, found.terms))


@pytest.mark.parametrize("joint", [ANKLE, TOE])
def test_a_tendon_in_series_stores_and_returns(joint):
    # The joint stands still: fibres stretch the tendon by F / k and are pulled back by it.
    samples, time, peak = 20_000, 1.0, 50.0
    phase = (np.arange(samples) + 0.5) / samples
    pull = np.zeros((samples, 1, 4))
    pull[:, 0, joint] = peak * np.sin(np.pi * phase) ** 2
    use = muscle_use(pull, np.zeros((*pull.shape, 2)), time / samples, strengths(BODY)[None], 1.0)
    stored = 0.5 * peak**2 * TENDON_GIVE[joint]
    assert use.work[0, joint] == pytest.approx([stored, -stored], rel=1e-6)
    assert not np.delete(use.work[0], joint, 0).any()


def test_fibres_of_a_joint_that_moves_as_its_tendon_gives_do_no_work():
    samples, k = 20_000, 1.0 / TENDON_GIVE[ANKLE]
    phase = (np.arange(samples) + 0.5) / samples
    pull = 80.0 * np.sin(np.pi * phase) ** 2  # on an ankle that gives by F / k: dorsiflexion as the force rises
    rate = np.gradient(pull, phase, edge_order=2) / k
    half = (-pull * rate / samples)[1:-1] / 2
    work = interval_work(pull[:-2], pull[1:-1], pull[2:], half, half, TENDON_GIVE[ANKLE])
    assert np.abs(np.sum(work, 0)).sum() < 1e-6 * (pull * np.abs(rate)).mean()


@pytest.mark.parametrize("joint", range(4))
def test_tissue_does_no_net_work_over_a_loop_of_one_joint(joint):
    phase = np.arange(4000) / 4000
    angle = np.tile([0.3, 0.4, 0.05, 0.2], (4000, 1))
    angle[:, joint] += 0.3 * np.sin(2 * np.pi * phase) + 0.05 * np.cos(6 * np.pi * phase)
    moment = passive_moments(BODY, angle)[:, joint]
    turn = (np.roll(angle, -1, 0) - np.roll(angle, 1, 0))[:, joint] / 2
    assert abs((moment * turn).sum()) < 1e-6 * np.abs(moment * turn).sum() + 1e-9
    assert np.abs(moment).max() > 1.0


def test_prices_of_one_joint_cannot_pay_for_another():
    # Shortening 1 J at the hip and stretching 1 J at the knee costs both.
    moment = np.zeros((3, 1, 4))
    delivered = np.zeros((3, 1, 4, 2))
    delivered[1, 0, :2, 0] = 1.0, -1.0
    use = muscle_use(moment, delivered, 0.01, strengths(BODY)[None], 1.0)
    assert use.energy[0].tolist() == pytest.approx([1 / MUSCLE_EFFICIENCY[0], 1 / MUSCLE_EFFICIENCY[1], 0.0, 0.0])


def test_the_tissues_stiffness_is_the_slope_of_its_moment():
    angle = np.tile([0.3, 0.4, 0.0, 0.2], (400, 1))
    angle[:, ANKLE] = np.linspace(-0.4, 0.3, 400)
    slope = np.gradient(passive_moments(BODY, angle)[:, ANKLE], angle[:, ANKLE], edge_order=2)
    np.testing.assert_allclose(ankle_tissue_stiffness(0.4, angle[:, ANKLE]), slope, rtol=1e-3)


def test_a_muscle_in_series_with_its_tendon_has_the_stiffness_of_both():
    together = np.array([100.0, 200.0, 360.0])
    own = charged_calf_stiffness(together + 50.0, 50.0, 0.0, 400.0, 1.0) + RELAXED_STIFFNESS
    np.testing.assert_allclose(1.0 / (1.0 / own + 1.0 / 400.0), together, rtol=1e-12)
    assert own[2] == pytest.approx(9 * 400.0)
