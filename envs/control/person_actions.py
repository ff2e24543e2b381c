"""Let a person act: offsets to the rest angles of hips, knees and ankles.

The offsets are added to the rest angles that the leg constants give, every 20 ms. They are 0 while the body stands, and
do nothing at an ankle with a rest angle or a device of its own. A person that walks more slowly than commanded aims at
ever more speed, and one that walks faster at less: it observes by how much.
"""

from math import radians

import numpy as np

from springfoot.arrays import NDArray

from ..physics.kernel import part
from ..physics.model import MOVED, SIDES
from ..settings.settings import BipedSettings

FARTHEST_AIM = 0.2
"""Most that a person aims above or below the commanded speed [m/s]; chosen: more than persons were too slow by."""


@part
def move_aim(controls, bodies, seconds, walking, running) -> None:
    """Move the speed that each person aims at by its CoM's shortfall from the commanded speed in a step.

    Args:
        controls: (N,) of `CONTROL_ROW`; `person` is changed.
        bodies: (N,) of `BODY_ROW`, as measured at the step's end.
        seconds: time of the step.
        walking: (N,) bool, bodies that neither stand nor have ended.
        running: (N,) bool, bodies that took the step; those that stand aim at the commanded speed.
    """
    for i in range(len(controls)):
        person = controls[i].person
        if walking[i]:
            lacking = controls[i].subject.speed - bodies[i].measured.com_velocity[0]
            person.aim = min(max(person.aim + person.aim_rate * seconds * lacking, -FARTHEST_AIM), FARTHEST_AIM)
        elif running[i]:
            person.aim = 0.0


class PersonActions:
    """The persons of N bodies, as actions set them.

    Args:
        settings: range of the offsets.
        rows: (N,) of `CONTROL_ROW`; `person` is changed.
        aim_rate: as the setting.
    """

    def __init__(self, settings: BipedSettings, rows: NDArray, aim_rate: float) -> None:
        self._range = radians(settings.person_range_deg)
        self._offset = rows["person"]["offset"]
        self._last_offset = rows["person"]["last_offset"]
        self._aim = rows["person"]["aim"]
        rows["person"]["aim_rate"] = aim_rate

    def reset(self, ids: NDArray) -> None:
        """Begin an episode of bodies `ids` (K,)."""
        self._offset[ids] = 0.0
        self._last_offset[ids] = 0.0
        self._aim[ids] = 0.0

    def offsets(self, actions: NDArray) -> NDArray:
        """Return the offsets (N, side, 3) [rad] of actions (N, 6), clipped to [-1, 1], in the order of
        `PERSON_ACTIONS`."""
        return self._range * np.clip(actions, -1.0, 1.0).reshape(-1, len(SIDES), len(MOVED))

    def move(self, offsets: NDArray, moving: NDArray, resting: NDArray) -> None:
        """Move the rest angles of the bodies `moving` (N,) by `offsets` (N, side, 3) [rad], those of bodies
        `resting` (N,) by 0."""
        self._offset[moving] = offsets[moving]
        self._offset[resting] = 0.0
