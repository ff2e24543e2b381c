"""Repeat the laboratory's experiment where the truth is known: find springs from a policy's walk under pushes.

`springfoot.gait.springs.identification_by_pushes` gets the records of ankle and toe that a laboratory would have, with
noise on the torque. The applied K stands beside the estimate.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from springfoot.agents.policies import PolicyFunction, has_feedback
from springfoot.arrays import NDArray
from springfoot.envs.control import FEET, PLATEAUS
from springfoot.envs.physics import ANKLE, LEFT, RIGHT, SIDES
from springfoot.envs.settings import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.recording import TICK, Recording, policy_and_settings
from springfoot.gait.springs import SPRINGS, PhaseSpring, PushedSpring, identify, identify_pushed

BOUNDS = (*PLATEAUS, 1.0)
"""Bounds of the phases: the plateaus of the fixed schedule, where K is constant, and the ramps between them."""
DECISIONS = "100hz"
"""Decisions of baselines and open-loop copies, with K that follows the phase alone: as often as theta_eq moves. K that
is held for longer belongs to an earlier phase, by another amount in each step, and on a ramp it is no function of
phase."""
LOADED = 0.1
"""A joint carries load in a phase if its mean torque there is beyond this fraction of the largest torque of its mean
course."""
LAST_SECOND = 1.0
"""Time left out at the end of an episode that fell [s]."""
COURSE = 100
"""Samples of a joint's mean torque over the stride, its course."""
NOISE_LASTS = 0.05
"""Correlation time of the noise on the torque [s]."""
REFLEX_DELAY = 0.02
"""Delay of the joint's own angle as a further state [s]."""


def prepare_pushed(
    name: str, given: dict[str, Any], seed: int = 0, threads: int = 2
) -> tuple[PolicyFunction, BipedSettings]:
    """Return the policy of that name and its environment settings; without feedback it decides at `DECISIONS` unless
    `given` says otherwise."""
    return policy_and_settings(name, given if has_feedback(name) else {"decisions": DECISIONS} | given, seed, threads)


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """Measurements that a laboratory would have at n instants of walking, legs that are alike together, and the
    truth."""

    leg: str
    """Leg of the measurements, `left`, `right` or `both`."""
    trial: NDArray
    """(n,) episode of the instant."""
    phase: NDArray
    """(n,) phase of the leg's controller [0, 1)."""
    torque: NDArray
    """(n, 2) torque of ankle and toe with its noise [N m], at the end of a control window, as angle and velocity."""
    angle: NDArray
    """(n, 2) [rad]."""
    velocity: NDArray
    """(n, 2) [rad/s]."""
    states: NDArray
    """(n, q) CoM velocity, hip height, trunk pitch and its rate; angle and velocity of hip and knee; ankle and toe
    `REFLEX_DELAY` earlier."""
    stiffness: NDArray
    """(n, 2) applied K [N m/rad]: the truth, which a laboratory does not have."""
    course: NDArray
    """(COURSE, 2) mean torque over the phase, without noise [N m]."""


