"""From actions to stiffness to control of the ankle and toe springs: tau = K (theta_eq - theta - beta dtheta/dt).

Arrays are (N, side, 2), the last axis being ankle and toe; flattened, they are in the order of `ACTIONS`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from springfoot.gait.body import Body

from ..physics.kernel import kernel
from ..physics.model import ANKLE
from ..settings import LONGEST_DELAY, BipedSettings
from ..timing import CONTROL_WINDOW
from .phase_table import PhaseTable
from .subjects import Subjects

FEET = slice(ANKLE, None)
"""Ankle and toe along the joint axis: the joints whose stiffness an action sets."""


def stiffness_ranges(settings: BipedSettings, body: Body) -> tuple[NDArray, NDArray]:
    """Lowest and highest stiffness of this body [N m/rad], each (2,) for ankle and toe."""
    low, high = np.array([settings.ankle_stiffness_range, settings.toe_stiffness_range]).T
    return low * body.stiffness_scale, high * body.stiffness_scale


def stiffness_of(action: NDArray, settings: BipedSettings, body: Body) -> NDArray:
    """Stiffness (..., 2) of ankle and toe [N m/rad] for actions in [-1, 1] in absolute mode, on a log scale."""
    middle, factor = _log_scale(settings, body)
    return middle * factor**action


def _log_scale(settings: BipedSettings, body: Body) -> tuple[NDArray, NDArray]:
    """Stiffness at action 0 [N m/rad], and the factor between it and the stiffness at action 1."""
    low, high = stiffness_ranges(settings, body)
    return np.sqrt(low * high), np.sqrt(high / low)


def action_of(stiffness: ArrayLike, settings: BipedSettings, body: Body) -> NDArray:
    """The action in [-1, 1] that gives a stiffness (..., 2) [N m/rad]; beyond the range, that of the nearer end."""
    low, high = stiffness_ranges(settings, body)
    value = np.clip(np.asarray(stiffness, float), low, high)
    return 2.0 * np.log(value / low) / np.log(high / low) - 1.0


def draw_delay(settings: BipedSettings, random: np.random.Generator) -> int:
    """Control windows from the request of a stiffness until it acts, in one episode; drawn if the settings say so."""
    if settings.stiffness_delay_range_s is None:
        return round(settings.stiffness_delay_s / CONTROL_WINDOW)
    shortest, longest = (round(delay / CONTROL_WINDOW) for delay in settings.stiffness_delay_range_s)
    return int(random.integers(shortest, longest + 1))


class FootSprings:
    """The state of the ankle and toe springs of N bodies, and the work that is done by changing them.

    Args:
        settings: ranges of stiffness and action mode.
        body: the body that the tables are for.
        equilibrium: (R, SAMPLES, 2) rest angles over the stride [rad], one for each row of the tables.
        schedule: (R, SAMPLES, 2) fixed stiffness [N m/rad], which a residual action multiplies.
        subjects: bodies and requested speeds.
        incline: what a slope adds to the equilibrium (`envs.control.leg_controller.slope_table`).
    """

    def __init__(
        self,
        settings: BipedSettings,
        body: Body,
        equilibrium: NDArray,
        schedule: NDArray,
        subjects: Subjects,
        incline: PhaseTable,
    ):
        num = len(subjects.place)
        self._follows = settings.equilibrium in ("planned", "angle")  # a constant equilibrium stays constant on a slope
        self._residual = settings.action_mode == "residual"
        self._fixed = [joint for joint, name in enumerate(("toe", "ankle")) if settings.stiffness_joints == name]
        middle, self._factor = _log_scale(settings, body)
        self._middle = np.tile(middle, (num, 2, 1))
        self._subjects, self._incline = subjects, incline
        self._equilibrium, self._schedule = PhaseTable(equilibrium), PhaseTable(schedule)
        self.stiffness = np.zeros((num, 2, 2))
        """(N, side, 2) K [N m/rad]; changed in place."""
        self.equilibrium = np.zeros((num, 2, 2))
        """(N, side, 2) rest angle [rad]; changed in place."""
        self.work_stiffness = np.zeros((num, 2, 2))
        """(N, side, 2) work done by the last change of stiffness [J]; changed in place."""
        self.work_equilibrium = np.zeros((num, 2, 2))
        """(N, side, 2) work done by moving the rest angle since that change [J]; changed in place."""
        self._fresh = np.ones(num, bool)
        self._everyone = np.ones(num, bool)
        self._delay = np.zeros(num, int)
        self._requests = np.zeros(
            (num, 1 + round(LONGEST_DELAY / CONTROL_WINDOW), 2, 2)
        )  # in the last windows, newest first

    def reset(self, ids: NDArray, delay: ArrayLike = 0) -> None:
        """Begin an episode of springs `ids` (K,).

        Their next change does no work and acts at once, as if it had been requested long before. Later changes act
        `delay` (K,) control windows after their request.
        """
        self._fresh[ids] = True
        self._delay[ids] = delay

    def scheduled(self, leg_phase: NDArray) -> NDArray:
        """(N, side, 2) fixed stiffness at the legs' phases [N m/rad]."""
        return self._schedule.at(leg_phase, self._subjects.place) * self._subjects.scale["torque"][:, None, None]

    def set_stiffness(
        self,
        action: NDArray,
        leg_phase: NDArray,
        angle: NDArray,
        running: NDArray | None = None,
        scheduled: NDArray | None = None,
    ) -> None:
        """Request new stiffness by an action (N, 4), to act after the delay.

        Changing K to K' under a deflection x puts 1/2 (K' - K) x^2 into the spring; x is that of the joint angles
        `angle` (N, side, joint) [rad]. Springs of bodies not `running` (N,) do not change (None: all are running);
        those of bodies `scheduled` (N,) take the fixed stiffness in place of the action's.
        """
        action = action.reshape(self.stiffness.shape)
        if self._residual:
            middle, factor = self._schedule.at(leg_phase, self._subjects.place), np.exp(action)
        else:
            middle, factor = self._middle, self._factor**action
            if self._fixed:
                middle = middle.copy()
                middle[..., self._fixed] = self._schedule.at(leg_phase, self._subjects.place)[..., self._fixed]
        if scheduled is not None:
            fixed = scheduled[:, None, None]
            middle = np.where(fixed, self._schedule.at(leg_phase, self._subjects.place), middle)
            factor = np.where(fixed, 1.0, factor)
        running = self._everyone if running is None else running
        state = self._fresh, running, self._delay, self._requests, self.stiffness
        works = self.work_stiffness, self.work_equilibrium
        _stiffen(middle, factor, self._subjects.scale, angle, self.equilibrium, *state, *works)

    def move_equilibrium(
        self, leg_phase: NDArray, angle: NDArray, control: NDArray, running: NDArray | None = None
    ) -> None:
        """Begin a control window: put K and K theta_eq into `control` (N, side, joint, 2).

        K is the stiffness whose delay is over, theta_eq the rest angle of the legs' phases `leg_phase` (N, side).
        Moving the rest angle, so that the deflection goes from x to x', puts 1/2 K (x'^2 - x^2) into the spring.
        """
        equilibrium = self._equilibrium.at(leg_phase, self._subjects.place)
        if self._follows and self._subjects.slope.any():
            equilibrium[..., 0] += self._subjects.slope[:, None] * self._incline.at(leg_phase)[..., ANKLE]
        running = self._everyone if running is None else running
        state = self._fresh, running, self._delay, self._requests, self.stiffness, self.equilibrium
        _move(equilibrium, angle, *state, self.work_stiffness, self.work_equilibrium, control)

    def hold(self, control: NDArray, angle: NDArray, held: NDArray) -> None:
        """Take over, for the bodies `held` (N,), the K and K theta_eq that stand in `control` (N, side, joint, 2).

        They act without delay, and the work of both changes is counted as above.
        """
        works = self.work_stiffness, self.work_equilibrium
        _hold(control, angle, held, self._fresh, self._requests, self.stiffness, self.equilibrium, *works)


