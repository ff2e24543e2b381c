"""Recordings of one policy on many right feet, side by side."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from springfoot.agents.policies.baselines import PolicyFunction
from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.settings.feet import feet_of
from springfoot.envs.settings.settings import BipedSettings

from .recording import Recording, planned_course, walk_all


def record_feet(
    policy: PolicyFunction,
    settings: BipedSettings,
    right_feet: Sequence[str | dict[str, Any]],
    *,
    name: str,
    episodes: int = 20,
    seed: int = 0,
    threads: int = 2,
    progress: Callable[[float], object] = lambda seconds: None,
) -> list[Recording]:
    """As `record`, the same episodes for each of the `right_feet`, settings of feet, side by side; a recording each."""
    each = [replace(settings, right_foot=foot) for foot in right_feet]
    feet = [feet_of(own.left_foot, own.right_foot) for own in each for _ in range(episodes)]
    seeds = [seed + episode for _ in each for episode in range(episodes)]
    planned = planned_course(reference_walk_at(settings, settings.speed).plan)
    walked = walk_all(policy, settings, {}, seeds, threads, (None, None, feet), progress)
    recordings = []
    for index, own in enumerate(each):
        rows = slice(index * episodes, (index + 1) * episodes)
        ticks, returns, reason = (values[rows] for values in walked[:3])
        recordings.append(
            Recording(
                policy=name,
                settings=own,
                seed=seed,
                ticks=ticks,
                returns=returns,
                fall_reason=reason,
                series={key: values[rows] for key, values in walked[3].items()},
                **planned,
            )
        )
    return recordings
