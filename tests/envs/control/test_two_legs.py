"""Legs with constants of their own: a person whose feet differ moves hips and knees differently on each side."""

from dataclasses import replace

import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.control.constants import leg_constants
from springfoot.envs.physics.model import KNEE
from springfoot.envs.settings.settings import settings_from

TUNED = leg_constants("planned", "people")
OTHER = replace(
    TUNED,
    knee_knots_deg=tuple(knot + 3.0 for knot in TUNED.knee_knots_deg),
    knee_stiffness=tuple(1.2 * k for k in TUNED.knee_stiffness),
    ankle_schedule=tuple(1.1 * k for k in TUNED.ankle_schedule),
    toe_flat_deg=TUNED.toe_flat_deg - 2.0,
)
"""As tuned but for what each leg reads by itself."""


def walk(biped: Biped, steps: int = 40, start: float = 0.2) -> list[Tick]:
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    biped.reset(np.arange(biped.num_envs), range(biped.num_envs), start=start)
    for _ in range(steps):
        biped.step(np.zeros((biped.num_envs, 4)))
    return ticks


@pytest.mark.parametrize("settings", [{}, {"speed_range": (1.0, 1.4)}], ids=str)
def test_a_right_leg_of_the_same_constants_changes_no_bit(settings):
    if settings:  # with a range the sets hold at every speed
        settings |= {"speed": 1.1}
    one, two = (Biped(settings_from(**settings), 2, legs=[TUNED], right_legs=right) for right in (None, [TUNED]))
    for mine, other in zip(walk(one), walk(two), strict=True):
        assert mine.measurement.angle.tobytes() == other.measurement.angle.tobytes()
        assert mine.stiffness.tobytes() == other.stiffness.tobytes()
    assert one.scheduled_stiffness().tobytes() == two.scheduled_stiffness().tobytes()


def test_each_leg_has_its_own_knee_ankle_and_schedule():
    settings = settings_from(action_mode="residual")
    ticks = walk(Biped(settings, 1, legs=[TUNED], right_legs=[OTHER]), 30)
    alone = [walk(Biped(settings, 1, legs=[legs]), 1)[0] for legs in (TUNED, OTHER)]
    for side, own in enumerate(alone):
        for name in ("stiffness", "equilibrium"):  # in the first window both walk at the same phases
            np.testing.assert_array_equal(getattr(ticks[0], name)[0, side, KNEE:], getattr(own, name)[0, side, KNEE:])
    assert (alone[0].stiffness[0, 1, KNEE:] != alone[1].stiffness[0, 1, KNEE:])[:2].all()


def test_legs_that_change_places_walk_in_the_mirror():
    settings = settings_from(action_mode="residual")
    ours = walk(Biped(settings, 1, legs=[TUNED], right_legs=[OTHER]), start=0.2)[-1]
    its = walk(Biped(settings, 1, legs=[OTHER], right_legs=[TUNED]), start=0.7)[-1]
    np.testing.assert_allclose(ours.measurement.angle[0], its.measurement.angle[0, ::-1], atol=1e-5)


def test_pairs_of_a_batch_walk_as_alone_bit_for_bit():
    variant = np.array([1, 0, 1])
    together = Biped(settings_from(), 3, legs=[TUNED, OTHER], variant=variant, right_legs=[OTHER, TUNED])
    alone = Biped(settings_from(), 1, legs=[TUNED], right_legs=[OTHER])
    together.reset(np.arange(3), [4, 5, 6])
    alone.reset(np.arange(1), [5])
    for _ in range(30):
        ours, its = together.step(np.zeros((3, 4))), alone.step(np.zeros((1, 4)))
        assert ours.observation[1].tobytes() == its.observation[0].tobytes()
        assert ours.values[1].tobytes() == its.values[0].tobytes()
