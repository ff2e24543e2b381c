"""Which physics settings leave the walk unchanged, and what each costs: the table of docs/physics.md.

    python -m benchmarks.physics
    python -m benchmarks.physics --policies schedule --episodes 4

Every row walks the same policies from the same seeds under settings that differ in what the row says. The walk is
held against that of the finest timestep; cost is `mj_step` alone over a control window, on recorded walking states.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
import tyro
from numpy.typing import NDArray
from tqdm import tqdm

from springfoot.agents.baselines import PolicyFunction
from springfoot.agents.command_line import exit_code
from springfoot.envs.physics.model import build_model
from springfoot.envs.settings import BipedSettings, body_of
from springfoot.envs.timing import CONTROL_WINDOW, PHYSICS_STEP, WINDOWS_PER_STEP
from springfoot.evaluation.metrics import Gait, measure
from springfoot.evaluation.recording import prepare, record
from springfoot.gait.body import Body
from springfoot.gait.errors import require_count

from .timing import load, machine
from .walking import Physics, Walk, record_walk

COLUMNS = ("thigh_flexion_deg", "knee_flexion_deg", "ankle_dorsiflexion_deg")
"""Mean curves that are held against the reference's."""
BODIES = 16
"""Walking bodies whose physics is timed."""

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


_SOLVER, _INTEGRATOR, _DISABLE = mujoco.mjtSolver, mujoco.mjtIntegrator, mujoco.mjtDisableBit
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
    "integrator RK4": _option(integrator=int(_INTEGRATOR.mjINT_RK4)),
    "mid-phase collision": _flag(_DISABLE.mjDSBL_MIDPHASE, False),
    "no joint stops": _flag(_DISABLE.mjDSBL_LIMIT, True),
    "no force sensors": _flag(_DISABLE.mjDSBL_SENSOR, True),
}
"""What a row changes of the default model; the first one is the reference. 4 ms does not divide a control window."""


def edited(edit: Edit, body: Body | None = None) -> mujoco.MjModel:
    """The default model with one change."""
    model = build_model(body or Body())
    edit(model)
    return model


def costs(models: list[mujoco.MjModel], walk: Walk, rounds: int) -> NDArray:
    """CPU time [us] per body of `mj_step` over one control window, all models in turn: (models, rounds x steps)."""
    physics = [Physics(model, walk.actions.shape[1]) for model in models]
    spent = np.empty((len(models), rounds + 1, len(walk.actions)))
    for round_ in range(rounds + 1):
        for step in range(len(walk.actions)):
            for index, each in enumerate(physics):
                each.place(walk, step)
                spent[index, round_, step] = each.step(walk, step)
    return 1e6 * spent[:, 1:].reshape(len(models), -1) / (WINDOWS_PER_STEP * walk.actions.shape[1])


def walked(policy: PolicyFunction, settings: BipedSettings, model: mujoco.MjModel, episodes: int, threads: int) -> Gait:
    """The gait of a policy on a model."""
    return measure(record(policy, settings, name="physics", episodes=episodes, threads=threads, model=model))


def row(gait: Gait, reference: Gait) -> list[str]:
    """One row's cells after its name and cost."""
    m = gait.metrics
    angles = [_rms(gait, reference, name) for name in COLUMNS]
    force = _rms(gait, reference, "grf_vertical_bw")
    joints = [m["joints"][joint]["rmse_deg"] for joint in ("thigh", "knee", "ankle")]
    peaks = [m["grf"][f"vertical_peak{peak}_bw"] for peak in (1, 2)]
    return [
        f"{m['falls']} of {m['episodes']}",
        _text([m["speed_m_s"]["mean"]], ".3f"),
        _text(joints, ".2f"),
        _text(peaks, ".2f"),
        _text(angles, ".2f"),
        _text([force], ".3f"),
    ]


HEAD = (
    "settings",
    "cost µs",
    "of the default",
    "falls",
    "speed m/s",
    "RMSE to people thigh / knee / ankle °",
    "peaks 1 / 2 BW",
    "angles apart thigh / knee / ankle °",
    "force apart BW",
)


def _rms(gait: Gait, reference: Gait, name: str) -> float | None:
    apart = gait.both.mean(name) - reference.both.mean(name)
    value = float(np.sqrt(np.square(apart).mean()))
    return value if np.isfinite(value) else None


def _text(values: list[float | None], pattern: str) -> str:
    return " / ".join("–" if value is None else format(value, pattern) for value in values)


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Walk the same policies under other physics settings; prints markdown tables."""

    policies: Annotated[tuple[str, ...], tyro.conf.arg(metavar="POLICY ...")] = ("schedule", "pretrained")
    """Any policies of evaluate.py."""
    episodes: int = 16
    """Episodes of each row, seeded 0, 1, …"""
    seconds: float = 12.0
    """Length of each."""
    rounds: int = 5
    """Times the walk is repeated to measure cost."""
    threads: int = 2
    """Threads of the walks; costs are measured on one."""


def run(flags: Flags) -> None:
    """Measure the costs, walk every row, print."""
    for name in ("episodes", "rounds", "threads"):
        require_count(name, getattr(flags, name))
    prepared = {name: prepare(name, {"episode_seconds": flags.seconds}) for name in flags.policies}
    models = [edited(edit) for edit in ROWS.values()]
    about = machine()
    print(f"{about['processor']}, load {load():.2f}, MuJoCo {about['versions']['mujoco']}")
    spent = costs(models, record_walk(BODIES, 50), flags.rounds)
    default = spent[list(ROWS).index(DEFAULT)]
    for policy_name, (policy, settings) in prepared.items():
        lines = [list(HEAD), ["---"] * len(HEAD)]
        body, reference = body_of(settings), None
        rows = tqdm(ROWS.items(), desc=policy_name, leave=False, disable=None)
        for (name, edit), cost in zip(rows, spent, strict=True):
            gait = walked(policy, settings, edited(edit, body), flags.episodes, flags.threads)
            reference = reference or gait
            price = [f"{np.median(cost):.1f}", f"{np.median(cost / default):.2f}"]
            lines.append([name, *price, *row(gait, reference)])
        print(f"\n`{policy_name}`, {flags.episodes} episodes x {flags.seconds:g} s\n")
        print("\n".join("| " + " | ".join(cells) + " |" for cells in lines))


def main() -> int:
    """Exit code: 0 done, 2 bad input, 130 ended by Ctrl-C."""
    flags = tyro.cli(Flags, prog="benchmarks.physics")
    return exit_code("physics", lambda: run(flags))


if __name__ == "__main__":
    sys.exit(main())
