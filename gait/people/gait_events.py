"""Find the gait cycle from contact force: heel strikes, toe-offs, strides, curves over percent of the stride."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from springfoot.arrays import NDArray

CONTACT_THRESHOLD_BW = 0.05
"""Vertical force above which a foot is on the ground [body weights]; chosen: 31 N at 63 kg (plates: 20 to 30 N)."""
SHORTEST_CONTACT = 0.10
"""Time below which a contact is a scuff of the swinging foot [s]; chosen: people's stance takes 0.5 s and more."""
SHORTEST_FLIGHT = 0.06
"""Time below which a gap is a bounce within stance, not swing [s]; chosen: people's swing takes 0.35 s and more."""
WARM_UP = 3.0
"""Beginning of each steady walk that the gait's numbers leave out [s]; a fall in it counts."""
PERCENT = np.arange(101)
"""Percents of the stride (or step) of a curve: 0, 1, ..., 100."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Contacts:
    """Gait events of one foot; times in s, ascending.

    A foot on the ground at the beginning of the record has no heel strike there, and at the end no toe-off: an event is
    a crossing of the threshold within the record.
    """

    heel_strikes: NDArray
    """Times (H,) at which the foot takes load."""
    toe_offs: NDArray
    """Times (O,) at which the foot leaves the ground."""

    def strides(self, after: float = 0.0) -> NDArray:
        """Return the S complete strides that begin at or after `after` [s]: (S, 3) heel strike, toe-off, next heel
        strike [s]."""
        begin = self.heel_strikes[:-1]
        end = self.heel_strikes[1:]
        toe_off = next_after(self.toe_offs, begin)
        # A stride without a toe-off before its end is not complete.
        keep = (begin >= after) & (toe_off < end)
        return np.stack([begin, toe_off, end], -1)[keep]


def find_contacts(vertical_force: NDArray, tick: float, threshold: float, first: float = 0.0) -> Contacts:
    """Find heel strikes and toe-offs of one foot from its vertical force.

    `vertical_force` (T,) is sampled every `tick` [s], its first sample at time `first` [s]; `threshold` has its unit
    (usually `CONTACT_THRESHOLD_BW` times body weight). Gaps shorter than `SHORTEST_FLIGHT` are closed, then contacts
    shorter than `SHORTEST_CONTACT` dropped. Times lie between samples, where the force crosses the threshold linearly.
    """
    force = np.asarray(vertical_force, float)
    # Close the gaps of bounces within stance, and only then drop the contacts of scuffs.
    loaded = _without_short_runs(force > threshold, False, SHORTEST_FLIGHT / tick)
    loaded = _without_short_runs(loaded, True, SHORTEST_CONTACT / tick)
    rises = np.flatnonzero(~loaded[:-1] & loaded[1:])
    falls = np.flatnonzero(loaded[:-1] & ~loaded[1:])

    def crossing(before: NDArray) -> NDArray:
        """Return the times [s] of crossings between the samples `before` and the next ones."""
        fraction = (threshold - force[before]) / (force[before + 1] - force[before])
        return first + tick * (before + fraction)

    return Contacts(heel_strikes=crossing(rises), toe_offs=crossing(falls))


def find_steps(left: Contacts, right: Contacts, after: float = 0.0) -> tuple[NDArray, NDArray]:
    """Return the P steps: from a heel strike to the next one, if that is the other foot's.

    Returns times (P, 2) of both heel strikes [s] and the side (P,) of the first, 0 left, 1 right. Only steps that begin
    at or after `after` [s].
    """
    times = np.concatenate([left.heel_strikes, right.heel_strikes])
    sides = np.repeat([0, 1], [len(left.heel_strikes), len(right.heel_strikes)])
    order = np.argsort(times, kind="stable")
    times = times[order]
    sides = sides[order]
    keep = (sides[:-1] != sides[1:]) & (times[:-1] >= after)
    return np.stack([times[:-1], times[1:]], -1)[keep], sides[:-1][keep]


def next_after(events: NDArray, times: NDArray) -> NDArray:
    """Return for each of `times` the first later one of the ascending `events`, infinity if there is none."""
    return np.append(events, np.inf)[np.searchsorted(events, times, side="right")]


def sample(series: NDArray, times: NDArray, tick: float, first: float = 0.0) -> NDArray:
    """Return `series` (T, ...) at `times` of any shape [s], linear between samples; shape times.shape + (...).

    Sample k of the series belongs to time first + k * tick; times outside it take the value of its end.
    """
    position = np.clip((np.asarray(times) - first) / tick, 0, len(series) - 1)
    before = np.minimum(position.astype(int), max(len(series) - 2, 0))  # 0 for a series of a single sample
    # One fraction a time, for all columns of the series.
    fraction = (position - before).reshape(position.shape + (1,) * (series.ndim - 1))
    after = np.minimum(before + 1, len(series) - 1)  # the same one in a series of a single sample
    return series[before] * (1 - fraction) + series[after] * fraction


def on_percent(
    series: NDArray, begin: NDArray, end: NDArray, tick: float, first: float = 0.0, percent: NDArray = PERCENT
) -> NDArray:
    """Return curves (S, P, ...) of `series` (T, ...) over `percent` (P,) of S intervals.

    They last from `begin` (S,) to `end` (S,) [s]; `tick` and `first` as in `sample`.
    """
    times = begin[:, None] + (end - begin)[:, None] * (percent / 100)
    return sample(series, times, tick, first)


def _without_short_runs(flags: NDArray, value: bool, shortest: float) -> NDArray:
    """Return `flags` with inner runs of `value` shorter than `shortest` samples inverted; runs at the ends stay."""
    changes = np.flatnonzero(flags[:-1] != flags[1:]) + 1  # the first samples of all runs but the first one
    result = flags.copy()
    for start, stop in pairwise(changes):
        if flags[start] == value and stop - start < shortest:
            result[start:stop] = not value
    return result
