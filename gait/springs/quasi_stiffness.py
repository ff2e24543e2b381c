"""Compute quasi-stiffness, the slope of a joint's moment over its angle, by phase of stance.

That of strides is the slope of their mean curves, with an interval over strides.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from springfoot.arrays import NDArray

from .jackknife import jackknife_interval
from .spring_fit import Estimate
from .stiffness import ankle_events, toe_events

SMALLEST_TURN = np.radians(2.0)
"""Least excursion of the angle in a phase for a slope over it to mean something [rad]; chosen."""
SLOPE_STEP = 0.0005
"""Time between the samples of a slope [strides]; chosen: with 0.005 the ends of a phase weigh too much, up to 5 %."""
FUKUCHI_OVERGROUND = (
    ("controlled plantarflexion", 0.0, 0.058, 1.20, 0.52),
    ("early rising", 0.058, 0.282, 2.14, 0.82),
    ("late rising", 0.282, 0.460, 8.33, 2.87),
    ("descending (push-off)", 0.460, 0.649, 3.48, 0.69),
)
"""Phase, its start and end, median and SD of the ankle's quasi-stiffness [N m/(rad kg)] in 25 overground trials of 25
adults at 1.1 to 1.3 m/s (Fukuchi et al., PeerJ 6:e4640, 2018, CC BY 4.0; per-trial slopes computed in
github.com/nikorose87/DJS-GA)."""


class StancePhase(NamedTuple):
    """A part of stance."""

    name: str
    start: float
    """Stride phase at its beginning."""
    end: float
    """Stride phase at its end."""


def stance_phases(joint: str, angle: NDArray, toe_off: float) -> list[StancePhase]:
    """Return the phases of stance of a joint, ankle or toe, from its mean angle (P,) over equal parts of the stride.

    The ankle's are those of `FUKUCHI_OVERGROUND`: they end at foot flat, half-way between it and maximum dorsiflexion,
    at maximum dorsiflexion and at toe-off. The toe's end at heel-off, at its largest angle and at toe-off. A phase that
    a walk does not have is left out.
    """
    phase = np.linspace(0.0, 1.0, len(angle))
    if joint == "ankle":
        strike, flat, top, off = ankle_events(phase, angle, toe_off).values()
        bounds = [strike, flat, (flat + top) / 2, top, off]
        names = [name for name, *_ in FUKUCHI_OVERGROUND]
    else:
        bounds = list(toe_events(phase, angle, toe_off).values())
        names = ["flat foot", "heel rise", "push-off"]
    return [
        StancePhase(name, start, end) for name, (start, end) in zip(names, pairwise(bounds), strict=True) if end > start
    ]


def phase_slope(angle: NDArray, moment: NDArray, phase: StancePhase) -> Estimate | None:
    """Return the slope of the mean moment over the mean angle in a phase, by least squares, [N m/rad] for [N m].

    `angle` [rad] and `moment` (S, P) are curves of S strides over equal parts of the stride; the moment is positive
    against the angle, so that a spring's slope is positive. The interval leaves out one stride after another
    (`jackknife`); of a single stride it is infinite. None where the angle makes less than `SMALLEST_TURN`.
    """
    count = max(round((phase.end - phase.start) / SLOPE_STEP), 2) + 1
    at = np.linspace(phase.start, phase.end, count)
    parts = np.linspace(0.0, 1.0, angle.shape[1])
    angles, moments = (np.array([np.interp(at, parts, row) for row in rows]) for rows in (angle, moment))
    if np.ptp(angles.mean(axis=0)) < SMALLEST_TURN:
        return None

    def slope(of: NDArray) -> float:
        return float(np.polyfit(angles[of].mean(axis=0), moments[of].mean(axis=0), 1)[0])

    strides = np.arange(len(angles))
    value = slope(strides)
    if len(strides) < 2:
        return Estimate(value, -np.inf, np.inf)
    return jackknife_interval(value, np.array([slope(strides[strides != stride]) for stride in strides]))
