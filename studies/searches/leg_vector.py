"""Turn leg constants into a vector of unit steps, which the search of `leg_tuning` moves."""

from dataclasses import asdict

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.control import KNOTS, TUNED_SPEED, LegConstants, constants_from
from springfoot.gait.people import HumanGait, human_gait
from springfoot.gait.springs import LOWEST_STIFFNESS

KNOT_STEP, GAIN_STEP = 2.0, 0.15
"""Unit steps of the search: of a knot [deg], of a gain [fraction of it]."""
ADDITIVE_STEP = {
    "toe_flat_deg": 3.0,
    "trunk_pitch_deg": 1.0,
    "swing_speed_gain": 0.05,
    "speed_torque": 15.0,
    "period_speed_gain": 0.03,
}
"""Unit steps of constants that may change sign or vanish, in the units of the constants."""
LEAD_STEP = 0.005
"""Unit step of the lead of a whole target curve of hip, knee or ankle [stride]. A search that moves knots one by one
does not find a lead: half a percent at hip and knee takes a degree off the knee of the planned walk at 1.2 m/s."""
LED = {"hip_knots_deg": "thigh", "knee_knots_deg": "knee", "ankle_knots_deg": "ankle"}
"""Constants' knots -> the target curve that the lead shifts."""
LEAST = {"ankle_schedule": LOWEST_STIFFNESS[0], "toe_schedule": LOWEST_STIFFNESS[1]}
"""Lower bounds of constants [N m/rad]."""


class Search:
    """Vectors of a search, in unit steps from its start, and the leg constants that they stand for.

    The last three entries of a vector lead whole target curves (`LED`). `names` (size,) has the constant of each entry.
    """

    def __init__(self, start: LegConstants, speed: float = TUNED_SPEED, target: HumanGait | None = None):
        self._start = {name: np.atleast_1d(np.array(value, float)) for name, value in asdict(start).items()}
        target = target or human_gait(speed)
        # Change of the knots [deg] that shifts a target curve by one `LEAD_STEP`: the step times the curve's rate.
        self._lead = {name: LEAD_STEP * np.rad2deg(target.rate(curve, KNOTS)) for name, curve in LED.items()}
        self.names = tuple(name for name, value in self._start.items() for _ in value) + tuple(LED)
        self.size = len(self.names)

    def constants(self, vector: NDArray) -> LegConstants:
        """Return the constants at a vector (size,): start plus steps, for gains start times e^(`GAIN_STEP` step).

        Constants in `LEAST` are not below their bound there; all are rounded to 5 decimals.
        """
        values = {}
        first = 0  # entry of the next constant in the vector
        leads = dict(zip(LED, vector[-len(LED) :], strict=True))
        for name, start in self._start.items():
            step = vector[first : first + start.size]
            first += start.size
            if name in LED:
                value = start + KNOT_STEP * step + leads[name] * self._lead[name]
            elif name == "neutral_deg":
                value = start + KNOT_STEP * step
            elif name in ADDITIVE_STEP:
                value = start + ADDITIVE_STEP[name] * step
            else:
                value = start * np.exp(GAIN_STEP * step)
            if name in LEAST:
                value = np.maximum(value, LEAST[name])  # an action sets no less
            values[name] = [float(round(x, 5)) for x in value] if start.size > 1 else float(round(value[0], 5))
        return constants_from(values)
