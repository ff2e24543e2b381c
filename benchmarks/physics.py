"""Which physics settings and joint constants leave the walk unchanged: the tables of docs/results/cost.md.

    python -m benchmarks.physics
    python -m benchmarks.physics --policies schedule --episodes 4
    python -m benchmarks.physics --vary joints
    python -m benchmarks.physics --vary stairs

Every row walks the same policies from the same seeds, and differs from the default as the row says. The walk is
held against that of the first row: with `--vary settings` the finest timestep, with `--vary joints` the default. The
cost of a physics setting is that of `mj_step` alone over a control window, on recorded walking states.
"""

import sys
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Annotated, Literal

import mujoco
import numpy as np
import tyro
from numpy.typing import NDArray
from tqdm import tqdm

from springfoot.agents.policies.baselines import PolicyFunction
from springfoot.command_line import exit_code
from springfoot.envs.physics.timing import WINDOWS_PER_ACTION_STEP
from springfoot.envs.settings.settings import BipedSettings, body_of
from springfoot.errors import require_count
from springfoot.evaluation.numbers.metrics import Gait, measure
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record

from .physics_changes import DEFAULT, JOINT_ROWS, ROWS, edited, joint_constant, without_stairs
from .timing import load, machine
from .walking import Physics, Walk, record_walk

COLUMNS = ("thigh_flexion_deg", "knee_flexion_deg", "ankle_dorsiflexion_deg")
"""Mean curves that are held against the reference's."""
BODIES = 16
"""Walking bodies with timed physics."""


def costs(models: list[mujoco.MjModel], walk: Walk, rounds: int) -> NDArray:
    """Return the CPU time [us] per body of `mj_step` over a control window, in turn: (models, rounds x steps)."""
    physics = [Physics(model, walk.actions.shape[1]) for model in models]
    spent = np.empty((len(models), rounds + 1, len(walk.actions)))
    for round_ in range(rounds + 1):
        for step in range(len(walk.actions)):
            for index, each in enumerate(physics):
                each.place(walk, step)
                spent[index, round_, step] = each.step(walk, step)
    return 1e6 * spent[:, 1:].reshape(len(models), -1) / (WINDOWS_PER_ACTION_STEP * walk.actions.shape[1])


def walked(
    policy: PolicyFunction, settings: BipedSettings, model: mujoco.MjModel | None, episodes: int, threads: int
) -> Gait:
    """Return the gait of a policy on a model, the default one if None."""
    return measure(record(policy, settings, name="physics", episodes=episodes, threads=threads, model=model))


def row(gait: Gait, reference: Gait) -> list[str]:
    """Return one row's cells after its name and cost."""
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


COST_HEAD = ("cost µs", "of the default")
HEAD = (
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
    """Walk the same policies with other physics settings or joint constants; prints markdown tables."""

    vary: Literal["settings", "joints", "stairs"] = "settings"
    """Settings of MuJoCo; constants of the joints: damping time beta, torque limit, armature, joint damping; or whether
    rest angles stand still in a control window."""

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
    """Walk every row, and of physics settings measure the costs; print."""
    for name in ("episodes", "rounds", "threads"):
        require_count(name, getattr(flags, name))
    prepared = {name: policy_and_settings(name, {"episode_seconds": flags.seconds}) for name in flags.policies}
    about = machine()
    print(f"{about['processor']}, load {load():.2f}, MuJoCo {about['versions']['mujoco']}")
    vary = {"settings": _vary_settings, "joints": _vary_joints, "stairs": _vary_stairs}
    vary[flags.vary](flags, prepared)


def _vary_settings(flags: Flags, prepared: dict[str, tuple[PolicyFunction, BipedSettings]]) -> None:
    models = [edited(edit) for edit in ROWS.values()]
    spent = costs(models, record_walk(BODIES, 50), flags.rounds)
    default = spent[list(ROWS).index(DEFAULT)]
    for policy_name, (policy, settings) in prepared.items():
        lines = [["settings", *COST_HEAD, *HEAD]]
        reference = None
        rows = tqdm(ROWS.items(), desc=policy_name, leave=False, disable=None)
        for (name, edit), cost in zip(rows, spent, strict=True):
            gait = walked(policy, settings, edited(edit, body_of(settings)), flags.episodes, flags.threads)
            reference = reference or gait
            price = [f"{np.median(cost):.1f}", f"{np.median(cost / default):.2f}"]
            lines.append([name, *price, *row(gait, reference)])
        _print_table(flags, policy_name, lines)


def _vary_joints(flags: Flags, prepared: dict[str, tuple[PolicyFunction, BipedSettings]]) -> None:
    for policy_name, (policy, settings) in prepared.items():
        lines = [["constant", *HEAD]]
        reference = None
        for name, change in tqdm(JOINT_ROWS.items(), desc=policy_name, leave=False, disable=None):
            with joint_constant(*change):
                gait = walked(policy, settings, None, flags.episodes, flags.threads)
            reference = reference or gait
            lines.append([name, *row(gait, reference)])
        _print_table(flags, policy_name, lines)


def _vary_stairs(flags: Flags, prepared: dict[str, tuple[PolicyFunction, BipedSettings]]) -> None:
    for policy_name, (policy, settings) in prepared.items():
        head = ("ankle moment N·m/kg", "ankle work J/kg", "cost of transport")
        lines = [["rest angles", *HEAD, *head]]
        reference = None
        for name, context in (("every 10 ms, the default", nullcontext), ("in every physics step", without_stairs)):
            with context():
                gait = walked(policy, settings, None, flags.episodes, flags.threads)
            reference = reference or gait
            m = gait.metrics
            work = gait.metrics["ankle_work_J_kg"]
            more = ([m["moments"]["ankle"]["peak_Nm_kg"]], [work["positive"], work["negative"]])
            costs_ = _text([m["cost_of_transport"]], ".4f")
            lines.append([name, *row(gait, reference), *(_text(each, ".3f") for each in more), costs_])
        _print_table(flags, policy_name, lines)


def _print_table(flags: Flags, policy: str, lines: list[list[str]]) -> None:
    print(f"\n`{policy}`, {flags.episodes} episodes x {flags.seconds:g} s\n")
    lines.insert(1, ["---"] * len(lines[0]))
    print("\n".join("| " + " | ".join(cells) + " |" for cells in lines))


def main() -> int:
    """Exit code: 0 done, 2 bad input, 130 ended by Ctrl-C."""
    flags = tyro.cli(Flags, prog="benchmarks.physics")
    return exit_code("physics", lambda: run(flags))


if __name__ == "__main__":
    sys.exit(main())
