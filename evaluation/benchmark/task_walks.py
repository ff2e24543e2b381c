"""Walk a policy on a frozen task: its returns on public seeds, and on seeds and bodies drawn from its digest."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from springfoot.agents import PolicyFunction, baseline, read_policy
from springfoot.agents.policies.baselines import BASELINES, own_settings
from springfoot.agents.policies.policy import SHIPPED
from springfoot.agents.training.returns import evaluate_returns
from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.learned_person import LEARNED
from springfoot.envs.settings.settings import BipedSettings, settings_from, settings_to_json
from springfoot.errors import SpringfootError, quoted, require_choice
from springfoot.tasks import HOW_IT_ACTS, MAY_NAME_FILES, MUST_AGREE, TASKS

EPISODES = 100
"""Episodes of a task, public or drawn."""
PUBLIC_SEED = 70_000_000
"""Seed of the first public episode; the following count on. No training has them unless it chooses them."""
DRAWN_HEIGHTS, DRAWN_MASSES = (1.55, 1.85), (50.0, 85.0)
"""Ranges of the drawn bodies [m], [kg], where the task itself draws none; chosen, most adults."""

_NO_FILES = (None, "tuned", *LEARNED)
"""Values of the settings `MAY_NAME_FILES` that name no file, or one of the package."""
_FINGERPRINT_EPISODES, _FINGERPRINT_ACTION = 8, 0.3
"""Episodes of a fingerprint, and the largest of their random actions [-]; chosen, a second's work."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskWalks:
    """Episodes of one policy on one task, in the order of their seeds."""

    returns: NDArray
    """(N,) return of each episode [-]."""
    fell: NDArray
    """(N,) whether it ended in a fall."""

    @property
    def summary(self) -> str:
        """Return mean ± SD of the return, and the falls, in words."""
        return f"{self.returns.mean():.1f} ± {self.returns.std():.1f}, {int(self.fell.sum())} of {len(self.fell)} fell"


def settings_of_task(task: str) -> BipedSettings:
    """Return the settings of a task, such as "Walk-v0"; raise `SpringfootError` for an unknown one."""
    require_choice("task", task, tuple(TASKS))
    return settings_from(**TASKS[task])


def task_fingerprint(task: str) -> float:
    """Return the mean return [-] of eight walks with small random actions on a task, to six digits.

    It moves with whatever moves these walks: settings, physics, reward, draws, the person.
    `springfoot.tasks.FINGERPRINTS` has the frozen ones.
    """
    biped = Biped(settings_of_task(task), _FINGERPRINT_EPISODES, 1)
    generator = np.random.default_rng(0)
    size = (_FINGERPRINT_EPISODES, len(biped.action_names))

    def act(observation: NDArray) -> NDArray:
        """Return small random actions, the same sequence for each fingerprint."""
        return generator.uniform(-_FINGERPRINT_ACTION, _FINGERPRINT_ACTION, size).astype(np.float32)

    returns, _, _ = evaluate_returns(biped, act, PUBLIC_SEED)
    return float(f"{returns.mean():.6g}")


def is_baseline(policy: str) -> bool:
    """Return True if `policy` names a baseline, such as `constant:300,40`; a folder of that name is `./random`."""
    return policy.partition(":")[0] in BASELINES


def policy_on_task(policy: str, task: str) -> tuple[PolicyFunction, BipedSettings]:
    """Return a policy, and the task's settings for it: all the task's own but `HOW_IT_ACTS`.

    `policy` is a .safetensors file, a run folder (its best policy), one of the package, or a baseline. Raises
    `SpringfootError` for another, and for a policy with an action that means something else there: one trained with
    another of `MUST_AGREE`.
    """
    settings = settings_of_task(task)
    if is_baseline(policy):
        if (own := own_settings(policy, settings)).keys() - set(HOW_IT_ACTS):
            raise SpringfootError(
                f"{policy} needs {', '.join(sorted(own))} of its own, which {task} does not leave open"
            )
        settings = replace(settings, **own)
        return baseline(policy, settings), settings
    if policy not in SHIPPED and not Path(policy).exists():
        raise SpringfootError(
            f"no policy {policy}: a submission is a .safetensors file, a run folder, one of {', '.join(SHIPPED)}, or a "
            f"baseline, {', '.join(BASELINES)}"
        )
    read = read_policy(policy)
    if named := [name for name in MAY_NAME_FILES if getattr(read.settings, name) not in _NO_FILES]:
        raise SpringfootError(f"{policy} needs a file, its {named[0]}, which a submission does not hold")
    known, needed = settings_to_json(read.settings), settings_to_json(settings)
    for name in MUST_AGREE:
        if known[name] != needed[name]:
            raise SpringfootError(
                f"{policy} was trained with {name} {quoted(known[name])}, {task} takes {quoted(needed[name])}"
            )
    return read, replace(settings, **{name: getattr(read.settings, name) for name in HOW_IT_ACTS})


def walk_publicly(policy: str, task: str, threads: int) -> TaskWalks:
    """Walk a policy on the public seeds of a task; any number of `threads` gives the same bits."""
    act, settings = policy_on_task(policy, task)
    return _walk(act, settings, PUBLIC_SEED, threads)


def walk_drawn_from(digest: str, policy: str, task: str, threads: int) -> TaskWalks:
    """Walk a policy on seeds that follow from its SHA-256 `digest`, with drawn bodies.

    The seeds change with any change of the policy, so that a training cannot know them.
    """
    act, settings = policy_on_task(policy, task)
    return _walk(act, with_drawn_bodies(settings), drawn_seed(digest), threads)


def drawn_seed(digest: str) -> int:
    """Return the seed of the first drawn episode of a policy with a SHA-256 `digest`."""
    return int(digest[:8], 16)


def with_drawn_bodies(settings: BipedSettings) -> BipedSettings:
    """Return the settings with bodies drawn from `DRAWN_HEIGHTS` and `DRAWN_MASSES`, unless they draw bodies
    themselves."""
    if settings.height_range is not None:
        return settings
    return replace(settings, height_range=DRAWN_HEIGHTS, mass_range=DRAWN_MASSES)


def _walk(act: PolicyFunction, settings: BipedSettings, seed: int, threads: int) -> TaskWalks:
    """Walk `EPISODES` episodes side by side, the first seeded with `seed`."""
    biped = Biped(settings, EPISODES, threads)
    returns, _, fell = evaluate_returns(biped, act, seed)
    return TaskWalks(returns=returns, fell=np.asarray(fell))
