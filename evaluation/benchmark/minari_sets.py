"""Write walks on a frozen task as Minari sets, for learners that see no environment: a set for each policy."""

import os
import re
import shutil
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from springfoot import __version__
from springfoot.agents import PolicyFunction
from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.walk import walked_steps
from springfoot.envs.settings.settings import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.extras import naming_extras
from springfoot.files.writing import is_taken, whole_folder
from springfoot.tasks import HOW_IT_ACTS

from .task_walks import policy_on_task

DATASETS_FOLDER = "MINARI_DATASETS_PATH"
"""Variable of the folder of Minari's sets."""
_BATCH = 50
"""Episodes side by side; chosen."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkedEpisode:
    """One episode of T steps."""

    seed: int
    """Seed of the episode."""
    observations: NDArray
    """(T + 1, D), float32."""
    actions: NDArray
    """(T, A), float32."""
    rewards: NDArray
    """(T,)."""
    fell: bool
    """Whether it ended in a fall (terminated), not by its length (truncated)."""


def set_id(policy: str, task: str) -> str:
    """Return the id under which Minari finds the set of a policy on a task: `springfoot/walk/expert-v0` is that of
    `expert` on Walk-v0, `springfoot/pushed/mine-v0` that of `runs/mine` or `mine.safetensors` on Pushed-v0."""
    stem = Path(policy).stem if Path(policy).suffix == ".safetensors" else Path(policy).name
    return f"{_namespace(task)}/{re.sub('[^a-z0-9]+', '-', stem.lower()).strip('-')}-v0"


def _namespace(task: str) -> str:
    """Return Minari's namespace of the sets of a task."""
    return f"springfoot/{task.rpartition('-')[0].lower()}"


def walked_episodes(settings: BipedSettings, policy: PolicyFunction, episodes: int, seed: int) -> list[WalkedEpisode]:
    """Walk `episodes` episodes, seeded `seed`, `seed` + 1, …; return observations, actions and rewards of each."""
    walked: list[WalkedEpisode] = []
    while len(walked) < episodes:
        count = min(_BATCH, episodes - len(walked))
        seeds = [seed + number for number in range(len(walked), len(walked) + count)]
        walked += _walk_batch(Biped(settings, count), policy, seeds)
    return walked


def _walk_batch(biped: Biped, policy: PolicyFunction, seeds: list[int]) -> list[WalkedEpisode]:
    """Walk one episode in each environment of `biped`, seeded by `seeds`; return the episodes.

    All environments step until the last episode ends; each episode is then cut to its own steps.
    """
    biped.reset(np.arange(len(seeds)), seeds)
    observations = [biped.observe().copy()]
    actions: list[NDArray] = []
    rewards: list[NDArray] = []
    walking_by_step: list[NDArray] = []
    fell = np.zeros(len(seeds), bool)

    def act(observation: NDArray) -> NDArray:
        """Return the policy's actions (N, A), and keep them."""
        actions.append(policy(observation))
        return actions[-1]

    for walking, result in walked_steps(biped, act):
        observations.append(result.observation.copy())
        rewards.append(result.reward.copy())
        walking_by_step.append(walking)
        fell |= walking & result.terminated
    steps = np.sum(walking_by_step, axis=0)
    # (environment, step, ...)
    all_observations = np.stack(observations, 1)
    all_actions = np.stack(actions, 1)
    all_rewards = np.stack(rewards, 1)
    return [
        WalkedEpisode(
            seed=seeds[k],
            observations=all_observations[k, : steps[k] + 1],  # the one after the last step too
            actions=all_actions[k, : steps[k]],
            rewards=all_rewards[k, : steps[k]],
            fell=bool(fell[k]),
        )
        for k in range(len(seeds))
    ]


def write_sets(policies: Sequence[str], task: str, episodes: int, seed: int = 0) -> dict[str, dict[str, float]]:
    """Write a Minari set for each of `policies` on a frozen task, each of `episodes` episodes seeded from `seed` on.

    Returns the number of episodes, steps and falls, and the mean return, by the id of the set. Minari keeps them in the
    folder of its variable MINARI_DATASETS_PATH; each is written whole or not at all. Raises `SpringfootError`, with
    nothing written, for a set that exists, two of one id, and policies that the task does not take.
    """
    with naming_extras():
        import h5py  # noqa: F401  # not above: extras
        import minari
        from minari import namespace
        from minari.data_collector import EpisodeBuffer
        from minari.storage.datasets_root_dir import get_dataset_path
    walkers = [policy_on_task(policy, task) for policy in policies]
    ids = [set_id(policy, task) for policy in policies]
    for own in ids:
        if ids.count(own) > 1:
            raise SpringfootError(f"two policies would make the Minari set {own}; rename one")
        if is_taken(get_dataset_path(own)):
            raise SpringfootError(f"the Minari set {own} exists already; minari delete {own}")
    if _namespace(task) not in namespace.list_local_namespaces():
        namespace.create_namespace(_namespace(task))
    results = {}
    for policy, own, (act, settings) in zip(policies, ids, walkers, strict=True):
        walked = walked_episodes(settings, act, episodes, seed)
        buffers = [
            EpisodeBuffer(
                id=index,
                seed=walk.seed,
                observations=walk.observations,  # pyright: ignore[reportArgumentType]  # an array serves
                actions=walk.actions,  # pyright: ignore[reportArgumentType]
                rewards=walk.rewards.tolist(),
                terminations=_false_until_last(len(walk.rewards), walk.fell),
                truncations=_false_until_last(len(walk.rewards), not walk.fell),
            )
            for index, walk in enumerate(walked)
        ]
        environment = gym.make(f"springfoot/{task}", **{name: getattr(settings, name) for name in HOW_IT_ACTS})
        out = get_dataset_path(own)
        with whole_folder(out, out) as (part, _), _datasets_in(part), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that an address is missing, and an evaluation's environment
            minari.create_dataset_from_buffers(
                own,
                buffers,
                env=environment.spec,
                observation_space=environment.observation_space,
                action_space=environment.action_space,
                algorithm_name=policy,
                author="springfoot contributors",
                description=f"{episodes} episodes of {policy} on {task}, from seed {seed} on.",
                requirements=[f"springfoot=={__version__}"],
            )
            # Minari writes below the set's id: its data move up, and the emptied folders go.
            (part / own / "data").rename(part / "data")
            shutil.rmtree(part / "springfoot")
        environment.close()
        results[own] = {
            "episodes": episodes,
            "steps": sum(len(walk.rewards) for walk in walked),
            "return_mean": float(np.mean([walk.rewards.sum() for walk in walked])),
            "falls": sum(walk.fell for walk in walked),
        }
    return results


@contextmanager
def _datasets_in(folder: Path) -> Iterator[None]:
    """Set Minari's variable so that it writes below `folder` until the block ends."""
    before = os.environ.get(DATASETS_FOLDER)
    os.environ[DATASETS_FOLDER] = str(folder)
    try:
        yield
    finally:
        os.environ.pop(DATASETS_FOLDER)
        if before is not None:
            os.environ[DATASETS_FOLDER] = before


def _false_until_last(steps: int, value: bool) -> list[Any]:
    """Return a list with False for each step but the last, which has `value`."""
    return [False] * (steps - 1) + [value]
