"""Identify K and beta by perturbation: from the way torque leaves its mean course when the body is pushed.

Pushes at random throw each stride off the mean of all strides. At equal phase of the controller a spring's rest angle
is the same in all strides and cancels; with d the deviation from the mean at that phase,

    d torque = -K(phase) (d angle + beta d velocity).

A stiffness that differs from trial to trial moves the whole trial's course too: a stiffer ankle bends less at more
torque, which looks like a softer one. So d is also counted from each trial's own course. (With K scattered by 3 %
deviations from the common course alone gave 246 for 402 N m/rad at 30-44 % of the stride, and these give 402.)

People's ankles were identified in walking by this method: Rouse et al. 2014, IEEE Trans. Neural Syst. Rehabil. Eng.
22:870-878. An undisturbed gait does not contain K (`identification`): its theta_eq moves with the angle, and any K fits
some theta_eq.

Phases are equal within bins of `BIN`, and the mean course is a straight line in each bin, since theta_eq moves on in
it; a trial's own course is one straight line over the phase of the stride. K is linear between knots: a ramp fitted by
a constant leaks its own deviations into K. Intervals leave out one trial at a time (`jackknife`), so that errors may
last a whole trial. Further states are tested as well: a joint with a torque that reacts to one of them is no spring,
whatever K is fitted.

Limits of the experiment: a reflex of the joint's own angle at the same instant looks like a spring, a reaction to an
unrecorded state like noise, and white noise of standard deviation d on the angle makes K too small, by s^2 / (s^2 +
d^2) with s the angle's spread (`PushedSpring.angle_spread`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, require_number, require_within

from .jackknife import fit_by_trial
from .spring_fit import Estimate

BIN = 0.0025
"""Width of the bins of equal phase [stride]."""
LEAST_IN_BIN = 8
"""Samples below which a bin is left out: its straight line takes two of them."""
ROUNDS = 4
"""Turns of fitting the lines of bins and of trials; eight further ones move K by less than a thousandth."""
LEAST_TRIALS = 10
"""Trials below which the verdict is `UNKNOWN`, as below twice the number of further states: intervals rest on their
number."""
LEAST_EXPLAINED = 0.5
"""Fraction of the torque's deviations that K and beta of a spring must explain: below, most of the torque is no
spring's."""
LEAST_PRECISION = 0.5
"""Half width of K's interval over K beyond which K counts as unknown."""
REACTION_LEVEL = 0.01
"""Significance at which further states must matter for the verdict `REACTS` (of true springs, 3 % meet it alone)."""
REACTION_SHARE = 0.01
"""Fraction of the explained variance that further states must explain beyond K and beta for the verdict `REACTS`: a
torque a tenth of the spring's."""

SPRING = "spring"
REACTS = "reacts: not a spring"
UNKNOWN = "not identified"


@dataclass(frozen=True, kw_only=True)
class PushedSpring:
    """Result of pushes for one joint in one phase; None for numbers that the data do not determine."""

    start: float
    """Stride phase at its beginning."""
    end: float
    """Stride phase at its end."""
    samples: int
    """Samples in bins with enough samples."""
    trials: int
    """Trials of these samples."""
    stiffness: Estimate | None
    """K [N m/rad], its mean over the samples."""
    damping_time: Estimate | None
    """beta [s], the ratio of the means of K beta and K; None if K may be 0."""
    explained: float
    """Fraction of the variance of the torque's deviations that K and beta explain [0..1]."""
    reaction: float
    """Fraction that further states explain beyond K and beta [0..1]."""
    reaction_p: float
    """Probability of that fraction by chance if the further states do not matter; 1 if it cannot be computed."""
    angle_spread: float
    """Standard deviation of the part of the angle's deviations that velocity does not explain [rad]."""
    verdict: str
    """`SPRING`, `REACTS` or `UNKNOWN`."""
    reason: str
    """Reason why it is no spring, one line; "" for a spring."""


def identify_pushed(
    torque: ArrayLike,
    angle: ArrayLike,
    velocity: ArrayLike,
    phase: ArrayLike,
    trial: ArrayLike,
    bounds: Sequence[float],
    *,
    states: ArrayLike | None = None,
    margin: float = 0.0,
    spacing: float | None = 0.02,
) -> tuple[PushedSpring, ...]:
    """Identify K, the damping time beta [s] and whether the torque is a spring's, for each phase of the stride, from
    many strides under random pushes.

    Args:
        torque: (n,) [N m], positive as the angle.
        angle: (n,) [rad], at the instants of the torque.
        velocity: (n,) [rad/s], at the same instants.
        phase: (n,) phase [0, 1) by which the rest angle moves; for a device, its controller's.
        trial: (n,) trial of each sample; trials are independent of each other, samples of one need not be.
        bounds: (P + 1,) ascending stride phases [0, 1]: P phases.
        states: (n, q) further states that the torque might follow, at the same instants, in any unit.
        margin: part of the stride left out at both ends of each phase.
        spacing: K is linear between knots at most this part of the stride apart; None: constant in each phase.

    Returns:
        P results, in the order of `bounds`. Raises `SpringfootError` for bad arrays or bounds.
    """
    data = _samples(torque, angle, velocity, phase, trial, states)
    edges = [require_within("a bound", bound, (0.0, 1.0)) for bound in bounds]
    if len(edges) < 2 or edges != sorted(set(edges)):
        raise SpringfootError(f"bounds must be two or more ascending stride phases, got {edges}")
    require_number("margin", margin, 0.0, 0.5, "of a stride")
    if spacing is not None:
        require_number("spacing", spacing, 0.0, 1.0, "of a stride", above=True)
    return tuple(_phase_spring(data, low, high, margin, spacing) for low, high in pairwise(edges))