def samples(
    recording: Recording, noise_percent: float = 0.0, seed: int = 0, legs: Sequence[int] = (LEFT, RIGHT)
) -> Samples:
    """Return the samples of these `legs` (0 left, 1 right) of a recording together, after the warm-up and without the
    last second of an episode that fell.

    `seed` is that of the noise on the torque. The noise of the torque has a standard deviation of `noise_percent` of
    the largest torque of the joint's mean course, and a correlation time of `NOISE_LASTS`.
    """
    series = {name: values.astype(float) for name, values in recording.series.items()}
    phase = series["phase"]
    pitch_rate = np.gradient(series["base"][..., 2], TICK, axis=1)[..., None]  # base: x, z and pitch
    trunk = np.concatenate([series["com_velocity"], series["base"][..., 1:], pitch_rate], -1)
    # The trunk's states beside those of each leg: (episodes, T, side, states).
    trunk = np.broadcast_to(trunk[:, :, None], (*phase.shape, trunk.shape[-1]))
    above = [series[name][..., :ANKLE] for name in ("angle", "velocity")]  # hip and knee
    earlier = np.roll(series["angle"][..., FEET], round(REFLEX_DELAY / TICK), axis=1)
    states = np.concatenate([trunk, *above, earlier], -1)
    tick = np.arange(phase.shape[1])
    end = recording.ticks - np.where(recording.fall_reason == "", 0, round(LAST_SECOND / TICK))
    measured = np.isin(tick, tick[recording.measured_ticks])
    walked = measured & (tick < end[:, None])
    keep = walked[..., None] & np.isfinite(states).all(-1) & np.isin(range(len(SIDES)), legs)
    if not keep.any():
        raise SpringfootError(f"{recording.policy} walks no strides whose springs could be found, where it is measured")
    torque = series["torque"][..., FEET]
    segment = (phase[keep] * COURSE).astype(int)
    count = np.maximum(np.bincount(segment, minlength=COURSE), 1)  # 1 where there are no samples: the sum is 0
    course = np.stack([np.bincount(segment, column, COURSE) / count for column in torque[keep].T], -1)
    # Noise of standard deviation 1 and correlation exp(-t / NOISE_LASTS): x' = a x + sqrt(1 - a^2) w, w white.
    a = np.exp(-TICK / NOISE_LASTS)
    white = np.random.default_rng(seed).standard_normal(torque.shape)
    noise = lfilter([np.sqrt(1 - a**2)], [1, -a], white, axis=1)[keep]
    trial = np.broadcast_to(np.arange(len(phase))[:, None, None], phase.shape)
    return Samples(
        leg=SIDES[legs[0]] if len(legs) == 1 else "both",
        trial=trial[keep],
        phase=phase[keep],
        torque=torque[keep] + noise_percent / 100 * np.abs(course).max(0) * noise,
        angle=series["angle"][..., FEET][keep],
        velocity=series["velocity"][..., FEET][keep],
        states=states[keep],
        stiffness=series["stiffness"][keep],
        course=course,
    )


@dataclass(frozen=True, kw_only=True)
class Row:
    """Spring of one joint in one phase: the applied one, and its estimates."""

    leg: str
    """Leg of the joint, `left`, `right`, or `both` where they are alike."""
    joint: str
    """Joint, one of `SPRINGS`."""
    start: float
    """Stride phase at its beginning."""
    end: float
    """Stride phase at its end."""
    applied: tuple[float, float, float]
    """Mean, lowest and highest applied K [N m/rad]."""
    load: float
    """Mean size of the mean torque in the phase over its largest in the stride [0, 1]."""
    pushed: PushedSpring
    """Spring found from pushes."""
    undisturbed: PhaseSpring | None = None
    """Spring that the usual estimator finds from the undisturbed gait."""

    @property
    def loaded(self) -> bool:
        """Return True if the joint carries load in this phase."""
        return self.load > LOADED


def identified(pushed: Samples, undisturbed: Samples | None = None, margin: float = 0.0) -> list[Row]:
    """Find the springs of ankle and toe in every phase of `BOUNDS`; return a row for each joint and phase.

    A row's load is the mean size of the torque in its phase, over the largest in the stride.

    Args:
        pushed: samples of walking under pushes.
        undisturbed: samples without pushes, for the usual estimator; None leaves it out.
        margin: part of the stride to leave out at both ends of a phase.

    Raises `SpringfootError` for a phase without samples.
    """
    rows = []
    course_phase = (np.arange(COURSE) + 0.5) / COURSE
    for column, joint in enumerate(SPRINGS):
        data = {name: getattr(pushed, name)[:, column] for name in ("torque", "angle", "velocity")}
        by_pushes = identify_pushed(
            **data, phase=pushed.phase, trial=pushed.trial, bounds=BOUNDS, states=pushed.states, margin=margin
        )
        usual: Sequence[PhaseSpring | None] = [None] * len(by_pushes)
        if undisturbed is not None:
            unpushed = {name: getattr(undisturbed, name)[:, column] for name in data}
            usual = identify(**unpushed, phase=undisturbed.phase, bounds=BOUNDS, margin=margin)
        mean_torque = np.abs(pushed.course[:, column])
        for spring, usual_spring in zip(by_pushes, usual, strict=True):
            inside = (pushed.phase >= spring.start + margin) & (pushed.phase < spring.end - margin)
            if not inside.any():
                raise SpringfootError(
                    f"no sample lies in stride phases {spring.start:g} to {spring.end:g}: walk longer"
                )
            applied = pushed.stiffness[inside, column]
            in_phase = mean_torque[(course_phase >= spring.start) & (course_phase < spring.end)]
            rows.append(
                Row(
                    leg=pushed.leg,
                    joint=joint,
                    start=spring.start,
                    end=spring.end,
                    applied=(float(applied.mean()), float(applied.min()), float(applied.max())),
                    load=float(in_phase.mean() / mean_torque.max()),
                    pushed=spring,
                    undisturbed=usual_spring,
                )
            )
    return rows
