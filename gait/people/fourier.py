"""Differentiate a periodic curve by its Fourier series."""

import numpy as np

from springfoot.arrays import NDArray

PLAN_HARMONICS = 20
"""Harmonics of the stride kept when a plan is differentiated (18 Hz at 1.2 m/s; thigh, knee and ankle within 0.05 deg
rms). The rate of its toe jumps at heel strike and toe-off: an infinite acceleration."""


def fourier_jet(samples: NDArray, harmonics: int, phase: NDArray, period: float) -> list[NDArray]:
    """Return a periodic curve's value (..., columns) at `phase` (...) [0..1], and two time derivatives.

    `samples` (n, columns) are evenly spaced over one `period` [s]. The curve is their Fourier series up to `harmonics`.
    """
    count = len(samples)
    weight = np.fft.rfft(samples, axis=0)[: harmonics + 1] / count
    weight[1:] *= 2  # each term stands for its negative frequency too, the mean for itself
    # Each time derivative multiplies a term by its angular frequency.
    turn = 2j * np.pi * np.arange(harmonics + 1)
    wave = np.exp(phase[..., None] * turn)
    return [np.real((wave * (turn / period) ** derivative) @ weight) for derivative in range(3)]
