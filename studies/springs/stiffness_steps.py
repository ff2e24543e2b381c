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
from springfoot.envs.batch import Biped, Tick, walked_steps
from springfoot.envs.control import FEET, PLATEAUS, TOE_OFF, stiffness_ranges
from springfoot.envs.physics import JOINTS, LEFT, RIGHT, SIDES
from springfoot.envs.settings import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.numbers import foot_contacts
from springfoot.evaluation.recording import TICK, WARM_UP
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
    """(C, len(DURATIONS), S, K, len(MOVEMENT)) difference from the unchanged walk; NaN for walks that fall."""
    unchanged: NDArray
    """(S, K, len(MOVEMENT)) the unchanged walk; NaN, like all results of that seed, where it falls."""
    cut: NDArray
    """(C,) fraction of the changes that the range of the actions cuts short."""

    @property
    def falls(self) -> NDArray:
        """Return (C, len(DURATIONS)) the number of changed walks that fell although their unchanged walk did not."""
        stood = np.isfinite(self.unchanged).all(axis=(1, 2))
        return (np.isnan(self.movement).any(axis=(3, 4)) & stood).sum(axis=2)


def action_step(settings: BipedSettings, body: Body, change: float) -> NDArray:
    """Return (2,) the change of ankle and toe actions that multiplies stiffness by 1 + `change`."""
    if settings.action_mode == "residual":
        return np.full(len(SPRINGS), np.log1p(change))
    low, high = stiffness_ranges(settings, body)
    return 2.0 * np.log1p(change) / np.log(high / low)


