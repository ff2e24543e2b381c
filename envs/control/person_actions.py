"""Let a person act: offsets to the rest angles of hips, knees and ankles; and name the source of the stiffness.

The offsets are added to the rest angles that the leg constants give, every 20 ms. They are 0 while the body stands, and
do nothing at an ankle with a rest angle or a device of its own. A person that walks more slowly than commanded aims at
ever more speed, and one that walks faster at less: the commanded speed that it observes is the one that it aims at.
"""

from collections.abc import Sequence
from math import radians

import numpy as np

from springfoot.arrays import NDArray

from ..physics.kernel import part
from ..physics.model import MOVED, SIDES
from ..settings.settings import BipedSettings

SOFTEST_CONSTANT = -0.5
"""Action of the softest stiffness that is drawn as a constant [-]; chosen: 50 and 12.6 N m/rad with the default ranges,
below which no walk was found."""
DRAWN_SOURCES = {"action": 0.6, "scaled": 0.18, "constant": 0.18, "random": 0.04}
"""Source of the stiffness that `stiffness_by` "drawn" takes -> its share; chosen: walks on a stiffness drawn anew in
every step cost three times the energy of others and little that a person can spare, so that many of them hide from
a training what others could spare."""
FARTHEST_AIM = 0.2
"""Most that a person aims above or below the commanded speed [m/s]; chosen: more than persons were too slow by."""


@part
def move_aim(controls, bodies, seconds, walking, running) -> None:
    """Move the speed that each person aims at by what its CoM lacked of the commanded speed in a step.

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


def draw_source(settings: BipedSettings, random: np.random.Generator) -> tuple[int, int, int, NDArray]:
    """Return the fields of `STIFFNESS_SOURCE` of an episode: not_action, scheduled, anew, and the (4,) `drawn` numbers.

    Draws nothing for the sources "action" and "schedule".
    """
    source = settings.stiffness_by
    if source == "drawn":
        source = random.choice(list(DRAWN_SOURCES), p=list(DRAWN_SOURCES.values()))
    if source == "action" and settings.acts == "person":
        source = "schedule"
    drawn = np.zeros(4)
    if source == "scaled":
        drawn = np.tile(random.uniform(-1.0, 1.0, 2), 2)  # ankle and toe, alike on both legs
    elif source == "constant":
        drawn = np.tile(random.uniform(SOFTEST_CONSTANT, 1.0, 2), 2)
    elif source == "random":
        drawn = random.uniform(-1.0, 1.0, 4)
    return int(source != "action"), int(source in ("schedule", "scaled")), int(source == "random"), drawn


class PersonActions:
    """The persons of N bodies, as actions set them, and the sources of their stiffness.

    Args:
        settings: range of the offsets, source of the stiffness.
        rows: (N,) of `CONTROL_ROW`; `person` and `source` are changed.
        aim_rate: as the setting.
    """

    def __init__(self, settings: BipedSettings, rows: NDArray, aim_rate: float) -> None:
        self._settings = settings
        self._range = radians(settings.person_range_deg)
        self._source = rows["source"]
        self._offset = rows["person"]["offset"]
        self._last_offset = rows["person"]["last_offset"]
        self._aim = rows["person"]["aim"]
        rows["person"]["aim_rate"] = aim_rate
        self._others_may = settings.stiffness_by != "action" or settings.acts == "person"

    def reset(self, ids: NDArray, randoms: Sequence[np.random.Generator]) -> None:
        """Begin an episode of bodies `ids` (K,), each drawing with its generator in `randoms` (K,)."""
        self._offset[ids] = 0.0
        self._last_offset[ids] = 0.0
        self._aim[ids] = 0.0
        if self._others_may:
            for index, random in zip(ids.tolist(), randoms, strict=True):
                self._source[index] = draw_source(self._settings, random)

    def offsets(self, actions: NDArray) -> NDArray:
        """Return the offsets (N, side, 3) [rad] of actions (N, 6), clipped to [-1, 1], in the order of
        `PERSON_ACTIONS`."""
        return self._range * np.clip(actions, -1.0, 1.0).reshape(-1, len(SIDES), len(MOVED))

    def move(self, offsets: NDArray, moving: NDArray, resting: NDArray) -> None:
        """Move the rest angles of the bodies `moving` (N,) by `offsets` (N, side, 3) [rad], those of bodies
        `resting` (N,) by 0."""
        self._offset[moving] = offsets[moving]
        self._offset[resting] = 0.0

    def replace(self, factor: NDArray, ranges: NDArray, running: NDArray, randoms: Sequence) -> None:
        """Write into `factor` the factors of the bodies whose stiffness others than the action set.

        Args:
            factor: (N, 4) factors of the actions on the stiffness [-], changed in place.
            ranges: (1, 4) factor at action 1 where no schedule sets the stiffness.
            running: (N,) bodies that take the step; a stiffness drawn anew is drawn for them.
            randoms: (N,) their generators.
        """
        if not self._others_may:
            return
        source = self._source
        for index in np.flatnonzero(running & (source["anew"] > 0)).tolist():
            source["drawn"][index] = randoms[index].uniform(-1.0, 1.0, 4)
        others = source["not_action"] > 0
        drawn = source["drawn"][others]
        scheduled = source["scheduled"][others, None] > 0
        factor[others] = np.where(scheduled, np.exp(drawn), ranges**drawn)
