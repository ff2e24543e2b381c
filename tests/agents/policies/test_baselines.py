"""The baselines set the stiffness they promise, read at the phase the environment shows."""

import numpy as np
import pytest

from springfoot.agents.policies.baselines import BASELINES, baseline, leg_phase, own_settings, schedule
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.control.equilibrium import REFERENCE_STIFFNESS
from springfoot.envs.control.stiffness_control import stiffness_of
from springfoot.envs.settings.settings import BipedSettings, settings_from
from springfoot.envs.task.observation_entries import OBSERVATION
from springfoot.evaluation.recording.recording import record
from springfoot.gait import Body, SpringfootError
from springfoot.gait.body.tissue import TOE_STIFFNESS
from springfoot.gait.springs.stiffness import thesis_schedule


def settings_of(name, **values):
    return settings_from(**(own_settings(name, settings_from(**values)) | values))


def started(settings, phases):
    """A batch whose left legs stand at `phases`."""
    biped = Biped(settings, len(phases))
    for index, phase in enumerate(phases):
        biped.reset(np.array([index]), [0], start=float(phase))
    return biped


@pytest.mark.parametrize("name", BASELINES)
def test_every_baseline_gives_valid_actions_and_the_core_takes_them(name):
    settings = settings_of(name)
    biped = started(settings, [0.1, 0.3, 0.7])
    actions = baseline(name, settings, seed=3)(biped.observe())
    assert actions.shape == (3, 4) and actions.dtype == np.float32
    assert np.all(np.abs(actions) <= 1)
    assert np.all(np.isfinite(biped.step(actions).reward))


def test_phase_is_read_from_the_observation():
    phases = np.array([0.0, 0.1, 0.5, 0.75, 0.999])
    read = leg_phase(started(BipedSettings(), phases).observe())
    assert read[:, 0] == pytest.approx(phases, abs=1e-6)
    assert read[:, 1] == pytest.approx((phases + 0.5) % 1, abs=1e-6)


def test_constant_is_300_and_40_newton_metres_a_radian_scaled_with_the_body():
    for values, scale in (({}, 1.0), ({"height": 1.87, "mass": 90.0}, 1.1 * 90 / 63)):
        settings = settings_of("constant", **values)
        result = started(settings, [0.2]).step(baseline("constant", settings)(np.zeros((1, len(OBSERVATION)))))
        for joint, value in (("ankle", 300.0), ("toe", 40.0)):
            for side in ("left", "right"):
                assert result.info[f"stiffness/{joint}_{side}"][0] == pytest.approx(value * scale, rel=1e-6)


def test_constant_of_other_stiffness():
    settings = BipedSettings()
    action = baseline("constant:450,30", settings)(np.zeros((1, len(OBSERVATION))))
    assert stiffness_of(action.reshape(2, 2), settings, Body()) == pytest.approx(
        np.array([[450.0, 30.0]] * 2), rel=1e-5
    )
    action = baseline("constant:450,30,200,60", settings)(np.zeros((3, len(OBSERVATION))))
    assert action.shape == (3, 4)
    assert stiffness_of(action.reshape(3, 2, 2), settings, Body()) == pytest.approx(
        np.array([[[450.0, 30.0], [200.0, 60.0]]] * 3), rel=1e-5
    )


def test_schedule_sets_the_stiffness_of_the_leg_tuning():
    biped = started(BipedSettings(), np.linspace(0, 1, 21)[:-1])
    action = baseline("schedule", biped.settings)(biped.observe()).reshape(20, 2, 2)
    assert stiffness_of(action, biped.settings, Body()) == pytest.approx(biped.scheduled_stiffness(), rel=1e-4)


@pytest.mark.parametrize("own", [{}, {"height": 1.9, "mass": 90.0, "speed": 1.07}])
def test_schedule_follows_the_body_and_the_speed_of_each_environment(own):
    settings = BipedSettings(
        height_range=(1.45, 2.0), mass_range=(40.0, 120.0), speed_range=(0.8, 1.6), speed_rate=2.0, **own
    )
    biped, follow = Biped(settings, 16), baseline("schedule", settings)
    biped.reset(np.arange(16), range(16))
    biped.command(np.arange(16), np.linspace(0.8, 1.6, 16))
    for _ in range(20):
        action = follow(biped.observe())
        wanted = biped.scheduled_stiffness()
        biped.step(action)
        set_to = stiffness_of(action.reshape(16, 2, 2), settings, biped.body)
        set_to *= biped.subjects.scale["torque"][:, None, None]
        assert set_to == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize(("name", "ankle"), [("thesis", 45.0), ("thesis_printed", 20.0)])
