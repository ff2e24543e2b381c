"""Bounds of a policy's numbers: the largest number itself is accepted, the next is not."""

import numpy as np
import pytest

from springfoot.agents.policies.number_bounds import LARGEST_WEIGHT, require_bounded
from springfoot.errors import SpringfootError

NAME = "layer.0.weight"


@pytest.mark.parametrize("values", [[LARGEST_WEIGHT], [-LARGEST_WEIGHT], [-LARGEST_WEIGHT, 0.0, LARGEST_WEIGHT]])
def test_the_largest_numbers_are_accepted(values):
    require_bounded("file", {NAME: np.array(values)})


@pytest.mark.parametrize(
    "wrong", [np.nextafter(LARGEST_WEIGHT, np.inf), np.nextafter(-LARGEST_WEIGHT, -np.inf), np.nan]
)
def test_the_next_number_is_refused(wrong):
    with pytest.raises(SpringfootError, match=f"^file: {NAME} must be in "):
        require_bounded("file", {NAME: np.array([0.0, wrong])})
