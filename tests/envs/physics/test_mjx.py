"""Ready for the GPU: the compiled model in MJX (extra `mjx`) walks as in C MuJoCo. Runs on the CPU."""

import mujoco
import numpy as np
import pytest

from benchmarks.walking import Physics, record_walk
from springfoot.envs.physics.model import build_spec
from springfoot.envs.physics.timing import WINDOWS_PER_ACTION_STEP
from springfoot.gait.body.body import Body

jax = pytest.importorskip("jax", reason="needs the extra mjx")
mjx = pytest.importorskip("mujoco.mjx", reason="needs the extra mjx")
STEPS = 60


@pytest.fixture
def double_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.mark.usefixtures("double_precision")
def test_mjx_walks_as_c_mujoco_does():
    spec = build_spec(Body())
    for sensor in list(spec.sensors):  # MJX 3.17 has no net force of contact sensors; they read, and move nothing
        spec.delete(sensor)
    model = spec.compile()
    walk = record_walk(1, 20)
    physics = Physics(model, 1)
    (data,) = physics.bodies
    first = 9  # from here on a heel strikes, which is the hard part
    physics.place(walk, first)
    started = mjx.make_data(model)
    here = started.replace(qpos=jax.numpy.array(data.qpos), qvel=jax.numpy.array(data.qvel))
    there, step, contacts, apart = mjx.put_model(model), jax.jit(mjx.step), set(), 0.0
    windows = walk.controls[first:].reshape(-1, model.nu)
    for index in range(STEPS):
        data.ctrl[:] = windows[index // physics.substeps]
        mujoco.mj_step(model, data)
        here = step(there, here.replace(ctrl=jax.numpy.array(data.ctrl)))
        contacts.add(int(data.ncon))
        for mine, theirs in ((data.qpos, here.qpos), (data.qvel, here.qvel)):
            apart = max(apart, float(np.abs(mine - np.asarray(theirs)).max()))
    assert len(contacts) > 1 and WINDOWS_PER_ACTION_STEP * physics.substeps * (len(walk.actions) - first) >= STEPS
    assert apart < 1e-6
