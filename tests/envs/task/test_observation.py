"""The observation: each entry is what its name says, finite and within bounds."""

from math import sqrt

import numpy as np
import pytest
from planned_body import Setup

from springfoot.envs import Biped
from springfoot.envs.physics.foot import SOUND
from springfoot.envs.physics.model import ACTIONS, LEFT, RIGHT
from springfoot.envs.settings.settings import body_of, settings_from
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.envs.task.worn import worn_entries
from springfoot.gait import human_gait
from springfoot.gait.body.body import GRAVITY


@pytest.fixture(scope="module")
def thesis_body():
    return Setup()


def test_every_entry_of_the_observation_is_what_its_name_says(thesis_body):
    setup = Setup(height=1.5, mass=80, speed=0.9)
    measured = setup.measurement([0.1, 0.7])
    measured.base[:, 1:] = [0.7, 0.1]
    measured.base_velocity[:] = [0.9, -0.1, 0.5]
    measured.angle[:] = np.arange(8).reshape(2, 4) / 10
    measured.velocity[:] = -np.arange(8).reshape(2, 4)
    force = np.zeros((2, 2, 3, 2))
    force[..., 1] = np.arange(6).reshape(2, 3) * 100.0
    action = np.tile([0.1, 0.2, 0.3, 0.4], (2, 1))
    planned = setup.human.mean("ankle", np.array([0.1, 0.6]))
    seen = setup.observe(measured, [0.1, 0.7], last_action=action, force=force)
    row, other = (dict(zip(setup.task(2).names, values, strict=True)) for values in seen)

    leg = setup.body.leg_length
    froude, rate = np.sqrt(GRAVITY * leg), np.sqrt(leg / GRAVITY)
    expected = {
        "hip_height": 0.7 / leg,
        "pitch": 0.1,
        "hip_left": 0.0,
        "toe_left": 0.3,
        "hip_right": 0.4,
        "ankle_right": 0.6,
        "hip_velocity_x": 0.9 / froude,
        "hip_velocity_z": -0.1 / froude,
        "pitch_rate": 0.5 * rate,
        "knee_rate_left": -1 * rate,
        "toe_rate_right": -7 * rate,
        "phase_sin": np.sin(0.2 * np.pi),
        "phase_cos": np.cos(0.2 * np.pi),
        "phase_sin_2": np.sin(0.4 * np.pi),
        "phase_cos_2": np.cos(0.4 * np.pi),
        "load_heel_left": 0.0,
        "load_toe_left": 200 / (80 * GRAVITY),
        "load_heel_right": 300 / (80 * GRAVITY),
        "com_x_error": 0.0,
        "com_z_error": 0.0,
        "last_action_ankle_left": 0.1,
        "last_action_toe_right": 0.4,
        "planned_ankle_left": planned[LEFT],
        "planned_ankle_right": planned[RIGHT],
        "leading_leg": 1.0,
        "command_speed": setup.body.froude_speed(0.9),
        "height_ratio": 1.5 / 1.7,
    }
    for name, value in expected.items():
        assert row[name] == pytest.approx(value, rel=1e-6, abs=1e-4), name
    assert other["leading_leg"] == -1.0
    assert other["com_x_error"] == pytest.approx(0.0, abs=1e-4)


def test_observation_is_finite_and_within_bounds_whatever_happens(thesis_body):
    task = thesis_body.task(3)
    measured = thesis_body.measurement([0.2, 0.3, 0.4])
    for values, wild in ((measured.angle, 1e9), (measured.velocity, -1e9), (measured.base_velocity, np.nan)):
        values[:] = wild
    measured.com[:] = np.inf
    seen = thesis_body.observe(measured, [0.2, 0.3, 0.4])
    assert seen.dtype == np.float32
    assert seen.shape == (3, len(OBSERVATION)) == (3, len(task.low))
    assert np.isfinite(seen).all()
    assert ((seen >= task.low) & (seen <= task.high)).all()
    assert np.isfinite(task.low).all() and np.isfinite(task.high).all()
    assert (task.low < task.high).all()


def test_names_are_unique_and_name_the_actions():
    names = [entry.name for entry in OBSERVATION]
    assert len(set(names)) == len(names)
    assert [name.removeprefix("last_action_") for name in names if name.startswith("last_action_")] == list(ACTIONS)


def test_contact_loads_are_in_weights_of_the_body_with_what_it_carries(thesis_body):
    loaded = Setup(carried_ratio=0.25)
    force = np.zeros((1, 2, 3, 2))
    force[..., 1] = 100.0
    entry = [each.name for each in OBSERVATION].index("load_ball_left")
    alone, carrying = (
        setup.observe(setup.measurement([0.1]), [0.1], force=force)[0, entry] for setup in (thesis_body, loaded)
    )
    assert alone == pytest.approx(100.0 / (63.0 * GRAVITY), rel=1e-6)
    assert carrying == pytest.approx(alone / 1.25, rel=1e-6)


@pytest.mark.parametrize("engages", [{}, {"engages": "dorsiflexion"}])
def test_a_brace_of_no_stiffness_is_told_as_none(engages):
    brace = {"ankle_stiffness": 0.0, "ankle_deg": -5.0} | engages
    settings = settings_from(right_foot={"kind": "intact", "orthosis": brace})
    body = body_of(settings)
    assert (worn_entries(body, settings.feet) == worn_entries(body, SOUND)).all()


def test_the_planned_step_is_told_in_leg_lengths_of_the_body_that_was_drawn():
    settings = settings_from(
        acts="person",
        height_range=(1.5, 1.9),
        speed_range=(1.0, 1.3),
        drawn_bodies=[{}, {"step_time_ratio": 0.85}, {"leg_ratio": 1.05, "step_time_ratio": 1.15}],
    )
    biped = Biped(settings, 3)
    speed = 1.2 * sqrt(1.8 / 1.7)  # as 1.2 m/s, a tabulated speed, at the height of the settings
    given = {"body": np.arange(3), "height": np.full(3, 1.8), "mass": np.full(3, 70.0), "speed": np.full(3, speed)}
    biped.reset(np.arange(3), list(range(3)), given=given)
    seen = biped.observe()[:, biped.observation_names.index("planned_step")]
    people = human_gait(speed, 1.8)
    step = sqrt(people.step_length * speed * people.stride_time / 2)  # as the plan, between measured length and time
    for told, ratio, body in zip(seen, (1.0, 0.85, 1.15), biped.subjects.bodies, strict=True):
        assert told == pytest.approx(ratio * step / body.leg_length, rel=1e-6)
