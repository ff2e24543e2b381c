"""Fit a spring and damper to one stretch of data by least squares, with intervals, for `identification`."""

from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from springfoot.arrays import NDArray

CONFIDENCE = 0.95
"""Confidence of every interval."""


class Estimate(NamedTuple):
    """A number and its 95 % confidence interval, which is infinite where the data set no bound."""

    value: float
    low: float
    high: float


class SpringFit(NamedTuple):
    """Fit of tau = a - K theta - c theta' along the last axis; leading axes are fits of their own."""

    coefficients: NDArray
    """(..., 3) a, K, c."""
    covariance: NDArray
    """(..., 3, 3) covariance of a, K, c."""
    residual: NDArray
    """(..., n) residuals of the torque."""
    freedom: int
    """Degrees of freedom, n - 3."""
    solvable: bool
    """False if the data leave K and c open; the numbers then mean nothing."""


def fit_spring(torque: NDArray, angle: NDArray, velocity: NDArray) -> SpringFit:
    """Fit by least squares about the means, angle and velocity scaled to unit size: no digits lost to units or
    offsets."""
    count = torque.shape[-1]
    mean = np.stack([angle.mean(-1), velocity.mean(-1)], -1)
    moved = np.stack([angle, velocity], -1) - mean[..., None, :]
    size = np.sqrt((moved**2).mean(-2))
    solvable = bool(np.all(size > 1e-9 * (1 + np.abs(mean))))
    size = np.where(size > 0, size, 1.0)
    unit = moved / size[..., None, :]
    gram = np.einsum("...ni,...nj->...ij", unit, unit)
    solvable &= bool(np.all(np.linalg.det(gram) > 1e-10 * count**2))
    inverse = np.linalg.pinv(gram, hermitian=True) / size[..., None, :] / size[..., :, None]
    pull = np.einsum("...ni,...n->...i", moved, torque - torque.mean(-1, keepdims=True))
    slopes = -np.einsum("...ij,...j->...i", inverse, pull)  # K, c
    offset = torque.mean(-1) + np.einsum("...i,...i->...", slopes, mean)
    residual = torque - offset[..., None] + np.einsum("...ni,...i->...n", moved + mean[..., None, :], slopes)
    freedom = count - 3
    variance = (residual**2).sum(-1) / freedom
    # a = mean torque + mean . (K, c), and the mean torque errs independently of the slopes.
    across = np.einsum("...ij,...j->...i", inverse, mean)
    covariance = np.empty((*variance.shape, 3, 3))
    covariance[..., 1:, 1:] = inverse
    covariance[..., 0, 1:] = covariance[..., 1:, 0] = across
    covariance[..., 0, 0] = 1 / count + np.einsum("...i,...i->...", across, mean)
    return SpringFit(
        np.concatenate([offset[..., None], slopes], -1),
        covariance * variance[..., None, None],
        residual,
        freedom,
        solvable,
    )


def intervals(fit: SpringFit) -> list[tuple[NDArray, NDArray, NDArray]]:
    """Return (value, low, high) of K, beta and theta_eq.

    Fieller 1954 for the ratios: all r for which the numerator - r K does not differ from 0. Exact, other than the delta
    method; if K may be 0 the ratio has no bounds.
    """
    quantile = stdtrit(fit.freedom, (1 + CONFIDENCE) / 2)  # Student's t
    a, K, c = np.moveaxis(fit.coefficients, -1, 0)
    v = np.moveaxis(fit.covariance, (-2, -1), (0, 1)) * quantile**2
    results = [(K, K - np.sqrt(v[1, 1]), K + np.sqrt(v[1, 1]))]
    with np.errstate(divide="ignore", invalid="ignore"):
        for top, index in ((c, 2), (a, 0)):
            squared = K**2 - v[1, 1]
            middle = (top * K - v[index, 1]) / squared
            product = (top**2 - v[index, index]) / squared
            half = np.sqrt(np.maximum(middle**2 - product, 0.0))
            bounded = squared > 0
            low = np.where(bounded, middle - half, -np.inf)
            high = np.where(bounded, middle + half, np.inf)
            results.append((top / K, low, high))
    return results
