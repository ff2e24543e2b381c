"""List the changes of the rows of docs/results/cost.md: physics, joint constants, and when rest angles move."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
from numpy.typing import NDArray

from springfoot.envs.physics import model as physics_model
from springfoot.envs.physics.model import JOINTS, build_model
from springfoot.envs.physics.simulation import Simulation
from springfoot.envs.physics.timing import CONTROL_WINDOW, PHYSICS_STEP
from springfoot.gait.body.body import Body

Edit = Callable[[mujoco.MjModel], None]


def _timestep(substeps: int) -> Edit:
    def edit(model: mujoco.MjModel) -> None:
        model.opt.timestep = CONTROL_WINDOW / substeps

    return edit


def _option(**values: int | float) -> Edit:
    def edit(model: mujoco.MjModel) -> None:
        for name, value in values.items():
            setattr(model.opt, name, value)

    return edit


def _flag(bit: mujoco.mjtDisableBit, disabled: bool) -> Edit:
    def edit(model: mujoco.MjModel) -> None:
        flags = model.opt.disableflags
        model.opt.disableflags = flags | int(bit) if disabled else flags & ~int(bit)

    return edit


_SOLVER = mujoco.mjtSolver
_INTEGRATOR = mujoco.mjtIntegrator
_DISABLE = mujoco.mjtDisableBit
DEFAULT = f"**{1e3 * PHYSICS_STEP:g} ms, the default**"
ROWS: dict[str, Edit] = {
    "0.25 ms (reference)": _timestep(40),
    "0.5 ms": _timestep(20),
    "1 ms": _timestep(10),
    DEFAULT: lambda model: None,
    "2.5 ms": _timestep(4),
    "3.3 ms": _timestep(3),
    "5 ms": _timestep(2),
    "search for islands": _flag(_DISABLE.mjDSBL_ISLAND, False),
    "pyramidal cone": _option(cone=int(mujoco.mjtCone.mjCONE_PYRAMIDAL)),
    "solver CG": _option(solver=int(_SOLVER.mjSOL_CG)),
    "solver PGS": _option(solver=int(_SOLVER.mjSOL_PGS)),
    "at most 5 solver iterations": _option(iterations=5),
    "at most 2 solver iterations": _option(iterations=2),
    "solver tolerance 1e-5": _option(tolerance=1e-5),
    "integrator implicit": _option(integrator=int(_INTEGRATOR.mjINT_IMPLICIT)),
    "integrator Euler": _option(integrator=int(_INTEGRATOR.mjINT_EULER)),
    "mid-phase collision": _flag(_DISABLE.mjDSBL_MIDPHASE, False),
    "no joint stops": _flag(_DISABLE.mjDSBL_LIMIT, True),
    "no force sensors": _flag(_DISABLE.mjDSBL_SENSOR, True),
}
"""Changes of the default model, by row; the first row is the reference. 4 ms does not divide a control window."""


LEGS = ("hip", "knee")
FEET = ("ankle", "toe")
JOINT_ROWS: dict[str, tuple[str, tuple[str, ...], float]] = {
    "the default": ("DAMPING_TIME", JOINTS, 1.0),
    **{
        f"{title} x {factor:g}": (constant, joints, factor)
        for title, constant, joints, factors in (
            ("beta of hip and knee", "DAMPING_TIME", LEGS, (0.0, 0.5, 1.5)),
            ("beta of ankle and toe", "DAMPING_TIME", FEET, (0.0, 0.5, 1.5)),
            ("torque limits", "TORQUE_LIMIT", JOINTS, (0.25, 0.5, 1.5)),
            ("armature", "ARMATURE", JOINTS, (0.0, 0.5, 1.5)),
            ("joint damping", "PASSIVE_DAMPING", JOINTS, (0.0, 0.5, 1.5)),
        )
        for factor in factors
    },
}
"""Changes by row: a constant of `envs.physics.model`, the joints, the factor. The leg constants stay those that
were tuned with the default; the first row is the reference."""


@contextmanager
def joint_constant(name: str, joints: tuple[str, ...], factor: float) -> Iterator[None]:
    """Within the context a constant of `envs.physics.model` is `factor` times itself at `joints`."""
    default = getattr(physics_model, name)
    changed = tuple(value * (factor if joint in joints else 1.0) for joint, value in zip(JOINTS, default, strict=True))
    setattr(physics_model, name, changed)
    try:
        yield
    finally:
        setattr(physics_model, name, default)


@contextmanager
def without_stairs() -> Iterator[None]:
    """Within the context K theta_eq moves in every physics step, straight on at its last rate, in place of every 10 ms.

    Its mean over a control window stays, so that nothing comes earlier or later.
    """
    roll = Simulation._roll
    last = "_rest_before"

    def smooth(self: Simulation, ids: NDArray | None, out: dict[str, NDArray]) -> None:
        k, drive = np.moveaxis(self._control, -1, 0)
        rest = drive / np.maximum(k, 1e-9)
        ramp = k * (rest - getattr(self, last, rest))
        setattr(self, last, rest)
        place = (np.arange(self._substeps) + 0.5) / self._substeps - 0.5
        control = np.repeat(self._control[:, None], self._substeps, 1)
        control[..., 1] += ramp[:, None] * place[:, None, None]
        control = control.reshape(self.num, self._substeps, -1)
        who = slice(None) if ids is None else ids
        if len(control[who]):
            options = {"control": control[who], "control_spec": int(mujoco.mjtState.mjSTATE_CTRL), "ids": ids}
            found = self._batch.rollout(self._substeps, record=list(out), **options)
        for name, values in out.items():
            values[:] = 0.0
            values[who] = found[name] if len(control[who]) else 0.0

    Simulation._roll = smooth
    try:
        yield
    finally:
        Simulation._roll = roll


def edited(edit: Edit, body: Body | None = None) -> mujoco.MjModel:
    """Return the default model with one change."""
    model = build_model(body or Body())
    edit(model)
    return model
