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
"""Duration of the change, or "fixed state" for the effect at the unchanged walk's states; measured quantity; time: at
the end of the "phase", or in stride "1", "2" or "many" (the second half of the strides)."""
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
    unfinished: NDArray
    """(C, len(DURATIONS)) number of changed walks that fell or were too slow for all strides."""
    cut: NDArray
    """(C,) fraction of the changes that the range of the actions cuts short."""
    speed: float
    """Speed of the unchanged walk [m/s]."""

    @property
    def moved(self) -> NDArray:
        """Return (C,) True for cells that change the speed of many strides: by `LEAST_MOVEMENT` or more in the mean,
        with both ends of the interval on the same side of 0."""
        off_zero = self.interval[MANY_STRIDES_SPEED].prod(-1) > 0  # both ends have the same sign
        return off_zero & (np.abs(self.mean[MANY_STRIDES_SPEED]) >= LEAST_MOVEMENT)

    @property
    def foretold(self) -> NDArray:
        """Return (C,) True for moved cells with a change of speed that has the sign of the acceleration at the
        unchanged walk's states."""
        return self.moved & (self.mean[IMPULSE] * self.mean[MANY_STRIDES_SPEED] > 0)


def summarise(walks: PairedWalks, change: float) -> Response:
    """Return means, intervals and links of paired walks with a `change` of K, as a fraction of it."""
    values = _values(walks)
    mean = {key: np.full(len(CELLS), np.nan) for key in values}
    interval = {key: np.full((len(CELLS), 2), np.nan) for key in values}
    for cell in range(len(CELLS)):
        rows = np.stack([quantity[cell] for quantity in values.values()])  # (quantities, S)
        rows = rows[:, np.isfinite(rows).all(0)]  # seeds that do not fall
        if rows.shape[1] < 2:
            continue  # the cell's entries stay NaN
        options = {"n_resamples": RESAMPLES, "method": "percentile", "rng": np.random.default_rng(0)}
        spread = bootstrap((rows,), np.mean, axis=-1, **options).confidence_interval
        for key, cell_mean, low, high in zip(values, rows.mean(-1), spread.low, spread.high, strict=True):
            mean[key][cell] = cell_mean
            interval[key][cell] = (low, high)
    return Response(
        change=change,
        mean=mean,
        interval=interval,
        links={name: _link(values[x], values[y]) for name, (x, y) in LINKS.items()},
        unfinished=walks.unfinished,
        cut=walks.cut,
        speed=float(np.nanmean(walks.unchanged[..., MOVEMENT.index("speed_m_s")])),
    )


def _values(walks: PairedWalks) -> dict[Key, NDArray]:
    """Return the measured quantities by key, (cells, seeds) each; "many" is the mean over the second half of the
    strides, but the last stride for `com_ahead_m`."""
    values: dict[Key, NDArray] = {("fixed state", name, ""): walks.fixed[..., k] for k, name in enumerate(FIXED)}
    values[VELOCITY] = walks.velocity
    half = walks.movement.shape[3] // 2
    for d, duration in enumerate(DURATIONS):
        for m, name in enumerate(MOVEMENT):
            by_stride = walks.movement[:, d, :, :, m]
            values[duration, name, "1"] = by_stride[..., 0]
            values[duration, name, "2"] = by_stride[..., 1]
            last = by_stride[..., -1] if name == "com_ahead_m" else by_stride[..., half:].mean(-1)
            values[duration, name, "many"] = last
    return values


def _link(x: NDArray, y: NDArray) -> tuple[float, float, float, float]:
    """Return Pearson's r of two quantities (cells, seeds) over the cells, the ends of its interval, and the p of a test
    with scrambled cells.

    A cell is a joint in a phase (`CELLS`); r is of the means over seeds. Seeds that fall in any cell are left out;
    all four are NaN if fewer than two are left, or if a mean is the same in all cells. It is an entry of
    `Response.links`.
    """
    complete = np.isfinite(x + y).all(0)
    x = x[:, complete]
    y = y[:, complete]
    if x.shape[1] < 2 or not (np.ptp(x.mean(1)) > 0 and np.ptp(y.mean(1)) > 0):
        return np.nan, np.nan, np.nan, np.nan

    def r(seeds: NDArray, axis: int = -1) -> Any:
        """Return Pearson's r over the cells of the means over `seeds`; `bootstrap` passes many resamples at once."""
        result: Any = pearsonr(x[:, seeds].mean(axis), y[:, seeds].mean(axis), axis=0)
        return result.statistic

    seeds = np.arange(x.shape[1])
    rng = np.random.default_rng(0)
    spread = bootstrap((seeds,), r, n_resamples=RESAMPLES, method="percentile", rng=rng)
    low, high = spread.confidence_interval
    method = PermutationMethod(n_resamples=RESAMPLES, rng=rng)
    scrambled: Any = pearsonr(x.mean(1), y.mean(1), method=method)
    return float(r(seeds)), float(low), float(high), float(scrambled.pvalue)


CSV_HEAD = (
    *("condition", "change", "joint", "phase", "begin", "end", "changed", "quantity", "when"),
    *("mean", "low", "high", "unfinished", "cut_short"),
)
LINKS_HEAD = ("condition", "link", "r", "low", "high", "scrambled_p")


def csv_rows(responses: Mapping[str, Response]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows under `CSV_HEAD`: one for each condition, cell and quantity."""
    for condition, response in responses.items():
        for cell, (joint, phase) in enumerate(CELLS):
            for key, mean in response.mean.items():
                unfinished = int(response.unfinished[cell, DURATIONS.index(key[0])]) if key[0] in DURATIONS else 0
                interval = map(float, response.interval[key][cell])
                numbers = float(mean[cell]), *interval, unfinished, float(response.cut[cell])
                yield condition, response.change, SPRINGS[joint], phase, *PHASES[phase], *key, *numbers


def link_rows(responses: Mapping[str, Response]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows under `LINKS_HEAD`: one for each condition and link."""
    for condition, response in responses.items():
        for name, numbers in response.links.items():
            yield condition, name, *numbers
