"""Mirror the world: left and right change places, half a stride later.

The body is planar, so an angle, a force or a speed of one leg becomes the same number of the other leg. Names decide:
a name in `_left` has its image in `_right`, all else belongs to both legs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from ..physics.model import SIDES

OPPOSITE = ("phase_sin", "phase_cos", "leading_leg")
"""Entries of the observation that change sign: the right leg's phase is the left one's and half a stride, and the other
leg leads. Sine and cosine of twice the phase stay."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mirror:
    """Mirror image of an observation of D entries and of A actions, by their names."""

    index: NDArray
    """(D,) entry of the observation that becomes each entry of its image."""
    sign: NDArray
    """(D,) factor of each entry, 1 or -1; int8, so that an image has the dtype of the observation."""
    action_index: NDArray
    """(A,) action that becomes each action of the image."""
    legs_order: NDArray
    """(A,) index of each action in a list of the left leg's actions followed by their images, those of the right
    leg."""

    def of(self, observation: NDArray) -> NDArray:
        """Return observations (..., D) of the mirrored world; the image of an image is the observation, bit for bit."""
        return np.take(observation, self.index, -1) * self.sign

    def both_legs(self, left: NDArray, right: NDArray) -> NDArray:
        """Return actions (..., A) in their order from those of the left leg (..., A/2) and their images of the right
        leg (..., A/2)."""
        return np.take(np.concatenate([left, right], -1), self.legs_order, -1)


def mirror_of(observation_names: Sequence[str], action_names: Sequence[str]) -> Mirror:
    """Return the mirror of the entries of an observation (D,) and of the actions (A,) with these names.

    Raises `SpringfootError` for a name with a side if the other side is missing, and for an action without a side.
    """
    action_index = _image_indices(action_names)
    for action, name in enumerate(action_names):
        if action_index[action] == action:
            raise SpringfootError(f"action {name} is of neither leg: its name must end in _{' or _'.join(SIDES)}")
    left = [action for action, name in enumerate(action_names) if name.endswith(f"_{SIDES[0]}")]
    by_legs = np.concatenate([left, action_index[left]])  # actions of the left leg, then of the right one
    return Mirror(
        index=_image_indices(observation_names),
        sign=np.array([-1 if name in OPPOSITE else 1 for name in observation_names], np.int8),
        action_index=action_index,
        legs_order=np.argsort(by_legs),
    )


def _image_indices(names: Sequence[str]) -> NDArray:
    """Return (n,) the index of each name's mirror image: the other side's name, or itself without a side."""
    index_of = {name: index for index, name in enumerate(names)}
    images = []
    for name in names:
        stem, _, side = name.rpartition("_")
        image = f"{stem}_{SIDES[1 - SIDES.index(side)]}" if side in SIDES else name
        if image not in index_of:
            raise SpringfootError(f"{name} has no mirror image: there is no {image}")
        images.append(index_of[image])
    return np.array(images, int)
