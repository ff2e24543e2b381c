"""Lay the ground below each foot: its slope, and the height of each footfall above or below the mean ground."""

from collections.abc import Sequence
from math import radians

import numpy as np

from springfoot.arrays import NDArray

from ..control.subjects import Subjects
from ..physics.measurement import Measurement
from ..physics.simulation import Simulation
from ..settings.settings import BipedSettings

NEXT_FOOTFALL_PHASE = 0.75
"""Stride phase at which a swinging foot gets the ground of its next footfall; chosen: the foot is then in mid-swing, at
least 35 mm above the ground that it left."""


class Ground:
    """Ground of N bodies, drawn from the generators of their environments.

    Args:
        settings: slope and unevenness; the simulation's models have the friction.
        simulation: simulation in which the ground is laid.
        subjects: bodies; their slope is changed.
        rows: (N,) of `TASK_ROW`; `ground` is changed.
    """

    def __init__(self, settings: BipedSettings, simulation: Simulation, subjects: Subjects, rows: NDArray):
        self._settings = settings
        self._simulation = simulation
        self.slope = subjects.slope
        """(N,) slope of the ground [rad], uphill positive."""
        self.height = rows["ground"]["height"]
        """(N, side) height of the ground below each foot above the mean ground [m]."""
        self._phase = rows["ground"]["phase"]  # (N, side) stride phases a window ago

    def reset(self, ids: NDArray, randoms: Sequence[np.random.Generator], leg_phase: NDArray) -> None:
        """Begin episodes of environments `ids` (K,) on even ground, with legs at the phases `leg_phase` (N, side)."""
        if self._settings.slope_range_deg is not None:
            for index, random in zip(ids.tolist(), randoms, strict=True):
                self.slope[index] = radians(random.uniform(*self._settings.slope_range_deg))
        self.height[ids] = 0.0
        self._phase[ids] = leg_phase[ids]
        self._simulation.lay(ids, self.slope[ids], self.height[ids])

    def advance(self, m: Measurement, leg_phase: NDArray, randoms: Sequence[np.random.Generator | None]) -> None:
        """Lay the ground of the next footfall below every foot that reached mid-swing in the last control window.

        The new ground stays below the foot. `m` and `leg_phase` (N, side) are measurement and stride phases after the
        window, `randoms` the generators of the environments.
        """
        arrived = (self._phase < NEXT_FOOTFALL_PHASE) & (leg_phase >= NEXT_FOOTFALL_PHASE)
        self._phase[:] = leg_phase
        for index, side in np.argwhere(arrived).tolist():
            random = randoms[index]
            if random is not None:
                lowest_point = self.height[index, side] + m.contact[index, side, :, 1].min()  # above the mean ground
                drawn = self._settings.unevenness_m * random.uniform(-1.0, 1.0)
                # Not into the foot: at most up to its lowest point, unless the old ground is already higher.
                self.height[index, side] = min(drawn, max(lowest_point, self.height[index, side]))
        ids = np.flatnonzero(arrived.any(axis=1))
        self._simulation.lay(ids, self.slope[ids], self.height[ids])
