"""Decide the actions that take effect: in every step or at gait events only; of the ankle, the toe or both."""

from math import isfinite

import numpy as np

from springfoot.arrays import NDArray
from springfoot.gait.people.human import HumanGait
from springfoot.gait.springs.stiffness import ankle_events, toe_events

from ..physics.kernel import kernel
from ..settings.settings import BipedSettings
from .phase_table import GRID


def planned_events(target: HumanGait) -> NDArray:
    """Return (4,) stride phases of the target's heel strike, foot flat, heel-off and toe-off, from its angle curves."""
    ankle = ankle_events(GRID, target.mean("ankle", GRID), target.toe_off)
    toe = toe_events(GRID, target.mean("toe", GRID), target.toe_off)
    return np.array([ankle["heel_strike"], ankle["foot_flat"], toe["heel_off"], target.toe_off])


@kernel
def _take(actions, running, events, rows):
    """Decide the actions that take effect: new ones where a leg has passed an event since its last decision.

    Args:
        actions: (N, 4) actions of the policy, not clipped.
        running: (N,) bool; other bodies keep their actions.
        events: (E,) stride phases at which a leg decides; none for decisions in every step.
        rows: (N,) of `CONTROL_ROW`; `decision` is changed.

    Returns False, with nothing changed, if an action of a running body is not finite.
    """
    for i in range(len(actions)):
        for k in range(4):
            if running[i] and not isfinite(actions[i, k]):
                return False
    for i in range(len(actions)):
        decision = rows[i].decision
        phase = rows[i].legs.phase
        for side in range(2):
            passed = 0  # events since the leg's heel strike
            for event in events:
                passed += phase[side] >= event
            no_new_event = len(events) > 0 and passed == decision.stage[side]
            keeps_action = not running[i] or no_new_event
            if running[i]:
                decision.stage[side] = passed
            for joint in range(2):
                k = 2 * side + joint  # of the four actions: ankle and toe of the left leg, then of the right one
                if keeps_action:
                    decision.action[k] = decision.last_action[k]
                elif rows[i].source.not_action or not rows[i].feet.controlled[side, joint]:
                    decision.action[k] = 0.0
                else:
                    decision.action[k] = min(max(actions[i, k], -1.0), 1.0)
    return True


class DecisionTimes:
    """Decide which actions of N bodies take effect in a step.

    With `decisions="event"` a leg decides where its phase passes an event. A touchdown sets the phase to 0, so the heel
    strike is that of the simulated foot, and a foot that bounces does not decide again. The other events lie at the
    target's phases.

    Args:
        settings: times and joints of decisions.
        target: gait with the events.
        rows: (N,) of `CONTROL_ROW`, with the joints that actions set.
    """

    def __init__(self, settings: BipedSettings, target: HumanGait, rows: NDArray):
        self._events = planned_events(target) if settings.decisions == "event" else np.empty(0)
        self._rows = rows
        self._decisions = rows["decision"]
        self.action = self._decisions["action"]
        """(N, 4) actions that take effect, in [-1, 1]."""

    def reset(self, ids: NDArray) -> None:
        """Let the next actions of bodies `ids` (K,) take effect at any phase."""
        self._decisions["stage"][ids] = -1
        self._decisions["last_action"][ids] = 0.0

    def take(self, actions: NDArray, running: NDArray) -> NDArray | None:
        """Return the actions that take effect, (N, 4): `actions` clipped to [-1, 1].

        Legs that have passed no event, and bodies that are not `running` (N,), keep their last actions. Returns None,
        with all state unchanged, if an action of a running body is not finite.
        """
        return self.action if _take(actions, running, self._events, self._rows) else None
