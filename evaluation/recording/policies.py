"""Return a policy by its name, and its environment in an evaluation: the one place that understands names of policies.

A name is a .safetensors or .onnx file, a run folder (its best policy), `pretrained`, `predicted`, `module:function`, a
baseline (`springfoot.agents.policies.baselines`), or `frozen:POLICY`, the open-loop copy of a trained policy.
"""

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
from springfoot.agents.policies.policy import OF_FEET, SHIPPED, load_policy
from springfoot.agents.policies.schedules import schedule_file
from springfoot.envs.settings.settings import CONDITION_SETTINGS, BipedSettings, settings_from, settings_to_json
from springfoot.errors import SpringfootError

from .open_loop import Watch, open_loop_copy

LONGEST_LABEL = 60
"""Most letters of a policy's name in results; chosen, a length that a folder can have in any script."""
CONDITIONS = {name: getattr(BipedSettings, name) for name in CONDITION_SETTINGS}
"""Standard conditions of every evaluation: defaults that replace the settings of the policy's training."""


def prepare(
    name: str,
    given: dict[str, Any],
    seed: int = 0,
    threads: int = 2,
    watch: Watch = lambda seconds: lambda walked: None,
) -> tuple[PolicyFunction, BipedSettings]:
    """Return a policy by name, and its environment in an evaluation.

    Args:
        name: a .safetensors or .onnx file, a run folder (its best policy), one of `SHIPPED`, `module:function`, a
            baseline of `agents.policies.baselines`, or `frozen:POLICY`, the mean K of one of the first four, which
            first walks for it (`open_loop_copy`).
        given: environment settings asked for. They replace `CONDITIONS`, and `CONDITIONS` replace the policy's own.
        seed: of the baseline `random`.
        threads: of the physics where a copy is made; any number gives the same bits.
        watch: as for `open_loop_copy`.

    Raises `SpringfootError` for an unknown name or a bad setting.
    """
    wanted = CONDITIONS | given
    kind = name.partition(":")[0]
    if kind == FROZEN:
        return _prepare_copy(name, given, threads, watch)
    if kind in BASELINES:
        conditions = settings_from(**{key: wanted[key] for key in CONDITIONS})
        settings = settings_from(**(own_settings(name, conditions) | wanted))
        return baseline(name, settings, seed), settings
    if is_schedule_file(name):
        own, make = schedule_file(name, settings_from(**{key: wanted[key] for key in CONDITIONS}))
        settings = settings_from(**(own | wanted))
        return make(settings), settings
    if name not in SHIPPED and not Path(name).exists() and not is_function(name):
        known = ", ".join(
            [*(name for name in SHIPPED if name not in OF_FEET), f"{OF_FEET[0]} to {OF_FEET[-1]}", *BASELINES]
        )
        raise SpringfootError(
            f"no policy {name!r}: give a .safetensors or .onnx file, a run folder, module:function, or one of {known}, "
            f"or {FROZEN}:POLICY"
        )
    policy = load_policy(name)
    return policy, settings_from(**(settings_to_json(policy.settings) | wanted))


def _prepare_copy(name: str, given: dict[str, Any], threads: int, watch: Watch) -> tuple[PolicyFunction, BipedSettings]:
    """Prepare `frozen:POLICY`: its mean K comes from the policy's own decisions, at whatever rate the copy decides."""
    other = name.partition(":")[2]
    if not other:
        raise SpringfootError(f"{FROZEN} is the copy of a policy, as in {FROZEN}:pretrained, got {name!r}")
    if other.partition(":")[0] == FROZEN:
        raise SpringfootError(f"a copy has no copy of its own: give {other}, got {name!r}")
    if not has_feedback(other):
        raise SpringfootError(f"{other} has no feedback to leave out, it is its own copy: give {other}, got {name!r}")
    policy, settings = prepare(other, {key: value for key, value in given.items() if key != "decisions"})
    decisions = given.get("decisions", settings.decisions)
    copy, absolute = open_loop_copy(policy, settings, name=other, threads=threads, watch=watch)
    return copy, replace(absolute, decisions=decisions)


def policy_label(name: str) -> str:
    """Return the name of a policy in results: its own, that of its run or that of its file, without folders.

    The label can name a folder, whatever `name` is: printable, no path, not hidden, not too long.
    """
    kind, _, other = name.partition(":")
    label = f"{FROZEN}-{policy_label(other)}" if kind == FROZEN and other else _own_name(name)
    safe = "".join(letter if letter.isprintable() and letter not in "/\\" else "-" for letter in label)
    return safe.lstrip(".")[:LONGEST_LABEL] or "policy"


def _own_name(name: str) -> str:
    """Return the name of a policy's file without folder and suffix; for the best and last policy of a run with the
    run's name."""
    path = Path(name)
    if path.suffix not in (".safetensors", ".onnx", *SCHEDULE_SUFFIXES):
        return path.resolve().name.replace(":", "-").replace(",", "-")
    return f"{path.resolve().parent.name}-{path.stem}" if path.stem in ("best", "last") else path.stem
