"""The walking task: observation, named reward terms and falls, on arrays over N environments.

Row i of every result depends on row i of the arguments alone, by the same operations for any N: a batch of N
gives the same bits as N batches of one.
"""

from collections.abc import Iterable, Sequence
from math import exp
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..control.leg_constants import LegConstants
from ..control.phase_table import GRID, PhaseTable
from ..control.reference_walk import ReferenceWalk
from ..control.subjects import Subjects
from ..physics.kernel import kernel
from ..physics.model import ANKLE, HIP, LEFT, RIGHT
from ..settings import DEFAULT_WEIGHTS, BipedSettings
from ..timing import ACTION_STEP
from .episode_end import divergence
from .observation import OBSERVATION, Observer
from .reward_reference import REFERENCE, body_scales, reference_curves

if TYPE_CHECKING:
    from ..physics.measurement import Measurement

MAX_PITCH = 0.8
"""A trunk tilted further than this, forward or backward, is a fall [rad]; chosen: walking stays within 0.04 rad."""
TOO_LOW, TOO_TILTED = "fell: hip too low", "fell: trunk too tilted"

POSE_TOLERANCE = 0.02
"""Pose error E at which its reward is 1/e [rad^2]; chosen: 2.8 deg at every joint."""
MAX_FORCE = 1.2
"""Vertical force of one foot beyond which it costs more [body weights]; chosen: people's peaks are 1.05 and 1.13."""
EXCESS_SHARE = 4.0
"""Weight of that excess against the distance from people's range [-]; chosen high, as a peak is short."""
FORCE_TOLERANCE = 0.4
"""Force outside people's range, both feet together, at which its reward is 1/e [body weights]; chosen: at 0.15 a
push-off far too strong costs hardly more than one a little too strong."""


TERMS: tuple[str, ...] = ("alive", "speed", "com_x", "com_z", "zmp", "pose", "grf", "stiffness_rate", "stiffness")
"""The reward's terms, in the order in which they are summed."""
ALIVE, SPEED, COM_X, COM_Z, ZMP, POSE, GRF, STIFFNESS_RATE, STIFFNESS = range(len(TERMS))


