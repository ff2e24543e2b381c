"""The world of each body: the ground below either foot, noise on what is observed, and how late stiffness acts."""

from collections.abc import Sequence
from math import radians

import numpy as np
from numpy.typing import NDArray

from .model import SIDES
from .observation import OBSERVATION
from .settings import BipedSettings
from .simulation import WINDOW, Measurement, Simulation
from .walkers import Walkers

MID_SWING = 0.75
"""Phase at which a swinging foot gets the ground of its next footfall: it is then 35 mm or more above the old one."""


class World:
    """The worlds of N bodies; each draws from its environment's own generator.

    Args:
        settings: friction apart, which is the simulation's.
        simulation: whose ground this is.
        walkers: whose slope this is.
    """

    def __init__(self, settings: BipedSettings, simulation: Simulation, walkers: Walkers):
        self._settings, self._simulation = settings, simulation
        num = simulation.num
        self.slope = walkers.slope
        """(N,) of the ground [rad], uphill positive."""
        self.height = np.zeros((num, len(SIDES)))
        """(N, side) of the ground below a foot above the mean one [m]."""
        self.delay = np.full(num, round(settings.stiffness_delay_s / WINDOW))
        """(N,) control windows between a commanded stiffness and its action."""
        self._phase = np.zeros((num, len(SIDES)))
        self._scale = settings.sensor_noise * np.array([entry.measured for entry in OBSERVATION], float)
        self._noise = np.zeros((num, len(OBSERVATION)))
        self._low, self._high = (
            np.array([getattr(e, end) for e in OBSERVATION], np.float32) for end in ("low", "high")
        )

    def reset(self, ids: NDArray, randoms: Sequence[np.random.Generator], leg_phase: NDArray) -> None:
        """Start episodes of environments `ids` (K,), their legs at phases `leg_phase` (N, side), on even ground."""
        slopes, delays = self._settings.slope_range_deg, self._settings.stiffness_delay_range_s
        for index, random in zip(ids.tolist(), randoms, strict=True):
            if slopes is not None:
                self.slope[index] = radians(random.uniform(*slopes))
            if delays is not None:
                shortest, longest = (round(delay / WINDOW) for delay in delays)
                self.delay[index] = random.integers(shortest, longest + 1)
            self._draw_noise(index, random)
        self.height[ids], self._phase[ids] = 0.0, leg_phase[ids]
        self._simulation.lay(ids, self.slope[ids], self.height[ids])

    def advance(self, m: Measurement, leg_phase: NDArray, randoms: Sequence[np.random.Generator | None]) -> None:
        """After a control window: every foot that came to mid-swing gets the ground of its next footfall.

        It is no higher than the foot has room for. `leg_phase` (N, side) is the present one.
        """
        if self._settings.unevenness_m == 0.0:
            return
        arrived = (self._phase < MID_SWING) & (leg_phase >= MID_SWING)
        self._phase[:] = leg_phase
        for index, side in np.argwhere(arrived).tolist():
            random = randoms[index]
            if random is not None:
                room = self.height[index, side] + m.contact[index, side, :, 1].min()
                drawn = self._settings.unevenness_m * random.uniform(-1.0, 1.0)
                self.height[index, side] = min(drawn, max(room, self.height[index, side]))
        ids = np.flatnonzero(arrived.any(axis=1))
        self._simulation.lay(ids, self.slope[ids], self.height[ids])

    def sense(self, randoms: Sequence[np.random.Generator | None], running: NDArray) -> None:
        """Draw the noise of a new observation for those `running` (N,)."""
        if self._settings.sensor_noise > 0.0:
            for index in np.flatnonzero(running).tolist():
                random = randoms[index]
                if random is not None:
                    self._draw_noise(index, random)

    def seen(self, observation: NDArray) -> NDArray:
        """The observation (N, D) with the noise of its measured entries, within its bounds."""
        if self._settings.sensor_noise == 0.0:
            return observation
        return np.clip(observation + self._noise, self._low, self._high).astype(np.float32)

    def _draw_noise(self, index: int, random: np.random.Generator) -> None:
        if self._settings.sensor_noise > 0.0:
            self._noise[index] = self._scale * random.standard_normal(len(self._scale))
