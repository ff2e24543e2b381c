"""Measure the effect of a step of stiffness, in one joint and phase of the stride: at fixed states, and on walks.

K becomes K (1 + change) and theta_eq stays, so that the spring's torque tau becomes tau (1 + change). Walks are paired:
copies from one seed are the same to the last bit until their first change, and differ by that change alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import ceil

import mujoco
import numpy as np

from springfoot.agents.policies import PolicyFunction, leg_phase
from springfoot.arrays import NDArray
from springfoot.envs.batch import Biped, Tick
from springfoot.envs.control import FEET, PLATEAUS, TOE_OFF, stiffness_ranges
from springfoot.envs.physics import JOINTS, LEFT, RIGHT, SIDES
from springfoot.envs.settings import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers import foot_contacts
from springfoot.evaluation.recording import TICK, WARM_UP, Episodes, recorded_steps
from springfoot.gait.body import Body
from springfoot.gait.people import (
    LOADING_END_PERCENT,
    PUSH_OFF_BEGIN_PERCENT,
    Contacts,
    find_steps,
    on_percent,
    sample,
)
from springfoot.gait.springs import SPRINGS

_EDGES = (0.0, LOADING_END_PERCENT / 100, PLATEAUS[4], PUSH_OFF_BEGIN_PERCENT / 100, 0.5, TOE_OFF[0], 1.0)
_NAMES = ("loading", "early mid-stance", "late mid-stance", "heel-off", "push-off", "swing")
PHASES = dict(zip(_NAMES, pairwise(_EDGES), strict=True))
"""Begin and end of each phase of a leg's stride: the four of docs/reference/metrics.md, cut further where the
schedule's late stance begins, where the other foot lands, and at the schedule's toe-off."""
CELLS = tuple(product(range(len(SPRINGS)), PHASES))
"""Cells in which stiffness changes: joint (0 ankle, 1 toe) and phase; C = 12."""
DURATIONS = ("one stride", "every stride")
"""Duration of the change: the left leg's first stride alone, or all strides of both legs from then on."""
SLOWEST_STRIDE = 2.5
"""Longest mean stride for which a walk has time to complete its strides [s]."""
PAIRED_SERIES = ("com", "com_velocity", "ankle", "force", "phase")
"""Series that are recorded: all of them, of 25 walks for each seed, would fill the memory."""
PHASE_LAG = 0.1
"""Longest time between a foot's first load and the new start of its leg's phase [s]."""
FIXED = ("torque_Nm", "forward_m_s2", "upward_m_s2", "forward_m_s", "upward_m_s")
"""Quantities at the unchanged walk's states, means of both legs: change of torque (plantarflexion positive) and of the
CoM's acceleration, averaged over the phase; and the integral of that acceleration over one leg's phase."""
MOVEMENT = ("speed_m_s", "step_length_m", "com_ahead_m", "com_height_m")
"""Quantities of each stride: mean speed of the CoM; mean length of the steps that begin in it; forward position of the
CoM when the unchanged walk's mean stride ends; mean height of the CoM."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PairedWalks:
    """S walks with and without each of C changes, K strides each."""

    fixed: NDArray
    """(C, S, len(FIXED)) effects at the states of the unchanged walk's first stride."""
    velocity: NDArray
    """(C, S) change of the CoM's forward velocity [m/s] at the end of the phase of a single change."""
    movement: NDArray
    """(C, len(DURATIONS), S, K, len(MOVEMENT)) difference from the unchanged walk; NaN for unfinished walks, which fell
    or were too slow for K strides."""
    unchanged: NDArray
    """(S, K, len(MOVEMENT)) the unchanged walk; NaN, like all results of that seed, where it is unfinished."""
    cut: NDArray
    """(C,) fraction of the changes that the range of the actions cuts short."""

    @property
    def unfinished(self) -> NDArray:
        """Return (C, len(DURATIONS)) the number of unfinished walks with a change beside a finished unchanged walk.

        C are the cells: joint and phase of the change.
        """
        finished = np.isfinite(self.unchanged).all(axis=(1, 2))
        return (np.isnan(self.movement).any(axis=(3, 4)) & finished).sum(axis=2)


def action_step(settings: BipedSettings, body: Body, change: float) -> NDArray:
    """Return (2,) the change of ankle and toe actions that multiplies stiffness by 1 + `change`.

    K = K_schedule e^a in residual mode; else a = -1 to 1 is the range of K on a log scale.
    """
    if settings.action_mode == "residual":
        return np.full(len(SPRINGS), np.log1p(change))
    low, high = stiffness_ranges(settings, body)
    return 2.0 * np.log1p(change) / np.log(high / low)


