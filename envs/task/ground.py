"""The ground below each foot: its slope, and how much higher or lower each footfall is."""

from collections.abc import Sequence
from math import radians

import numpy as np
from numpy.typing import NDArray

from ..control.subjects import Subjects
from ..physics.measurement import Measurement
from ..physics.model import SIDES
from ..physics.simulation import Simulation
from ..settings import BipedSettings

NEXT_FOOTFALL_PHASE = 0.75
"""Stride phase, in mid-swing, at which a foot gets the ground of its next footfall: it is then 35 mm or more above the
old one."""


class Ground:
    """The ground of N bodies; each draws from its environment's own generator.

    Args:
        settings: slope and unevenness; friction is the simulation's.
        simulation: whose ground this is.
        subjects: they own the slope.
    """

    def __init__(self, settings: BipedSettings, simulation: Simulation, subjects: Subjects):
        self._settings, self._simulation = settings, simulation
        self.slope = subjects.slope
        """(N,) of the ground [rad], uphill positive."""
        self.height = np.zeros((simulation.num, len(SIDES)))
        """(N, side) of the ground below a foot above the mean one [m]."""
        self._phase = np.zeros((simulation.num, len(SIDES)))

    def reset(self, ids: NDArray, randoms: Sequence[np.random.Generator], leg_phase: NDArray) -> None:
        """Start episodes of environments `ids` (K,), their legs at phases `leg_phase` (N, side), on even ground."""
        if self._settings.slope_range_deg is not None:
            for index, random in zip(ids.tolist(), randoms, strict=True):
                self.slope[index] = radians(random.uniform(*self._settings.slope_range_deg))
        self.height[ids], self._phase[ids] = 0.0, leg_phase[ids]
        self._simulation.lay(ids, self.slope[ids], self.height[ids])

    def advance(self, m: Measurement, leg_phase: NDArray, randoms: Sequence[np.random.Generator | None]) -> None:
        """After a control window: every foot that came to mid-swing gets the ground of its next footfall.

        It is no higher than the foot has room for. `leg_phase` (N, side) is the present one.
        """
        if self._settings.unevenness_m == 0.0:
            return
        arrived = (self._phase < NEXT_FOOTFALL_PHASE) & (leg_phase >= NEXT_FOOTFALL_PHASE)
        self._phase[:] = leg_phase
        for index, side in np.argwhere(arrived).tolist():
            random = randoms[index]
            if random is not None:
                room = self.height[index, side] + m.contact[index, side, :, 1].min()
                drawn = self._settings.unevenness_m * random.uniform(-1.0, 1.0)
                self.height[index, side] = min(drawn, max(room, self.height[index, side]))
        ids = np.flatnonzero(arrived.any(axis=1))
        self._simulation.lay(ids, self.slope[ids], self.height[ids])
