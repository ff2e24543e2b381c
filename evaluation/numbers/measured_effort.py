"""Measure the effort of a recorded walk, the cost to its muscles as `springfoot.gait.plan.effort` defines it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.foot import Feet
from springfoot.envs.physics.model import ANKLE, JOINTS, KNEE, SIDES
from springfoot.envs.physics.muscles import leg_strengths
from springfoot.envs.settings.settings import body_of
from springfoot.envs.task.scales import ANKLE_STIFFNESS_UNIT, TOE_SHARE, TOE_STIFFNESS_UNIT
from springfoot.errors import SpringfootError
from springfoot.gait import GRAVITY, Body
from springfoot.gait.body.tissue import STIFFNESS_PER_TORQUE, ankle_tissue_stiffness, charged_calf_stiffness
from springfoot.gait.plan.effort import (
    AS_IS,
    Effort,
    Muscle,
    MuscleUse,
    beyond_range,
    mean_squared_acceleration,
    metabolic_energy,
    muscle_use,
)

from ..recording.recording import TICK, Recording
from .series import distance_walked


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeEffort:
    """Use of the muscles in the steady walk of one episode, both legs; legs and joints as in `SIDES` and `JOINTS`."""

    seconds: float
    """Length of the span [s]."""
    distance: float
    """Distance that the CoM covers in it [m]."""
    use: MuscleUse
    """Activation, rate and energy of the muscles' fibres."""
    net_energy: NDArray
    """(side, joint) metabolic energy, of the work of net joint moments in place of the fibres' [J]."""
    acceleration: float
    """`Effort.acceleration`."""
    beyond_range: float
    """`Effort.beyond_range` of the worse leg [deg]."""


def episode_effort(
    series: dict[str, NDArray], body: Body, feet: Feet, first: int, last: int, muscle: Muscle = AS_IS
) -> EpisodeEffort | None:
    """Measure the use of the muscles in one episode, from tick `first` up to `last`; None for less than 3 ticks.

    The first and the last of these ticks are left out: the fibres' work in a tick needs its neighbours.

    Args:
        series: name -> (T, ...), as in a recording.
        body: that walked, on these `feet`.
        first: tick from which the walk is steady.
        last: its end.
        muscle: factors on properties of the muscles.
    """
    if last - first < 3:
        return None
    angle = series["angle"][first:last]
    use = muscle_use(
        series["fibre_moment"][first:last],
        series["muscle_work"][first:last],
        TICK,
        leg_strengths(body, feet),
        body.strength_scale,
        muscle,
    )
    inner = slice(first + 1, last - 1)  # the ticks that `use` is of
    return EpisodeEffort(
        seconds=(inner.stop - inner.start) * TICK,
        distance=distance_walked(series["com"], inner.start, inner.stop),
        use=use,
        net_energy=metabolic_energy(series["joint_work"][inner]).sum((0, -1)),
        acceleration=mean_squared_acceleration(series["velocity"][inner.start - 1 : inner.stop], TICK),
        beyond_range=max(beyond_range(angle[:, side]) for side in range(len(SIDES))),
    )


def mean_effort(episodes: Sequence[EpisodeEffort], body: Body) -> Effort | None:
    """Return the effort of a body over all its `episodes` together; None if the body does not move forward.

    Rates are means over time; `beyond_range` is the largest of any episode.
    """
    total = _EpisodeSums.of(episodes)
    if total.distance <= 0.0:
        return None
    return Effort(
        work=float(total.energy.sum() / (body.total_mass * GRAVITY * total.distance)),
        activation=float(total.activation.sum() / total.seconds),
        rate=float(sum(episode.use.rate.sum() for episode in episodes) / total.seconds),
        acceleration=sum(episode.acceleration * episode.seconds for episode in episodes) / total.seconds,
        beyond_range=max(episode.beyond_range for episode in episodes),
    )


