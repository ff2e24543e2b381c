"""What of a policy's stiffness follows the phase alone: its mean K played open loop, and how much of K is the rest.

A policy decides K of ankle and toe from all that it observes. Its mean K over the stride is a schedule, which walks
open loop at the same equilibrium; what K does besides, at equal phase, is feedback.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from springfoot.agents.policies.baselines import PolicyFunction, follow
from springfoot.arrays import NDArray
from springfoot.envs.control.phase_table import GRID
from springfoot.envs.control.reference_walk import tabulated_speeds
from springfoot.envs.control.standing import steady_walk
from springfoot.envs.settings.settings import CONDITION_SETTINGS, DRAWN_SETTINGS, THEME_OF, BipedSettings, body_of
from springfoot.errors import SpringfootError
from springfoot.gait.springs.stiffness import SPRINGS

from .recording import TICK, WARM_UP, Recording, record

MEAN_KNOTS = 50
"""Phases at which a mean K is given, linear between them: every 2 % of the stride, on which all corners of the tuned
schedule but one lie, and at 50 Hz a decision or so to each."""
SMOOTHING = 0.01
"""Weight of the curvature at a knot against one decision on it: nothing, but where a leg skips phases."""
COPY_EPISODES, COPY_SECONDS = 8, 12.0
"""Undisturbed walking whose mean K is taken, at each speed; seeds 0 to 7: some 150 decisions to a knot."""
UNDISTURBED: dict[str, Any] = {
    name: getattr(BipedSettings, name) for name in CONDITION_SETTINGS if THEME_OF[name] in ("episode", "disturbance")
} | {"unevenness_m": 0.0, "episode_seconds": COPY_SECONDS}
"""Settings of that walking; body, speed, slope, friction and all else are those asked for."""
Watch = Callable[[float], Callable[[float], object]]
"""How somebody follows a walk: told its length [s], it gives what is told each step's."""
SAME_K = 1e-9
"""Variance of log K below which K is constant and has no share of anything."""


def deciding_legs(settings: BipedSettings) -> list[int]:
    """Return the sides whose springs follow the policy's stiffness at ankle and toe; in others either is a device."""
    return [side for side, foot in enumerate(settings.feet) if not any(joint.device for joint in foot.joints)]


def decided(
    recording: Recording, sides: Sequence[int] | None = None, series: str = "stiffness"
) -> tuple[NDArray, NDArray]:
    """Phase (n,) of a leg at each decision and K (n, 2) [N m/rad] of ankle and toe from then on.

    Of the steady walk, the first `WARM_UP` seconds left out; of all `sides` together. Where none are named, a leg whose
    foot is a device decides nothing and is left out, unless both are. Times at which muscles are slack are left out.
    `series` names another pair in place of K.
    """
    begin, end = steady_walk(recording.settings)
    step = round(recording.settings.step_seconds / TICK)
    at = np.arange(step, recording.series["phase"].shape[1], step)
    at = at[(at * TICK >= begin + WARM_UP) & (at * TICK < end)]
    own = deciding_legs(recording.settings) or [0, 1]
    where = np.ix_(range(len(recording.ticks)), at, own if sides is None else sides)
    phase = recording.series["phase"][where].ravel().astype(float)  # at the tick's beginning, when K was decided
    values, stiffness = (
        recording.series[name][where].reshape(-1, len(SPRINGS)).astype(float) for name in (series, "stiffness")
    )
    walked = np.isfinite(phase) & np.isfinite(values).all(-1) & (stiffness > 0.0).all(-1)
    return phase[walked] % 1.0, values[walked]


