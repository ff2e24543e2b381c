"""Which actions take effect, and when: in every step or at gait events only; those of the ankle, the toe or both."""

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from springfoot.gait.human import HumanGait
from springfoot.gait.stiffness import ankle_events, toe_events

from ..physics.kernel import kernel
from ..settings import BipedSettings
from .phase_table import GRID


def gait_events(human: HumanGait) -> NDArray:
    """(4,) stride phases of people's heel strike, foot flat, heel-off and toe-off, from their angle curves."""
    ankle = ankle_events(GRID, human.mean("ankle", GRID), human.toe_off)
    toe = toe_events(GRID, human.mean("toe", GRID), human.toe_off)
    return np.array([ankle["heel_strike"], ankle["foot_flat"], toe["heel_off"], human.toe_off])


class DecisionTimes:
    """Decides which actions of N bodies take effect in a step.

    With `decisions="event"` events are read from the leg's phase. A touchdown sets the phase to 0, so the heel strike
    is that of the foot itself, and a foot that bounces does not decide again. Other events lie at people's phases.
    """

    def __init__(self, settings: BipedSettings, human: HumanGait, num: int):
        self._events = gait_events(human) if settings.decisions == "event" else np.empty(0)
        self._decided = np.array([settings.stiffness_joints in ("both", joint) for joint in ("ankle", "toe")])
        self._stage = np.full((num, 2), -1)  # number of events since heel strike when each leg decided last

    def reset(self, ids: NDArray) -> None:
        """Let the next actions of bodies `ids` (K,) take effect whatever the phase."""
        self._stage[ids] = -1

    def take(self, action: NDArray, last_action: NDArray, leg_phase: NDArray, running: NDArray) -> bool:
        """Clip `action` (N, 4) to [-1, 1] in place; legs at no event and bodies not running keep `last_action`.

        Returns False for a number that is not finite; `action` is then undefined.
        """
        sides = (len(action), 2, 2)
        actions = last_action.reshape(sides), action.reshape(sides)
        return _take(running, self._decided, self._events, leg_phase, self._stage, *actions)


@kernel
def _take(running, decided, events, phase, stage, last_action, action):
    for i in range(len(action)):
        for side in range(2):
            now = 0
            for event in events:
                now += phase[i, side] >= event
            held = not running[i] or (len(events) > 0 and now == stage[i, side])
            if running[i]:
                stage[i, side] = now
            for joint in range(2):
                if running[i] and not isfinite(action[i, side, joint]):
                    return False
                if held:
                    action[i, side, joint] = last_action[i, side, joint]
                elif not decided[joint]:
                    action[i, side, joint] = 0.0
                else:
                    action[i, side, joint] = min(max(action[i, side, joint], -1.0), 1.0)
    return True
