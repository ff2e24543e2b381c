"""Compare the ankle's quasi-stiffness, the slope of its angle-moment curve, between people's mean curves and published
trials.
"""

from dataclasses import dataclass

import numpy as np

from ..people.human import human_gait
from .identification import PhaseSpring, identify


@dataclass(frozen=True, kw_only=True)
class QuasiStiffness:
    """One phase of the ankle's angle-moment curve: people's mean curves beside published single trials."""

    phase: str
    """Name of the phase, as published."""
    start: float
    """Stride phase at its beginning."""
    end: float
    """Stride phase at its end."""
    slope: float
    """Slope of people's mean curve, moment over angle by least squares [N m/(rad kg)]."""
    identified: PhaseSpring
    """Spring and damper of the phase, if theta_eq stood still in it (`identification`); K [N m/(rad kg)]."""
    published: float
    """Median of the published slopes [N m/(rad kg)]."""
    published_sd: float
    """Standard deviation of the published slopes over trials [N m/(rad kg)]."""


FUKUCHI_SPEED = 1.2
"""Middle [m/s] of the speed class of `FUKUCHI_OVERGROUND`, 1.1 to 1.3 m/s."""
FUKUCHI_OVERGROUND = (
    ("controlled plantarflexion", 0.0, 0.058, 1.20, 0.52),
    ("early rising", 0.058, 0.282, 2.14, 0.82),
    ("late rising", 0.282, 0.460, 8.33, 2.87),
    ("descending (push-off)", 0.460, 0.649, 3.48, 0.69),
)
"""Phase, its start and end, median and SD of the ankle's quasi-stiffness [N m/(rad kg)] in 25 overground trials of 25
adults (Fukuchi et al., PeerJ 6:e4640, 2018, CC BY 4.0; per-trial slopes computed in github.com/nikorose87/DJS-GA)."""


def ankle_quasi_stiffness() -> tuple[QuasiStiffness, ...]:
    """Return the ankle's quasi-stiffness in four phases at 1.2 m/s: people's (`human_gait`) beside another
    laboratory's.

    Quasi-stiffness is the slope of the angle-moment curve, not the K of a spring.
    """
    human = human_gait(FUKUCHI_SPEED)
    phase = np.arange(100) / 100
    angle = human.mean("ankle", phase)
    moment = human.mean("ankle_moment", phase)
    velocity = human.rate("ankle", phase) / human.stride_time
    # `identify` takes torques positive as the angle, opposite to people's moments. Phases end where the next begin.
    bounds = (0.0, *(end for _, _, end, _, _ in FUKUCHI_OVERGROUND))
    rows = []
    for row, spring in zip(FUKUCHI_OVERGROUND, identify(-moment, angle, velocity, phase, bounds), strict=True):
        name, start, end, median, sd = row
        inside = (phase >= start) & (phase < end)
        rows.append(
            QuasiStiffness(
                phase=name,
                start=start,
                end=end,
                slope=float(np.polyfit(angle[inside], moment[inside], 1)[0]),
                identified=spring,
                published=median,
                published_sd=sd,
            )
        )
    return tuple(rows)
