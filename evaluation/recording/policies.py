"""Return a policy by its name, and settings to evaluate it with: the one place that understands names of policies."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from springfoot.agents.policies.baselines import (
    BASELINES,
    FROZEN,
    SCHEDULE_SUFFIXES,
    PolicyFunction,
    baseline,
    has_feedback,
    is_schedule_file,
    own_settings,
)
from springfoot.agents.policies.foreign import is_function
from springfoot.agents.policies.policy import SHIPPED, load_policy, perhaps_policy
from springfoot.agents.policies.schedule_files import schedule_file
from springfoot.envs.settings.settings import CONDITION_SETTINGS, BipedSettings, settings_from, settings_to_json
from springfoot.errors import SpringfootError

from .open_loop import Watch, open_loop_copy

LONGEST_LABEL = 60
"""Most letters of a policy's name in results; chosen, a length that a folder can have in any script."""
CONDITIONS = {name: getattr(BipedSettings, name) for name in CONDITION_SETTINGS}
"""Standard conditions of every evaluation: defaults that replace the settings of the policy's training."""


def policy_and_settings(
    name: str,
    given: dict[str, Any],
    seed: int = 0,
    threads: int = 2,
    watch: Watch = lambda seconds: lambda walked: None,
) -> tuple[PolicyFunction, BipedSettings]:
    """Return the policy called `name`, and the environment settings to evaluate it with.

    Args:
        name: a trained policy: a .safetensors or .onnx file, a run folder (its best policy), one of `SHIPPED`, or
            `module:function`; a table of stiffness over the stride in a .csv or .json file; a baseline of
            `agents.policies.baselines`; or `frozen:POLICY`: the mean K over the stride of a trained policy, as an
            open-loop policy (`open_loop_copy` walks with the trained one first to measure it).
        given: environment settings asked for. They replace `CONDITIONS`, and `CONDITIONS` replace the policy's own.
        seed: of the baseline `random`.
        threads: of the physics in the walk from which `frozen:POLICY` is made; any number gives the same bits.
        watch: reports the progress of that walk, see `Watch`.

    Raises `SpringfootError` for an unknown name or a bad setting.
    """
    overriding = CONDITIONS | given
    kind = name.partition(":")[0]
    if kind == FROZEN:
        return _frozen_copy(name, given, threads, watch)
    # Settings that an evaluation replaces, among them body and speed: both kinds of policy below depend on those.
    replaced = {key: overriding[key] for key in CONDITIONS}
    if kind in BASELINES:
        settings = settings_from(**(own_settings(name, settings_from(**replaced)) | overriding))
        return baseline(name, settings, seed), settings
    if is_schedule_file(name):
        schedule_settings, policy_for = schedule_file(name, settings_from(**replaced))
        settings = settings_from(**(schedule_settings | overriding))
        return policy_for(settings), settings
    if name not in SHIPPED and not Path(name).exists() and not is_function(name):
        names = ", ".join((*SHIPPED, *BASELINES))
        raise SpringfootError(
            f"no policy {name!r}: give a .safetensors or .onnx file, a run folder, a schedule in a .csv or .json file, "
            f"module:function, {FROZEN}:POLICY, or one of {names}{perhaps_policy(name, (*SHIPPED, *BASELINES, FROZEN))}"
        )
    policy = load_policy(name)
    return policy, settings_from(**(settings_to_json(policy.settings) | overriding))


def _frozen_copy(name: str, given: dict[str, Any], threads: int, watch: Watch) -> tuple[PolicyFunction, BipedSettings]:
    """Return the open-loop copy `frozen:POLICY`, called `name`, and its settings; arguments as in
    `policy_and_settings`.

    A setting `decisions` in `given` holds for the copy alone: the policy decides as in its training while its mean K is
    measured. Raises `SpringfootError` without a policy to copy, and for a policy without feedback.
    """
    copied = name.partition(":")[2]
    if not copied:
        raise SpringfootError(f"{FROZEN} is the copy of a policy, as in {FROZEN}:pretrained, got {name!r}")
    if copied.partition(":")[0] == FROZEN:
        raise SpringfootError(f"a copy has no copy of its own: give {copied}, got {name!r}")
    if not has_feedback(copied):
        raise SpringfootError(f"{copied} has no feedback to leave out, it is its own copy: give {copied}, got {name!r}")
    policy, settings = policy_and_settings(copied, {key: value for key, value in given.items() if key != "decisions"})
    decisions = given.get("decisions", settings.decisions)
    copy, absolute = open_loop_copy(policy, settings, name=copied, threads=threads, watch=watch)
    return copy, replace(absolute, decisions=decisions)


def policy_label(name: str) -> str:
    """Return a policy's name for results: the baseline's, the run's or the file's, without folders.

    The label can name a folder, whatever `name` is: it is printable, no path, not hidden and not too long.
    """
    kind, _, copied = name.partition(":")
    label = f"{FROZEN}-{policy_label(copied)}" if kind == FROZEN and copied else _name_without_folder(name)
    safe = "".join(letter if letter.isprintable() and letter not in "/\\" else "-" for letter in label)
    return safe.lstrip(".")[:LONGEST_LABEL] or "policy"


def _name_without_folder(name: str) -> str:
    """Return the name of a policy without folder and suffix: `runs/mine` is `mine`, `constant:300,40`
    `constant-300-40`.

    The best and last policy of a run have the run's name before theirs.
    """
    path = Path(name)
    real = Path(os.path.realpath(name))  # `Path.resolve` raises for a link to itself
    if path.suffix not in (".safetensors", ".onnx", *SCHEDULE_SUFFIXES):
        return real.name.replace(":", "-").replace(",", "-")
    return f"{real.parent.name}-{path.stem}" if path.stem in ("best", "last") else path.stem
