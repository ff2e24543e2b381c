"""The batched simulation: its kinematics against MuJoCo's, its springs against the equation, its bits."""

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from springfoot.envs.physics.contact import CONTACTS, geom_name
from springfoot.envs.physics.measurement import Measurement, measure_bodies
from springfoot.envs.physics.model import JOINTS, SIDES, TOE, build_model, damping_times, torque_limits
from springfoot.envs.physics.simulation import Simulation
from springfoot.envs.physics.timing import PHYSICS_STEPS_PER_WINDOW
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import Body

LEGS = (len(SIDES), len(JOINTS))


def advance(simulation: Simulation, stiffness: NDArray, drive: NDArray, ids: NDArray | None = None) -> Measurement:
    control = np.stack(np.broadcast_arrays(np.zeros((simulation.num, *LEGS)), stiffness, drive)[1:], -1)
    simulation.advance(control, ids)
    return measured(simulation)


def measured(simulation: Simulation) -> Measurement:
    measure_bodies(*simulation.arrays)
    return Measurement.of(simulation.arrays.bodies["measured"].copy())


def started(num: int, threads: int = 1, body: Body | None = None) -> tuple[Simulation, np.random.Generator]:
    """Simulations hanging a little above the floor in random postures."""
    simulation, random = Simulation(body or Body(), num, threads), np.random.default_rng(3)
    base = np.stack([random.normal(size=num), np.full(num, 0.93), 0.1 * random.normal(size=num)], -1)
    simulation.reset(
        np.arange(num),
        base,
        random.normal(size=(num, 3)),
        0.2 * random.normal(size=(num, *LEGS)),
        random.normal(size=(num, *LEGS)),
    )
    return simulation, random


@pytest.mark.parametrize(
    ("body", "ground"),
    [
        (Body(), (0.0, 0.0, 0.0)),
        (Body(1.55, 90.0), (0.0, 0.0, 0.0)),
        (Body(1.7, 63.0, 1.06, 0.93, 0.3), (0.0, 0.0, 0.0)),
        (Body(), (0.08, 0.004, -0.003)),
    ],
)
def test_kinematics_agree_with_mujoco(body, ground):
    simulation, random = started(4, body=body)
    simulation.arrays.bodies["ground"] = ground
    m = advance(simulation, random.uniform(5, 300, (4, *LEGS)), random.normal(size=(4, *LEGS)))
    slope = ground[0]

    def from_ground(forward_and_up: NDArray, height: float = 0.0) -> NDArray:
        """Return a place or a velocity with its upward part relative to the ground below."""
        return forward_and_up - [0, slope * forward_and_up[0] + height]

    for index in range(4):
        data = simulation.data(index)
        mujoco.mj_subtreeVel(simulation.model, data)
        np.testing.assert_allclose(m.com[index], from_ground(data.subtree_com[0][[0, 2]]), atol=1e-12)
        np.testing.assert_allclose(m.com_velocity[index], from_ground(data.subtree_linvel[0][[0, 2]]), atol=1e-12)
        np.testing.assert_allclose(m.base[index, :2], from_ground(data.qpos[:2]), atol=1e-12)
        np.testing.assert_allclose(m.base_velocity[index, :2], from_ground(data.qvel[:2]), atol=1e-12)
        for s, side in enumerate(SIDES):
            ankle = from_ground(data.body(f"foot_{side}").xpos[[0, 2]])
            np.testing.assert_allclose(m.ankle[index, s], ankle, atol=1e-12)
            for c, contact in enumerate(CONTACTS):
                geom = simulation.model.geom(geom_name(contact, side)).id
                lowest = data.geom_xpos[geom][[0, 2]] - [0, simulation.model.geom_size[geom, 0]]
                np.testing.assert_allclose(m.contact[index, s, c], from_ground(lowest, ground[1 + s]), atol=1e-12)


def test_joint_torque_is_the_spring_equation_up_to_the_limit():
    simulation, random = started(8)
    body = simulation.body
    stiffness = random.uniform(0, 800, (8, *LEGS))
    rest = 0.3 * random.normal(size=(8, *LEGS))
    m = advance(simulation, stiffness, stiffness * rest)
    spring = stiffness * (rest - m.angle - damping_times(body) * m.velocity)
    limit = torque_limits(body)
    below = np.abs(spring) < limit
    assert below.any()
    assert not below.all()
    for index in range(8):
        torque = simulation.data(index).qfrc_actuator[3:].reshape(LEGS)
        np.testing.assert_allclose(torque[below[index]], spring[index][below[index]], rtol=0, atol=1e-9)
        np.testing.assert_allclose(torque, np.clip(spring[index], -limit, limit), rtol=0, atol=1e-9)
        np.testing.assert_allclose(m.torque[index], torque, rtol=0, atol=1e-9)


