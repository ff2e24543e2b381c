"""Actions to stiffness, and the work of changing a spring."""

import numpy as np
import pytest
from numpy.typing import NDArray
from parts import move, stiffen

from springfoot.envs.control.constants import slope_constants
from springfoot.envs.control.legs import slope_table
from springfoot.envs.control.phase_table import GRID, PLACE, SAMPLES, PhaseTable
from springfoot.envs.control.stiffness_control import (
    FootSprings,
    action_of,
    stiffness_of,
    stiffness_ranges,
)
from springfoot.envs.control.subjects import Subjects
from springfoot.envs.physics.measurement import BODY_ROW
from springfoot.envs.physics.model import JOINTS, SIDES
from springfoot.envs.settings.settings import ActionMode, BipedSettings
from springfoot.gait.body.body import Body


def test_the_map_is_logarithmic_between_the_ends():
    settings, body = BipedSettings(), Body()
    ends = stiffness_of(np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]]), settings, body)
    np.testing.assert_allclose(ends, [[20, 5], [np.sqrt(20 * 800), np.sqrt(5 * 200)], [800, 200]], rtol=1e-12)


def test_stiffness_scales_with_mass_and_height():
    settings, body = BipedSettings(), Body(1.9, 100.0)
    low, high = stiffness_ranges(settings, body)
    scale = 100 / 63 * 1.9 / 1.7
    np.testing.assert_allclose([low, high], np.array([[20, 5], [800, 200]]) * scale, rtol=1e-12)


def test_action_of_inverts_the_map_and_stops_at_the_ends():
    settings, body = BipedSettings(), Body(1.6, 70.0)
    actions = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    np.testing.assert_allclose(action_of(stiffness_of(actions, settings, body), settings, body), actions, atol=1e-12)
    np.testing.assert_array_equal(action_of([[1e-9, 1e9]], settings, body), [[-1.0, 1.0]])


def springs(mode: ActionMode = "absolute", num: int = 3) -> "Springs":
    rest = np.stack([0.3 * np.sin(2 * np.pi * GRID), 0.1 * np.cos(2 * np.pi * GRID)], -1)[None]
    schedule = np.stack([200 + 100 * GRID, 30 + 0 * GRID], -1)[None]
    settings = BipedSettings(action_mode=mode)
    return Springs(settings, rest, schedule, Subjects(settings, np.array([1.2]), num))


class Springs:
    """Foot springs and what they act on."""

    def __init__(self, settings: BipedSettings, rest: NDArray, schedule: NDArray, subjects: Subjects):
        self.feet = FootSprings(settings, rest, schedule, subjects)
        self.rows, self.everyone = subjects.rows, np.ones(len(subjects.rows), bool)
        self.bodies = np.zeros(len(self.rows), BODY_ROW)
        self.angle = self.bodies["measured"]["angle"]
        self.control = np.zeros((len(self.rows), len(SIDES), len(JOINTS), 2))
        own = self.rows["springs"]
        self.stiffness, self.equilibrium = own["stiffness"], own["equilibrium"]
        self.work_stiffness, self.work_equilibrium = own["work_stiffness"], own["work_equilibrium"]

    def set_stiffness(self, action: NDArray, leg_phase: NDArray) -> None:
        self.rows["legs"]["phase"] = leg_phase
        feet = self.feet
        stiffen(
            self.rows,
            self.bodies,
            feet.schedule.table,
            feet.options,
            feet.factor(action),
            self.everyone,
            ~self.everyone,
        )

    def move_equilibrium(self, leg_phase: NDArray) -> None:
        self.rows["legs"]["phase"] = leg_phase
        incline = slope_table(slope_constants()).table
        move(
            self.rows,
            self.bodies,
            self.control,
            self.feet.rest.table,
            incline,
            self.feet.feet,
            self.feet.options,
            self.everyone,
        )


def test_a_residual_action_multiplies_the_schedule():
    feet = springs("residual")
    action = np.random.default_rng(1).uniform(-1, 1, (3, 4))
    phase = np.array([[0.1, 0.6], [0.25, 0.75], [0.0, 0.5]])
    feet.set_stiffness(action, phase)
    expected = np.stack([200 + 100 * phase, np.full((3, 2), 30.0)], -1) * np.exp(action.reshape(3, 2, 2))
    np.testing.assert_allclose(feet.stiffness, expected, rtol=1e-9)