def effort_numbers(episodes: Sequence[EpisodeEffort], body: Body) -> dict[str, Any]:
    """Return `effort` of metrics.json, nested as in docs/reference/metrics.md; None for numbers of a body that does not
    move forward."""
    effort = mean_effort(episodes, body)
    if effort is None:
        nothing = dict.fromkeys(("fibre_J_kg_m", "net_joint_J_kg_m", "activation"))
        return {
            **nothing,
            **dict.fromkeys(("rate", "acceleration", "total")),
            "per_joint": dict.fromkeys(JOINTS, nothing),
            "per_leg": {side: {**nothing, "per_joint": dict.fromkeys(JOINTS, nothing)} for side in SIDES},
        }
    total = _EpisodeSums.of(episodes)
    # Of the body alone, as people's costs are stated; `mean_effort` has the weight with load, which the muscles carry.
    per_kg_and_metre = 1.0 / (body.mass * total.distance)

    def numbers_of(energy: NDArray, net_energy: NDArray, activation: NDArray) -> dict[str, float]:
        """Return fibre work and net joint work per kg and metre, and mean activation, of some legs and joints together.

        The arguments are their sums over the episodes: of energies [J], and of activation over time [s].
        """
        return {
            "fibre_J_kg_m": float(energy.sum() * per_kg_and_metre),
            "net_joint_J_kg_m": float(net_energy.sum() * per_kg_and_metre),
            "activation": float(activation.sum() / total.seconds),
        }

    parts = total.energy, total.net_energy, total.activation

    def of_leg(side: int) -> dict[str, Any]:
        """Return the numbers of one leg, and of each of its joints."""
        per_joint = {joint: numbers_of(*(part[side, index] for part in parts)) for index, joint in enumerate(JOINTS)}
        return {**numbers_of(*(part[side] for part in parts)), "per_joint": per_joint}

    return {
        **numbers_of(*parts),
        "rate": effort.rate,
        "acceleration": effort.acceleration,
        "total": effort.total,
        "per_joint": {joint: numbers_of(*(part[:, index] for part in parts)) for index, joint in enumerate(JOINTS)},
        "per_leg": {side: of_leg(index) for index, side in enumerate(SIDES)},
    }


def cost_of_transport(work: float, mass: float, distance: float) -> float | None:
    """Return positive joint `work` [J] of both legs over the weight of `mass` [kg] and `distance` [m], dimensionless.

    None without progress, and for work that is not finite.
    """
    cost = work / (mass * GRAVITY * distance) if distance > 0 else nan
    return float(cost) if isfinite(cost) else None


def stiffness_charge(recording: Recording, factor: float = 1.0) -> float:
    """Return the mean of the reward term `stiffness` over all steps of a recording with the setting `ankle_tendon`.

    `factor` is on `STIFFNESS_PER_TORQUE`: with 1 the mean is that of the recorded term. Devices are no muscles: where
    one acts beside an ankle, its K counts here too. Raises `SpringfootError` without `ankle_tendon`.
    """
    settings = recording.settings
    if settings.ankle_tendon is None:
        raise SpringfootError("stiffness_charge needs a recording with ankle_tendon, got None")
    scale = body_of(settings).strength_scale
    ticks_per_step = round(settings.step_seconds / TICK)
    at_ends = {
        name: values[:, ticks_per_step - 1 :: ticks_per_step].astype(float) for name, values in recording.series.items()
    }
    angle = at_ends["angle"]
    tissue = scale * ankle_tissue_stiffness(angle[..., KNEE], angle[..., ANKLE])
    ankle, toe = np.moveaxis(at_ends["stiffness"], -1, 0)
    torque = at_ends["fibre_moment"][..., ANKLE]
    charged_ankle = charged_calf_stiffness(
        ankle, tissue, torque, settings.ankle_tendon, scale, factor * STIFFNESS_PER_TORQUE
    )
    squares = (charged_ankle / ANKLE_STIFFNESS_UNIT) ** 2 + TOE_SHARE * (toe / TOE_STIFFNESS_UNIT) ** 2
    return float(np.nanmean(squares) / (1.0 + TOE_SHARE) / scale**2)


@dataclass(frozen=True, kw_only=True, eq=False)
class _EpisodeSums:
    """Sums over episodes; arrays (side, joint)."""

    seconds: float
    distance: float
    energy: NDArray
    net_energy: NDArray
    activation: NDArray

    @classmethod
    def of(cls, episodes: Sequence[EpisodeEffort]) -> "_EpisodeSums":
        """Return the sums over `episodes`, 0 for none."""
        zero = np.zeros((len(SIDES), len(JOINTS)))
        return cls(
            seconds=sum(episode.seconds for episode in episodes),
            distance=sum(episode.distance for episode in episodes),
            energy=sum((episode.use.energy for episode in episodes), zero),
            net_energy=sum((episode.net_energy for episode in episodes), zero),
            activation=sum((episode.use.activation for episode in episodes), zero),
        )