def mean_over_phase(phase: NDArray, values: NDArray) -> NDArray:
    """Return (MEAN_KNOTS, C) periodic curve, linear between knots, of least squares from `values` (n, C) at `phase`
    (n,).
    """
    normal = np.zeros((MEAN_KNOTS, MEAN_KNOTS))
    circle = np.arange(MEAN_KNOTS)
    knot = np.minimum((phase * MEAN_KNOTS).astype(int), MEAN_KNOTS - 1)
    following = (knot + 1) % MEAN_KNOTS
    way = phase * MEAN_KNOTS - knot
    normal[circle, circle] = np.bincount(knot, (1 - way) ** 2, MEAN_KNOTS) + np.bincount(following, way**2, MEAN_KNOTS)
    beside = np.bincount(knot, (1 - way) * way, MEAN_KNOTS)
    normal[circle, (circle + 1) % MEAN_KNOTS] = beside
    normal[(circle + 1) % MEAN_KNOTS, circle] = beside
    curvature = (
        np.roll(np.eye(MEAN_KNOTS), 1, axis=1) + np.roll(np.eye(MEAN_KNOTS), -1, axis=1) - 2 * np.eye(MEAN_KNOTS)
    )
    sums = [
        np.bincount(knot, (1 - way) * v, MEAN_KNOTS) + np.bincount(following, way * v, MEAN_KNOTS) for v in values.T
    ]
    return np.linalg.solve(normal + SMOOTHING * curvature.T @ curvature, np.stack(sums, -1))


def feedback(recording: Recording) -> dict[str, dict[str, float | None]]:
    """`feedback` of metrics.json: what the phase does not explain of log K, of ankle and toe; None without K.

    `share` is that part of its variance [0..1], `spread` its standard deviation at equal phase (0.1: K varies by 10 %).
    The variance at equal phase is half the mean squared difference of neighbours in phase (Rice, Annals of Statistics
    12 (1984) 1215), so that any schedule has none, steps or not.
    """
    phase, stiffness = decided(recording)
    if len(phase) < 2:
        return {joint: {"share": None, "spread": None} for joint in SPRINGS}
    logarithm = np.log(stiffness[np.argsort(phase)])
    variances = zip(SPRINGS, logarithm.var(0), 0.5 * (np.diff(logarithm, axis=0) ** 2).mean(0), strict=True)
    return {
        joint: {"share": min(float(alike / total), 1.0) if total > SAME_K else 0.0, "spread": float(np.sqrt(alike))}
        for joint, total, alike in variances
    }


def open_loop_copy(
    policy: PolicyFunction,
    settings: BipedSettings,
    *,
    name: str,
    threads: int = 2,
    watch: Watch = lambda seconds: lambda walked: None,
) -> tuple[PolicyFunction, BipedSettings]:
    """Return a policy's mean K over the stride as a policy, and its environment: `settings` with absolute actions.

    Args:
        policy: observations to actions.
        settings: in which it walks; the mean is of its body on its ground, `UNDISTURBED`.
        name: what the policy is called in errors.
        threads: of the physics; any number gives the same bits.
        watch: told how long the walks for it are [s], returns what is told the seconds of each step.

    The mean is of both legs together at equal phase of the leg, by least squares (`mean_over_phase`). Where other
    speeds can be commanded it is taken at each tabulated one, and linear between; for other bodies it scales. The
    equilibrium is the settings' own. A residual action can leave the range of absolute ones, a copy cannot: K beyond
    it is the nearer end's. Raises `SpringfootError` for a policy that walks no strides.
    """
    alone = replace(settings, **(UNDISTURBED | dict.fromkeys(DRAWN_SETTINGS)))
    means: dict[float, NDArray] = {}
    speeds = tabulated_speeds(settings).tolist()
    how: dict[str, Any] = {"name": name, "episodes": COPY_EPISODES, "threads": threads}
    how["progress"] = watch(len(speeds) * COPY_EPISODES * COPY_SECONDS)
    for speed in speeds:
        recording = record(policy, replace(alone, speed=speed), **how)
        phase, stiffness = decided(recording)
        if len(phase):
            knots = np.clip(mean_over_phase(phase, stiffness), stiffness.min(0), stiffness.max(0))
            at = np.arange(MEAN_KNOTS) / MEAN_KNOTS
            means[speed] = np.stack([np.interp(GRID, at, curve, period=1.0) for curve in knots.T], -1)
    if not means:
        raise SpringfootError(f"{name} walks no strides after {WARM_UP:g} s whose mean stiffness could be taken")
    absolute = replace(settings, action_mode="absolute")
    return follow(np.stack(list(means.values())), np.array(list(means)), absolute, body_of(absolute)), absolute
