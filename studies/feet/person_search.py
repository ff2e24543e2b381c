"""Turn a person who adapts to a foot, and the foot's own numbers, into a vector that a search moves."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.control import HELD_BY_SOUND, LegConstants, constants_from
from springfoot.envs.physics import INTACT, Feet
from springfoot.envs.settings import ADAPTED, KINDS, LEGS, SPRING_NUMBERS, foot_setting

from ..searches.leg_search import GAIN_STEP, Search

OF_MUSCLES = ("ankle_knots_deg", "toe_flat_deg", "ankle_schedule", "toe_schedule")
"""Constants that a leg whose ankle and toe are devices does not read."""
NEVER = ("neutral_deg",)
"""Constants that no leg reads with planned springs."""
ANGLE_STEP = {"ankle_deg": 1.0, "toe_deg": 3.0}
"""One unit of the search for a foot's rest angle [deg]; for a stiffness it is `GAIN_STEP`."""


@dataclass(frozen=True, kw_only=True)
class Person:
    """Candidate of a search: leg constants of both sides, and their foot."""

    sound: LegConstants
    other: LegConstants
    foot: str | dict[str, Any]
    """The foot as a setting, without `adapted`."""

    @property
    def feet(self) -> Feet:
        """Return a sound left foot, and this one on the right."""
        return INTACT, foot_setting("foot", self.foot).foot

    def setting(self, speed: float) -> dict[str, Any]:
        """Return the foot as a setting, with `adapted` for `speed` [m/s]."""
        foot = {"kind": self.foot} if isinstance(self.foot, str) else dict(self.foot)
        legs = dict(zip(LEGS, (asdict(self.sound), asdict(self.other)), strict=True))
        return foot | {ADAPTED: {f"{speed:g}": {leg: _with_lists(values) for leg, values in legs.items()}}}


class PersonSearch:
    """A person as a vector of unit steps from where the search began.

    Args:
        start: where it begins.
        speed: for which the constants are [m/s].
        design: steps of the foot's own numbers, in units of those of the legs; at 0 the numbers stay.
    """

    def __init__(self, start: Person, speed: float, design: float):
        self._start = start
        self._design = design
        self._legs = [Search(start.sound, speed), Search(start.other, speed)]
        foot = foot_setting("foot", start.foot)
        device = foot.foot.ankle.device is not None
        left_out = [NEVER, NEVER + HELD_BY_SOUND + (OF_MUSCLES if device else ())]  # of the sound and the other leg
        self._free = [
            np.array([name not in left_out_names for name in legs.names])
            for legs, left_out_names in zip(self._legs, left_out, strict=True)
        ]
        self._numbers = tuple(KINDS[foot.kind]) if design else ()
        self._numbers = tuple(name for name in self._numbers if name in SPRING_NUMBERS and name != "damping_time")
        self.size = sum(int(free.sum()) for free in self._free) + len(self._numbers)

    def person(self, vector: NDArray) -> Person:
        """Return the candidate at a vector (size,): entries of the sound leg, of the other leg, and of the foot."""
        first = 0  # entry of the next part in the vector
        legs = []
        for search, free in zip(self._legs, self._free, strict=True):
            steps = np.zeros(search.size)
            steps[free] = vector[first : first + int(free.sum())]
            first += int(free.sum())
            legs.append(search.constants(steps))
        sound, other = legs
        shared = {name: getattr(sound, name) for name in HELD_BY_SOUND}
        other = constants_from(asdict(other) | shared)
        return Person(sound=sound, other=other, foot=self._foot(vector[first:]))

    def _foot(self, steps: NDArray) -> str | dict[str, Any]:
        """Return the foot at these `steps` of its numbers: angles by steps, stiffness by e^(`GAIN_STEP` step)."""
        if not self._numbers:
            return self._start.foot
        foot: dict[str, Any] = (
            {"kind": self._start.foot} if isinstance(self._start.foot, str) else dict(self._start.foot)
        )
        for name, step in zip(self._numbers, self._design * steps, strict=True):
            known = SPRING_NUMBERS[name]
            usual = float(foot.get(name, known.usual))
            value = usual + ANGLE_STEP[name] * step if name in ANGLE_STEP else usual * np.exp(GAIN_STEP * step)
            foot[name] = round(float(np.clip(value, known.low, known.high)), 3)
        return foot


def _with_lists(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return `values` with lists for tuples, as in JSON."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}
