"""Check periodic cubic splines against SciPy's."""

import numpy as np
from scipy.interpolate import CubicSpline

from springfoot.gait.plan.periodic_spline import periodic_spline


def test_splines_over_the_same_knots_have_the_bits_of_scipys():
    rng = np.random.default_rng(0)
    knots = np.sort(rng.uniform(0, 1, 60))
    spline = periodic_spline(knots)
    for values in rng.normal(size=(3, 59)):
        scipys = CubicSpline(knots, np.append(values, values[0]), bc_type="periodic")
        np.testing.assert_array_equal(spline(values).c, scipys.c)
        np.testing.assert_array_equal(spline(values)(3 * knots), scipys(3 * knots))