@kernel
def _stiffen(
    middle,
    factor,
    scale,
    angle,
    equilibrium,
    fresh,
    running,
    delay,
    requests,
    stiffness,
    work_stiffness,
    work_equilibrium,
):
    for i in range(len(stiffness)):
        for side in range(2):
            for joint in range(2):
                work_stiffness[i, side, joint] = work_equilibrium[i, side, joint] = 0.0
                if running[i]:
                    before = stiffness[i, side, joint]
                    after = middle[i, side, joint] * scale[i].torque * factor[i, side, joint]
                    deflection = equilibrium[i, side, joint] - angle[i, side, ANKLE + joint]
                    requests[i, 0, side, joint] = after
                    if fresh[i]:
                        requests[i, :, side, joint] = after
                    if fresh[i] or delay[i] == 0:
                        stiffness[i, side, joint] = after
                    if not fresh[i] and delay[i] == 0:
                        work_stiffness[i, side, joint] = 0.5 * (after - before) * deflection**2


@kernel
def _move(
    wanted, angle, fresh, running, delay, requests, stiffness, equilibrium, work_stiffness, work_equilibrium, control
):
    for i in range(len(equilibrium)):
        if running[i] and delay[i] > 0:
            _arrive(delay[i], angle[i], equilibrium[i], requests[i], stiffness[i], work_stiffness[i])
        for side in range(2):
            for joint in range(2):
                k, theta = stiffness[i, side, joint], angle[i, side, ANKLE + joint]
                if running[i]:
                    before, after = equilibrium[i, side, joint] - theta, wanted[i, side, joint] - theta
                    equilibrium[i, side, joint] = wanted[i, side, joint]
                    if not fresh[i]:
                        work_equilibrium[i, side, joint] += 0.5 * k * (after * after - before * before)
                control[i, side, ANKLE + joint, 0] = k
                control[i, side, ANKLE + joint, 1] = k * equilibrium[i, side, joint]
        fresh[i] = fresh[i] and not running[i]


@kernel
def _arrive(delay, angle, equilibrium, requests, stiffness, work):
    """Let the request of `delay` windows ago act, and shift the past requests by one window."""
    for side in range(2):
        for joint in range(2):
            before, after = stiffness[side, joint], requests[delay, side, joint]
            deflection = equilibrium[side, joint] - angle[side, ANKLE + joint]
            stiffness[side, joint] = after
            work[side, joint] += 0.5 * (after - before) * deflection**2
            for past in range(len(requests) - 1, 0, -1):
                requests[past, side, joint] = requests[past - 1, side, joint]


@kernel
def _hold(control, angle, held, fresh, requests, stiffness, equilibrium, work_stiffness, work_equilibrium):
    for i in range(len(held)):
        if not held[i]:
            continue
        for side in range(2):
            for joint in range(2):
                k, drive = control[i, side, ANKLE + joint]
                theta, before = angle[i, side, ANKLE + joint], stiffness[i, side, joint]
                old, new = equilibrium[i, side, joint] - theta, drive / k - theta
                stiffness[i, side, joint], equilibrium[i, side, joint] = k, drive / k
                requests[i, :, side, joint] = k
                if not fresh[i]:
                    work_stiffness[i, side, joint] += 0.5 * (k - before) * old * old
                    work_equilibrium[i, side, joint] += 0.5 * k * (new * new - old * old)
        fresh[i] = False
