"""The laboratory's experiment where the truth is known: springs are found from how a policy walks under pushes.

What a laboratory would record of ankle and toe, with noise on the torque, goes to
`springfoot.gait.springs.perturbation`; the K that was applied stands beside what it finds.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import lfilter

from springfoot.agents.policies import PolicyFunction, has_feedback
from springfoot.arrays import NDArray
from springfoot.envs.control import FEET, PLATEAUS
from springfoot.envs.physics import ANKLE
from springfoot.envs.settings import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.recording import TICK, WARM_UP, Recording, prepare
from springfoot.gait.springs import SPRINGS, PhaseSpring, PushedSpring, identify, identify_pushed

BOUNDS = (*PLATEAUS, 1.0)
"""Phases: the plateaus of the fixed schedule, on which its K is constant, and the ramps between them."""
DECISIONS = "100hz"
"""When a baseline or a copy, whose K follows the phase alone, decides: as often as theta_eq moves. K that is held for
longer belongs to an earlier phase, by more or less in each step; where it ramps it is then no function of phase."""
LOADED = 0.1
"""A joint carries load in a phase if its mean torque there is beyond this share of the largest of its mean course."""
LAST_SECOND = 1.0
"""End of an episode that fell, which is left out [s]."""
COURSE = 100
"""Parts of the stride in which the mean course of the torque is taken."""
NOISE_LASTS = 0.05
"""Correlation time of the noise on the torque [s]."""
REFLEX_DELAY = 0.02
"""The joint's own angle this much earlier is one of the further states [s]."""


def prepare_pushed(
    name: str, given: dict[str, Any], seed: int = 0, threads: int = 2
) -> tuple[PolicyFunction, BipedSettings]:
    """As `policies.prepare`, but what has no feedback decides at `DECISIONS` unless `given` says otherwise."""
    return prepare(name, given if has_feedback(name) else {"decisions": DECISIONS} | given, seed, threads)


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """What a laboratory would have of n instants of walking, both legs together."""

    trial: NDArray
    """(n,) its episode."""
    phase: NDArray
    """(n,) of the leg's controller [0, 1)."""
    torque: NDArray
    """(n, 2) of ankle and toe with its noise [N m], at the end of a control window, as angle and velocity are."""
    angle: NDArray
    """(n, 2) [rad]."""
    velocity: NDArray
    """(n, 2) [rad/s]."""
    states: NDArray
    """(n, q) CoM velocity, hip height, trunk pitch and its rate; angle and velocity of hip and knee; ankle and toe
    `REFLEX_DELAY` earlier."""
    stiffness: NDArray
    """(n, 2) K applied [N m/rad]: the truth, which no laboratory has."""
    course: NDArray
    """(COURSE, 2) mean torque over the phase, without noise [N m]."""


def samples(recording: Recording, noise_percent: float = 0.0, seed: int = 0) -> Samples:
    """Instants after the warm-up, up to the last second of an episode that fell.

    The torque's noise has a standard deviation of `noise_percent` of the largest torque of the joint's mean course, and
    lasts `NOISE_LASTS`.
    """
    series = {name: values.astype(float) for name, values in recording.series.items()}
    phase = series["phase"]
    pitch_rate = np.gradient(series["base"][..., 2], TICK, axis=1)[..., None]
    trunk = np.concatenate([series["com_velocity"], series["base"][..., 1:], pitch_rate], -1)
    trunk = np.broadcast_to(trunk[:, :, None], (*phase.shape, trunk.shape[-1]))
    above = [series[name][..., :ANKLE] for name in ("angle", "velocity")]
    earlier = np.roll(series["angle"][..., FEET], round(REFLEX_DELAY / TICK), axis=1)
    states = np.concatenate([trunk, *above, earlier], -1)
    tick = np.arange(phase.shape[1])
    end = recording.ticks - np.where(recording.fall_reason == "", 0, round(LAST_SECOND / TICK))
    walked = (tick >= round(WARM_UP / TICK)) & (tick < end[:, None])
    keep = walked[..., None] & np.isfinite(states).all(-1)
    if not keep.any():
        raise SpringfootError(f"{recording.policy} walks no strides after {WARM_UP:g} s whose springs could be found")
    torque = series["torque"][..., FEET]
    segment = (phase[keep] * COURSE).astype(int)
    count = np.maximum(np.bincount(segment, minlength=COURSE), 1)
    course = np.stack([np.bincount(segment, column, COURSE) / count for column in torque[keep].T], -1)
    kept = np.exp(-TICK / NOISE_LASTS)
    white = np.random.default_rng(seed).standard_normal(torque.shape)
    noise = lfilter([np.sqrt(1 - kept**2)], [1, -kept], white, axis=1)[keep]
    trial = np.broadcast_to(np.arange(len(phase))[:, None, None], phase.shape)
    return Samples(
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
    """One joint in one phase."""

    joint: str
    """Of `SPRINGS`."""
    start: float
    """Stride phase at which it begins."""
    end: float
    """Stride phase at which it ends."""
    applied: tuple[float, float, float]
    """Mean, lowest and highest K applied [N m/rad]."""
    load: float
    """Mean size of the mean torque in the phase over its largest in the stride [0..1]."""
    pushed: PushedSpring
    """What the pushes tell."""
    undisturbed: PhaseSpring | None = None
    """What the undisturbed gait would tell."""

    @property
    def loaded(self) -> bool:
        """Whether the joint carries load."""
        return self.load > LOADED


def identified(pushed: Samples, undisturbed: Samples | None = None, margin: float = 0.0) -> list[Row]:
    """Return the springs of ankle and toe in every phase of `BOUNDS`, without `margin` [stride] at both ends."""
    rows = []
    at = (np.arange(COURSE) + 0.5) / COURSE
    for column, joint in enumerate(SPRINGS):
        data = {name: getattr(pushed, name)[:, column] for name in ("torque", "angle", "velocity")}
        found = identify_pushed(
            **data, phase=pushed.phase, trial=pushed.trial, bounds=BOUNDS, states=pushed.states, margin=margin
        )
        still: Sequence[PhaseSpring | None] = [None] * len(found)
        if undisturbed is not None:
            data = {name: getattr(undisturbed, name)[:, column] for name in data}
            still = identify(**data, phase=undisturbed.phase, bounds=BOUNDS, margin=margin)
        force = np.abs(pushed.course[:, column])
        for spring, other in zip(found, still, strict=True):
            inside = (pushed.phase >= spring.start + margin) & (pushed.phase < spring.end - margin)
            truth = pushed.stiffness[inside, column]
            here = force[(at >= spring.start) & (at < spring.end)]
            rows.append(
                Row(
                    joint=joint,
                    start=spring.start,
                    end=spring.end,
                    applied=(float(truth.mean()), float(truth.min()), float(truth.max())),
                    load=float(here.mean() / force.max()),
                    pushed=spring,
                    undisturbed=other,
                )
            )
    return rows