class Task:
    """What a policy sees, what it is rewarded for, and what counts as a fall, for N bodies.

    Args:
        settings: the weights of the reward, and the time of a step.
        rows: leg constants and walk of each row of the tables (`envs.control.reference_walk.rows`).
        subjects: bodies and commanded speeds.
    """

    def __init__(
        self, settings: BipedSettings, rows: Sequence[tuple[LegConstants, ReferenceWalk]], subjects: Subjects
    ) -> None:
        self.names = tuple(entry.name for entry in OBSERVATION)
        self._subjects = subjects
        self._observer = Observer(subjects)
        self.low, self.high = self._observer.low, self._observer.high
        self.weights = DEFAULT_WEIGHTS | settings.reward_weights

        self._weights = np.array([self.weights[name] for name in TERMS])
        self._share = settings.step_seconds / ACTION_STEP
        curves = {walk: reference_curves(walk.plan, walk.human, settings.step_seconds) for _, walk in rows}
        self._curves = PhaseTable(np.stack([curves[walk].view(float).reshape(len(GRID), -1) for _, walk in rows]))
        self._scales = np.concatenate([body_scales(body) for body in subjects.bodies])

    def fit(self, ids: Iterable[int]) -> None:
        """Take over the present bodies of the subjects `ids`."""
        self._observer.fit(ids)
        for index in ids:
            self._scales[index] = body_scales(self._subjects.bodies[index])[0]

    def observe(
        self,
        m: "Measurement",
        leg_phase: NDArray,
        last_action: NDArray,
        force: NDArray,
        curves: NDArray | None = None,
    ) -> NDArray:
        """The observation, float32 (N, D) as `OBSERVATION`, clipped to its bounds.

        `leg_phase` (N, 2) stride phases [0, 1); `last_action` (N, 4); `force` (N, 2, 3, 2) on the body [N], mean
        over the step; `curves` are `at(leg_phase)`, if they are known. NaN reads as the upper bound.
        """
        curves = self.at(leg_phase) if curves is None else curves
        error, planned_ankle = self._error(m, leg_phase, curves), curves["pose"][..., ANKLE]
        return self._observer.observe(m, leg_phase, error, planned_ankle, last_action, force)

    def planned_com(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """The plan's CoM (x in the world, z) [m], shape (N, 2)."""
        return m.com - self.tracking(m, leg_phase)[:, :2]

    def tracking(self, m: "Measurement", leg_phase: NDArray) -> NDArray:
        """CoM minus plan: x [m], z [m] and forward speed [m/s], shape (N, 3)."""
        return self._error(m, leg_phase, self.at(leg_phase))

    def terms(
        self,
        m: "Measurement",
        leg_phase: NDArray,
        action: NDArray,
        last_action: NDArray,
        stiffness: NDArray,
        force_windows: NDArray,
        curves: NDArray | None = None,
    ) -> NDArray:
        """The reward's terms, unweighted and dimensionless, (N, len(TERMS)) in the order of `TERMS`.

        Rewards in [0, 1]: `alive`; `speed`, `com_x`, `com_z`, exp(-(error/tolerance)^2) of the CoM against
        the ZMP plan; `zmp`, the same of the CoP of both feet against the planned ZMP, 0 in flight;
        `pose`, exp(-E/0.02) with E = 1/2 sum over legs of (3, 2.5, 3, 0.1) x squared distance [rad^2] of thigh
        (to the vertical), knee, ankle and toe from people's mean curves at the leg's phase.
        `grf`, exp(-D/0.4) with D the body weights by which the feet's forces leave people's range: vertical
        beyond 1.2 (fourfold), both components beyond mean +- 0.5 SD at the leg's phase.
        Costs >= 0: `stiffness_rate`, squared change of the action in 20 ms; `stiffness`, mean over legs of
        [(K_ankle/300)^2 + (K_toe/60)^2/4]/1.25, K scaled to 1.70 m and 63 kg.

        `action`, `last_action` (N, 4); `stiffness` (N, 2, 2) as [side][ankle, toe] [N m/rad]; `force_windows`
        (W, N, 2, 3, 2) on the body [N] in the W control windows of the step; `curves` as in `observe`.
        """
        terms = np.empty((len(leg_phase), len(TERMS)))
        state = m.base, m.angle, m.com, m.com_velocity, m.ankle, m.contact, m.diverged
        curves = self.at(leg_phase) if curves is None else curves
        _judge(
            self._scales,
            self._subjects.scale,
            curves,
            *state,
            leg_phase,
            action,
            last_action,
            stiffness,
            force_windows,
            self._share,
            terms,
        )
        return terms

    def reward(self, terms: NDArray) -> NDArray:
        """Weighted sum of the terms, (N,), in proportion to the time of a step, 1 for 20 ms; 0 where `alive` is 0."""
        total = np.empty(len(terms))
        _sum(self._weights, self._share, terms, total)
        return total

    def reasons(self, m: "Measurement", terminated: NDArray) -> NDArray:
        """(N,) why an episode is `terminated` (N,), "" where it is not."""
        reasons = np.where(terminated, self.fallen(m), "").astype(object)
        for index in np.flatnonzero(terminated & (m.diverged >= 0)).tolist():
            reasons[index] = divergence(m, index)
        return reasons

    def fallen(self, m: "Measurement") -> NDArray:
        """Why each environment has fallen, a string array (N,): empty while it has not."""
        tilted = np.where(np.abs(m.base[:, 2]) <= MAX_PITCH, "", TOO_TILTED)
        return np.where(m.base[:, 1] >= self._scales["min_hip_height"], tilted, TOO_LOW)

    def _error(self, m: "Measurement", leg_phase: NDArray, curves: NDArray) -> NDArray:
        error = np.empty((len(leg_phase), 3))
        _track(self._subjects.scale, curves, m.com, m.com_velocity, m.ankle, leg_phase, error)
        return error

    def at(self, leg_phase: NDArray) -> NDArray:
        """People and plan at the legs' phases, (N, side) of dtype `REFERENCE`."""
        return self._curves.at(leg_phase, self._subjects.place).view(REFERENCE)[..., 0]


@kernel
def _track(ratios, curves, com, com_velocity, ankle, leg_phase, error):
    for i in range(len(error)):
        x, z, speed = _error(ratios[i], curves[i], com[i], com_velocity[i], ankle[i], leg_phase[i])
        error[i, 0], error[i, 1], error[i, 2] = x, z, speed


@kernel
def _error(ratio, curves, com, com_velocity, ankle, leg_phase):
    """CoM minus plan: x, z, forward speed. The x of the plan is from the ankle of the leg whose stance began last."""
    leader = LEFT if leg_phase[LEFT] < 0.5 else RIGHT
    planned = curves[leader]
    planned_x = ankle[leader, 0] + ratio.length * planned.stride_length * leg_phase[leader]
    planned_x += ratio.length * planned.com[0]
    return com[0] - planned_x, com[1] - ratio.length * planned.com[1], com_velocity[0] - ratio.time * planned.speed


@kernel
def _judge(
    scales,
    ratios,
    curves,
    base,
    angle,
    com,
    com_velocity,
    ankle,
    contact,
    diverged,
    leg_phase,
    action,
    last_action,
    stiffness,
    force_windows,
    share,
    terms,
):
    for i in range(len(base)):
        scale = scales[i]
        upright = base[i, 1] >= scale.min_hip_height and abs(base[i, 2]) <= MAX_PITCH  # False for NaN
        terms[i, ALIVE] = 1.0 if upright and diverged[i] < 0 else 0.0
        x, z, speed = _error(ratios[i], curves[i], com[i], com_velocity[i], ankle[i], leg_phase[i])
        terms[i, COM_X] = exp(-((x / scale.tolerance[0]) ** 2))
        terms[i, COM_Z] = exp(-((z / scale.tolerance[1]) ** 2))
        terms[i, ZMP] = _near_zmp(scale, ratios[i], curves[i], ankle[i], contact[i], leg_phase[i], force_windows[:, i])
        terms[i, SPEED] = exp(-((speed / scale.tolerance[2]) ** 2))
        pose_error = force_distance = stiffness_cost = stiffness_rate = 0.0
        for side in range(2):
            people = curves[i, side]
            pose_error += 0.5 * _pose_error(scale, base[i, 2], angle[i, side], people)
            force_distance += _force_distance(scale, force_windows[:, i, side], people)
            for joint in range(2):
                k = stiffness[i, side, joint] / scale.stiffness_unit[joint]
                stiffness_cost += 0.5 * scale.stiffness_share[joint] * k**2
        for k in range(4):
            stiffness_rate += ((action[i, k] - last_action[i, k]) / share) ** 2
        terms[i, POSE] = exp(-pose_error / POSE_TOLERANCE)
        terms[i, GRF] = exp(-force_distance / FORCE_TOLERANCE)
        terms[i, STIFFNESS], terms[i, STIFFNESS_RATE] = stiffness_cost, stiffness_rate


@kernel
def _near_zmp(scale, ratio, curves, ankle, contact, leg_phase, force_windows):
    """exp(-(distance / tolerance)^2) of the CoP of both feet, mean over the windows of a step, from the planned ZMP."""
    load = moment = 0.0
    for window in range(len(force_windows)):
        for side in range(2):
            for point in range(3):
                load += force_windows[window, side, point, 1]
                moment += force_windows[window, side, point, 1] * contact[side, point, 0]
    if load <= 0.0:
        return 0.0
    leader = LEFT if leg_phase[LEFT] < 0.5 else RIGHT
    planned = curves[leader]
    ahead = ratio.length * (planned.stride_length * leg_phase[leader] + planned.zmp)
    return exp(-(((moment / load - ankle[leader, 0] - ahead) / scale.tolerance[3]) ** 2))


@kernel
def _pose_error(scale, pitch, angle, people):
    error = 0.0
    for joint in range(4):
        lean = pitch if joint == HIP else 0.0  # thigh to the vertical = hip - pitch
        error += scale.pose_share[joint] * (angle[joint] - people.pose[joint] - lean) ** 2
    return error


@kernel
def _force_distance(scale, force_windows, people):
    """Body weights by which one foot's forces in the windows of a step leave people's range."""
    count = len(force_windows)
    forward = up = excess = 0.0
    for window in range(count):
        contacts = force_windows[window]
        vertical = (contacts[0, 1] + contacts[1, 1] + contacts[2, 1]) / scale.weight
        forward += (contacts[0, 0] + contacts[1, 0] + contacts[2, 0]) / scale.weight / count
        up += vertical / count
        excess += max(vertical - MAX_FORCE, 0.0) / count
    beyond_forward = max(abs(forward - people.force[0]) - people.force_band[0], 0.0)
    beyond_up = max(abs(up - people.force[1]) - people.force_band[1], 0.0)
    return EXCESS_SHARE * excess + beyond_forward + beyond_up


@kernel
def _sum(weights, share, terms, total):
    for i in range(len(total)):
        total[i] = 0.0
        for term in range(len(weights)):
            total[i] += weights[term] * terms[i, term]
        total[i] *= share * terms[i, ALIVE]