@pytest.mark.parametrize("side", range(2))
def test_muscles_without_stiffness_bear_nothing(side):
    simulation, random = started(1)
    stiffness = random.uniform(50, 300, (1, *LEGS))
    stiffness[0, side, TOE] = 0.0
    advance(simulation, stiffness, stiffness * random.normal(size=(1, *LEGS)))
    moment = simulation.arrays.bodies["muscles"]["moment"][0, 0]
    assert moment[side, TOE] == 0.0
    assert np.count_nonzero(moment) == moment.size - 1


def test_force_is_the_mean_over_the_windows_physics_steps():
    simulation, _ = started(1)
    model = simulation.model
    stiffness = np.full((1, *LEGS), 300.0)
    for _ in range(10):
        data = simulation.data(0)
        m = advance(simulation, stiffness, 0 * stiffness)
        # replay the window step by step, from the same state and solver warm start
        again = mujoco.MjData(model)
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        mujoco.mj_setState(model, again, state, kind)
        again.ctrl[::2] = 300.0
        total = np.zeros(model.nsensordata)
        for _ in range(PHYSICS_STEPS_PER_WINDOW):
            mujoco.mj_step(model, again)
            total += again.sensordata
        expected = (total / PHYSICS_STEPS_PER_WINDOW).reshape(2, 3, 3)[..., [0, 2]]
        np.testing.assert_allclose(m.force[0], expected, atol=1e-6)
    assert m.force[..., 1].sum() > 100.0  # the replay met the floor


def test_simulations_left_out_stand_still():
    simulation, _ = started(3)
    before = measured(simulation)
    m = advance(simulation, np.full((3, *LEGS), 100.0), np.zeros((3, *LEGS)), ids=np.array([1]))
    for index in (0, 2):
        np.testing.assert_array_equal(m.angle[index], before.angle[index])
        assert m.time[index] == 0.0
        assert not m.force[index].any()
    assert m.time[1] == pytest.approx(0.01)
    assert not np.array_equal(m.angle[1], before.angle[1])


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_gives_the_bits_of_its_members_alone(threads):
    num = 5
    together, random = started(num, threads)
    start = measured(together)
    alone = []
    for index in range(num):
        single = Simulation(together.body, 1)
        pick = slice(index, index + 1)
        base, rate = start.base[pick], start.base_velocity[pick]
        single.reset(np.arange(1), base, rate, start.angle[pick], start.velocity[pick])
        alone.append(single)
    for _ in range(40):
        stiffness = random.uniform(20, 400, (num, *LEGS))
        drive = 10 * random.normal(size=(num, *LEGS))
        m = advance(together, stiffness, drive)
        for index, single in enumerate(alone):
            one = advance(single, stiffness[index : index + 1], drive[index : index + 1])
            for name in ("com", "com_velocity", "angle", "torque", "force", "contact", "ankle"):
                np.testing.assert_array_equal(getattr(m, name)[index], getattr(one, name)[0], err_msg=name)


def test_divergence_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings to a file in the working directory
    simulation, _ = started(3)
    base, rate = np.zeros((2, 1, 3))
    base[:, 1], rate[:, 0] = 1.0, 1e20
    simulation.reset(np.array([1]), base, rate, np.zeros((1, *LEGS)), np.zeros((1, *LEGS)))
    m = advance(simulation, np.full((3, *LEGS), 100.0), np.zeros((3, *LEGS)))
    assert mujoco.mjtWarning(int(m.diverged[1])).name.startswith("mjWARN_BAD")
    assert m.diverged[0] == m.diverged[2] == -1
    assert all(np.isfinite(getattr(m, name)).all() for name in ("com", "angle", "velocity", "force"))


def test_a_custom_models_own_damping_and_limits_give_the_torques_of_its_joints():
    model = build_model(Body())
    for name in (f"{joint}_{side}" for side in SIDES for joint in JOINTS):
        model.actuator(f"stiffness_{name}").gainprm[2] *= 2.0
        model.jnt_actfrcrange[model.joint(name).id] *= 0.3
    simulation = Simulation(Body(), 1, model=model)
    simulation.reset(
        np.arange(1), np.array([[0.0, 2.0, 0.0]]), np.zeros((1, 3)), np.full((1, *LEGS), 0.2), np.ones((1, *LEGS))
    )
    m = advance(simulation, np.full((1, *LEGS), 400.0), np.full((1, *LEGS), 30.0))
    np.testing.assert_allclose(m.torque[0], simulation.data(0).qfrc_actuator[3:].reshape(LEGS), atol=1e-9)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("timestep", 0.003, "a custom model's timestep must be a whole part of 0.01 s, got 0.003 s"),
        ("timestep", 0.02, "a custom model's timestep must be a whole part of 0.01 s, got 0.02 s"),
        ("integrator", mujoco.mjtIntegrator.mjINT_RK4, "a custom model's integrator must be Euler"),
    ],
)
def test_a_custom_model_with_other_steps_is_refused(option, value, message):
    model = build_model(Body())
    setattr(model.opt, option, value)
    with pytest.raises(SpringfootError, match=message):
        Simulation(Body(), 1, model=model)
