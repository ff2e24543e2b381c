"""Measure what a recorded walk costs its muscles, by the price of `springfoot.gait.plan.effort`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.foot import Feet
from springfoot.envs.physics.model import JOINTS, SIDES
from springfoot.envs.physics.muscles import leg_strengths
from springfoot.gait import GRAVITY, Body
from springfoot.gait.plan.effort import (
    Effort,
    MuscleUse,
    beyond_range,
    mean_squared_acceleration,
    metabolic_energy,
    muscle_use,
)

from ..recording.recording import TICK


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeEffort:
    """Use of the muscles in the steady walk of one episode, both legs; legs and joints as in `SIDES` and `JOINTS`."""

    seconds: float
    """Length of the span [s]."""
    distance: float
    """Way of the CoM [m]."""
    use: MuscleUse
    """Of the fibres."""
    net_energy: NDArray
    """(side, joint) the same price of the work of net joint moments [J]."""
    acceleration: float
    """`Effort.acceleration`."""
    beyond_range: float
    """`Effort.beyond_range` of the worse leg [deg]."""


def episode_effort(series: dict[str, NDArray], body: Body, feet: Feet, first: int, last: int) -> EpisodeEffort | None:
    """Measure the effort of one episode in the ticks from `first` up to `last`; None for less than 3 ticks.

    Args:
        series: name -> (T, ...), as in a recording.
        body: that walked, on these `feet`.
        first: tick from which the walk is steady.
        last: its end.
    """
    if last - first < 3:
        return None
    angle = series["angle"][first:last]
    use = muscle_use(
        series["fibre_moment"][first:last],
        series["muscle_work"][first:last],
        TICK,
        leg_strengths(body, feet),
        body.stiffness_scale,
    )
    inner = slice(first + 1, last - 1)  # the ticks that `use` is of
    return EpisodeEffort(
        seconds=(inner.stop - inner.start) * TICK,
        distance=float(series["com"][inner.stop - 1, 0] - series["com"][inner.start - 1, 0]),
        use=use,
        net_energy=metabolic_energy(series["joint_work"][inner]).sum((0, -1)),
        acceleration=mean_squared_acceleration(series["velocity"][inner.start - 1 : inner.stop], TICK),
        beyond_range=max(beyond_range(angle[:, side]) for side in range(len(SIDES))),
    )


def mean_effort(episodes: Sequence[EpisodeEffort], body: Body) -> Effort | None:
    """Return the effort of several episodes of one body together; None without progress."""
    total = _Total.of(episodes)
    if total.distance <= 0.0:
        return None
    return Effort(
        work=float(total.energy.sum() / (body.total_mass * GRAVITY * total.distance)),
        activation=float(total.activation.sum() / total.seconds),
        rate=float(sum(each.use.rate.sum() for each in episodes) / total.seconds),
        acceleration=sum(each.acceleration * each.seconds for each in episodes) / total.seconds,
        beyond_range=max(each.beyond_range for each in episodes),
    )


def effort_numbers(episodes: Sequence[EpisodeEffort], body: Body) -> dict[str, Any]:
    """Return `effort` of metrics.json, nested as in docs/reference/metrics.md; numbers are None without progress."""
    effort = mean_effort(episodes, body)
    total = _Total.of(episodes)
    per_metre = 1.0 / (body.mass * total.distance) if effort else np.nan

    def of(energy: NDArray, net_energy: NDArray, activation: NDArray) -> dict[str, float | None]:
        return {
            "fibre_J_kg_m": float(energy.sum() * per_metre) if effort else None,
            "net_joint_J_kg_m": float(net_energy.sum() * per_metre) if effort else None,
            "activation": float(activation.sum() / total.seconds) if effort else None,
        }

    parts = total.energy, total.net_energy, total.activation
    return {
        **of(*parts),
        "rate": effort and effort.rate,
        "acceleration": effort and effort.acceleration,
        "total": effort and effort.total,
        "per_joint": {joint: of(*(part[:, index] for part in parts)) for index, joint in enumerate(JOINTS)},
        "per_leg": {side: of(*(part[index] for part in parts)) for index, side in enumerate(SIDES)},
    }


@dataclass(frozen=True, kw_only=True, eq=False)
class _Total:
    """Sums over episodes; arrays (side, joint)."""

    seconds: float
    distance: float
    energy: NDArray
    net_energy: NDArray
    activation: NDArray

    @classmethod
    def of(cls, episodes: Sequence[EpisodeEffort]) -> "_Total":
        """Return the sums of `episodes`."""
        none = np.zeros((len(SIDES), len(JOINTS)))
        return cls(
            seconds=sum(each.seconds for each in episodes),
            distance=sum(each.distance for each in episodes),
            energy=sum((each.use.energy for each in episodes), none),
            net_energy=sum((each.net_energy for each in episodes), none),
            activation=sum((each.use.activation for each in episodes), none),
        )