def step_at(model: mujoco.MjModel, data: mujoco.MjData, change: float) -> tuple[NDArray, NDArray]:
    """Return the effect at the state of `data` of changing one spring's K to K (1 + `change`), its rest angle kept.

    Each spring changes by itself; contacts respond by MuJoCo's solver. Returns the change of the spring's torque (side,
    (ankle, toe)) [N m], dorsiflexion positive, and of the CoM's acceleration (side, (ankle, toe), (forward, up))
    [m/s^2]. Leaves `data` after `mj_forward`, with its own control.
    """
    control = data.ctrl.reshape(len(SIDES), len(JOINTS), 2)[:, FEET]  # a view: K and K theta_eq of each spring
    first_joint = model.nv - len(SIDES) * len(JOINTS)  # after the degrees of freedom of the base
    warm_start = data.qacc_warmstart.copy()
    jacobian = np.zeros((3, model.nv))

    def forward() -> tuple[NDArray, NDArray]:
        """Return the torques of the springs (side, (ankle, toe)) and the accelerations (nv,) under `control`."""
        data.qacc_warmstart[:] = warm_start  # so that the same control gives the same bits
        mujoco.mj_forward(model, data)
        return data.qfrc_actuator[first_joint:].reshape(len(SIDES), len(JOINTS))[:, FEET].copy(), data.qacc.copy()

    torque, acceleration = forward()
    mujoco.mj_jacSubtreeCom(model, data, jacobian, model.body("trunk").id)
    torque_changes = np.zeros((len(SIDES), len(SPRINGS)))
    com_changes = np.zeros((len(SIDES), len(SPRINGS), 2))
    for spring in np.ndindex(*torque_changes.shape):
        unchanged = control[spring].copy()
        control[spring] *= 1.0 + change
        changed_torque, changed_acceleration = forward()
        torque_changes[spring] = (changed_torque - torque)[spring]
        com_changes[spring] = (jacobian @ (changed_acceleration - acceleration))[[0, 2]]  # x, z
        control[spring] = unchanged
    forward()
    return torque_changes, com_changes


def paired_walks(
    policy: PolicyFunction,
    settings: BipedSettings,
    change: float,
    seeds: Sequence[int],
    *,
    strides: int = 20,
    threads: int = 2,
    progress: Callable[[float], object] = lambda seconds: None,
) -> PairedWalks:
    """Walk without and with the change in each of `CELLS`, from the same start for each seed.

    Args:
        policy, settings: from `springfoot.evaluation.recording.policies.policy_and_settings`.
        change: change of K, as a fraction of it: 0.1 for 10 % more.
        seeds: S seeds; each draws the phase at which its walks start.
        strides: number K of strides, from the left foot's first heel strike after `WARM_UP` on.
        threads: threads of the physics; any number gives the same bits.
        progress: called with the simulated time [s] of all walks together after every step.

    Raises `SpringfootError` if fewer than two unchanged walks stay up.
    """
    # One batch: S unchanged walks, then S walks for each cell and duration.
    num = len(seeds)
    copies = 1 + len(CELLS) * len(DURATIONS)
    biped = Biped(settings, copies * num, threads)
    biped.reset(np.arange(copies * num), list(seeds) * copies)
    changes = _Changes(action_step(settings, biped.body, change), num)
    samples = _Samples(biped, change, num)
    previous_phase = np.zeros((copies * num, len(SIDES)))
    stride = np.full(copies * num, -1)  # of the left foot; 0 begins at its first heel strike after the warm-up
    changed, cut = np.zeros((2, copies), int)  # changed actions, and those that the range of the actions cuts
    steps = 0

    def act(observation: NDArray) -> NDArray:
        """Return the policy's actions with the changes added.

        Count strides, and for each copy of the walks the changed actions and those beyond ±1, where the environment
        cuts them.
        """
        phase = leg_phase(observation)
        if steps * biped.dt >= WARM_UP:
            stride[:] += phase[:, LEFT] < previous_phase[:, LEFT]
        previous_phase[:] = phase
        samples.stride = stride[:num]  # of the unchanged walks, the first ones, in this step's ticks
        added = changes.added(phase, stride)
        action = policy(observation) + added
        changed[:] += (added != 0.0).reshape(copies, -1).sum(1)
        cut[:] += ((added != 0.0) & (np.abs(action) > 1.0)).reshape(copies, -1).sum(1)
        return action

    stood = np.ones(copies * num, bool)
    longest = ceil((WARM_UP + SLOWEST_STRIDE * (strides + 1)) / biped.dt)
    kept = Episodes.empty(copies * num, longest * biped.windows_per_step, PAIRED_SERIES)
    for active, result in recorded_steps(biped, act, kept, steps=longest, on_tick=samples.take):
        steps += 1
        stood = active & ~result.terminated
        progress(float(stood.sum()) * biped.dt)
        if not (stride[stood] <= strides).any():
            break
    stood &= stride > strides
    if stood[:num].sum() < 2:
        raise SpringfootError(
            f"of {num} unchanged walks fewer than two stay up: changed walks have nothing to be compared with"
        )
    changed, cut = (of_copies[1:].reshape(len(CELLS), -1).sum(1) for of_copies in (changed, cut))
    return _paired(kept, samples, biped.body, strides, stood, cut / np.maximum(changed, 1))