class _Data(NamedTuple):
    """Columns of n samples."""

    torque: NDArray
    angle: NDArray
    velocity: NDArray
    phase: NDArray
    trial: NDArray
    states: NDArray
    """(n, q)."""


def _samples(
    torque: ArrayLike,
    angle: ArrayLike,
    velocity: ArrayLike,
    phase: ArrayLike,
    trial: ArrayLike,
    states: ArrayLike | None,
) -> _Data:
    """Return the samples as float arrays, trials counted from 0; raise `SpringfootError` for wrong shapes or numbers
    that are not finite."""
    arrays = tuple(np.asarray(values, float) for values in (torque, angle, velocity, phase, trial))
    shapes = [values.shape for values in arrays]
    if len(set(shapes)) > 1 or len(shapes[0]) != 1 or not all(np.isfinite(values).all() for values in arrays):
        raise SpringfootError(
            f"torque, angle, velocity, phase and trial must be finite numbers, one a sample, got shapes {shapes}"
        )
    further = np.empty((len(arrays[0]), 0)) if states is None else np.asarray(states, float)
    if further.ndim != 2 or len(further) != len(arrays[0]) or not np.isfinite(further).all():
        raise SpringfootError(f"states must be finite numbers ({len(arrays[0])}, q), got shape {further.shape}")
    torque, angle, velocity, phase, trial = arrays
    return _Data(torque, angle, velocity, phase, np.unique(trial, return_inverse=True)[1], further)


def _phase_spring(data: _Data, low: float, high: float, margin: float, spacing: float | None) -> PushedSpring:
    """Identify the spring of the phase from `low` to `high` [stride], with the verdict whether it is a spring.

    K and beta are None if trials are too few or the motion is too small. `margin` and `spacing` are as in
    `identify_pushed`.
    """
    # Samples of the phase, by bins of equal phase; bins with few samples are left out.
    first = low + margin
    last = high - margin
    inside = np.flatnonzero((data.phase >= first) & (data.phase < last))
    # The bins that have samples, counted from 0; then again without those that have too few.
    bin_index = np.unique(((data.phase[inside] - first) / BIN).astype(int), return_inverse=True)[1]
    enough = np.bincount(bin_index)[bin_index] >= LEAST_IN_BIN if len(bin_index) else np.empty(0, bool)
    inside = inside[enough]
    bin_index = np.unique(bin_index[enough], return_inverse=True)[1]
    phase = data.phase[inside]
    # Trials are counted anew from 0, without those that have no sample here.
    trial = np.unique(data.trial[inside], return_inverse=True)[1]
    trials = int(trial.max()) + 1 if len(trial) else 0
    common = {"start": low, "end": high, "samples": len(inside), "trials": trials}
    # Further states: the given ones and two curvatures. Their test needs more trials than states; here twice as many.
    needed = max(LEAST_TRIALS, 2 * (data.states.shape[1] + 2))
    if trials < needed:
        return _unknown_spring(common, f"{trials} trials are too few, {needed} are needed")
    # Deviations from the mean course of all trials; curvature of the spring counts as a further state.
    torque, angle, velocity, *states = (
        _minus_lines(column, phase, bin_index)
        for column in (data.torque[inside], data.angle[inside], data.velocity[inside], *data.states[inside].T)
    )
    curvatures = [angle**2, angle * np.abs(angle)]
    knot_weights = _knot_weights(phase, first, last, spacing)
    # The angle less the part that velocity explains; the tiny number is for a velocity of 0 throughout.
    unexplained = angle - velocity * (angle @ velocity) / max(velocity @ velocity, 1e-300)
    spread = float(np.sqrt(np.mean(unexplained**2)))
    # d torque = -K d angle - K beta d velocity, K and K beta linear between knots; then with further states besides.
    spring_columns = np.concatenate([knot_weights * -angle[:, None], knot_weights * -velocity[:, None]], 1)
    line_unknowns = 2 * (int(bin_index.max()) + 1 + trials)  # of the mean courses, a straight line in each
    # Also less each trial's own course. It is that of the products: K theta' has no course of K's and theta's.
    torque, *columns = (
        _minus_courses(column, phase, bin_index, trial) for column in (torque, *spring_columns.T, *states, *curvatures)
    )
    of_spring = columns[: spring_columns.shape[1]]
    fit = fit_by_trial(np.stack(of_spring, -1), torque, trial, line_unknowns)
    fit_with_states = fit_by_trial(np.stack(columns, -1), torque, trial, line_unknowns)
    if fit is None or fit_with_states is None:
        return _unknown_spring(common, "angle and velocity move too little, or as one, to tell K from beta")
    # K and K beta as means over the samples, by all trials and without each trial; beta = (K beta) / K.
    mean_weights = knot_weights.mean(0)
    knots = len(mean_weights)
    stiffness = fit.coefficients[:knots] @ mean_weights
    stiffness_without = fit.without[:, :knots] @ mean_weights
    k_beta = fit.coefficients[knots:] @ mean_weights
    k_beta_without = fit.without[:, knots:] @ mean_weights
    K = fit.interval(stiffness, stiffness_without)
    bounded = K.low > 0 or K.high < 0
    # The part that further states explain beyond the spring, and its p-value.
    reaction = max(fit_with_states.explained - fit.explained, 0.0)
    chance = fit_with_states.chance(2 * knots)
    verdict, reason = _verdict(K, fit.explained, reaction, chance)
    return PushedSpring(
        **common,
        stiffness=K,
        damping_time=fit.interval(k_beta / stiffness, k_beta_without / stiffness_without) if bounded else None,
        explained=fit.explained,
        reaction=reaction,
        reaction_p=chance,
        angle_spread=spread,
        verdict=verdict,
        reason=reason,
    )