def test_thesis_brings_its_schedule_and_its_swing(name, ankle):
    settings = settings_of(name)
    assert settings.equilibrium == "phase" and settings.schedule is not None
    biped = started(settings, [0.8])
    set_to = stiffness_of(baseline(name, settings)(biped.observe()).reshape(1, 2, 2), settings, Body())
    assert set_to[0, 0, 0] == pytest.approx(ankle, rel=1e-5)  # left ankle in swing
    assert set_to[0, 1, 0] > 100.0  # right ankle in stance


@pytest.mark.parametrize(
    ("swing", "falls"),
    [
        (((45.0, 0.0), (25.0, 10.0)), 0),  # (K, rest angle in degrees) of ankle and toe
        pytest.param(
            *(((20.0, 0.0), (25.0, 10.0)), 0),
            marks=pytest.mark.xfail(strict=True, reason="3 of 4 fall since planned legs bend earlier"),
        ),
        (((45.0, 0.0), (5.0, 10.0)), 0),
        (((20.0, 0.0), (5.0, 0.0)), 4),  # as printed
        (((200.0, 0.0), (50.0, 0.0)), 4),
        (((45.0, 0.0), (25.0, 0.0)), 4),
    ],
)
def test_the_thesis_falls_while_its_toe_rests_at_0_in_swing_and_walks_with_it_up(swing, falls):
    lines = thesis_schedule(Body(), swing=swing)
    settings = BipedSettings(equilibrium="phase", schedule=lines, episode_seconds=8.0)
    assert np.count_nonzero(record(schedule(settings), settings, name="", episodes=4, threads=1).fall_reason) == falls


def test_a_factor_multiplies_the_schedule():
    biped = started(BipedSettings(), np.linspace(0, 1, 21)[:-1])
    once, half = (
        stiffness_of(baseline(name, biped.settings)(biped.observe()).reshape(20, 2, 2), biped.settings, Body())
        for name in ("schedule", "schedule:0.5")
    )
    least = [low for low, _ in (BipedSettings().ankle_stiffness_range, BipedSettings().toe_stiffness_range)]
    assert half == pytest.approx(np.maximum(0.5 * once, least), rel=1e-5)


def test_quasi_stiffness_is_peoples_on_its_plateaus():
    biped = started(BipedSettings(), [0.03, 0.17, 0.37, 0.56, 0.8])
    set_to = stiffness_of(
        baseline("quasi_stiffness", biped.settings)(biped.observe()).reshape(5, 2, 2), biped.settings, Body()
    )
    assert set_to[:, 0, 0] == pytest.approx(REFERENCE_STIFFNESS, rel=1e-5)
    assert set_to[..., 1] == pytest.approx(TOE_STIFFNESS, rel=1e-5)


def test_schedule_follows_one_that_is_given():
    given = {"ankle": [[0.0, 100.0, 0.0], [0.6, 50.0, 0.0]], "toe": [[0.0, 20.0, 0.0]]}
    biped = started(settings_from(schedule=given), [0.3, 0.8])
    stiffness = stiffness_of(
        baseline("schedule", biped.settings)(biped.observe()).reshape(2, 2, 2), biped.settings, Body()
    )
    assert stiffness[0] == pytest.approx(np.array([[100.0, 20.0], [50.0, 20.0]]), rel=1e-5)
    assert stiffness[1] == pytest.approx(stiffness[0, ::-1], rel=1e-6)


def test_untrained_is_mid_range_and_random_is_seeded():
    observation = np.zeros((5, len(OBSERVATION)))
    assert not baseline("untrained", BipedSettings())(observation).any()
    first, again, other = (baseline("random", BipedSettings(), seed)(observation) for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_stiffness_in_residual_mode_is_refused():
    for name in ("constant", "schedule"):
        with pytest.raises(SpringfootError, match="action_mode"):
            baseline(name, BipedSettings(action_mode="residual"))


@pytest.mark.parametrize(
    "name",
    [
        "standing",
        "constant:1",
        "constant:1,-2",
        "constant:1,2,3",
        "constant:1,2,3,inf",
        "constant:a,b",
        "constant:nan,3",
        "random:3",
        "schedule:0",
        "schedule:a",
    ],
)
def test_unknown_baselines_are_refused_with_one_line(name):
    with pytest.raises(SpringfootError) as caught:
        baseline(name, BipedSettings())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("acts", ["person", "both"])
@pytest.mark.parametrize("name", BASELINES)
def test_a_baseline_moves_no_legs(name, acts):
    said = rf"^baselines set stiffness alone: acts must be stiffness for {name}, got {acts}$"
    with pytest.raises(SpringfootError, match=said):
        baseline(name, settings_of(name, acts=acts))
