"""Work and energy over every physics step: equal to MuJoCo's own, and closed."""

import mujoco
import numpy as np
import pytest

from springfoot.envs import Biped
from springfoot.envs.physics.energy import LEDGER, StepRecord, parts_of, window_work
from springfoot.envs.physics.model import ANKLE, JOINTS, SIDES, build_model
from springfoot.envs.physics.timing import PHYSICS_STEP, PHYSICS_STEPS_PER_WINDOW
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.gait import GRAVITY, Body

BODIES = (
    Body(),
    Body(height=1.9, mass=100.0, carried_ratio=0.2),
    Body(1.5, 45.0, 1.04, carried_ratio=0.1, carried_at="waist"),
)


def steps_at_rest(num, velocity=0.0):
    """A window in which nothing pushes and every velocity stays."""
    rates = np.full((num, PHYSICS_STEPS_PER_WINDOW, 11), velocity)
    return StepRecord(rates[:, 0].copy(), np.zeros(num), rates, *np.zeros((3, *rates.shape)))


def walk(name, seconds, num=1, **given):
    """Ticks of a walk from seed 0 on, and the batch after it."""
    policy, settings = policy_and_settings(name, {"episode_seconds": seconds + 1.0} | given)
    biped, ticks = Biped(settings, num), []
    biped.reset(np.arange(num), list(range(num)))
    biped.on_tick = ticks.append
    observation = biped.observe()
    for _ in range(round(seconds / biped.dt)):
        observation = biped.step(policy(observation)).observation
    return ticks, biped


@pytest.mark.parametrize("body", BODIES, ids=str)
def test_mechanical_energy_is_that_of_the_compiled_model(body):
    model, random = build_model(body), np.random.default_rng(0)
    data = mujoco.MjData(model)
    for _ in range(20):
        data.qpos[:], data.qvel[:] = random.normal(size=11), random.normal(size=11)
        mujoco.mj_forward(model, data)
        mujoco.mj_energyPos(model, data)
        mujoco.mj_energyVel(model, data)
        angle, state = np.zeros((1, len(SIDES), len(JOINTS))), (data.qpos[None], data.qvel[None])
        control = np.zeros((*angle.shape, 2))
        work = window_work(parts_of(body), steps_at_rest(1), control, control, angle, np.zeros(1), state, PHYSICS_STEP)
        assert work.energy["mechanical"][0] == pytest.approx(data.energy.sum(), rel=1e-12)


@pytest.mark.parametrize("name", ["pretrained", "schedule"])
def test_torque_and_work_equal_a_replay_step_by_step(name):
    policy, settings = policy_and_settings(name, {"episode_seconds": 3.0, "push_newton": 150.0, "push_interval": 0.5})
    biped, ticks, controls, pushes = Biped(settings, 1), [], [], []
    biped.reset(np.array([0]), [0])
    replay = biped.data(0)  # the state at the start

    def keep(tick):
        ticks.append(tick)
        controls.append(biped.data(0).ctrl.copy())
        pushes.append(biped.data(0).xfrc_applied.copy())

    biped.on_tick = keep
    observation = biped.observe()
    for _ in range(100):
        observation = biped.step(policy(observation)).observation
    trunk, joints = biped.model.body("trunk").id, slice(3, None)
    assert any(push[trunk, 0] for push in pushes)
    for tick, control, push in zip(ticks, controls, pushes, strict=True):
        replay.ctrl[:], replay.xfrc_applied[:] = control, push
        torque, work, pushed = np.zeros(8), np.zeros((8, 2)), 0.0
        for _ in range(PHYSICS_STEPS_PER_WINDOW):
            before, place = replay.qvel.copy(), replay.xipos[trunk, 0]
            mujoco.mj_step(biped.model, replay)
            net = (replay.qfrc_actuator + replay.qfrc_passive)[joints]
            done = net * 0.5 * (before + replay.qvel)[joints] * biped.model.opt.timestep
            torque += net / PHYSICS_STEPS_PER_WINDOW
            work += np.stack([np.maximum(done, 0.0), np.minimum(done, 0.0)], -1)
            pushed += push[trunk, 0] * (replay.xipos[trunk, 0] - place)
        np.testing.assert_allclose(tick.work.torque.ravel(), torque, rtol=0, atol=1e-9)
        np.testing.assert_allclose(tick.work.work.reshape(8, 2), work, rtol=0, atol=1e-9)
        assert tick.work.energy["pushes"][0] == pytest.approx(pushed, abs=0.05)  # MuJoCo's place lags by a step
    assert np.abs(replay.qpos[:3] - biped.measurement.base[0]).max() == 0.0


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("pretrained", {}),
        ("schedule", {}),
        ("constant", {}),
        ("schedule", {"height": 1.9, "mass": 100.0, "carried_ratio": 0.2}),
        ("schedule", {"slope_deg": 5.0}),
        ("pretrained", {"push_newton": 150.0, "unevenness_m": 0.01}),
    ],
)
def test_energy_closes_over_ten_strides(name, given):
    ticks, biped = walk(name, 14.0, **given)
    energy = np.concatenate([tick.work.energy for tick in ticks])
    own = energy[-(10 * 110) :]  # ten strides of 1.1 s
    change = own["mechanical"][-1] - energy["mechanical"][-len(own) - 1]
    works = sum(own[part].sum() for part in ("actuators", "passive_damping", "contact", "pushes"))
    assert abs(change - works) / biped.settings.mass / 10 <= 0.01
    put_in = own["equilibrium_changes"].sum() + own["stiffness_changes"].sum()
    assert own["actuators"].sum() == pytest.approx(put_in + own["spring_damping"].sum(), abs=0.04 * put_in)
    assert own["passive_damping"].max() <= 0.0 and own["spring_damping"].sum() < 0.0
    both = np.concatenate([tick.work.work for tick in ticks])[-len(own) :].sum()
    assert both == pytest.approx(own["actuators"].sum() + own["passive_damping"].sum(), rel=1e-9)


