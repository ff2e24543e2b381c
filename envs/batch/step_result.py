"""Define the result of one step of the batch, and the record of each of its control windows for evaluations."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from springfoot.arrays import NDArray

from ..control.stiffness_control import muscle_stiffness
from ..physics.energy import WindowWork
from ..physics.kernel import part
from ..physics.measurement import Measurement
from ..physics.model import ACTIONS, ANKLE, SIDES
from ..task.episode_end import TERMINATIONS
from ..task.reward import TERMS

REPORT = np.dtype(
    [
        ("stiffness", float, (len(SIDES), 2)),
        ("torque", float, (len(SIDES), 2)),
        ("equilibrium", float, (len(SIDES), 2)),
        ("work_stiffness", float, (len(SIDES), 2)),
        ("work_equilibrium", float, (len(SIDES), 2)),
        ("controlled", float, (len(SIDES), 2)),
        ("reward", float, len(TERMS)),
        ("phase", float, len(SIDES)),
        ("time", float),
        ("speed", float),
    ]
)
"""The numbers reported of one body's step besides observation and reward, as `INFO` names and explains them."""
INFO = (
    *(
        f"{name}/{action}"
        for name in ("stiffness", "torque", "equilibrium", "work/stiffness", "work/equilibrium", "controlled")
        for action in ACTIONS
    ),
    *(f"reward/{term}" for term in TERMS),
    *(f"phase/{side}" for side in SIDES),
    "time",
    "speed",
)
"""Names of the numbers of `REPORT`, in order.

Of each action: `stiffness/` [N m/rad], muscles and a device in their place together, `torque/` [N m] and `equilibrium/`
[rad] at the step's end; `work/stiffness/` and `work/equilibrium/` [J] of the step; `controlled/`, 1 where the action
counts and 0 where it is read as 0. Of each reward term: `reward/`, unweighted. Of each leg: `phase/` [0, 1). `time`
[s], `speed` [m/s].
"""


@part
def report(rows, controls, bodies, terms, options, values) -> None:
    """Fill `StepResult.values` of one step.

    Args:
        rows: (N,) of `TASK_ROW`; `steps` count this one.
        controls: (N,) of `CONTROL_ROW`.
        bodies: (N,) of `BODY_ROW`, as measured at the step's end.
        terms: (N, len(TERMS)) reward terms, unweighted [-].
        options: (1,) of `TASK_OPTIONS`.
        values: (N, len(INFO)).
    """
    reports = values.view(REPORT)
    for i in range(len(rows)):
        row = reports[i, 0]  # the record in place of the numbers of row i
        springs = controls[i].springs
        feet = controls[i].feet
        m = bodies[i].measured
        row.time = options[0].seconds * rows[i].steps
        row.speed = m.com_velocity[0]
        for term in range(terms.shape[1]):
            row.reward[term] = terms[i, term]
        for side in range(2):
            row.phase[side] = controls[i].legs.phase[side]
            for joint in range(2):
                row.stiffness[side, joint] = muscle_stiffness(springs, side, joint) + springs.device[side, joint]
                row.torque[side, joint] = m.torque[side, ANKLE + joint]
                row.equilibrium[side, joint] = springs.equilibrium[side, joint]
                row.work_stiffness[side, joint] = springs.work_stiffness[side, joint]
                row.work_equilibrium[side, joint] = springs.work_equilibrium[side, joint]
                # No action counts where others set the stiffness.
                row.controlled[side, joint] = feet.controlled[side, joint] * (1 - controls[i].source.not_action)


@dataclass(kw_only=True, eq=False)
class StepResult:
    """Result of one step; every array has N rows."""

    observation: NDArray
    """(N, D) float32."""
    reward: NDArray
    """(N,)."""
    terminated: NDArray
    """(N,) fallen or diverged."""
    truncated: NDArray
    """(N,) out of time."""
    values: NDArray
    """(N, len(INFO)) in the order of `INFO`."""
    termination: NDArray
    """(N,) int reason of a termination, a code of `TERMINATIONS`, 0 for none; do not write to it."""

    @property
    def info(self) -> dict[str, NDArray]:
        """Name -> (N,): `values` by their names in `INFO`, and `termination`."""
        return dict(zip(INFO, self.values.T, strict=True)) | {"termination": self.termination}

    @property
    def reasons(self) -> NDArray:
        """(N,) `termination` in words."""
        return np.array(TERMINATIONS)[self.termination]


@dataclass(frozen=True, kw_only=True, eq=False)
class Tick:
    """Record of one control window for an evaluation; arrays over N, axes as in `Measurement`."""

    measurement: Measurement
    phase: NDArray
    """(N, side) stride phase of each leg at the window's start."""
    stiffness: NDArray
    """(N, side, joint) K held in the window [N m/rad]."""
    equilibrium: NDArray
    """(N, side, joint) rest angle theta_eq held in the window, feed-forward torque included as torque / K [rad]."""
    work: WindowWork
    """Torque, work and energy over the window's physics steps."""
    fibre_moment: NDArray
    """(N, side, joint) mean moment of the muscles' fibres in the window, extension positive, 0 where none act [N m]."""
    muscle_work: NDArray
    """(N, side, joint, 2) work in the halves of the window of muscles, tissue left out, on the joint [J]."""
    com_reference: NDArray
    """(N, 2) the plan's CoM (x, z) in the world at the window's end [m]."""
    active: NDArray
    """(N,) True for the environments that ran in this window."""


def stiffness_and_rest(control: NDArray, slack: NDArray) -> dict[str, NDArray]:
    """Return the fields `stiffness` and `equilibrium` of a `Tick`, K [N m/rad] and theta_eq [rad] of each joint.

    `control` is (N, side, joint, 2), K [N m/rad] and K theta_eq [N m], `slack` (N, side) 1 for an ankle with slack
    muscles: its K is reported as 0, though its tissue has some. Where K is 0, theta_eq is 0.
    """
    stiffness, drive = np.moveaxis(control, -1, 0)
    stiffness = stiffness.copy()
    stiffness[..., ANKLE][slack == 1] = 0.0
    rest = np.divide(drive, stiffness, out=np.zeros_like(drive), where=stiffness > 0.0)
    return {"stiffness": stiffness, "equilibrium": rest}


class Outcome(NamedTuple):
    """The arrays of a `StepResult` that the kernel `end_step` fills; shapes as there."""

    observation: NDArray
    reward: NDArray
    terminated: NDArray
    truncated: NDArray
    values: NDArray


def empty_outcome(num: int, entries: int) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
    """Return the arrays of an `Outcome`, as a plain tuple, for a step of `num` environments with so many entries of the
    observation; they are not yet filled."""
    return (
        np.empty((num, entries), np.float32),  # observation
        np.empty(num),  # reward
        np.empty(num, bool),  # terminated
        np.empty(num, bool),  # truncated
        np.empty((num, len(INFO))),  # values
    )


def report_start(m: Measurement, leg_phase: NDArray, controlled: NDArray) -> NDArray:
    """Return `StepResult.values` before an episode's first step: `controlled`, phases and speed; all else is 0.

    Args:
        m: the measurement right after the reset.
        leg_phase: (N, side) stride phase of each leg [0, 1).
        controlled: (N, side, 2) True where actions set the stiffness of ankle and toe.
    """
    values = np.zeros((len(leg_phase), len(INFO)))
    rows = values.view(REPORT)[:, 0]  # one record in place of the numbers of each row
    rows["phase"] = leg_phase
    rows["speed"] = m.com_velocity[:, 0]
    rows["controlled"] = controlled
    return values
