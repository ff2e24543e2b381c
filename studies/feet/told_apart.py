"""Tell which of several feet takes least at one walked speed, which are told apart from it, and which are alike.

Every person walks the same episodes on every foot, so that feet are compared in pairs of episodes. Two feet are told
apart if further training on the dearer one alone would not make it the cheaper one (`gain_of`), the 95 % interval of
the difference leaves 0 out, and every person has its sign. They are alike if the interval lies within `MOST_ALIKE`,
else uncertain. The interval is over persons, as one person's episodes are alike and say nothing of how others learn: of
one person nothing is told apart, and nothing is alike. A slower walk has another price: so prices are taken at one
speed that all walk, between two walks at two commanded speeds, never beyond them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.settings import FootSetting

from ..base.intervals import interval_of_persons

GAIN = 0.10
"""Share of its price that a person may gain by further training on one sound, braced or rigid foot alone: on sound feet
`learned-2` gained 10.0 % of effort (docs/results/csv/specialists.csv; one training of each person)."""
GAIN_OF_KIND = {"weak": 0.22, **dict.fromkeys(("passive", "adaptive", "drop", "rigid_toe", "no_toe"), 0.11)}
"""The same of other kinds, by fibre work, used for both prices: `learned` alone gained 22 % with calves of 25 %, 11 %
on a passive foot of 300 N m/rad (the same file). Kinds that were not measured are taken to be as passive ones."""
MOST_ALIKE = 0.05
"""Largest difference of feet that are alike; chosen."""


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
    """True if the dearer foot is so after its gain, the interval leaves 0 out, and every person's mean has its sign;
    False of one person."""

    @property
    def alike(self) -> bool:
        """Return True if the interval lies within `MOST_ALIKE` either way; False of one person."""
        return self.persons > 1 and self.low > -MOST_ALIKE and self.high < MOST_ALIKE

    @property
    def text(self) -> str:
        """Return the difference in percent with its interval, such as "−8 % (−10 to −6)".

        Of one person there is no interval.
        """
        return self.to_digits(0)

    def to_digits(self, digits: int) -> str:
        """Return `text` to so many decimal digits of a percent."""
        low, high = (_percent(end, digits) for end in (self.low, self.high))
        interval = f" ({low} to {high})" if self.persons > 1 else ""
        return f"{_percent(self.mean, digits)} %{interval}"


def gain_of(foot: FootSetting) -> float:
    """Return the share of its price that a person may gain by further training on this foot alone."""
    return GAIN_OF_KIND.get(foot.kind, GAIN)


def least_told_apart(gain: float) -> float:
    """Return the least difference, as a share of the cheaper foot's price, at which a foot with this `gain` is dearer
    after it."""
    return 1.0 / (1.0 - gain) - 1.0


def gain_words(*kinds: str) -> str:
    """Return a sentence on the least differences that tell feet of these kinds from cheaper ones."""
    shares = [f"{100 * least_told_apart(GAIN_OF_KIND.get(kind, GAIN)):.0f} % ({kind})" for kind in kinds]
    return (
        "A person trained on with one foot alone may take less: a foot is told from a cheaper one where it takes more "
        f"by {_list(shares)}."
    )


def difference(prices: NDArray, others: NDArray, gain: float = GAIN, others_gain: float = GAIN) -> Difference:
    """Return the difference of a foot's `prices` from another foot's prices `others`, both (P, E), of the same P
    persons in the same E episodes.

    `gain` and `others_gain` are those of the two feet (`gain_of`): that of the dearer one counts. The interval is that
    of `interval_of_persons`.
    """
    shares = prices / others - 1.0
    of_persons = shares.mean(1)
    low, high = interval_of_persons([*shares])
    mean = float(of_persons.mean())
    signs = np.sign(of_persons)
    leaves_0_out = len(prices) > 1 and (low > 0.0 or high < 0.0)
    dearer, dearers_gain = (1.0 + mean, gain) if mean > 0.0 else (1.0 / (1.0 + mean), others_gain)
    apart = dearer * (1.0 - dearers_gain) >= 1.0 and leaves_0_out and bool((signs == signs[0]).all())
    return Difference(mean=mean, low=low, high=high, persons=len(prices), told_apart=apart)


LEAST_CHANGE = 0.02
"""Least difference of two walked speeds between which a price is interpolated [m/s]."""
TOLERANCE = 0.005
"""How far a speed may lie beyond two walked ones [m/s]; chosen, a rounding."""


def common_speed(asked: float, walked: Sequence[NDArray | None]) -> float:
    """Return the walked speed [m/s] nearest to the one `asked` for that lies between the two walks of every person on
    all feet that have such a speed in common.

    Feet that have none with the others are left out one by one, the slowest first, as one too stiff spring would leave
    no answer on all others. It is `asked` itself if no foot has a speed that all persons walk on it.

    `walked` has for each foot the speeds (2, P, E) [m/s] of two walks of P persons in E episodes; None for a foot on
    which an episode fell.
    """
    of_persons = [speeds.mean(-1) for speeds in walked if speeds is not None]
    spans = [(float(speeds.min(0).max()), fastest_of_all(speeds)) for speeds in of_persons]
    spans = sorted((span for span in spans if span[0] <= span[1]), key=lambda span: span[1])
    for left_out, (_, fastest) in enumerate(spans):
        slowest = max(low for low, _ in spans[left_out:])
        if slowest <= fastest:
            return float(np.clip(asked, slowest, fastest))
    return asked


def fastest_of_all(speeds: NDArray) -> float:
    """Return the largest speed [m/s] that every person reaches in one of two walks, of `speeds` (2, P) [m/s]."""
    return float(speeds.max(0).min())


def without_price(speed: float, walked: NDArray | None) -> str:
    """Return words on why a foot has no price at a walked `speed` [m/s]; `walked` is an entry of those of
    `common_speed`."""
    if walked is None:
        return "somebody falls"
    fastest = fastest_of_all(walked.mean(-1))
    if fastest < speed - TOLERANCE:
        return f"one person walks {fastest:.2f} m/s at most"
    return "somebody has no two walks around that speed"


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


def comparison(
    asked: float, speed: float, walked: Mapping[str, NDArray | None], prices: Sequence[NDArray | None]
) -> str:
    """Return sentences on the walked `speed` [m/s] of the comparison, on whether its feet reach the one `asked` for,
    and on the feet without a price.

    `walked` has by name of a foot an entry of those of `common_speed`, `prices` one price of each foot.
    """
    unknown = [
        f"{name}, as {without_price(speed, speeds)}"
        for (name, speeds), values in zip(walked.items(), prices, strict=True)
        if values is None
    ]
    compared = [
        fastest_of_all(speeds.mean(-1))
        for speeds, values in zip(walked.values(), prices, strict=True)
        if speeds is not None and values is not None
    ]
    if not compared:
        return f"No foot has a price: {'; '.join(unknown)}."
    short = sum(fastest < asked - TOLERANCE for fastest in compared)
    where = "on no foot" if short == len(compared) else "not on every foot"
    why = f", as {where} all persons reach the asked {asked:g} m/s" if short else ""
    without = f" Without a price: {'; '.join(unknown)}." if unknown else ""
    return f"Compared at {speed:.2f} m/s walked{why}.{without}"


def verdict(price: str, prices: Mapping[str, NDArray], gains: Mapping[str, float] | None = None) -> str:
    """Return sentences on the foot of least price, those alike, the saving against the first, and the other feet.

    Feet that are neither alike nor told apart are uncertain, and have their interval. Of one person all changes are
    told, without a word on which are alike.

    Args:
        price: name of the price, such as "fibre work".
        prices: name of a foot -> prices (P, E) of P persons in E episodes; one foot at least.
        gains: name of a foot -> its gain (`gain_of`); None: `GAIN` of each.
    """
    first = next(iter(prices))
    least = min(prices, key=lambda name: prices[name].mean())
    if len(prices) == 1:
        return f"{price.capitalize()} is known with {least} alone."
    gains = dict.fromkeys(prices, GAIN) if gains is None else gains
    changes = {
        name: difference(values, prices[least], gains[name], gains[least])
        for name, values in prices.items()
        if name != least
    }
    sentence = f"{price.capitalize()} is least with {least}"
    if len(prices[least]) == 1:
        return f"{sentence}, of one person: no interval.{_against(least, changes)}"
    if alike := [name for name, change in changes.items() if change.alike]:
        sentence += f", alike (within {100 * MOST_ALIKE:g} %) with {_list(alike)}"
    dearer = {name: change for name, change in changes.items() if change.told_apart}
    if dearer.pop(first, None):
        sentence += f": {difference(prices[least], prices[first]).text} against {first}"
    uncertain = [
        f"{name}, {change.to_digits(1)}" for name, change in changes.items() if not (change.alike or change.told_apart)
    ]
    doubts = f" Uncertain against {least}: {'; '.join(uncertain)}." if uncertain else ""
    return f"{sentence}.{_against(least, dearer)}{doubts}"


def _against(least: str, changes: Mapping[str, Difference]) -> str:
    """Return a sentence on the changes of feet against the foot `least`, after a space; nothing without a change."""
    told = [f"{name} {_percent(change.mean)} %" for name, change in changes.items()]
    return f" Against {least}: {_list(told)}." if told else ""


def _percent(share: float, digits: int = 0) -> str:
    """Return a share in percent with its sign, 0 without one, to so many decimal `digits`."""
    percent = round(100.0 * share, digits)
    return f"{percent:+.{digits}f}".replace("-", "−") if percent else "0"


def _list(words: Sequence[str]) -> str:
    """Return words as a list in a sentence."""
    *others, last = words
    return f"{', '.join(others)} and {last}" if others else last