@pytest.mark.parametrize("sides", [["right"], ["left", "right"]], ids="-".join)
@pytest.mark.parametrize(("way", "angle"), [("dorsiflexion", -5.7), ("plantarflexion", 0.0)])
def test_energy_closes_with_springs_that_act_one_way_and_they_give_back_what_they_take(way, angle, sides):
    spring = {"ankle_stiffness": 200.0, "ankle_deg": angle, "toe_stiffness": 10.0, "engages": way}
    policy, settings = policy_and_settings(
        "pretrained", {f"{side}_foot": {"kind": "intact", "orthosis": spring} for side in sides}
    )
    biped, ticks, controls = Biped(settings, 1), [], []
    biped.reset(np.array([0]), [0])
    replay = biped.data(0)

    def keep(tick):
        ticks.append(tick)
        controls.append(biped.data(0).ctrl.copy())

    biped.on_tick = keep
    observation = biped.observe()
    for _ in range(400):
        result = biped.step(policy(observation))
        observation = result.observation
        assert not result.terminated.any()

    worn = [
        (3 + len(JOINTS) * side + ANKLE + at, joint.orthosis)
        for side, foot in enumerate(settings.feet)
        for at, joint in enumerate(foot.joints)
        if joint.orthosis
    ]

    def stored() -> float:
        sign = 1.0 if way == "dorsiflexion" else -1.0
        beyond = [max(sign * (replay.qpos[dof] - own.rest), 0.0) for dof, own in worn]
        return sum(0.5 * own.stiffness * x**2 for x, (_, own) in zip(beyond, worn, strict=True))

    held, taken, damped = [stored()], [0.0], 0.0
    for control in controls:
        replay.ctrl[:] = control
        for _ in range(PHYSICS_STEPS_PER_WINDOW):
            before = replay.qvel.copy()
            mujoco.mj_step(biped.model, replay)
            moved = 0.5 * (before + replay.qvel) * biped.model.opt.timestep
            damping = -biped.model.dof_damping * before
            damped += damping @ moved
            taken.append(taken[-1] - (replay.qfrc_passive - damping) @ moved)
            held.append(stored())
    turned_over = np.abs(np.diff(held)).sum()
    assert max(held) > 1.0 and turned_over > 20.0
    np.testing.assert_allclose(np.array(held) - held[0], taken, atol=0.1 * max(held))
    assert taken[-1] == pytest.approx(held[-1] - held[0], abs=0.002 * turned_over)
    energy = np.concatenate([tick.work.energy for tick in ticks])
    assert energy["passive_damping"].sum() == pytest.approx(damped - taken[-1], rel=1e-9)
    change = energy["mechanical"][-1] - energy["mechanical"][0]
    works = sum(energy[part][1:].sum() for part in ("actuators", "passive_damping", "contact", "pushes"))
    assert abs(change - works) / settings.mass / 7 <= 0.01  # seven strides


