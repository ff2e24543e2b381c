"""Find policies that move a person: those that adapt to feet."""

from collections.abc import Sequence
from typing import Any

from springfoot.agents.policies import PolicyFunction
from springfoot.envs import BipedSettings
from springfoot.errors import SpringfootError
from springfoot.evaluation.recording import policy_and_settings


def person_and_settings(name: str, given: dict[str, Any]) -> tuple[PolicyFunction, BipedSettings]:
    """Return the policy `name`, which moves a person, and the settings to walk it with.

    `given` are settings that replace the policy's own, as in `policy_and_settings`.

    Raises `SpringfootError` for a policy that sets stiffness alone.
    """
    act, settings = policy_and_settings(name, given)
    if settings.acts == "stiffness":
        raise SpringfootError(f"{name} moves no person: it was trained with acts 'stiffness'")
    return act, settings


def require_each_once(persons: Sequence[str]) -> None:
    """Raise `SpringfootError` for a person that is named more than once among `persons`."""
    if repeated := [name for name in persons if persons.count(name) > 1]:
        raise SpringfootError(f"{repeated[0]} is given {len(repeated)} times; give each person once")
