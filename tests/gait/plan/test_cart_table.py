"""The cart-table model against its own equation, SciPy's boundary-value solver and the textbook's cosh and sinh."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.interpolate import BPoly, PPoly

from springfoot.gait import GRAVITY
from springfoot.gait.plan.cart_table import Bob, _quintics, closed_form, periodic_com, zmp

TIMES, STEP = np.array([0.0, 0.066, 0.55]), 0.66
POINTS = np.array([0.140 - STEP, -0.020, 0.140])
HEIGHT, LOWEST_AT = 0.97, 0.033
SLOPES = pytest.mark.parametrize("slope", [0.0, 0.05, -0.08])
GRID = np.linspace(0.0, TIMES[-1], 10_001)


def motion_over(slope, amplitude, second=(0.0, 0.0)):
    bob = Bob(step_time=TIMES[-1], amplitude=amplitude, lowest_at=LOWEST_AT, second=second)
    return periodic_com(TIMES, POINTS, STEP, HEIGHT, bob, slope)


def test_zmp_of_a_body_at_rest_is_vertically_below_it():
    assert zmp(0.2, 0.9, 0.0, 0.0) == 0.2
    slope = np.radians(5)
    assert zmp(0.2, 0.9, 0.0, 0.0, slope) == pytest.approx(0.2 - 0.9 * np.tan(slope))
    assert zmp([0.0, 1.0], 0.9, [0.0, GRAVITY], [0.0, 0.0]) == pytest.approx([0.0, 0.1])


@pytest.mark.parametrize(("amplitude", "second"), [(0.0, (0.0, 0.0)), (0.02, (0.0, 0.0)), (0.02, (-0.1, 0.2))])
@SLOPES
def test_periodic_motion_has_the_zmp_it_was_made_for(slope, amplitude, second):
    motion = motion_over(slope, amplitude, second)
    assert np.abs(motion.zmp(GRID) - np.interp(GRID, TIMES, POINTS)).max() < 1e-6


@pytest.mark.parametrize("amplitude", [0.0, 0.02])
@SLOPES
def test_periodic_motion_is_the_solution_of_the_boundary_value_problem(slope, amplitude):
    motion = motion_over(slope, amplitude)

    def dynamics(t, state):
        _, height = motion.position(t)
        _, lift = motion.acceleration(t)
        pull = (GRAVITY * np.cos(slope) + lift) / height
        return np.stack([state[1], pull * (state[0] - np.interp(t, TIMES, POINTS)) - GRAVITY * np.sin(slope)])

    def repeats(start, end):
        return np.array([end[0] - start[0] - STEP, end[1] - start[1]])

    grid = np.union1d(np.linspace(0, TIMES[-1], 401), TIMES)
    guess = np.stack([np.linspace(-0.33, 0.33, len(grid)), np.full(len(grid), 1.2)])
    solution = solve_bvp(dynamics, repeats, grid, guess, tol=1e-9, max_nodes=20_000)
    assert solution.success
    assert np.abs(motion.path(grid) - solution.sol(grid)[0]).max() < 1e-8


def test_the_height_is_lowest_high_and_lowest_again_as_its_harmonics_say():
    bob = Bob(step_time=2.0, amplitude=0.5, lowest_at=0.25, second=(0.2, -0.4))
    # A quarter of a step after the lowest point of the cosine, twice the turn is half a turn.
    assert bob([0.25, 0.75, 1.25]) == pytest.approx([-0.5 * 1.2, 0.5 * 0.2, 0.5 * 0.8])
    times, step = np.linspace(0.0, 2.0, 7), 1e-5
    for order in (1, 2):
        slope = (bob(times + step, order - 1) - bob(times - step, order - 1)) / (2 * step)
        np.testing.assert_allclose(bob(times, order), slope, atol=1e-7)


@SLOPES
def test_closed_form_and_integration_agree(slope):
    closed, integrated = motion_over(slope, 0.0), motion_over(slope, 1e-14)
    assert type(closed.path) is not type(integrated.path)
    assert np.abs(closed.path(GRID) - integrated.path(GRID)).max() < 1e-10
    assert np.abs(closed.path(GRID, 1) - integrated.path(GRID, 1)).max() < 1e-9


def test_over_straight_lines_the_closed_form_is_the_textbooks_cosh_and_sinh():
    rate = np.sqrt(GRAVITY / HEIGHT)
    # Over a straight ZMP x = p + a cosh + b sinh; four conditions: smooth inside, repeating at the ends.
    first, second = np.diff(TIMES)
    slopes = np.diff(POINTS) / np.diff(TIMES)
    cosh, sinh = np.cosh(rate * np.array([first, second])), np.sinh(rate * np.array([first, second]))
    matrix = np.array(
        [
            [cosh[0], sinh[0], -1, 0],
            [sinh[0], cosh[0], 0, -1],
            [-1, 0, cosh[1], sinh[1]],
            [0, -1, sinh[1], cosh[1]],
        ]
    )
    kink = (slopes[1] - slopes[0]) / rate
    a1, b1, a2, b2 = np.linalg.solve(matrix, [0.0, kink, 0.0, -kink])
    u = rate * np.where(first > GRID, GRID, GRID - first)
    expected = np.interp(GRID, TIMES, POINTS) + np.where(
        first > GRID, a1 * np.cosh(u) + b1 * np.sinh(u), a2 * np.cosh(u) + b2 * np.sinh(u)
    )
    assert np.abs(motion_over(0.0, 0.0).path(GRID) - expected).max() < 1e-12


def test_quintics_made_at_once_have_the_bits_of_scipys_made_one_by_one():
    rng = np.random.default_rng(0)
    t, (x, v, a) = np.sort(rng.uniform(0, 1, 240)), rng.normal(size=(3, 240))
    one_by_one = PPoly.from_bernstein_basis(BPoly.from_derivatives(t, np.stack([x, v, a], -1)))
    np.testing.assert_array_equal(_quintics(t, x, v, a).c, one_by_one.c)


@pytest.mark.parametrize("pieces", [1, 2, 5])
@pytest.mark.parametrize("degree", [0, 1, 3, 6])
@SLOPES
def test_closed_form_solves_the_equation_over_any_piecewise_polynomial(degree, pieces, slope):
    rng = np.random.default_rng([degree, pieces])
    knots = np.concatenate([[0.0], np.sort(rng.uniform(0.1, 0.9, pieces - 1)), [1.0]])
    reference = PPoly(rng.normal(0, 0.1, (degree + 1, pieces)), knots)  # it jumps from piece to piece
    path = closed_form(reference, STEP, HEIGHT, slope)
    t = rng.uniform(0, 1, 1000)
    pull = GRAVITY * np.cos(slope) / HEIGHT
    np.testing.assert_allclose(path(t, 2), pull * (path(t) - reference(t)) - GRAVITY * np.sin(slope), atol=1e-9)
    tiny = 1e-9
    for knot in knots[1:-1]:
        for derivative in (0, 1):
            assert path(knot - tiny, derivative) == pytest.approx(path(knot + tiny, derivative), abs=1e-6)
    assert path(1.0) - path(0.0) == pytest.approx(STEP) and path(1.0, 1) == pytest.approx(path(0.0, 1))