def step_at(model: mujoco.MjModel, data: mujoco.MjData, change: float) -> tuple[NDArray, NDArray]:
    """Compute the effect of K (1 + `change`) in each spring by itself at the state of `data`, its rest angle unchanged.

    Contacts respond as the solver has them respond. Returns the change of torque (side, (ankle, toe)) [N m],
    dorsiflexion positive, and of the CoM's acceleration (side, (ankle, toe), (forward, up)) [m/s^2]. Leaves `data`
    after `mj_forward`.
    """
    control = data.ctrl.reshape(len(SIDES), len(JOINTS), 2)[:, FEET]
    joints = model.nv - len(SIDES) * len(JOINTS)  # those of the base come first
    guess = data.qacc_warmstart.copy()
    jacobian = np.zeros((3, model.nv))

    def forward() -> tuple[NDArray, NDArray]:
        data.qacc_warmstart[:] = guess  # so that no change gives the same bits
        mujoco.mj_forward(model, data)
        return data.qfrc_actuator[joints:].reshape(len(SIDES), len(JOINTS))[:, FEET].copy(), data.qacc.copy()

    torque, acceleration = forward()
    mujoco.mj_jacSubtreeCom(model, data, jacobian, model.body("trunk").id)
    torques = np.zeros((len(SIDES), len(SPRINGS)))
    accelerations = np.zeros((len(SIDES), len(SPRINGS), 2))
    for spring in np.ndindex(*torques.shape):
        kept = control[spring].copy()
        control[spring] *= 1.0 + change  # K and K theta_eq
        changed_torque, changed_acceleration = forward()
        torques[spring] = (changed_torque - torque)[spring]
        accelerations[spring] = (jacobian @ (changed_acceleration - acceleration))[[0, 2]]
        control[spring] = kept
    forward()
    return torques, accelerations


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
        change: of K, as a fraction of it: 0.1 for 10 % more.
        seeds: S of them; each draws the phase at which the walk starts.
        strides: K, from the left foot's first heel strike after `WARM_UP` on.
        threads: of the physics; any number gives the same bits.
        progress: called with the simulated time [s] of all walks together after every step.

    Raises `SpringfootError` if fewer than two unchanged walks stay up.
    """
    num = len(seeds)
    copies = 1 + len(CELLS) * len(DURATIONS)
    biped = Biped(settings, copies * num, threads)
    biped.reset(np.arange(copies * num), list(seeds) * copies)
    changes = _Changes(action_step(settings, biped.body, change), num)
    record = _Record(biped, change, num)
    before = np.zeros((copies * num, len(SIDES)))
    stride = np.full(copies * num, -1)
    asked, cut = np.zeros((2, copies), int)
    steps = 0

    def act(observation: NDArray) -> NDArray:
        phase = leg_phase(observation)
        if steps * biped.dt >= WARM_UP:
            stride[:] += phase[:, LEFT] < before[:, LEFT]
        before[:] = phase
        record.stride = stride[:num]
        added = changes.added(phase, stride)
        action = policy(observation) + added
        asked[:] += (added != 0.0).reshape(copies, -1).sum(1)
        cut[:] += ((added != 0.0) & (np.abs(action) > 1.0)).reshape(copies, -1).sum(1)
        return action

    stood = np.ones(copies * num, bool)
    longest = ceil((WARM_UP + SLOWEST_STRIDE * (strides + 1)) / biped.dt)
    for active, result in walked_steps(biped, act, longest):
        steps += 1
        stood = active & ~result.terminated
        progress(float(stood.sum()) * biped.dt)
        if not (stride[stood] <= strides).any():
            break
    stood &= stride > strides
    if stood[:num].sum() < 2:
        raise SpringfootError(f"of {num} unchanged walks fewer than two stay up: nothing can be held against them")
    asked, cut = (each[1:].reshape(len(CELLS), -1).sum(1) for each in (asked, cut))
    return record.paired(strides, stood, cut / np.maximum(asked, 1))


class _Changes:
    """Changes of action in each walk: none in the first S walks, then S walks for each cell and duration."""

    def __init__(self, step: NDArray, num: int):
        rows = [(np.zeros(len(SPRINGS)), (0.0, 0.0), False)]
        for (joint, name), duration in product(CELLS, DURATIONS):
            rows.append((step * (np.arange(len(SPRINGS)) == joint), PHASES[name], duration == "every stride"))
        own, edges, self._lasts = (np.repeat(each, num, axis=0) for each in map(np.array, zip(*rows, strict=True)))
        self._step = own[:, None]
        self._begin, self._end = edges.T[..., None]

    def added(self, phase: NDArray, stride: NDArray) -> NDArray:
        """Return the changes (N, 4) of the actions at `phase` (N, side) of the left foot's `stride` (N,), 0 the
        first."""
        left = (stride == 0) | (self._lasts & (stride > 0))
        due = np.stack([left, left & self._lasts], -1)
        return ((due & (phase >= self._begin) & (phase < self._end))[..., None] * self._step).reshape(len(phase), -1)


class _Record:
    """Record of the walks at every tick of 10 ms; the first S walks are unchanged."""

    def __init__(self, biped: Biped, change: float, num: int):
        self.stride = np.full(num, -1)
        """(S,) of each unchanged walk, before the next step; 0 is the first."""
        self._biped = biped
        self._change = change
        self._num = num
        self._ticks: list[tuple[NDArray, ...]] = []
        self._samples = np.zeros((len(CELLS), num, 4))  # count; sums of torque [N m], acceleration (x, z) [m/s^2]
        biped.on_tick = self._keep

    def _keep(self, tick: Tick) -> None:
        """Keep positions, forces and phases of a tick, and sample the first stride of unchanged walks."""
        m = tick.measurement
        own = slice(self._num)
        walks = m.com.copy(), m.com_velocity[:, 0].copy(), m.ankle[..., 0].copy(), m.force[..., 1].sum(-1)
        self._ticks.append((*walks, tick.phase[own, LEFT].copy(), self.stride.copy()))
        for index in np.flatnonzero(self.stride == 0).tolist():
            self._sample(index, tick.phase[index])

    def _sample(self, index: int, phase: NDArray) -> None:
        """Add the effect of each change at the present state of an unchanged walk, for legs in the phase of the
        change."""
        torque, acceleration = step_at(self._biped.model, self._biped.data(index), self._change)
        for cell, (joint, name) in enumerate(CELLS):
            begin, end = PHASES[name]
            for side in np.flatnonzero((phase >= begin) & (phase < end)):
                self._samples[cell, index] += 1.0, -torque[side, joint], *acceleration[side, joint]

    def paired(self, strides: int, active: NDArray, cut: NDArray) -> PairedWalks:
        """Return each changed walk less the unchanged walk of its seed."""
        com, velocity, ankle, load, phase, stride = (np.stack(each) for each in zip(*self._ticks, strict=True))
        # The movement of each walk; the unchanged walks come first and give the clock.
        movement = np.full((len(active), strides, len(MOVEMENT)), np.nan)
        clocks = np.zeros((self._num, strides))
        for index in range(len(active)):
            own = index % self._num
            first = TICK * np.argmax(stride[:, own] == 0)
            contacts = foot_contacts(load[:, index], self._biped.body)
            landed = contacts[LEFT].heel_strikes
            landed = landed[landed > first - PHASE_LAG][: strides + 1]
            if not active[index] or len(landed) <= strides:
                continue
            if index == own:
                clocks[own] = np.linspace(landed[0], landed[-1], strides + 1)[1:]
            movement[index] = _movement(com[:, index], ankle[:, index], contacts, landed, clocks[own])
        movement = movement.reshape(-1, self._num, *movement.shape[1:])
        # The velocity of all copies of a seed when each phase of its unchanged first stride ends.
        ends = np.stack([_ends(*each) for each in zip(phase.T, stride.T, strict=True)], -1)  # (phases, S)
        now = velocity.reshape(len(velocity), -1, self._num)[ends, :, np.arange(self._num)]  # (phases, S, copies)
        single = 1 + np.arange(len(CELLS)) * len(DURATIONS)
        place = [list(PHASES).index(name) for _, name in CELLS]
        stood = np.isfinite(movement[0]).all((1, 2))
        windows, torque_acceleration = np.split(self._samples, [1], axis=-1)
        mean = torque_acceleration / np.where(stood[:, None], windows, np.nan)
        return PairedWalks(
            fixed=np.concatenate([mean, mean[..., 1:] * windows * TICK / len(SIDES)], -1),
            velocity=np.where(stood, now[place, :, single] - now[place, :, 0], np.nan),
            movement=(movement[1:] - movement[0]).reshape(len(CELLS), len(DURATIONS), *movement.shape[1:]),
            unchanged=movement[0],
            cut=cut,
        )


def _ends(phase: NDArray, stride: NDArray) -> list[int]:
    """Return the last tick of each of `PHASES` in the first stride, from a leg's `phase` and `stride` (T,)."""
    gone = np.where(stride <= 0, phase, 1.0)
    begun = np.argmax(stride == 0)
    return [int(begun + np.argmax(gone[begun:] >= end)) - 1 for _, end in PHASES.values()]


