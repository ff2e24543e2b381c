"""Split a policy's stiffness into a schedule of the phase, which can be played open loop, and feedback.

A policy decides K of ankle and toe from its whole observation. Its mean K over the stride is a schedule, which walks
open loop at the same equilibrium; differences of K at equal phase are feedback.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from springfoot.agents.policies.baselines import PolicyFunction, follow
from springfoot.arrays import NDArray
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.reference_walk import tabulated_speeds
from springfoot.envs.physics.model import LEFT, RIGHT, SIDES
from springfoot.envs.settings.settings import CONDITION_SETTINGS, DRAWN_SETTINGS, THEME_OF, BipedSettings, body_of
from springfoot.errors import SpringfootError
from springfoot.gait.springs.stiffness import SPRINGS

from .recording import TICK, WARM_UP, Recording, record

MEAN_KNOTS = 50
"""Phases of the mean K, linear between them: every 2 % of the stride. All corners of the tuned schedule but one lie on
them, and at 50 Hz about one decision of a stride belongs to each."""
SMOOTHING = 0.01
"""Weight of the curvature at a knot against one decision on it: negligible, except where a leg skips phases."""
COPY_EPISODES, COPY_SECONDS = 8, 12.0
"""Undisturbed episodes, seeds 0 to 7, and length of each [s], from which the mean K at a speed comes: some 150
decisions for each knot."""
UNDISTURBED: dict[str, Any] = {
    name: getattr(BipedSettings, name) for name in CONDITION_SETTINGS if THEME_OF[name] in ("episode", "disturbance")
} | {"unevenness_m": 0.0, "episode_seconds": COPY_SECONDS}
"""Settings of those episodes; body, speed, slope, friction and all else stay as they are."""
Watch = Callable[[float], Callable[[float], object]]
"""Function that starts a report of progress: it takes the length of a walk [s], and returns a function to call with the
seconds of each step."""
ALIKE = 0.1
"""Root-mean-square difference of log K up to which the mean schedules of two legs are alike, 10 % of K; chosen."""
SAME_K = 1e-9
"""Variance of log K below which K counts as constant."""


def deciding_legs(settings: BipedSettings) -> list[int]:
    """Return the legs with ankle and toe that follow the policy's K, 0 left and 1 right.

    A leg with a device at ankle or toe is left out: the device has a stiffness of its own.
    """
    return [side for side, foot in enumerate(settings.feet) if not any(joint.device for joint in foot.joints)]


def decisions_of(
    recording: Recording, sides: Sequence[int] | None = None, series: str = "stiffness"
) -> tuple[NDArray, NDArray]:
    """Return the phase of the leg at each of n decisions, (n,) in [0, 1), and K of its ankle and toe from then on,
    (n, 2) [N m/rad].

    A policy decides once in each step of the environment, of 20 ms by default. The decisions are those of all episodes
    and all `sides` together (0 left, 1 right; by default the `deciding_legs`, or both legs if there are none), in the
    walk that is measured. Times with slack muscles (K = 0) are left out. `series` names
    another recorded pair of ankle and toe, such as the rest angles, to return in place of K.
    """
    begin, end = recording.measured_span
    ticks_a_decision = round(recording.settings.step_seconds / TICK)
    samples = np.arange(0, recording.series["phase"].shape[1], ticks_a_decision)
    samples = samples[(samples * TICK >= begin) & (samples * TICK < end)]
    if sides is None:
        sides = deciding_legs(recording.settings) or [LEFT, RIGHT]
    at_decisions = np.ix_(range(len(recording.ticks)), samples, sides)  # (episode, decision, side)
    phase = recording.series["phase"][at_decisions].ravel().astype(float)  # at the tick's beginning, when K was decided
    values, stiffness = (
        recording.series[name][at_decisions].reshape(-1, len(SPRINGS)).astype(float) for name in (series, "stiffness")
    )
    usable = np.isfinite(phase) & np.isfinite(values).all(-1) & (stiffness > 0.0).all(-1)
    return phase[usable] % 1.0, values[usable]  # float32 may round a phase up to 1


def mean_over_phase(phase: NDArray, values: NDArray) -> NDArray:
    """Return the mean of n values of C quantities over the phase, as periodic curves: their values at `MEAN_KNOTS` even
    phases, (MEAN_KNOTS, C).

    `values` is (n, C), `phase` (n,) their phases in [0, 1). A curve is linear between its knots, and fitted by least
    squares with a penalty on curvature (`SMOOTHING`).
    """
    # Each value lies between two knots, with the weights 1 - fraction and fraction.
    knot = np.minimum((phase * MEAN_KNOTS).astype(int), MEAN_KNOTS - 1)
    next_knot = (knot + 1) % MEAN_KNOTS
    fraction = phase * MEAN_KNOTS - knot
    # Normal equations: products of the weights, summed over the values; a knot meets itself and its two neighbours.
    circle = np.arange(MEAN_KNOTS)
    normal = np.zeros((MEAN_KNOTS, MEAN_KNOTS))
    normal[circle, circle] = np.bincount(knot, (1 - fraction) ** 2, MEAN_KNOTS) + np.bincount(
        next_knot, fraction**2, MEAN_KNOTS
    )
    neighbours = np.bincount(knot, (1 - fraction) * fraction, MEAN_KNOTS)
    normal[circle, (circle + 1) % MEAN_KNOTS] = neighbours
    normal[(circle + 1) % MEAN_KNOTS, circle] = neighbours
    right_side = [
        np.bincount(knot, (1 - fraction) * column, MEAN_KNOTS) + np.bincount(next_knot, fraction * column, MEAN_KNOTS)
        for column in values.T
    ]
    # Second differences of the knots around the circle: the curvature.
    identity = np.eye(MEAN_KNOTS)
    curvature = np.roll(identity, 1, axis=1) + np.roll(identity, -1, axis=1) - 2 * identity
    return np.linalg.solve(normal + SMOOTHING * curvature.T @ curvature, np.stack(right_side, -1))


def _mean_stiffness(phase: NDArray, stiffness: NDArray) -> NDArray:
    """Return the mean K over the stride on `GRID`, (SAMPLES, 2) [N m/rad], of n decisions.

    `phase` (n,) in [0, 1) and `stiffness` (n, 2) [N m/rad], ankle and toe, are those of the decisions. The curve of
    `mean_over_phase` can overshoot them, so it is clipped to their range; between its knots it is linear.
    """
    knots = np.clip(mean_over_phase(phase, stiffness), stiffness.min(0), stiffness.max(0))
    knot_phases = np.arange(MEAN_KNOTS) / MEAN_KNOTS
    return np.stack([np.interp(GRID, knot_phases, curve, period=1.0) for curve in knots.T], -1)


def alike_legs(recording: Recording) -> list[list[int]]:
    """Return the `deciding_legs` of a walk, or both legs if there are none, in groups of legs that are alike.

    [[0, 1]] for equal feet with mean K over the stride within `ALIKE`, else [[0], [1]]; 0 is the left leg.
    """
    legs = deciding_legs(recording.settings) or [LEFT, RIGHT]
    left, right = recording.settings.feet
    return [legs] if left == right and _differ_by(recording, legs) <= ALIKE else [[leg] for leg in legs]


def _differ_by(recording: Recording, legs: Sequence[int]) -> float:
    """Return the root-mean-square difference of log K between the mean schedules of both `legs`, the larger of ankle
    and toe; 0 without decisions of both."""
    decisions = [decisions_of(recording, [leg]) for leg in legs]
    if len(decisions) < 2 or not all(len(phase) for phase, _ in decisions):
        return 0.0
    one, other = (np.log(_mean_stiffness(*of_leg)) for of_leg in decisions)
    return float(np.sqrt(np.square(one - other).mean(0)).max())


def feedback(recording: Recording) -> dict[str, dict[str, float | None]]:
    """Return `feedback` of metrics.json: the variation of log K of ankle and toe that the phase does not explain.

    `share` is the fraction of the variance that is left at equal phase [0, 1], `spread` the standard deviation at equal
    phase (0.1: K varies by 10 %); both are None if no group of legs has two decisions. The variance at equal phase is
    half the mean squared difference of neighbours in phase (Rice, Annals of Statistics 12 (1984) 1215), so that a
    schedule has next to none, be it smooth or constant but for jumps. Legs that are not alike (`alike_legs`) have
    schedules of their own: the variances of each leg are averaged. Differences between alike legs count.
    """
    by_leg = [decisions_of(recording, legs) for legs in alike_legs(recording)]
    # log K (n, 2) of each group of legs, in the order of the phase
    logarithms = [np.log(stiffness[np.argsort(phase)]) for phase, stiffness in by_leg if len(phase) >= 2]
    if not logarithms:
        return {joint: {"share": None, "spread": None} for joint in SPRINGS}
    totals = np.mean([logarithm.var(0) for logarithm in logarithms], axis=0)
    at_equal_phase = np.mean([0.5 * (np.diff(logarithm, axis=0) ** 2).mean(0) for logarithm in logarithms], axis=0)
    return {
        # At most 1: where the phase explains nothing, neighbours differ by chance a little more than all decisions.
        joint: {"share": min(float(alike / total), 1.0) if total > SAME_K else 0.0, "spread": float(np.sqrt(alike))}
        for joint, total, alike in zip(SPRINGS, totals, at_equal_phase, strict=True)
    }


def open_loop_copy(
    policy: PolicyFunction,
    settings: BipedSettings,
    *,
    name: str,
    threads: int = 2,
    watch: Watch = lambda seconds: lambda walked: None,
) -> tuple[PolicyFunction, BipedSettings]:
    """Return a policy's mean K over the stride as a policy, and settings for it: `settings` with absolute actions.

    Args:
        policy: observations to actions.
        settings: of its environment; the mean is of its body on its ground, under `UNDISTURBED`.
        name: of the policy, in errors.
        threads: of the physics; any number gives the same bits.
        watch: reports the progress of the walk from which the mean is taken, see `Watch`.

    The mean is of both legs together at equal phase of the leg, by least squares (`mean_over_phase`); of each leg by
    itself if they are not alike (`alike_legs`). If other speeds can be commanded, it is taken at each tabulated speed,
    and is linear between them; K scales with the body. The equilibrium is that of the settings. A residual action can
    leave the range of absolute actions, a copy cannot: K beyond the range becomes its nearer end. Raises
    `SpringfootError` for a policy that walks no strides, and for one that moves the legs too.
    """
    if settings.acts != "stiffness":
        raise SpringfootError(f"{name} has no open-loop copy: it moves the legs too (acts {settings.acts!r})")
    undisturbed = replace(settings, **(UNDISTURBED | dict.fromkeys(DRAWN_SETTINGS)))
    means: dict[float, NDArray] = {}  # by speed; without the speeds at which the policy walks no strides
    speeds = tabulated_speeds(settings).tolist()
    recorded: dict[str, Any] = {"name": name, "episodes": COPY_EPISODES, "threads": threads}
    recorded["progress"] = watch(len(speeds) * COPY_EPISODES * COPY_SECONDS)
    for speed in speeds:
        recording = record(policy, replace(undisturbed, speed=speed), **recorded)
        groups = alike_legs(recording)
        # Group of each side. A leg with a device is in none, and follows no K: the other leg's stands in.
        group_of = [next((k for k, legs in enumerate(groups) if side in legs), 0) for side in range(len(SIDES))]
        decisions = [decisions_of(recording, legs) for legs in groups]
        if all(len(phase) for phase, _ in decisions):
            curves = [_mean_stiffness(phase, stiffness) for phase, stiffness in decisions]
            # (SAMPLES, side, joint)
            means[speed] = np.stack([curves[group] for group in group_of], axis=1)
    if not means:
        raise SpringfootError(f"{name} walks no strides after {WARM_UP:g} s whose mean stiffness could be taken")
    absolute = replace(settings, action_mode="absolute")
    return follow(np.stack(list(means.values())), np.array(list(means)), absolute, body_of(absolute)), absolute
