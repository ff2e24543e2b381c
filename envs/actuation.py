"""Actions to stiffness to control, for the ankle and toe springs: tau = K (theta_eq - theta - beta dtheta/dt).

Axes: (N, side, 2), the last one ankle and toe; an action's four numbers are these rows in the order of `ACTIONS`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from springfoot.gait.body import Body

from .model import ANKLE
from .phase import PhaseTable
from .settings import BipedSettings

FEET = slice(ANKLE, None)
"""Ankle and toe along the joint axis: the joints whose stiffness is the action."""


def stiffness_ranges(settings: BipedSettings, body: Body) -> tuple[NDArray, NDArray]:
    """Lowest and highest (ankle, toe) stiffness of this body [N m/rad]."""
    low, high = np.array([settings.ankle_stiffness_range, settings.toe_stiffness_range]).T
    return low * body.stiffness_scale, high * body.stiffness_scale


def stiffness_of(action: NDArray, settings: BipedSettings, body: Body) -> NDArray:
    """Absolute mode: actions in [-1, 1], (..., 2) for ankle and toe, on a log scale to N m/rad."""
    low, high = stiffness_ranges(settings, body)
    return low * (high / low) ** ((action + 1.0) / 2.0)


def action_of(stiffness: ArrayLike, settings: BipedSettings, body: Body) -> NDArray:
    """The action in [-1, 1] that gives a stiffness [N m/rad], (..., 2); beyond the range, the nearer end."""
    low, high = stiffness_ranges(settings, body)
    value = np.clip(np.asarray(stiffness, float), low, high)
    return 2.0 * np.log(value / low) / np.log(high / low) - 1.0


class FootSprings:
    """The state of N bodies' ankle and toe springs, and the work done on them by changing them.

    Args:
        settings, body: ranges and action mode.
        equilibrium: (V, SAMPLES, 2) rest angles over the stride [rad].
        schedule: (V, SAMPLES, 2) stiffness [N m/rad] that a residual action multiplies.
        num: N.
        variant: (N,) which of the V curves each body has.
    """

    def __init__(
        self,
        settings: BipedSettings,
        body: Body,
        equilibrium: NDArray,
        schedule: NDArray,
        num: int,
        variant: NDArray | None = None,
    ):
        self._settings, self._body = settings, body
        self._variant = (np.zeros(num, int) if variant is None else variant)[:, None]
        self._equilibrium = PhaseTable(equilibrium)
        self._schedule = PhaseTable(schedule)
        self.stiffness = np.zeros((num, 2, 2))
        self.equilibrium = np.zeros((num, 2, 2))
        self._fresh = np.ones(num, bool)

    def reset(self, ids: NDArray) -> None:
        """The next change of springs `ids` costs no work."""
        self._fresh[ids] = True

    def scheduled(self, leg_phase: NDArray) -> NDArray:
        """(N, side, 2) fixed stiffness at the legs' phases [N m/rad]."""
        return self._schedule.at(leg_phase, self._variant)

    def set_stiffness(
        self, action: NDArray, leg_phase: NDArray, angle: NDArray, frozen: NDArray | None = None
    ) -> NDArray:
        """Take new stiffness from an action (N, 4) at foot angles (N, side, 2); returns the work put in [J].

        Changing K under a deflection x puts 1/2 (K' - K) x^2 into the spring. Rows in the mask `frozen` (N,) stay.
        """
        action = action.reshape(self.stiffness.shape)
        if self._settings.action_mode == "residual":
            stiffness = self.scheduled(leg_phase) * np.exp(action)
        else:
            stiffness = stiffness_of(action, self._settings, self._body)
        if frozen is not None:
            stiffness[frozen] = self.stiffness[frozen]
        work = 0.5 * (stiffness - self.stiffness) * (self.equilibrium - angle) ** 2
        self.stiffness = stiffness
        return np.where(self._fresh[:, None, None], 0.0, work)

    def move_equilibrium(self, leg_phase: NDArray, angle: NDArray, frozen: NDArray | None = None) -> NDArray:
        """Take the rest angles of the legs' phases; returns the work put in, 1/2 K (x'^2 - x^2) [J]."""
        equilibrium = self._equilibrium.at(leg_phase, self._variant)
        if frozen is not None:
            equilibrium[frozen] = self.equilibrium[frozen]
        before, after = self.equilibrium - angle, equilibrium - angle
        work = 0.5 * self.stiffness * (after * after - before * before)
        self.equilibrium = equilibrium
        work = np.where(self._fresh[:, None, None], 0.0, work)
        self._fresh = np.zeros_like(self._fresh) if frozen is None else self._fresh & frozen
        return work
