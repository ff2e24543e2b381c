"""What a step of stiffness does, from paired walks: means over seeds, their intervals, and how well one link of the
chain foretells the next over joints and phases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import PermutationMethod, bootstrap, pearsonr

from springfoot.arrays import NDArray

from .stiffness_steps import CELLS, DURATIONS, FIXED, MOVEMENT, PHASES, SPRINGS, PairedWalks

RESAMPLES = 2000
"""Of every bootstrap, and of scrambling the cells."""
LEAST_MOVEMENT = 1e-3
"""A change of speed that is smaller [m/s], a thousandth of a walk's, is no movement."""

Key = tuple[str, str, str]
"""How long K is changed, or "fixed state"; what is measured; when: as the "phase" ends, in stride "1", "2", "many"."""
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
"""What is held against what over the cells; a is the CoM's acceleration forward."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Response:
    """What a change of K did to one walk; C cells, S seeds."""

    change: float
    """Of K, as a share of it."""
    mean: Mapping[Key, NDArray]
    """Each (C,), over the seeds whose walks of the cell do not fall."""
    interval: Mapping[Key, NDArray]
    """Each (C, 2), 95 % by bootstrap over seeds; NaN for fewer than two."""
    links: Mapping[str, tuple[float, float, float, float]]
    """Of each of `LINKS` Pearson's r over the cells, its 95 % interval (bootstrap over seeds), and the share of
    scrambled orders of the cells whose r is as far from 0; NaN where nothing changes."""
    falls: NDArray
    """(C, len(DURATIONS)) changed walks that fell."""
    cut: NDArray
    """(C,) share of the changes that the range of the actions cut short."""
    speed: float
    """Of the unchanged walk [m/s]."""

    @property
    def moved(self) -> NDArray:
        """(C,) whether the speed of many strides changes: its interval is off 0, and its mean by `LEAST_MOVEMENT`."""
        return (self.interval[MANY_STRIDES_SPEED].prod(-1) > 0) & (
            np.abs(self.mean[MANY_STRIDES_SPEED]) >= LEAST_MOVEMENT
        )

    @property
    def foretold(self) -> NDArray:
        """(C,) whether that is so and the acceleration at the unchanged walk's states has the sign of it."""
        return self.moved & (self.mean[IMPULSE] * self.mean[MANY_STRIDES_SPEED] > 0)


def response(walks: PairedWalks, change: float) -> Response:
    """Means, intervals and links of paired walks with `change`."""
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
    """Return each (C, S); "many" is the mean of the second half of the strides, of `com_ahead_m` its end."""
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
    """As in `Response.links`, from (C, S) of either end."""
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
    """Rows under `CSV_HEAD`: one for each condition, cell and quantity."""
    for condition, own in responses.items():
        for cell, (joint, phase) in enumerate(CELLS):
            for key, mean in own.mean.items():
                fell = int(own.falls[cell, DURATIONS.index(key[0])]) if key[0] in DURATIONS else 0
                numbers = float(mean[cell]), *map(float, own.interval[key][cell]), fell, float(own.cut[cell])
                yield condition, own.change, SPRINGS[joint], phase, *PHASES[phase], *key, *numbers


def link_rows(responses: Mapping[str, Response]) -> Iterator[tuple[Any, ...]]:
    """Rows under `LINKS_HEAD`."""
    for condition, own in responses.items():
        for name, numbers in own.links.items():
            yield condition, name, *numbers
