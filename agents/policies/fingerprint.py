"""Digest the environment that a policy relies on, so that a policy of another environment is refused."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.learned_person import digest_of_person
from springfoot.envs.control.equilibrium import foot_curves, foot_feed
from springfoot.envs.control.legs import leg_curves
from springfoot.envs.control.reference_walk import rows
from springfoot.envs.control.stiffness_control import stiffness_of
from springfoot.envs.settings.settings import TUNED
from springfoot.errors import SpringfootError

_MODEL_NUMBERS = (
    *("body_mass", "body_inertia", "body_pos", "body_ipos", "jnt_range", "jnt_actfrcrange", "dof_damping"),
    *("dof_armature", "geom_size", "geom_pos", "pair_friction", "pair_solref", "pair_solreffriction", "pair_solimp"),
    "actuator_gainprm",
)
"""Arrays of the compiled model that decide how the body moves."""
_EVERY = 50
"""Samples of a curve between two that are digested."""


def fingerprint(biped: Biped) -> dict[str, str]:
    """Return the SHA-256 digests of all that a policy relies on: `observation`, `action`, compiled `model`, `legs`, and
    the file of a learned `person`.

    `legs` digests the constants of hips, knees and foot springs, and the target curves, at every tabulated speed.
    Numbers count to six significant digits, so that compilers and processors agree.
    """
    model = biped.model
    actions = np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]])  # of ankle and toe: softest, middle, stiffest
    of_legs: list[Any] = []
    for constants, walk in rows(biped.walks):
        curves = (leg_curves(constants, walk), *foot_curves(biped.settings, constants, walk))
        of_legs += [*asdict(constants).values(), *(curve[::_EVERY] for curve in curves)]
        if (feed := foot_feed(biped.settings, constants, walk)) is not None:
            of_legs.append(feed[::_EVERY])
    person = biped.settings.walker
    of_person = {} if person == TUNED else {"person": digest_of_person(person)}
    return of_person | {
        "observation": _digest(biped.observation_names, biped.observation_low, biped.observation_high),
        "action": _digest(biped.action_names, stiffness_of(actions, biped.settings, biped.body)),
        "model": _digest(_MODEL_NUMBERS, *(getattr(model, name) for name in _MODEL_NUMBERS), [model.opt.timestep]),
        "legs": _digest(asdict(biped.constants[0]), *of_legs),
    }


def require_same(name: object, stored: Mapping[str, str], current: Mapping[str, str]) -> None:
    """Raise `SpringfootError` if the fingerprint `stored` in the policy `name` differs from that of this version's
    environment, `current`."""
    if different := [part for part in current if current[part] != stored.get(part)]:
        raise SpringfootError(
            f"{name} was trained on another version of this environment: other {' and '.join(different)}; "
            "train it again, or use the version of springfoot it came from"
        )


def _digest(names: Iterable[str], *numbers: Any) -> str:
    """Return the SHA-256 digest of names, and of numbers to six significant digits."""
    values = np.concatenate([np.ravel(item).astype(np.float64) for item in numbers])
    values[np.abs(values) < 1e-9] = 0.0  # rounding noise has no significant digits
    return hashlib.sha256(" ".join([*names, *(f"{value:.6g}" for value in values)]).encode()).hexdigest()
