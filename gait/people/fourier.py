"""Differentiate a periodic curve by its Fourier series."""

from functools import lru_cache

import numpy as np

from springfoot.arrays import NDArray

PLAN_HARMONICS = 20
"""Harmonics of the stride kept when a plan is differentiated (18 Hz at 1.2 m/s; thigh, knee and ankle within 0.05 deg
rms). The rate of its toe jumps at heel strike and toe-off: an infinite acceleration."""


def fourier_jet(samples: NDArray, harmonics: int, phase: NDArray, period: float) -> list[NDArray]:
    """Return a periodic curve's value (..., columns) at `phase` (...) [0..1], and two time derivatives.

    `samples` (n, columns) are evenly spaced over one `period` [s]. The curve is their Fourier series up to `harmonics`.
    """
    weight = np.fft.rfft(samples, axis=0)[: harmonics + 1] / len(samples)
    weight[1:] *= 2  # each term stands for its negative frequency too, the mean for itself
    values = np.real(_waves(phase.tobytes(), harmonics, period) @ weight)
    return list(values.reshape(3, *phase.shape, -1))


@lru_cache(maxsize=8)
def _waves(phases: bytes, harmonics: int, period: float) -> NDArray:
    """Return the terms (3 N, harmonics + 1) of a Fourier series, then their first and second time derivatives.

    `phases` (N,) are float64 in bytes. Cached, as a plan is differentiated a dozen times.
    """
    # Each time derivative multiplies a term by its angular frequency.
    turn = 2j * np.pi * np.arange(harmonics + 1)
    wave = _wave(phases, harmonics)
    return np.concatenate([wave * (turn / period) ** derivative for derivative in range(3)])


@lru_cache(maxsize=8)
def _wave(phases: bytes, harmonics: int) -> NDArray:
    """Return the terms (N, harmonics + 1) of a Fourier series at the `phases` of `_waves`; cached."""
    return np.exp(np.frombuffer(phases)[:, None] * (2j * np.pi * np.arange(harmonics + 1)))
