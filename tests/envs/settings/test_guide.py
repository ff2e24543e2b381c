"""The guide "plan": a body follows its own plan, and knows nothing of people but step length and time."""

import json

import numpy as np
import pytest

from benchmarks.scrambled import scrambled
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control import generic_constants
from springfoot.envs.settings.settings import settings_from
from springfoot.gait import SpringfootError

PLAN = {"guide": "plan"}


@pytest.fixture
def noise_file(tmp_path):
    path = tmp_path / "noise.json"
    path.write_text(json.dumps(scrambled()), encoding="utf-8")
    return str(path)


def digest(num=3, steps=100, **settings):
    biped = Biped(settings_from(**PLAN, **settings), num)
    biped.reset(np.arange(num), list(range(num)))
    random = np.random.default_rng(0)
    seen = [biped.step(random.uniform(-0.3, 0.3, (num, len(biped.action_names)))) for _ in range(steps)]
    return [
        np.stack([getattr(step, name) for step in seen]).tobytes() for name in ("observation", "reward", "terminated")
    ]


@pytest.mark.parametrize("more", [{}, {"acts": "both"}, {"decisions": "event"}, {"start": "standing"}], ids=str)
def test_people_scrambled_walk_the_same_bits(noise_file, more):
    assert digest(**more) == digest(**more, people_file=noise_file)


def test_the_plans_moment_stands_beside_the_springs_whatever_their_stiffness():
    def control(action):
        biped = Biped(settings_from(**PLAN, start=0.3), 1)
        biped.reset(np.array([0]), [0])
        ticks = []
        biped.on_tick = ticks.append
        biped.step(np.full((1, 4), action))
        return ticks[0].stiffness[0, :, 2:], ticks[0].equilibrium[0, :, 2:]

    (soft, soft_rest), (stiff, stiff_rest) = control(-0.5), control(0.5)
    assert np.all(stiff > 2 * soft)
    # K theta_eq = K theta_plan + M: two stiffnesses at the same phase tell both.
    moment = (soft_rest - stiff_rest) / (1 / soft - 1 / stiff)
    biped = Biped(settings_from(**PLAN), 1)
    (walk,) = biped.walks
    unit = walk.body.total_mass * walk.body.length_scale * walk.constants[0].feedforward[2]
    for side, phase in enumerate((0.3, 0.8)):
        for joint, name in enumerate(("ankle", "toe")):
            fed = -unit * walk.target.mean(f"{name}_moment", phase)
            assert moment[side, joint] == pytest.approx(fed, abs=0.05 * np.abs(moment).max()), (side, name)


def test_its_own_person_walks_with_the_fixed_schedule():
    settings = settings_from(**PLAN, action_mode="residual")
    biped = Biped(settings, 4)
    biped.reset(np.arange(4), [10, 11, 12, 13])
    fallen = np.zeros(4, bool)
    for _ in range(300):
        fallen |= biped.step(np.zeros((4, 4))).terminated
    assert not fallen.any()
    assert biped.measurement.com[:, 0] / 6.0 == pytest.approx(1.2, abs=0.15)


def test_legs_begin_at_constants_that_nobody_tuned():
    for acts in ("stiffness", "person", "both"):
        assert Biped(settings_from(**PLAN, acts=acts), 1).constants == (generic_constants(),)


def test_settings_that_need_people_are_refused():
    own = {"name": "x.csv", "strides": 1, "speed": None, "stride_time": 1.2, "step_length": None, "toe_off": 0.63}
    own |= {"mean": {}, "sd": {}}
    with pytest.raises(SpringfootError, match="human must be None with guide 'plan': the plan replaces human data"):
        settings_from(**PLAN, human=own)
    with pytest.raises(SpringfootError, match="guide must be"):
        settings_from(guide="nobody")