def test_the_works_add_up_to_the_change_of_the_springs_energy():
    feet, random = springs(), np.random.default_rng(2)
    angle, control = feet.angle, feet.control
    angle[:] = 0.1 * random.normal(size=(3, 2, 4))
    phase = np.array([[0.1, 0.6], [0.2, 0.7], [0.3, 0.8]])
    feet.set_stiffness(random.uniform(-1, 1, (3, 4)), phase)
    feet.move_equilibrium(phase)
    assert not feet.work_stiffness.any() and not feet.work_equilibrium.any()  # a new episode costs nothing

    def energy():
        return 0.5 * feet.stiffness * (feet.equilibrium - angle[..., 2:]) ** 2

    before = energy()
    feet.set_stiffness(random.uniform(-1, 1, (3, 4)), phase)
    for later in (0.05, 0.1):
        feet.move_equilibrium(phase + later)
    work = feet.work_stiffness + feet.work_equilibrium
    np.testing.assert_allclose(work, energy() - before, atol=1e-12)
    assert np.abs(work).max() > 1e-3
    np.testing.assert_array_equal(control[..., 2:, 0], feet.stiffness)
    np.testing.assert_array_equal(control[..., 2:, 1], feet.stiffness * feet.equilibrium)
    assert not control[..., :2, :].any()  # hips and knees are not theirs


def test_a_delayed_change_of_stiffness_does_work_on_its_own_spring_when_it_arrives():
    feet, random = springs(), np.random.default_rng(4)
    feet.feet.reset(np.arange(3), delay=1)
    feet.angle[:] = 0.1 * random.normal(size=(3, 2, 4))
    phase = np.array([[0.1, 0.6], [0.2, 0.7], [0.3, 0.8]])  # all feet on the ground: every spring acts
    actions = random.uniform(-1, 1, (2, 3, 4))
    feet.set_stiffness(actions[0], phase)
    feet.move_equilibrium(phase)
    feet.move_equilibrium(phase)
    before = feet.stiffness.copy()
    deflection = feet.equilibrium - feet.angle[..., 2:]
    feet.set_stiffness(actions[1], phase)
    np.testing.assert_array_equal(feet.stiffness, before)
    assert not feet.work_stiffness.any()
    feet.move_equilibrium(phase)
    feet.move_equilibrium(phase)
    taut = feet.rows["springs"]["taut"]
    np.testing.assert_allclose(feet.work_stiffness, taut * 0.5 * (feet.stiffness - before) * deflection**2, atol=1e-12)
    assert np.abs(feet.work_stiffness[taut > 0]).min() > 1e-6


def test_phase_tables_are_linear_between_rows_and_each_environment_reads_its_own():
    rows = np.stack([np.stack([np.sin(2 * np.pi * GRID) * k, GRID + k], -1) for k in range(4)])
    place = np.zeros(3, PLACE)
    place["row"], place["weight"] = [0, 2, 3], [0.25, 0.5, 0.0]
    phase = np.array([[0.1234, 0.6], [0.3, 0.8], [0.5, 0.0]])
    single = np.stack([PhaseTable(row).at(phase) for row in rows])
    expected = [0.75 * single[0, 0] + 0.25 * single[1, 0], (single[2, 1] + single[3, 1]) / 2, single[3, 2]]
    np.testing.assert_allclose(PhaseTable(rows).at(phase, place), expected, atol=1e-12)


def test_phase_tables_are_periodic_and_linear_between_samples():
    table = PhaseTable(np.stack([np.sin(2 * np.pi * GRID), GRID], -1))
    phase = np.random.default_rng(3).uniform(0, 1 - 1 / SAMPLES, (7, 2))
    values = table.at(phase)
    np.testing.assert_allclose(values[..., 0], np.sin(2 * np.pi * phase), atol=1e-5)
    np.testing.assert_allclose(values[..., 1], phase, atol=1e-12)
    last = table.at(np.array([1 - 1e-12]))
    assert last[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert table.at(np.array([np.nextafter(1, 0)]))[0, 0] == pytest.approx(0.0, abs=1e-9)