class _Changes:
    """Changes of the actions in each of N walks: none in the first S, then S walks for each cell and duration.

    Args:
        step: (2,) change of ankle and toe actions that changes K as wanted (`action_step`).
        num: number S of seeds.
    """

    def __init__(self, step: NDArray, num: int):
        # A row for each copy of the walks: change of ankle and toe, begin and end of the phase, whether it lasts.
        rows = [(np.zeros(len(SPRINGS)), (0.0, 0.0), False)]
        for (joint, name), duration in product(CELLS, DURATIONS):
            rows.append((step * (np.arange(len(SPRINGS)) == joint), PHASES[name], duration == "every stride"))
        steps, edges, self._lasts = (
            np.repeat(column, num, axis=0) for column in map(np.array, zip(*rows, strict=True))
        )
        self._step = steps[:, None]  # (N, 1, 2), for both sides
        self._begin, self._end = edges.T[..., None]  # (N, 1) each

    def added(self, phase: NDArray, stride: NDArray) -> NDArray:
        """Return the changes (N, 4) of the actions at `phase` (N, side), in the left foot's `stride` (N,), 0 the first.

        A change of one stride is made in the left leg alone, a lasting one in both.
        """
        left = (stride == 0) | (self._lasts & (stride > 0))
        due = np.stack([left, left & self._lasts], -1)  # (N, side)
        return ((due & (phase >= self._begin) & (phase < self._end))[..., None] * self._step).reshape(len(phase), -1)


class _Samples:
    """Samples of the effects that the changes have at the states of the S unchanged walks, at every tick of 10 ms."""

    def __init__(self, biped: Biped, change: float, num: int):
        self.stride = np.full(num, -1)
        """(S,) stride of each unchanged walk, set before each step; 0 is the first."""
        self.strides: list[NDArray] = []
        """The same at every tick so far."""
        self.sums = np.zeros((len(CELLS), num, 4))
        """(C, S, 4) number of samples; their sums of torque [N m] and acceleration (x, z) [m/s^2]."""
        self._biped = biped
        self._change = change

    def take(self, tick: Tick) -> None:
        """Keep the tick's strides; in an unchanged walk's first stride, also sample the effect of each change."""
        self.strides.append(self.stride.copy())
        for index in np.flatnonzero(self.stride == 0).tolist():
            self._sample(index, tick.phase[index])

    def _sample(self, index: int, phase: NDArray) -> None:
        """Add the effect of each change at the present state of an unchanged walk, for each leg with a `phase`
        (side,) in that of the change."""
        torque, acceleration = step_at(self._biped.model, self._biped.data(index), self._change)
        for cell, (joint, name) in enumerate(CELLS):
            begin, end = PHASES[name]
            for side in np.flatnonzero((phase >= begin) & (phase < end)):
                self.sums[cell, index] += 1.0, -torque[side, joint], *acceleration[side, joint]


