"""Tell which of several feet takes least at one walked speed, and which feet are told apart from it.

Every person walks the same episodes on every foot, so that feet are compared in pairs of episodes. Two feet are told
apart if they differ by `GAP` or more, the 95 % interval of the difference leaves 0 out, and every person has its sign.
The interval is over persons, as one person's episodes are alike and say nothing of how others learn.
A slower walk has another price: so prices are taken at one speed that all walk, between two walks at two commanded
speeds, never beyond them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray

from ..base.intervals import interval_of_persons

GAP = 0.05
"""Least difference that is told apart: in a trial a network trained on one foot alone walked up to 5 % cheaper
on it than one trained on all feet."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """Difference of a foot's price from another's, as a share of the other's."""

    mean: float
    low: float
    """Low end of the 95 % interval."""
    high: float
    """High end of the 95 % interval."""
    persons: int
    """Number of persons."""
    told_apart: bool
    """True if the mean is `GAP` or more, the interval leaves 0 out, and every person's mean has its sign."""

    @property
    def text(self) -> str:
        """Return the difference in percent with its interval, such as "−8 % (−10 to −6)".

        Of one person there is no interval.
        """
        interval = f" ({_percent(self.low)} to {_percent(self.high)})" if self.persons > 1 else ""
        return f"{_percent(self.mean)} %{interval}"


def difference(prices: NDArray, others: NDArray) -> Difference:
    """Return the difference of a foot's `prices` from another foot's prices `others`, both (P, E), of the same P
    persons in the same E episodes.

    The interval is that of `interval_of_persons`.
    """
    shares = prices / others - 1.0
    of_persons = shares.mean(1)
    low, high = interval_of_persons([*shares])
    mean = float(of_persons.mean())
    signs = np.sign(of_persons)
    apart = abs(mean) >= GAP and (low > 0.0 or high < 0.0) and bool((signs == signs[0]).all())
    return Difference(mean=mean, low=low, high=high, persons=len(prices), told_apart=apart)


LEAST_CHANGE = 0.02
"""Least difference of two walked speeds between which a price is interpolated [m/s]."""
TOLERANCE = 0.005
"""How far a speed may lie beyond two walked ones [m/s]; chosen, a rounding."""


def common_speed(asked: float, walked: Sequence[NDArray | None]) -> float:
    """Return the walked speed [m/s] nearest to the one `asked` for that lies between the two walks of every person on
    every foot; `asked` itself if there is none.

    `walked` has for each foot the speeds (2, P, E) [m/s] of two walks of P persons in E episodes; None for a foot on
    which an episode fell.
    """
    of_persons = [speeds.mean(-1) for speeds in walked if speeds is not None]
    slowest = max((float(speeds.min(0).max()) for speeds in of_persons), default=asked)
    fastest = min((float(speeds.max(0).min()) for speeds in of_persons), default=asked)
    return float(np.clip(asked, slowest, fastest)) if slowest <= fastest else asked


def price_at(speed: float, walked: NDArray, prices: NDArray) -> NDArray | None:
    """Return the prices (P, E) of P persons in E episodes at a walked `speed`, interpolated between two walks of each.

    Args:
        speed: walked speed [m/s].
        walked: (2, P, E) speeds of the two walks [m/s].
        prices: (2, P, E) prices of the two walks.

    Returns None where a person's two walks are of nearly one speed, or where `speed` lies beyond both in the mean over
    the episodes: a foot can be too slow for it.
    """
    change = walked[1] - walked[0]
    of_persons = walked.mean(-1)  # (2, P)
    beyond = (speed < of_persons.min(0) - TOLERANCE) | (speed > of_persons.max(0) + TOLERANCE)
    if (np.abs(change) < LEAST_CHANGE).any() or beyond.any():
        return None
    return prices[0] + (prices[1] - prices[0]) * (speed - walked[0]) / change


def verdict(price: str, names: Sequence[str], prices: Sequence[NDArray | None]) -> str:
    """Return a sentence on the foot of least price, those like it, the dearer ones, and the saving against the first.

    Args:
        price: name of the price, such as "fibre work".
        names: names of the feet; the others are compared with the first.
        prices: for each foot the prices (P, E) of P persons in E episodes; None where one fell or was too slow.
    """
    walked = {name: values for name, values in zip(names, prices, strict=True) if values is not None}
    if not walked:
        return f"{price.capitalize()} is unknown: on every foot somebody falls or is too slow."
    least = min(walked, key=lambda name: walked[name].mean())
    against_least = {name: difference(values, walked[least]) for name, values in walked.items() if name != least}
    like_least = [name for name in walked if name == least or not against_least[name].told_apart]
    first = names[0]
    others = [name for name in like_least if name != least]
    sentence = f"{price.capitalize()} is least with {least}"
    if others:
        sentence += f", not told apart from {_list(others)}"
    if first not in walked:
        sentence += f"; unknown with {first}, on which somebody falls or is too slow"
    elif first not in like_least:
        sentence += f": {difference(walked[least], walked[first]).text} against {first}"
    dearer = [f"{name} {_percent(against_least[name].mean)} %" for name in walked if name not in (*like_least, first)]
    sentence += f". Against {least}: {_list(dearer)}." if dearer else "."
    unknown = [name for name in names[1:] if name not in walked]
    return f"{sentence} Unknown, as somebody falls or is too slow: {_list(unknown)}." if unknown else sentence


def _percent(share: float) -> str:
    """Return a share in whole percent with its sign, 0 without one."""
    percent = round(100.0 * share)
    return f"{percent:+d}".replace("-", "−") if percent else "0"


def _list(words: Sequence[str]) -> str:
    """Return words as a list in a sentence."""
    *others, last = words
    return f"{', '.join(others)} and {last}" if others else last
