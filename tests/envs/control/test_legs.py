"""The leg constants and the phase."""

import json
import re
from dataclasses import asdict
from importlib import resources

import numpy as np
import pytest

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control import legs as legs
from springfoot.envs.control import stride_phase
from springfoot.envs.control.constants import constants_at, constants_from, constants_name, leg_constants
from springfoot.envs.control.equilibrium import PLATEAUS, REFERENCE_STIFFNESS, neutral, planned, plateau_curve
from springfoot.envs.control.legs import knot_curve
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.control.stiffness_control import action_of
from springfoot.envs.settings.settings import BipedSettings
from springfoot.errors import SpringfootError


def test_every_set_of_constants_says_what_found_it():
    table = json.loads(resources.files("springfoot.envs.control").joinpath("legs.json").read_text(encoding="utf-8"))
    assert set(table["found_by"]) == set(table["constants"])
    for equilibrium, cadence in (("planned", "people"), ("planned", "thesis"), ("neutral", "people")):
        name = constants_name(equilibrium, cadence)
        assert table["found_by"][name].startswith("springfoot study leg-tuning")


def test_angle_and_phase_share_the_planned_constants():
    assert leg_constants("angle", "people") == leg_constants("phase", "people") == leg_constants("planned", "people")
    assert leg_constants("neutral", "people") != leg_constants("planned", "people")


def test_constants_are_linear_between_speeds_and_the_nearest_beyond():
    slow, fast = leg_constants("planned", "people"), leg_constants("neutral", "people")
    sets = {0.8: slow, 1.2: fast}
    assert constants_at(sets, 0.8) == constants_at(sets, 0.5) == slow
    assert constants_at(sets, 1.2) == constants_at(sets, 1.9) == constants_at({1.2: fast}, 0.8) == fast
    between = vars(constants_at(sets, 0.9))
    for name, value in between.items():
        low, high = (np.array(vars(each)[name]) for each in (slow, fast))
        np.testing.assert_allclose(value, 0.75 * low + 0.25 * high, rtol=1e-12, atol=1e-12)
        assert type(value) is type(vars(slow)[name])


def test_every_committed_speed_has_its_own_constants():
    """A set whose name tells a speed is what a walk at that speed gets."""
    table = json.loads(resources.files("springfoot.envs.control").joinpath("legs.json").read_text(encoding="utf-8"))
    sets = {constants_name("planned", "people", speed): speed for speed in np.round(np.arange(0.4, 2.0, 0.1), 9)}
    for name in set(sets) & set(table["constants"]):
        expected = constants_from(table["constants"][name])
        assert leg_constants("planned", "people", sets[name]) == expected
        biped = Biped(BipedSettings(height=1.9, mass=70.0, speed=sets[name] * np.sqrt(1.9 / 1.7)), 1)
        np.testing.assert_allclose(biped.constants[0].hip_knots_deg, expected.hip_knots_deg, rtol=1e-9)


def test_a_setting_without_constants_is_refused():
    with pytest.raises(SpringfootError) as error:
        Biped(BipedSettings(equilibrium="neutral", cadence="thesis"), 1)
    assert str(error.value) == (
        "there are no tuned leg constants for equilibrium 'neutral', cadence 'thesis' and people's moments; "
        "equilibrium 'neutral' needs cadence 'people'"
    )


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("trunk_pitch_deg", float("nan"), "trunk_pitch_deg must be in [-1e+06, 1e+06], got nan"),
        ("hip_knots_deg", [0.0] * 9, "hip_knots_deg must be 10 numbers"),
        ("ankle_schedule", [0.0] * 5, "ankle_schedule must be in [1, 1e+06], got 0"),
        ("toe_schedule", "x", "toe_schedule must be in [1, 1e+06], got 'x'"),
        ("speed_torque", 1e200, "speed_torque must be in [-1e+06, 1e+06], got 1e+200"),
        ("unknown", 1.0, "constants must be a dictionary with hip_knots_deg"),
    ],
)
def test_constants_that_cannot_be_are_refused_in_one_line(name, value, said):
    values = asdict(leg_constants("planned", "people")) | {name: value}
    with pytest.raises(SpringfootError, match=f"^{re.escape(said)}"):
        constants_from(values)


def test_knots_are_met_and_periodic():
    knots = np.arange(10.0) ** 2 / 10
    curve = np.rad2deg(knot_curve(tuple(knots)))
    np.testing.assert_allclose(curve[:: len(GRID) // 10], knots, atol=1e-9)
    assert abs(curve[-1] - curve[0]) < abs(curve[1] - curve[0]) + 0.2


def test_on_the_plan_the_reference_stiffness_gives_peoples_moment():
    walk = reference_walk_at(BipedSettings(), 1.2)
    target = walk.target
    plain = {"ankle_knots_deg": (0.0,) * 10, "feedforward": (0.0, 0.0, 1.0)}
    constants = constants_from({**vars(leg_constants("planned", "people")), **plain})
    rest = planned(constants, walk)[:, 0]
    rate = target.rate("ankle", GRID) / (constants.period_factor * walk.plan.stride_time)
    torque = plateau_curve(REFERENCE_STIFFNESS) * (rest - target.mean("ankle", GRID) - 0.02 * rate)
    np.testing.assert_allclose(torque, -63.0 * target.mean("ankle_moment", GRID), atol=1e-9)


def test_the_neutral_equilibrium_is_constant():
    rest = neutral(leg_constants("neutral", "people"))
    np.testing.assert_array_equal(rest, np.broadcast_to(rest[0], rest.shape))


def test_plateaus_are_flat():
    curve = plateau_curve((10.0, 20.0, 30.0, 40.0, 50.0))
    for value, start, end in zip((10, 20, 30, 40, 50), PLATEAUS[::2], PLATEAUS[1::2], strict=True):
        inside = (start <= GRID) & (end >= GRID)
        np.testing.assert_allclose(curve[inside], value)


def test_a_slope_moves_the_legs_on_it_and_no_bit_beside_it():
    def walked(slope_deg):
        biped = Biped(BipedSettings(), 2)
        biped.subjects.slope[:] = 0.0, np.radians(slope_deg)
        biped.reset(np.arange(2), [3, 3])
        for _ in range(20):
            action = action_of(biped.scheduled_stiffness(), biped.settings, biped.body)
            observation = biped.step(action.reshape(2, -1)).observation
        return observation

    level, beside = walked(0.0), walked(4.0)
    np.testing.assert_array_equal(beside[0], level[0])
    assert (beside[1] != level[1]).any()


def test_the_phase_waits_for_a_late_foot_and_starts_anew_with_it():
    biped = Biped(BipedSettings(), 1)
    biped.reset(np.array([0]), [0], start=0.3)
    phases, landed = [], []
    for _ in range(150):
        phases.append(biped.step(np.array([[0.6, 0.2, 0.6, 0.2]])).info["phase/left"][0])
        landed.append(biped.measurement.force[0, :, :, 1].sum(1) > 31.0)
    step = np.diff(phases)
    assert max(phases) <= 1.0 - stride_phase.HOLD
    assert (step > -1e-12).sum() >= 145  # it runs forward but where a stride ends
    for index in np.flatnonzero(step < -0.5):
        assert landed[index + 1][0]  # the left foot is down where its stride begins
