"""Numbers at the edge: each check refuses them in one line that names the setting, the bounds and the number."""

from fractions import Fraction

import numpy as np
import pytest

from springfoot.errors import require_count, require_number, require_within
from springfoot.gait import SpringfootError

CHECKS = {
    "within": lambda value: require_within("speed", value, (0.4, 2.0), "m/s"),
    "number": lambda value: require_number("speed", value, 0.4, 2.0, "m/s"),
    "count": lambda value: require_count("steps", value, 1, 2),
}
UNWANTED = [10**400, -(10**400), 10**5000, float("inf"), float("nan"), 0, 3, True, "1", None, 1j, [1.0]]


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
@pytest.mark.parametrize("value", UNWANTED, ids=[str(type(value)) for value in UNWANTED])
def test_what_is_not_allowed_is_refused_in_one_short_line(check, value):
    with pytest.raises(SpringfootError, match=r"^(speed|steps) must be .*, got ") as caught:
        check(value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 100


@pytest.mark.parametrize("value", [1, 1.0, np.float32(1.0), np.int64(1), Fraction(1)])
def test_what_is_allowed_comes_back_as_a_float(value):
    assert all(type(CHECKS[name](value)) is float and CHECKS[name](value) == 1.0 for name in ("within", "number"))


def test_the_ends_are_allowed_unless_it_must_be_above():
    assert require_number("gain", 0.0, 0.0) == 0.0 and require_number("gain", 2, 0.0, 2.0, above=True) == 2.0
    with pytest.raises(SpringfootError, match=r"gain must be a finite number > 0, got 0"):
        require_number("gain", 0.0, 0.0, above=True)


@pytest.mark.parametrize(("value", "told"), [(2.00001, "2.00001"), (0.399996, "0.399996"), (2.12345, "2.123")])
def test_a_number_just_beyond_an_end_does_not_read_as_allowed(value, told):
    with pytest.raises(SpringfootError, match=rf"^speed must be in \[0.4, 2\] m/s, got {told}$"):
        CHECKS["within"](value)