@pytest.mark.parametrize("given", [{}, {"speed": 0.9, "stop_at": 2.0}], ids=["walks", "stops"])
def test_changes_of_springs_are_those_that_every_step_reports(given):
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 7.0} | given)
    biped, ticks, reported = Biped(settings, 2), [], {}
    biped.reset(np.arange(2), [0, 1])
    biped.on_tick = ticks.append
    observation = biped.observe()
    for _ in range(300 if given else 100):
        result = biped.step(policy(observation))
        observation = result.observation
        for source in ("stiffness", "equilibrium"):
            both = [result.info[f"work/{source}/ankle_{side}"] for side in SIDES]
            reported[source] = reported.get(source, 0.0) + sum(both)
    energy = np.stack([tick.work.energy for tick in ticks])
    for source, joules in reported.items():
        assert energy[f"{source}_changes"][..., ANKLE].sum(0) == pytest.approx(joules, rel=1e-9)
        assert np.abs(joules).min() > 0.1


def test_changes_of_a_spring_cost_what_its_deflection_says():
    angle = np.zeros((1, len(SIDES), len(JOINTS)))
    angle[0, 1, ANKLE] = 0.1
    held, control = np.zeros((2, *angle.shape, 2))
    held[0, 1, ANKLE], control[0, 1, ANKLE] = (300.0, 300.0 * 0.3), (400.0, 400.0 * -0.2)
    state = np.zeros((2, 1, 11))
    energy = window_work(
        parts_of(Body()), steps_at_rest(1), control, held, angle, np.zeros(1), (state[0], state[1]), PHYSICS_STEP
    ).energy[0]
    assert energy["stiffness_changes"][ANKLE] == pytest.approx(0.5 * 100 * 0.2**2)
    assert energy["equilibrium_changes"][ANKLE] == pytest.approx(0.5 * 400 * (0.3**2 - 0.2**2))
    assert energy["stiffness_changes"].sum() == energy["stiffness_changes"][ANKLE]


def test_a_push_works_by_force_times_way():
    rates = steps_at_rest(1)
    rates.velocity[..., 0] = rates.before[..., 0] = 1.5
    nothing, state = np.zeros((1, len(SIDES), len(JOINTS), 2)), np.zeros((2, 1, 11))
    state[1, 0, 0] = 1.5
    energy = window_work(
        parts_of(Body()), rates, nothing, nothing, nothing[..., 0], np.array([40.0]), (state[0], state[1]), PHYSICS_STEP
    ).energy[0]
    assert energy["pushes"] == pytest.approx(40.0 * 1.5 * 0.01)
    assert energy["mechanical"] == pytest.approx(0.5 * 63.0 * 1.5**2 + potential(Body()), rel=1e-12)


def potential(body):
    """Of a body upright with the hip at 0 [J]."""
    model = build_model(body)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model.body_subtreemass[model.body("trunk").id] * GRAVITY * data.subtree_com[model.body("trunk").id, 2]


def test_watching_changes_no_bit_and_who_stands_still_does_nothing():
    policy, settings = policy_and_settings("schedule", {"episode_seconds": 3.0})
    runs = []
    for watched in (False, True):
        biped, ticks = Biped(settings, 3), []
        biped.reset(np.arange(3), [0, 1, 2])
        biped.on_tick = ticks.append if watched else None
        observation, active = biped.observe(), np.ones(3, bool)
        for step in range(40):
            active[1] = step == 0
            observation = biped.step(policy(observation), active=active).observation
        runs.append(biped.observe())
        for tick in ticks[2:]:
            still = tick.work.energy[1]
            assert all(not still[name].any() for name in LEDGER.names or () if name != "mechanical")
            assert not tick.work.torque[1].any() and tick.work.torque[0].any()
    np.testing.assert_array_equal(*runs)
