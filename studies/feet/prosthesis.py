"""Find the stiffness of a passive prosthetic ankle for bodies of several masses.

    springfoot study prosthesis learned

The right foot is the prosthesis; its toe and rest angle are the usual ones. walks.csv has the sound side's peak force
and the prosthesis's push-off beside the price.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from .spring_map import SpringMap


@dataclass(frozen=True, kw_only=True)
class Prosthesis(SpringMap):
    """Walk on passive right feet of every stiffness."""

    CASE: ClassVar[str] = "mass of the body [kg]"
    CASES: ClassVar[Sequence[float]] = (50.0, 63.0, 80.0)
    SPRINGS: ClassVar[Sequence[float]] = (*np.arange(150.0, 501.0, 50.0).tolist(), 600.0, 800.0, 1000.0, 1500.0)
    """[N m/rad]; with a coarser grid the parabola through the best and its neighbours lies off by a fifth."""
    KINDS: ClassVar[Sequence[str]] = ("passive",)

    def settings_of(self, case: float) -> Mapping[str, Any]:
        """Return the setting `mass` with the value `case` [kg]."""
        return {"mass": case}

    def feet_of(self, case: float, spring: float) -> Mapping[str, Any]:
        """Return the setting of a passive right foot with an ankle of stiffness `spring` [N m/rad]."""
        return {"right_foot": {"kind": "passive", "ankle_stiffness": spring}}
