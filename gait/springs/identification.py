"""Identify K, beta and theta_eq from torque, angle and velocity of an undisturbed gait.

In each phase of the stride the joint is taken as one spring and damper, torque = K (theta_eq - theta - beta theta'),
which is linear in K theta_eq, K and K beta: ordinary least squares. Intervals are exact if the torque's errors are
independent, normal and of one size, and angle and velocity are without error. Neither holds in a gait laboratory:
smoothed or averaged curves have errors that last for many samples, and then the intervals are too narrow (a warning
says so); white noise of standard deviation d on the angle makes K too small, by s^2 / (s^2 + d^2) with s the angle's
spread (`PhaseSpring.angle_spread`).

Its limit: no data of an undisturbed gait tell a theta_eq that stands still from one that moves with the angle. The
result is the slope of the loop of torque over angle (quasi-stiffness), and the spring's K only if theta_eq stood still
in the phase. On the simulation's own schedule, with a theta_eq that moves, it gives 162 N m/rad for an applied 424 at
30-44 % of the stride, and 137 for 296 at 50-62 % (`springfoot study identify schedule`); interval and warning do not
show it. If a gait can be pushed, `identification_by_pushes` finds K itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_number, require_within

from .spring_fit import Estimate, fit_spring, intervals

COLLINEAR = 0.95
"""Correlation of angle and velocity beyond which K and beta can hardly be separated (variance inflation above 10)."""
ILL_CONDITIONED = 30.0
"""Condition number of (1, angle, velocity), columns of unit length, beyond which it harms (Belsley et al. 1980)."""
LEAST_SPREAD = np.deg2rad(0.5)
"""Angle spread [rad] below which there is too little motion: the best gait laboratories err by as much, and such an
error would halve K."""
CORRELATED = 0.5
"""Lag-1 correlation of the residuals beyond which a warning calls the intervals too narrow."""

PARAMETERS = ("stiffness", "damping_time", "equilibrium")


@dataclass(frozen=True, kw_only=True)
class PhaseSpring:
    """The spring and damper identified in one phase; None for numbers that the data do not determine."""

    start: float
    """Stride phase at its beginning."""
    end: float
    """Stride phase at its end."""
    samples: int
    """Samples in the phase."""
    stiffness: Estimate | None
    """K [N m/rad]; its interval by Student's t."""
    damping_time: Estimate | None
    """beta [s], a ratio of two estimates: its interval is Fieller's."""
    equilibrium: Estimate | None
    """theta_eq [rad], with Fieller's interval."""
    r2: float | None
    """Fraction of the torque's variance that the spring explains [0..1]."""
    correlation: float | None
    """Correlation of angle and velocity [-1..1]."""
    condition: float
    """Condition number of (1, angle, velocity), columns of unit length."""
    angle_spread: float
    """Standard deviation of the part of the angle that velocity does not explain [rad]; K is found by it."""
    residual_correlation: float | None
    """Lag-1 correlation of the residuals in the order given [-1..1]; None if they are mere rounding."""
    warning: str
    """Reason to doubt the numbers, one line; "" if there is none."""


def identify(
    torque: ArrayLike,
    angle: ArrayLike,
    velocity: ArrayLike,
    phase: ArrayLike,
    bounds: Sequence[float],
    margin: float = 0,
) -> tuple[PhaseSpring, ...]:
    """Identify K, beta and theta_eq of each phase of the stride by least squares, with their intervals.

    They are those of a spring only if its theta_eq stood still in the phase; otherwise use
    `identification_by_pushes.identify_pushed`.

    Args:
        torque: [N m], or per kg, positive as the angle (a plantarflexion moment with its sign turned).
        angle: [rad]. velocity: [rad/s]. All arrays of one shape, of one stride or many.
        phase: stride phase of each sample [0, 1).
        bounds: (P + 1,) ascending stride phases [0, 1] between which springs are constant: P phases.
        margin: part of the stride left out at both ends of each phase, where data change from spring to spring.

    Returns:
        P results, in the order of `bounds`. Raises `SpringfootError` for bad arrays or bounds.
    """
    return tuple(
        _phase_spring(edges, *curves)
        for edges, curves in _samples_by_phase(torque, angle, velocity, phase, bounds, margin)
    )


