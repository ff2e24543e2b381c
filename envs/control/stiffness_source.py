"""Choose the source of the stiffness where the action moves the person: the action itself, or another."""

from collections.abc import Sequence

import numpy as np

from springfoot.arrays import NDArray

from ..settings.settings import BipedSettings

SOFTEST_CONSTANT = -0.5
"""Action of the softest stiffness that is drawn as a constant [-]; chosen: 50 and 12.6 N m/rad with the default ranges,
below which no walk was found."""
DRAWN_SOURCES = {"action": 0.6, "scaled": 0.18, "constant": 0.18, "random": 0.04}
"""Source of the stiffness that `stiffness_by` "drawn" takes -> its share of the episodes; chosen. Walks on a stiffness
that is drawn anew in every step cost three times as much energy; where they were many, they hid from a training the
energy that other walks could save."""


def draw_source(settings: BipedSettings, random: np.random.Generator) -> tuple[int, int, int, NDArray]:
    """Draw the source of one episode; return (not_action, scheduled, anew, drawn), the fields of `STIFFNESS_SOURCE`.

    Draws nothing for the sources "action" and "schedule".
    """
    source = settings.stiffness_by
    if source == "drawn":
        source = random.choice(list(DRAWN_SOURCES), p=list(DRAWN_SOURCES.values()))
    if source == "action" and settings.acts == "person":
        source = "schedule"
    drawn = np.zeros(4)
    if source == "scaled":
        drawn = np.tile(random.uniform(-1.0, 1.0, 2), 2)  # ankle and toe, alike on both legs
    elif source == "constant":
        drawn = np.tile(random.uniform(SOFTEST_CONSTANT, 1.0, 2), 2)
    elif source == "random":
        drawn = random.uniform(-1.0, 1.0, 4)
    return int(source != "action"), int(source in ("schedule", "scaled")), int(source == "random"), drawn


class StiffnessSource:
    """The sources of the stiffness of N bodies.

    Args:
        settings: `stiffness_by` and `acts`.
        rows: (N,) of `CONTROL_ROW`; `source` is changed.
    """

    def __init__(self, settings: BipedSettings, rows: NDArray) -> None:
        self._settings = settings
        self._source = rows["source"]
        self._is_always_action = settings.stiffness_by == "action" and settings.acts != "person"

    def reset(self, ids: NDArray, randoms: Sequence[np.random.Generator]) -> None:
        """Choose the source of an episode of bodies `ids` (K,), each with its generator in `randoms` (K,)."""
        if self._is_always_action:
            return
        for index, random in zip(ids.tolist(), randoms, strict=True):
            self._source[index] = draw_source(self._settings, random)

    def replace_factors(self, factor: NDArray, at_one: NDArray, running: NDArray, randoms: Sequence) -> None:
        """Replace the factors on the stiffness of the bodies with another source than the action.

        Args:
            factor: (N, 4) factors of the actions on the stiffness [-], changed in place.
            at_one: (1, 4) factor of an action of 1 where no schedule sets the stiffness; an action is a power of it.
            running: (N,) bodies that take the step; sources that draw in every step draw for them.
            randoms: (N,) their generators.
        """
        if self._is_always_action:
            return
        source = self._source
        for index in np.flatnonzero(running & (source["anew"] > 0)).tolist():
            source["drawn"][index] = randoms[index].uniform(-1.0, 1.0, 4)
        others = source["not_action"] > 0
        action = source["drawn"][others]
        scheduled = source["scheduled"][others, None] > 0
        factor[others] = np.where(scheduled, np.exp(action), at_one**action)
