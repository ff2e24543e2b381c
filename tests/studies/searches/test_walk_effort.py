"""What a simulated walk pays for its effort: closed forms, and that it tells walks apart."""

from dataclasses import replace

import numpy as np
import pytest

from springfoot.envs.control.constants import leg_constants
from springfoot.envs.settings.settings import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers.planned_task import effort_and_impact, impact_of
from springfoot.gait import Body
from springfoot.gait.body.body import GRAVITY
from springfoot.gait.plan.effort import ACTIVATION_TIME, MUSCLE_EFFICIENCY
from springfoot.studies.searches.leg_cost import FALL_COST, cost, misses
from springfoot.studies.searches.leg_tuning import LegTuning
from springfoot.studies.searches.leg_walks import SETTLED, measured, walk
from springfoot.studies.searches.walk_effort import effort_price

BODY = Body()
SETTINGS = BipedSettings(guide="plan", episode_seconds=10.0)
LEGS = leg_constants("planned", "people", follows_plan=True)


def test_impact_is_the_mean_square_of_the_forces_rate():
    time = np.arange(0.0, 4.0, 0.001)
    force = np.stack([0.1 * np.cos(2 * np.pi * time), 1.0 + 0.2 * np.sin(2 * np.pi * time)], -1)
    expected = 2 * ACTIVATION_TIME**2 * (2 * np.pi) ** 2 * (0.1**2 + 0.2**2) / 2
    assert impact_of(force, 0.001) == pytest.approx(expected, rel=1e-3)


def test_a_walk_is_measured_as_it_was_simulated():
    walked = walk(SETTINGS, [LEGS], [0], 1, foreign=())
    biped = walked.biped
    series = walked.episode(0)
    tally = measured(series, biped)
    assert walked.missing[0] == 0.0 and tally is not None
    missed = misses(tally, biped)
    effort, impact, held = effort_and_impact(series, tally, biped, SETTLED)
    assert held["speed"] == pytest.approx(0.0, abs=0.05) and held["period"] == pytest.approx(0.0, abs=0.03)
    # Over strides that repeat themselves joints do little net work, and the energy is that of their work.
    own = series["joint_work"].sum((0, 1, 2))
    way = np.ptp(series["com"][:, 0])
    spent = own[0] / MUSCLE_EFFICIENCY[0] + abs(own[1]) / MUSCLE_EFFICIENCY[1]
    assert effort.work < 1.1 * spent / (BODY.mass * GRAVITY * way)  # tissue and tendon give some of it
    assert effort.work > 0.4 * spent / (BODY.mass * GRAVITY * way)
    assert effort_price(series, tally, biped, missed) > 10 * (effort.total + impact)
    assert measured(series, biped, 6.0) is None


def test_a_limp_is_unsteady_and_a_walk_off_its_plan_is_out_of_place():
    walked = walk(SETTINGS, [LEGS], [0], 1, foreign=())
    biped = walked.biped
    series = walked.episode(0)
    force = series["force"].copy()
    com = series["com"].copy()
    force[:, 0, :, 1] *= 0.8  # the left foot carries less than the right, in every stride
    com[:, 0] += 0.3

    def found(change):
        changed = series | change
        tally = measured(changed, biped)
        assert tally is not None
        return effort_and_impact(changed, tally, biped, SETTLED)

    level, limping, ahead, early = map(found, ({}, {"force": force}, {"com": com}, {"phase": 0.9 * series["phase"]}))
    assert limping[2]["unsteady"] > level[2]["unsteady"] + 0.03
    assert ahead[2]["place"] == pytest.approx(0.3, abs=1.5 * level[2]["place"])
    assert ahead[2]["speed"] == pytest.approx(level[2]["speed"], abs=1e-9)
    way = 2 * biped.plan.step_length
    assert 0.0 <= level[2]["skipped"] < 0.1 * way
    assert 1.0 - early[2]["skipped"] / way == pytest.approx(0.9 * (1.0 - level[2]["skipped"] / way))


def test_no_walk_pays_as_much_as_a_fall():
    limp = replace(LEGS, hip_stiffness=(20.0, 20.0), knee_stiffness=(20.0, 20.0))
    own, fallen = cost(SETTINGS, [LEGS, limp], 0, 1, 0.0, pays="effort")
    assert own < FALL_COST < fallen


def test_a_search_by_effort_refuses_least_squares():
    with pytest.raises(SpringfootError, match="refinements must be 0 where a walk pays for effort, got 2"):
        LegTuning(pays="effort", refinements=2).check()
