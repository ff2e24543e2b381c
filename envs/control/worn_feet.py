"""Hold the feet of each environment: its own, or those that a reset draws or gives in place of them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from springfoot.errors import SpringfootError, quoted

from ..physics.foot import Feet, act_one_way
from ..settings.drawn import OWN_FEET, FootPair, draw_feet
from ..settings.feet import FOOT_SETTINGS, foot_setting
from ..settings.settings import BipedSettings


class WornFeet:
    """Feet of N environments.

    Args:
        settings: `drawn_feet`.
        own: N pairs, the feet of each environment where nothing replaces them.
    """

    def __init__(self, settings: BipedSettings, own: Sequence[Feet]):
        self._settings = settings
        self._drawn = settings.drawn_feet or ()
        self._own = list(own)
        self._replaced = [OWN_FEET] * len(own)
        self.pairs = list(own)
        """Left and right foot of each environment now."""
        self.known = [*dict.fromkeys(own), *((entry.example, entry.example) for entry in self._drawn)]
        """Pairs with every torque-angle line, schedule and one-way spring of the environments' own and drawn feet."""
        self.one_way = any(map(act_one_way, self.known))
        """True if any of them acts one way."""

    def check(self, given: Mapping[str, Any] | None) -> None:
        """Raise `SpringfootError` for feet `given`, as for `draw`, that this batch cannot wear."""
        for name in FOOT_SETTINGS:
            self.checked(name, (given or {}).get(name, []))

    def draw(
        self, randoms: Sequence[np.random.Generator], given: Mapping[str, Sequence[Any]] | None = None
    ) -> list[FootPair]:
        """Return K pairs of feet for environments, drawn by their generators; None for a foot of the environment's own.

        `given` is name of `FOOT_SETTINGS` -> K feet in place of drawn ones, checked or in plain JSON. Those that it
        replaces are drawn all the same, so that later draws do not depend on `given`.
        """
        chosen = [self.checked(name, (given or {}).get(name, [None] * len(randoms))) for name in FOOT_SETTINGS]
        replaced = []
        for random, left, right in zip(randoms, *chosen, strict=True):
            drawn_left, drawn_right = draw_feet(self._drawn, random) if self._drawn else OWN_FEET
            replaced.append((left or drawn_left, right or drawn_right))
        return replaced

    def checked(self, name: str, feet: Sequence[Any]) -> list[Any]:
        """Return `feet` of a reset or a saved state as `FootSetting`s; None stays. `name` is one of `FOOT_SETTINGS`.

        Raises `SpringfootError` for feet that this batch cannot wear.
        """
        chosen = [None if foot is None else foot_setting(name, foot) for foot in feet]
        for foot in chosen:
            if foot is not None and act_one_way((foot.foot, foot.foot)) and not self.one_way:
                raise SpringfootError(
                    f"{name}: a reset can give an orthosis that engages one way only where the feet of the settings, "
                    "drawn_feet too, have one"
                )
        return chosen

    def put_on(self, ids: Sequence[int], replaced: Sequence[FootPair]) -> list[int]:
        """Put the feet `replaced` (K,) on environments `ids` (K,), their own where None.

        Returns the indices of the environments with a changed foot.
        """
        changed = []
        for index, feet in zip(ids, replaced, strict=True):
            self._replaced[index] = feet
            left, right = (own if foot is None else foot.foot for own, foot in zip(self._own[index], feet, strict=True))
            if (left, right) != self.pairs[index]:
                self.pairs[index] = left, right
                changed.append(index)
        return changed

    def to_json(self, ids: Sequence[int]) -> list[list[Any]]:
        """Return the feet that replace those of environments `ids` (K,): K pairs in JSON values, None for none."""
        return [[foot and foot.to_json() for foot in self._replaced[index]] for index in ids]

    def from_json(self, pairs: Any, count: int) -> list[FootPair]:
        """Return the argument of `put_on` from the value of `to_json` of `count` environments.

        Raises `SpringfootError` for any other value.
        """
        listed = isinstance(pairs, (list, tuple)) and len(pairs) == count
        if not listed or any(not isinstance(pair, (list, tuple)) or len(pair) != 2 for pair in pairs):
            raise SpringfootError(f"the state does not fit: 'feet' must be {count} pairs of feet, got {quoted(pairs)}")
        sides = [self.checked(name, [pair[side] for pair in pairs]) for side, name in enumerate(FOOT_SETTINGS)]
        return list(zip(*sides, strict=True))
