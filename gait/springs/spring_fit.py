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
    """False if the data do not determine K and c; the numbers then mean nothing."""


def fit_spring(torque: NDArray, angle: NDArray, velocity: NDArray) -> SpringFit:
    """Fit tau = a - K theta - c theta' to torque, angle and velocity (..., n), n > 3, by least squares.

    It works on deviations from the means, scaled to unit size, so that no digits are lost to units or offsets.
    """
    count = torque.shape[-1]
    mean = np.stack([angle.mean(-1), velocity.mean(-1)], -1)
    deviation = np.stack([angle, velocity], -1) - mean[..., None, :]
    scale = np.sqrt((deviation**2).mean(-2))
    solvable = bool(np.all(scale > 1e-9 * (1 + np.abs(mean))))  # angle and velocity vary by more than rounding
    scale = np.where(scale > 0, scale, 1.0)  # no division by 0
    unit_columns = deviation / scale[..., None, :]  # angle and velocity, each of mean square 1
    # The normal equations X'X (K, c) = -X' torque, with the columns angle and velocity.
    gram = np.einsum("...ni,...nj->...ij", unit_columns, unit_columns)
    solvable &= bool(np.all(np.linalg.det(gram) > 1e-10 * count**2))  # not the same curve twice, but for its size
    inverse = np.linalg.pinv(gram, hermitian=True) / scale[..., None, :] / scale[..., :, None]
    moment = np.einsum("...ni,...n->...i", deviation, torque - torque.mean(-1, keepdims=True))
    slopes = -np.einsum("...ij,...j->...i", inverse, moment)  # K, c
    offset = torque.mean(-1) + np.einsum("...i,...i->...", slopes, mean)
    residual = torque - offset[..., None] + np.einsum("...ni,...i->...n", deviation + mean[..., None, :], slopes)
    freedom = count - 3
    variance = (residual**2).sum(-1) / freedom
    # a = mean torque + mean . (K, c), and the mean torque errs independently of the slopes.
    offset_covariance = np.einsum("...ij,...j->...i", inverse, mean)
    covariance = np.empty((*variance.shape, 3, 3))
    covariance[..., 1:, 1:] = inverse
    covariance[..., 0, 1:] = covariance[..., 1:, 0] = offset_covariance
    covariance[..., 0, 0] = 1 / count + np.einsum("...i,...i->...", offset_covariance, mean)
    return SpringFit(
        np.concatenate([offset[..., None], slopes], -1),
        covariance * variance[..., None, None],
        residual,
        freedom,
        solvable,
    )


def intervals(fit: SpringFit) -> list[tuple[NDArray, NDArray, NDArray]]:
    """Return (value, low, high) of K, of beta = c / K and of theta_eq = a / K, each (...).

    a, K and c are the coefficients of the fit, tau = a - K theta - c theta'. Intervals of ratios are Fieller's (1954),
    exact: all r for which numerator - r K does not differ from 0. If K may be 0 a ratio has no bounds.
    """
    quantile = stdtrit(fit.freedom, (1 + CONFIDENCE) / 2)  # Student's t
    # v are covariances of a, K, c times the squared quantile: squared half widths.
    a, K, c = np.moveaxis(fit.coefficients, -1, 0)
    v = np.moveaxis(fit.covariance, (-2, -1), (0, 1)) * quantile**2
    results = [(K, K - np.sqrt(v[1, 1]), K + np.sqrt(v[1, 1]))]
    with np.errstate(divide="ignore", invalid="ignore"):
        for numerator, index in ((c, 2), (a, 0)):  # index: that of the numerator among a, K, c
            # The bounds are the roots of (numerator - r K)^2 = v_nn - 2 r v_nK + r^2 v_KK.
            square = K**2 - v[1, 1]
            centre = (numerator * K - v[index, 1]) / square
            product = (numerator**2 - v[index, index]) / square
            half = np.sqrt(np.maximum(centre**2 - product, 0.0))  # not below 0 by rounding
            bounded = square > 0
            low = np.where(bounded, centre - half, -np.inf)
            high = np.where(bounded, centre + half, np.inf)
            results.append((numerator / K, low, high))
    return results