def _phase_spring(edges: tuple[float, float], torque: NDArray, angle: NDArray, velocity: NDArray) -> PhaseSpring:
    """Identify the spring of one phase, from its bounds and its samples (n,), and collect reasons to doubt it."""
    count = len(torque)
    estimates: Sequence[Estimate | None] = [None] * len(PARAMETERS)
    r2 = correlation = residual_correlation = None
    spread = 0.0
    condition = np.inf
    reasons = []
    if count <= 3:
        reasons.append(f"{count} samples are too few for three unknowns")
    else:
        fit = fit_spring(torque, angle, velocity)
        columns = np.stack([np.ones(count), angle, velocity], -1)
        lengths = np.sqrt((columns**2).sum(0))
        # A column of zeros, say of a joint at rest, keeps its length of 0.
        condition = float(np.linalg.cond(columns / np.where(lengths > 0, lengths, 1.0)))
        angle_deviation = angle - angle.mean()
        velocity_deviation = velocity - velocity.mean()
        deviation_product = np.sqrt((angle_deviation @ angle_deviation) * (velocity_deviation @ velocity_deviation))
        correlation = (
            float(np.clip(angle_deviation @ velocity_deviation / deviation_product, -1, 1))
            if deviation_product > 0
            else None
        )
        # The spread without the part that velocity explains; without a correlation it explains nothing.
        spread = float(np.sqrt(angle_deviation @ angle_deviation / count * (1 - (correlation or 0.0) ** 2)))
        if correlation is not None and abs(correlation) > COLLINEAR:
            reasons.append(f"angle and velocity are nearly collinear (r = {correlation:.3f})")
        elif condition > ILL_CONDITIONED:
            reasons.append(f"angle and velocity hardly differ from constants (condition {condition:.0f})")
        if spread < LEAST_SPREAD:
            reasons.append(f"too little motion (angle spread {np.rad2deg(spread):.2f} deg)")
        if not fit.solvable:
            reasons.append("K, beta and theta_eq cannot be told apart")
        else:
            # K, beta, theta_eq: the order of `PARAMETERS`.
            estimates = fitted = [Estimate(*map(float, numbers)) for numbers in intervals(fit)]
            unexplained = fit.residual @ fit.residual
            total = np.sum((torque - torque.mean()) ** 2)
            r2 = float(1 - unexplained / total) if total > 0 else None
            if unexplained > 1e-20 * (torque @ torque):  # otherwise the residuals are mere rounding
                residual_correlation = float(fit.residual[1:] @ fit.residual[:-1] / unexplained)
            if fitted[0].low <= 0:
                reasons.append(
                    "the torque grows with the angle: no spring"
                    if fitted[0].high < 0
                    else "stiffness is not significantly above 0: beta and theta_eq have no bounds"
                )
            if residual_correlation is not None and residual_correlation > CORRELATED:
                reasons.append(
                    f"residuals are correlated ({residual_correlation:.2f} from sample to sample): intervals too narrow"
                )
    return PhaseSpring(
        start=edges[0],
        end=edges[1],
        samples=count,
        **dict(zip(PARAMETERS, estimates, strict=True)),
        r2=r2,
        correlation=correlation,
        condition=condition,
        angle_spread=spread,
        residual_correlation=residual_correlation,
        warning="; ".join(reasons),
    )


def _samples_by_phase(
    torque: ArrayLike, angle: ArrayLike, velocity: ArrayLike, phase: ArrayLike, bounds: Sequence[float], margin: float
) -> list[tuple[tuple[float, float], tuple[NDArray, NDArray, NDArray]]]:
    """Return the samples of each phase: its two bounds, and torque, angle and velocity (n,) in it without the margin.

    Arguments are as in `identify`; raises `SpringfootError` for bad ones.
    """
    arrays = [np.asarray(values, float) for values in (torque, angle, velocity, phase)]
    shapes = [values.shape for values in arrays]
    if len(set(shapes)) > 1 or not all(np.isfinite(values).all() for values in arrays):
        raise SpringfootError(
            f"torque, angle, velocity and phase must be finite numbers of one shape, got shapes {shapes}"
        )
    edges = [require_within("a bound", bound, (0.0, 1.0)) for bound in bounds]
    if len(edges) < 2 or edges != sorted(set(edges)):
        raise SpringfootError(f"bounds must be two or more ascending stride phases, got {edges}")
    require_number("margin", margin, 0.0, 0.5, "of a stride")
    torque, angle, velocity, phase = arrays
    insides = [(phase >= low + margin) & (phase < high - margin) for low, high in pairwise(edges)]
    return [
        (span, (torque[inside], angle[inside], velocity[inside]))
        for span, inside in zip(pairwise(edges), insides, strict=True)
    ]
