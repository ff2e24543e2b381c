"""Find the spring beside both ankles that helps weak calves.

    springfoot study orthosis learned

The stiffness of an orthosis is in N m/deg, as Waterval et al. measured it: in a planar simulation of both calves (2023)
more weakness and more speed want stiffer springs; in their people (2019) the worst spring took 10.7 % more than the
best. Mass is no case: with every device scaled alike it is an identity.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor
from typing import Any, ClassVar

import numpy as np

from springfoot.envs.settings import KINDS, SPRING_NUMBERS
from springfoot.errors import require_within

from .spring_map import SpringMap

PER_DEG = 180.0 / np.pi
"""N m/rad in 1 N m/deg."""
MOST_SPRING = floor(100.0 * 1000.0 / PER_DEG) / 100.0
"""Largest stiffness of an orthosis [N m/deg]: that of the setting, 1000 N m/rad, rounded down, as messages print it."""


@dataclass(frozen=True, kw_only=True)
class Orthosis(SpringMap):
    """Walk with weak calves, and orthoses of every stiffness at both ankles."""

    CASE: ClassVar[str] = "strength of both calves"
    CASES: ClassVar[Sequence[float]] = (0.2, 0.25, 0.3, 0.35, 1.0)
    """As a fraction of the model's sound one; a sound walk at 1.2 m/s uses 0.4."""
    SPRINGS: ClassVar[Sequence[float]] = (0.0, 0.9, 1.8, 2.7, 3.6, 4.9, 6.2, 7.4, 8.7)
    """[N m/deg]; Waterval et al. (2019) tried 0.9 to 8.7."""
    UNIT: ClassVar[str] = "N·m/deg"
    KINDS: ClassVar[Sequence[str]] = ("weak", "intact")

    def settings_of(self, case: float) -> Mapping[str, Any]:
        """Return no settings: the body is the usual one."""
        return {}

    def feet_of(self, case: float, spring: float) -> Mapping[str, Any]:
        """Return two weak calves (sound ones for 1) with an orthosis each, at rest at 0°."""
        foot = braced_calf(case, spring)
        return {"left_foot": foot, "right_foot": foot}


def braced_calf(strength: float, spring: float, rest_deg: float = 0.0) -> dict[str, Any]:
    """Return the setting of a foot in an orthosis of stiffness `spring` [N m/deg] and rest angle `rest_deg`, below a
    calf of `strength` times a sound calf's; raise `SpringfootError`, which names flags of `springfoot feet`, for a
    number out of range."""
    require_within("spring", spring, (0.0, MOST_SPRING), "N m/deg")
    rest = SPRING_NUMBERS["ankle_deg"]
    require_within("rest_deg", rest_deg, (rest.low, rest.high), rest.unit)
    if strength == 1.0:
        calf = {"kind": "intact"}
    else:
        weak = KINDS["weak"]["strength"]
        require_within("calf", strength, (weak.low, weak.high), weak.unit)
        calf = {"kind": "weak", "strength": strength}
    return calf | {"orthosis": {"ankle_stiffness": round(spring * PER_DEG, 3), "ankle_deg": rest_deg}}
