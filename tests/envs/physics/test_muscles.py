"""The price of the muscles in a simulated walk: against every physics step, part by part, and with planted devices."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.cheating import finely_used, replayed
from springfoot.envs import Biped
from springfoot.envs.physics import foot as physics_foot
from springfoot.envs.physics.foot import LOCK, SOUND
from springfoot.envs.physics.model import ANKLE, JOINTS, RIGHT, TOE, passive_damping
from springfoot.envs.physics.muscles import leg_strengths, muscles_of
from springfoot.envs.physics.timing import PHYSICS_STEPS_PER_WINDOW
from springfoot.envs.settings import feet as settings_feet
from springfoot.envs.settings.feet import RIGID_TOE_STIFFNESS
from springfoot.envs.settings.settings import body_of, settings_from
from springfoot.envs.task.reward import TERMS
from springfoot.evaluation.numbers import measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import TICK, record
from springfoot.gait import GRAVITY, Body
from springfoot.gait.body.tissue import passive_moments
from springfoot.gait.plan.effort import TENDON_GIVE, metabolic_energy, muscle_use

WALKS = (
    ("pretrained", {}),
    ("schedule", {}),
    ("schedule", {"slope_deg": 3.0}),
    ("schedule", {"height": 1.9, "mass": 100.0, "speed": 1.4}),
    ("schedule", {"right_foot": {"kind": "weak", "strength": 0.5, "orthosis": {"ankle_stiffness": 100.0}}}),
    (
        "schedule",
        {"right_foot": {"kind": "intact", "orthosis": {"ankle_stiffness": 100.0, "engages": "dorsiflexion"}}},
    ),
)
DEVICES = (
    ("rigid_toe", {"kind": "rigid_toe"}, [TOE]),
    ("adaptive", {"kind": "adaptive"}, [ANKLE, TOE]),
    ("passive", {"kind": "passive", "ankle_stiffness": 400.0}, [ANKLE, TOE]),
    ("rigid", {"kind": "rigid"}, [ANKLE, TOE]),
)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("schedule", {}),
        ("predicted", {}),
        ("pretrained", {}),
        ("schedule", {"speed": 0.8}),
        ("pretrained", {"mass": 100.0}),
    ],
)
def test_windows_price_a_walk_as_steps_of_2_ms_with_the_same_smooth_force_do(name, given):
    act, settings = policy_and_settings(name, {"episode_seconds": 7.0, **given})
    biped, windows = Biped(settings, 1), 600
    biped.reset(np.array([0]), [0])
    torque, angle, ticks, _ = replayed(biped, act, windows)
    fine = finely_used(biped, torque, angle, windows)
    kept = np.stack([tick.fibre_moment[0] for tick in ticks]), np.stack([tick.muscle_work[0] for tick in ticks])
    own = muscle_use(*kept, TICK, leg_strengths(biped.body, settings.feet), biped.body.strength_scale)
    assert own.energy.sum() == pytest.approx(fine.energy.sum(), rel=0.02)
    assert own.activation.sum() == pytest.approx(fine.activation.sum(), rel=0.02)


def test_a_walk_that_falls_is_replayed_to_its_fall():
    act, settings = policy_and_settings("schedule", {"episode_seconds": 7.0, "right_foot": "rigid"})
    biped = Biped(settings, 1)
    biped.reset(np.array([0]), [0])
    torque, angle, ticks, _ = replayed(biped, act, 600)
    assert 0 < len(ticks) < 600
    assert len(torque) == len(angle) - 1 == PHYSICS_STEPS_PER_WINDOW * len(ticks)


def test_a_force_that_alternates_every_window_is_priced():
    settings = settings_from(decisions="100hz", episode_seconds=2.0)
    spent = []
    for size in (0.0, 0.6):
        biped = Biped(settings, 1)
        biped.reset(np.array([0]), [0])
        energy = 0.0
        for number in range(40):
            biped.step(size * np.array([[1.0, 0.0, 1.0, 0.0]]) * (-1) ** number)
            energy += biped._simulation.arrays.bodies["muscles"]["energy"][0, :, ANKLE].sum()
        spent.append(energy)
    assert spent[1] > 3.0 * spent[0]


def test_the_reward_pays_what_a_recording_measures():
    act, settings = policy_and_settings("schedule", {"episode_seconds": 4.0, "push_newton": 100.0})
    recording = record(act, settings, name="schedule", episodes=2, seed=3, threads=1)
    body = body_of(settings)
    for episode in range(2):
        series = {key: values[episode].astype(float) for key, values in recording.series.items()}
        use = muscle_use(
            series["fibre_moment"],
            series["muscle_work"],
            TICK,
            leg_strengths(body, settings.feet),
            body.strength_scale,
        )
        terms = dict(zip(TERMS, series["reward"].T, strict=True))
        way = settings.speed * 2 * TICK
        paid = terms["fibre_work"][::2].sum() * body.mass * GRAVITY * way
        assert paid == pytest.approx(use.energy.sum(), rel=1e-4)  # of single precision
        for name, used in (("activation", use.activation), ("activation_rate", use.rate)):
            assert terms[name][::2].sum() * 2 * TICK == pytest.approx(used.sum(), rel=1e-4), name


@pytest.mark.parametrize(("name", "given"), WALKS, ids=str)
def test_parts_of_the_work_make_up_that_of_the_joint(name, given):
    act, settings = policy_and_settings(name, {"episode_seconds": 14.0} | given)
    recording = record(act, settings, name=name, episodes=1)
    assert recording.fall_reason[0] == ""
    body = body_of(settings)
    series = {key: values[0, 300:].astype(float) for key, values in recording.series.items()}
    angle, work = series["angle"], series["joint_work"][1:].sum(-1)
    turn, middle = np.diff(angle, axis=0), 0.5 * (angle[1:] + angle[:-1])
    moment = series["fibre_moment"][1:]
    pull = np.maximum(moment, 0.0)
    # What a tendon holds at the end and did not at the start, F^2 / 2 k, from the fibres' force between two windows.
    stored = 0.5 * pull[:-1] * pull[1:] * np.array(TENDON_GIVE) / body.strength_scale
    tendon = stored[0] - stored[-1]
    strength = leg_strengths(body, settings.feet)
    fibres = muscle_use(moment, series["muscle_work"][1:], TICK, strength, body.strength_scale).work.sum(-1)
    tissue = -(passive_moments(body, middle) * turn)[1:-1].sum(0)
    damping = -(passive_damping(body) * turn**2 / TICK)[1:-1].sum(0)
    orthosis = settings.right_foot.foot.ankle.orthosis
    device = np.zeros((2, 4))
    if orthosis:
        beta = 0.0 if orthosis.engages else 0.02 * np.sqrt(body.length_scale)
        brace = orthosis.stiffness * (np.clip(middle, *orthosis.slack) - middle - beta * turn / TICK) * turn
        device[RIGHT, ANKLE] = brace[1:-1, RIGHT, ANKLE].sum()
    parts = fibres + tendon + tissue + damping + device
    whole = work[1:-1].sum(0)
    size = np.abs(series["joint_work"][1:]).sum((0, -1))
    np.testing.assert_allclose(parts, whole, rtol=0, atol=0.01 * size.max())
    np.testing.assert_allclose(
        series["muscle_work"][2:-1].sum((0, -1)), fibres + tendon, rtol=0, atol=1e-4 * size.max()
    )
    assert np.abs(tendon).max() < 0.02 * size.max()  # a tendon stores and returns


@pytest.mark.parametrize(("name", "foot", "joints"), DEVICES, ids=[name for name, *_ in DEVICES])
def test_a_planted_device_costs_its_muscles_nothing(name, foot, joints):
    act, settings = policy_and_settings("schedule", {"episode_seconds": 1.5, "right_foot": foot})
    recording = record(act, settings, name=name, episodes=2, threads=1)
    moment = recording.series["fibre_moment"][:, :, RIGHT]
    for joint in range(len(JOINTS)):
        fibres = np.nan_to_num(moment[..., joint])
        assert fibres.any() != (joint in joints)


def test_a_brace_that_carries_the_whole_moment_leaves_nothing_to_slack_muscles():
    foot = {"kind": "drop", "orthosis": {"ankle_stiffness": 20.0}}
    act, settings = policy_and_settings("schedule", {"episode_seconds": 3.0, "right_foot": foot})
    series = record(act, settings, name="drop", episodes=1).series
    slack = series["stiffness"][0, :, RIGHT, 0] == 0.0
    carried, fibres = (series[name][0, :, RIGHT, ANKLE] for name in ("joint_torque", "fibre_moment"))
    assert slack.sum() > 50 and not fibres[slack].any() and fibres[~slack].all()
    assert np.abs(carried[slack]).max() > 1.0


def test_a_weak_calf_has_its_share_of_the_strength():
    feet = settings_from(right_foot={"kind": "weak", "strength": 0.25}).feet
    left, right = leg_strengths(Body(), feet)
    assert left[ANKLE, 0] == pytest.approx(0.10 * 63.0 * GRAVITY * 1.70)
    assert right[ANKLE, 0] == pytest.approx(0.25 * left[ANKLE, 0]) and right[ANKLE, 1] == left[ANKLE, 1]
    np.testing.assert_array_equal(left[:ANKLE], right[:ANKLE])


@pytest.mark.parametrize("kind", ["braced", "passive", "rigid", "rigid_toe"])
def test_effort_per_kg_does_not_depend_on_mass_if_devices_scale_with_it(kind, monkeypatch):
    def effort(scale):
        foot = {
            "braced": {"kind": "intact", "orthosis": {"ankle_stiffness": 150.0 * scale}},
            "passive": {"kind": "passive", "ankle_stiffness": 400.0 * scale, "toe_stiffness": 60.0 * scale},
        }.get(kind, kind)
        # A lock and the rigid foot's toe have no settings.
        for module in (physics_foot, settings_feet):
            monkeypatch.setattr(module, "LOCK", replace(LOCK, stiffness=LOCK.stiffness * scale))
        monkeypatch.setattr(settings_feet, "RIGID_TOE_STIFFNESS", RIGID_TOE_STIFFNESS * scale)
        given = {"episode_seconds": 6.0, "mass": 63.0 * scale, "right_foot": foot}
        act, settings = policy_and_settings("learned", given)
        return measure(record(act, settings, name="learned", episodes=1)).metrics["effort"]

    own, other = effort(1.0), effort(1.3)
    for name in ("fibre_J_kg_m", "net_joint_J_kg_m", "activation", "total"):
        assert other[name] == pytest.approx(own[name], rel=1e-5), name


def test_fibres_pay_four_times_what_they_do_and_less_than_what_is_done_on_them():
    assert metabolic_energy(np.array([1.0, -1.2])) == pytest.approx([4.0, 1.0])


def test_a_load_makes_no_muscle_tendon_or_tissue_other():
    alone = muscles_of(Body(), SOUND)
    loaded = muscles_of(Body(1.7, 63.0, 1.0, 1.0, 0.2), SOUND)
    assert alone.tobytes() == loaded.tobytes()
