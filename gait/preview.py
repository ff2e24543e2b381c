"""Preview control of the zero-moment point (ZMP): the CoM motion over any ZMP reference, known a little ahead.

S. Kajita et al., "Biped walking pattern generation by using preview control of zero-moment point", ICRA 2003,
pp. 1620-1626; the gains after T. Katayama et al., Int. J. Control 41 (1985) 677-699. Where the height is constant and
the whole ZMP known, `cart_table` has the exact motion.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import inf

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_discrete_are

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_number, require_within

from .body.body import GRAVITY

HORIZON = 2.4
"""How much of the reference is known ahead [s]; chosen. With Kajita's 1.6 s the CoM of a walk at 1.2 m/s stays 4.6 mm
behind, as the reference counts as constant beyond the horizon; with 2.4 s it stays 0.4 mm behind."""
ERROR_WEIGHT = 1.0
"""Q_e, of the squared sum of ZMP errors [1/m^2] (Kajita et al. 2003, caption of the preview gains)."""
JERK_WEIGHT = 1e-6
"""R, of the squared change of jerk from tick to tick [s^6/m^2] (as above; the state has no weight there either)."""
TICK_RANGE = (1e-4, 0.1)
"""Accepted ticks [s]; chosen."""
HEIGHT_RANGE = (0.05, 10.0)
"""Accepted CoM heights [m]; chosen."""
FEWEST_SAMPLES = 2
"""Fewest samples of a reference."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PreviewMotion:
    """A CoM over time as preview control moves it; arrays (T,), one entry a tick; made by `preview_com`."""

    x: NDArray
    """Forward position [m]."""
    velocity: NDArray
    """[m/s]."""
    acceleration: NDArray
    """[m/s^2]; the jerk is constant within a tick, so it is continuous."""
    zmp: NDArray
    """ZMP [m] by equation (1), which follows the reference."""


def preview_com(
    zmp_reference: ArrayLike,
    tick: float,
    height: float,
    *,
    horizon: float = HORIZON,
    error_weight: float = ERROR_WEIGHT,
    jerk_weight: float = JERK_WEIGHT,
) -> PreviewMotion:
    """The CoM at constant `height` [m] whose ZMP follows `zmp_reference` (T,) [m], sampled every `tick` [s].

    The cart-table driven by its jerk u, state s = (x, x', x''), s(k+1) = A s(k) + b u(k), p = c s with
    c = (1, 0, -height/g), minimises the sum of error_weight (p - p_ref)^2 + jerk_weight (u(k) - u(k-1))^2 by
    u(k) = -G_e sum_{i<=k} (p - p_ref)(i) - G_s s(k) + sum_{j=1..N} G_p(j) p_ref(k+j), N = horizon / tick. It
    begins at rest over the first sample; the reference is held at its ends beyond the data.
    Raises `SpringfootError` for a reference that is not a row of finite numbers and for settings out of range.
    """
    reference = _row(zmp_reference)
    tick = require_within("tick", tick, TICK_RANGE, "s")
    height = require_within("height", height, HEIGHT_RANGE, "m")
    require_within("horizon", horizon, (tick, 60.0), "s")
    require_number("error_weight", error_weight, 0.0, above=True)
    require_number("jerk_weight", jerk_weight, 0.0, above=True)
    ahead = round(horizon / tick)
    of_error, of_state, of_preview = _gains(tick, height, ahead, float(error_weight), float(jerk_weight))
    advance, push, _ = _cart_table(tick, height)

    # Seen from where it stands at first, what the gains cut off at the horizon does not depend on the origin.
    origin = reference[0]
    reference = reference - origin
    held = np.concatenate([reference, np.full(ahead, reference[-1])])
    previewed = np.correlate(held[1:], of_preview, "valid")
    states = np.empty((len(reference), 3))
    state, error = np.zeros(3), 0.0
    lever = height / GRAVITY
    for k, wanted in enumerate(reference):
        states[k] = state
        error += state[0] - lever * state[2] - wanted
        state = advance @ state + push * (previewed[k] - of_error * error - of_state @ state)
    x, velocity, acceleration = states.T
    x = x + origin
    return PreviewMotion(x=x, velocity=velocity, acceleration=acceleration, zmp=x - lever * acceleration)


def _cart_table(tick: float, height: float) -> tuple[NDArray, NDArray, NDArray]:
    """A (3, 3), b (3,) and c (3,) of s(k+1) = A s(k) + b u(k), p(k) = c s(k) (equation (10))."""
    advance = np.array([[1.0, tick, tick**2 / 2], [0.0, 1.0, tick], [0.0, 0.0, 1.0]])
    push = np.array([tick**3 / 6, tick**2 / 2, tick])
    return advance, push, np.array([1.0, 0.0, -height / GRAVITY])


@lru_cache(maxsize=8)
def _gains(
    tick: float, height: float, ahead: int, error_weight: float, jerk_weight: float
) -> tuple[float, NDArray, NDArray]:
    """(G_e, G_s (3,), G_p (ahead,)) of the control law."""
    a, b, c = _cart_table(tick, height)
    # Of the state (error, s(k) - s(k-1)): its cost has the error alone, its input is the change of jerk.
    advance = np.block([[np.ones((1, 1)), (c @ a)[None]], [np.zeros((3, 1)), a]])
    push = np.array([[c @ b], *b[:, None]])
    weight = np.diag([error_weight, 0.0, 0.0, 0.0])
    cost = solve_discrete_are(advance, push, weight, [[jerk_weight]])
    scale = 1 / (jerk_weight + push.T @ cost @ push)
    gain = (scale * push.T @ cost @ advance)[0]

    closed = (advance - push * gain).T
    of_preview, future = np.empty(ahead), cost[:, 0]
    for j in range(ahead):
        of_preview[j] = (scale * push.T @ future).item()
        future = closed @ future
    return float(gain[0]), gain[1:], of_preview


def _row(zmp_reference: ArrayLike) -> NDArray:
    try:
        reference = np.asarray(zmp_reference, float)
    except (TypeError, ValueError, OverflowError) as error:
        raise SpringfootError("zmp_reference must be a row of numbers [m]") from error
    if reference.ndim != 1 or len(reference) < FEWEST_SAMPLES:
        raise SpringfootError(
            f"zmp_reference must have shape (T,) with T >= {FEWEST_SAMPLES}, got shape {reference.shape}"
        )
    if not np.all(np.abs(reference) < inf):
        bad = int(np.argmin(np.isfinite(reference)))
        raise SpringfootError(f"zmp_reference must be finite numbers [m], got {reference[bad]} at sample {bad}")
    return reference
