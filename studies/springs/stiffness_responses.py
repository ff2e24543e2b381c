"""Summarise paired walks: means over seeds with intervals, and how well one link of the chain foretells the next."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import PermutationMethod, bootstrap, pearsonr

from springfoot.arrays import NDArray

from .stiffness_steps import CELLS, DURATIONS, FIXED, MOVEMENT, PHASES, SPRINGS, PairedWalks

RESAMPLES = 2000
"""Resamples of every bootstrap, and orders of the scrambled joints and phases."""
LEAST_MOVEMENT = 1e-3
"""Least change of speed that counts as a movement [m/s], a thousandth of a walk's speed."""

Key = tuple[str, str, str]
"""Duration of the change, or "fixed state"; measured quantity; time: at the end of the "phase", in stride "1", "2",
"many"."""
TORQUE: Key = ("fixed state", "torque_Nm", "")
ACCELERATION: Key = ("fixed state", "forward_m_s2", "")
IMPULSE: Key = ("fixed state", "forward_m_s", "")
VELOCITY: Key = ("one stride", "velocity_m_s", "phase")
MANY_STRIDES_SPEED: Key = ("every stride", "speed_m_s", "many")
LINKS: dict[str, tuple[Key, Key]] = {
    "Δτ → Δa": (TORQUE, ACCELERATION),
    "∫Δa dt → Δv as the phase ends": (IMPULSE, VELOCITY),
    "∫Δa dt → Δspeed of the first stride": (IMPULSE, ("every stride", "speed_m_s", "1")),
    "∫Δa dt → Δspeed of many strides": (IMPULSE, MANY_STRIDES_SPEED),
    "Δv as the phase ends → Δspeed of many strides": (VELOCITY, MANY_STRIDES_SPEED),
}
"""Link of the chain -> its two quantities, correlated over joints and phases; a is the CoM's forward acceleration."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Response:
    """Effect of a change of K on one walk, over C cells (a joint in a phase) and S seeds."""

    change: float
    """Change of K, as a fraction of it."""
    mean: Mapping[Key, NDArray]
    """Quantity -> (C,) mean over the seeds that do not fall in that cell."""
    interval: Mapping[Key, NDArray]
    """Quantity -> (C, 2) 95 % interval by bootstrap over seeds; NaN for fewer than two seeds."""
    links: Mapping[str, tuple[float, float, float, float]]
    """Link -> Pearson's r over the cells, its 95 % interval (bootstrap over seeds), and the fraction of scrambled
    orders of the cells with an r as far from 0; NaN where nothing changes."""
    falls: NDArray
    """(C, len(DURATIONS)) number of changed walks that fell."""
    cut: NDArray
    """(C,) fraction of the changes that the range of the actions cuts short."""
    speed: float
    """Speed of the unchanged walk [m/s]."""

    @property
    def moved(self) -> NDArray:
        """Tell in which cells, (C,), the speed of many strides changes: an interval off 0, a mean of `LEAST_MOVEMENT`
        or more."""
        return (self.interval[MANY_STRIDES_SPEED].prod(-1) > 0) & (
            np.abs(self.mean[MANY_STRIDES_SPEED]) >= LEAST_MOVEMENT
        )

    @property
    def foretold(self) -> NDArray:
        """Tell in which cells, (C,), the walk moved with the sign of the acceleration at the unchanged walk's
        states."""
        return self.moved & (self.mean[IMPULSE] * self.mean[MANY_STRIDES_SPEED] > 0)


def response(walks: PairedWalks, change: float) -> Response:
    """Return means, intervals and links of paired walks with `change`."""
    values = _values(walks)
    mean = {key: np.full(len(CELLS), np.nan) for key in values}
    interval = {key: np.full((len(CELLS), 2), np.nan) for key in values}
    for cell in range(len(CELLS)):
        rows = np.stack([each[cell] for each in values.values()])
        rows = rows[:, np.isfinite(rows).all(0)]
        if rows.shape[1] < 2:
            continue
        how = {"n_resamples": RESAMPLES, "method": "percentile", "rng": np.random.default_rng(0)}
        spread = bootstrap((rows,), np.mean, axis=-1, **how).confidence_interval
        for key, own, low, high in zip(values, rows.mean(-1), spread.low, spread.high, strict=True):
            mean[key][cell] = own
            interval[key][cell] = (low, high)
    return Response(
        change=change,
        mean=mean,
        interval=interval,
        links={name: _link(values[x], values[y]) for name, (x, y) in LINKS.items()},
        falls=walks.falls,
        cut=walks.cut,
        speed=float(np.nanmean(walks.unchanged[..., MOVEMENT.index("speed_m_s")])),
    )


def _values(walks: PairedWalks) -> dict[Key, NDArray]:
    """Return quantity -> (C, S); "many" is the mean over the second half of the strides, and the end for
    `com_ahead_m`."""
    found: dict[Key, NDArray] = {("fixed state", name, ""): walks.fixed[..., k] for k, name in enumerate(FIXED)}
    found[VELOCITY] = walks.velocity
    half = walks.movement.shape[3] // 2
    for d, duration in enumerate(DURATIONS):
        for m, name in enumerate(MOVEMENT):
            own = walks.movement[:, d, :, :, m]
            found[duration, name, "1"] = own[..., 0]
            found[duration, name, "2"] = own[..., 1]
            found[duration, name, "many"] = own[..., -1] if name == "com_ahead_m" else own[..., half:].mean(-1)
    return found


def _link(x: NDArray, y: NDArray) -> tuple[float, float, float, float]:
    """Return an entry of `Response.links` from the two quantities, (C, S) each."""
    whole = np.isfinite(x + y).all(0)
    x = x[:, whole]
    y = y[:, whole]
    if x.shape[1] < 2 or not (np.ptp(x.mean(1)) > 0 and np.ptp(y.mean(1)) > 0):
        return np.nan, np.nan, np.nan, np.nan

    def r(seeds: NDArray, axis: int = -1) -> Any:
        ends: Any = pearsonr(x[:, seeds].mean(axis), y[:, seeds].mean(axis), axis=0)
        return ends.statistic

    seeds = np.arange(x.shape[1])
    rng = np.random.default_rng(0)
    spread = bootstrap((seeds,), r, n_resamples=RESAMPLES, method="percentile", rng=rng)
    low, high = spread.confidence_interval
    how = PermutationMethod(n_resamples=RESAMPLES, rng=rng)
    scrambled: Any = pearsonr(x.mean(1), y.mean(1), method=how)
    return float(r(seeds)), float(low), float(high), float(scrambled.pvalue)


CSV_HEAD = (
    *("condition", "change", "joint", "phase", "begin", "end", "changed", "quantity", "when"),
    *("mean", "low", "high", "falls", "cut_short"),
)
LINKS_HEAD = ("condition", "link", "r", "low", "high", "scrambled_p")


def csv_rows(responses: Mapping[str, Response]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows under `CSV_HEAD`: one for each condition, cell and quantity."""
    for condition, own in responses.items():
        for cell, (joint, phase) in enumerate(CELLS):
            for key, mean in own.mean.items():
                fell = int(own.falls[cell, DURATIONS.index(key[0])]) if key[0] in DURATIONS else 0
                numbers = float(mean[cell]), *map(float, own.interval[key][cell]), fell, float(own.cut[cell])
                yield condition, own.change, SPRINGS[joint], phase, *PHASES[phase], *key, *numbers


def link_rows(responses: Mapping[str, Response]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows under `LINKS_HEAD`."""
    for condition, own in responses.items():
        for name, numbers in own.links.items():
            yield condition, name, *numbers