def _verdict(K: Estimate, explained: float, reaction: float, chance: float) -> tuple[str, str]:
    """Return the verdict on a joint in a phase, and the reason if it is no spring.

    `explained` and `reaction` are fractions of the torque's variance, `chance` the p-value of the reaction.
    """
    if chance < REACTION_LEVEL and reaction >= REACTION_SHARE * (explained + reaction):
        return REACTS, f"further states explain {100 * reaction:.0f} % of the torque's deviations beyond K and beta"
    # K is below 0 even at the end of an interval twice as wide.
    if K.value + 2 * (K.high - K.value) < 0 and explained >= REACTION_SHARE:
        return REACTS, "the torque grows with the angle"
    if K.low <= (1 - LEAST_PRECISION) * K.value:
        return UNKNOWN, f"K is known to ±{(K.high - K.low) / 2:.0f} N m/rad only"
    if explained < LEAST_EXPLAINED:
        return UNKNOWN, f"K and beta explain {100 * explained:.0f} % of the torque's deviations"
    return SPRING, ""


def _unknown_spring(common: dict[str, float], reason: str) -> PushedSpring:
    """Return the result, with the reason, of a phase with data that determine no number."""
    return PushedSpring(
        **common,  # type: ignore[arg-type]
        stiffness=None,
        damping_time=None,
        explained=0.0,
        reaction=0.0,
        reaction_p=1.0,
        angle_spread=0.0,
        verdict=UNKNOWN,
        reason=reason,
    )


def _minus_courses(values: NDArray, phase: NDArray, bin_index: NDArray, trial: NDArray) -> NDArray:
    """Return `values` (n,) minus one straight line over `phase` for each trial, and one for each bin.

    `bin_index` and `trial` (n,) count from 0. Lines of trials and of bins are fitted in turn.
    """
    for _ in range(ROUNDS):
        for index in (trial, bin_index):
            values = _minus_lines(values, phase, index)
    return values


def _minus_lines(values: NDArray, phase: NDArray, index: NDArray) -> NDArray:
    """Return `values` (n,) minus the straight line over `phase` that fits the values of the same `index` (n,)."""

    def centred(column: NDArray) -> NDArray:
        """Return a column (n,) less its mean for each index."""
        return column - (np.bincount(index, column) / np.bincount(index))[index]

    phase_deviation = centred(phase)
    # Least squares for each index: the sum of products over the sum of squares. One phase alone has a slope of 0.
    values = centred(values)
    spread = np.bincount(index, phase_deviation**2)
    slope = np.bincount(index, phase_deviation * values) / np.where(spread > 1e-18, spread, np.inf)
    return values - slope[index] * phase_deviation


def _knot_weights(phase: NDArray, low: float, high: float, spacing: float | None) -> NDArray:
    """Return the weights (n, knots) with which a function's values at knots give its values at `phase` (n,).

    It is linear between knots, which are evenly spaced from `low` to `high` and at most `spacing` apart; with a
    `spacing` of None it is constant, with a single knot.
    """
    if spacing is None:
        return np.ones((len(phase), 1))
    pieces = max(1, int(np.ceil((high - low) / spacing - 1e-9)))  # less a hair: rounding must not add a piece
    position = np.clip((phase - low) / (high - low) * pieces, 0, pieces)
    # Each knot's weight falls from 1 at the knot to 0 at its neighbours.
    return np.maximum(0.0, 1 - np.abs(position[:, None] - np.arange(pieces + 1)))