def _paired(
    kept: Episodes, samples: _Samples, body: Body, strides: int, finished: NDArray, cut: NDArray
) -> PairedWalks:
    """Return the differences of each changed walk from the unchanged walk of its seed.

    `kept` are the N walks, the unchanged ones first, `strides` is the number of strides, `finished` (N,) True for walks
    that completed them, `cut` as in `PairedWalks`.
    """
    stride = np.stack(samples.strides)  # (T, S)
    num = stride.shape[1]
    # Movement of each walk; the unchanged ones come first, and their mean strides are the clock of all.
    movement = np.full((len(finished), strides, len(MOVEMENT)), np.nan)
    clocks = np.zeros((num, strides))
    for index in np.flatnonzero(finished).tolist():
        seed = index % num
        first_stride = TICK * np.argmax(stride[:, seed] == 0)
        series = kept.episode(index)
        contacts = foot_contacts(series["force"][..., 1].sum(2), body)
        landed = contacts[LEFT].heel_strikes
        landed = landed[landed > first_stride - PHASE_LAG][: strides + 1]
        if len(landed) <= strides:
            continue
        if index == seed:
            clocks[seed] = np.linspace(landed[0], landed[-1], strides + 1)[1:]
        movement[index] = _movement(series["com"], series["ankle"][..., 0], contacts, landed, clocks[seed])
    movement = movement.reshape(-1, num, *movement.shape[1:])  # (copies, S, K, len(MOVEMENT))
    # Velocity of all copies of a seed when each phase of its unchanged first stride ends.
    phase = kept.series["phase"][:num, : len(stride), LEFT]  # (S, T)
    ends = np.stack([_phase_ends(*of_seed) for of_seed in zip(phase, stride.T, strict=True)])  # (S, phases)
    velocity = kept.series["com_velocity"][..., 0].reshape(-1, num, kept.length).astype(float)  # (copies, S, length)
    at_ends = np.take_along_axis(velocity, ends[None], 2)  # (copies, S, phases)
    # Copy 0 is unchanged, copy 1 + len(DURATIONS) x cell + duration has that change.
    one_stride = 1 + np.arange(len(CELLS)) * len(DURATIONS)  # copy with each cell's change of one stride
    phase_index = [list(PHASES).index(name) for _, name in CELLS]
    complete = np.isfinite(movement[0]).all((1, 2))  # seeds with a finished unchanged walk, a step in each stride
    # Means over the samples, and the acceleration's integral over the phase of one leg.
    counts, sums = np.split(samples.sums, [1], axis=-1)
    mean = sums / np.where(complete[:, None], counts, np.nan)
    return PairedWalks(
        fixed=np.concatenate([mean, mean[..., 1:] * counts * TICK / len(SIDES)], -1),
        velocity=np.where(complete, at_ends[one_stride, :, phase_index] - at_ends[0, :, phase_index], np.nan),
        movement=(movement[1:] - movement[0]).reshape(len(CELLS), len(DURATIONS), *movement.shape[1:]),
        unchanged=movement[0],
        cut=cut,
    )


def _phase_ends(phase: NDArray, stride: NDArray) -> list[int]:
    """Return the last tick of each of `PHASES` in a leg's first stride.

    At T ticks, `phase` (T,) is that of the leg in [0, 1), `stride` (T,) the number of its stride, 0 the first.
    """
    first = int(np.argmax(stride == 0))  # tick at which the first stride begins
    phase_or_end = np.where(stride[first:] == 0, phase[first:], 1.0)  # 1 from its end on
    return [first + int(np.argmax(phase_or_end >= end)) - 1 for _, end in PHASES.values()]


def _movement(com: NDArray, ankle: NDArray, contacts: list[Contacts], landed: NDArray, clock: NDArray) -> NDArray:
    """Return the quantities of `MOVEMENT` in each stride, (K, len(MOVEMENT)), of one walk.

    Over T ticks and K strides, `com` (T, (x, z)) are positions and `ankle` (T, side) forward ones [m], `landed`
    (K + 1,) the left foot's heel strikes [s], and `clock` (K,) the ends of the unchanged walk's mean strides [s].
    """
    com_at_strikes = sample(com[:, 0], landed, TICK, TICK)
    speed = np.diff(com_at_strikes) / np.diff(landed)
    times, side = find_steps(contacts[LEFT], contacts[RIGHT], landed[0])
    # A step goes from one ankle at its beginning to the other ankle at its end, both between ticks: rounded to a tick,
    # as an evaluation reads a mean step, they are off by as much as a change of stiffness moves them.
    ankles = sample(ankle, times, TICK, TICK)  # (steps, (begin, end), side)
    length = np.take_along_axis(ankles[:, 1], 1 - side[:, None], 1) - np.take_along_axis(ankles[:, 0], side[:, None], 1)
    stride = np.searchsorted(landed, times[:, 0], side="right") - 1
    # Sum and number of the steps that begin in each stride.
    total, count = (np.bincount(stride, weights, len(landed))[: len(clock)] for weights in (length[:, 0], None))
    with np.errstate(invalid="ignore"):  # a stride without a whole step has NaN
        step_length = total / count
    height = on_percent(com[:, 1], landed[:-1], landed[1:], TICK, TICK).mean(1)
    ahead = sample(com[:, 0], clock, TICK, TICK)
    return np.stack([speed, step_length, ahead, height], -1)