def _movement(com: NDArray, ankle: NDArray, contacts: list[Contacts], landed: NDArray, clock: NDArray) -> NDArray:
    """Return the quantities of `MOVEMENT` in each stride, (K, len(MOVEMENT)), of one walk.

    `com` (T, 2) and `ankle` (T, side) are positions [m], `landed` (K + 1,) the left foot's heel strikes [s], and
    `clock` (K,) the ends of the unchanged walk's mean strides [s].
    """
    place = sample(com[:, 0], landed, TICK, TICK)
    times, side = find_steps(contacts[LEFT], contacts[RIGHT], landed[0])
    ends = sample(ankle, times, TICK, TICK)  # (steps, (begin, end), side)
    length = np.take_along_axis(ends[:, 1], 1 - side[:, None], 1) - np.take_along_axis(ends[:, 0], side[:, None], 1)
    own = np.searchsorted(landed, times[:, 0], side="right") - 1
    total, count = (np.bincount(own, each, len(landed))[: len(clock)] for each in (length[:, 0], None))
    with np.errstate(invalid="ignore"):  # a stride without a step of both feet has none
        step_length = total / count
    height = on_percent(com[:, 1], landed[:-1], landed[1:], TICK, TICK).mean(1)
    ahead = sample(com[:, 0], clock, TICK, TICK)
    return np.stack([np.diff(place) / np.diff(landed), step_length, ahead, height], -1)
