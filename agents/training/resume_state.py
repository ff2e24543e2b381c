"""Save and restore the exact state of a training between two updates, so that it continues with the same bits.

The state has the learner, environments with their simulations, every random generator, and unwritten values of the
logger.
"""

import random
from collections import deque
from collections.abc import Mapping
from math import isfinite
from typing import Any, NotRequired, TypedDict

import numpy as np
import torch

from springfoot.envs.batch.exact_state import FEET
from springfoot.errors import SpringfootError, require_count

from .ppo import Learner
from .sb3_vec_env import SegmentedFootBipedVecEnv

_LEARNER = ("network.", "adam.", "observation.", "return.")
"""First parts of the names of the learner's arrays."""
_SIMULATION = "simulation."
"""First part of the names of the environments' arrays."""


class Episode(TypedDict):
    """A finished episode: its return and its length in steps, by the names of stable-baselines3."""

    r: float
    l: int  # noqa: E741


class Learning(TypedDict):
    """JSON part of the state of a training; the other part is arrays."""

    generators: list[dict[str, Any]]
    """State of each environment's random generator."""
    feet: NotRequired[list[list[Any]]]
    """Drawn feet of each environment in JSON values, where `drawn_feet` draws some."""
    actions: dict[str, Any]
    """State of the action space's random generator."""
    numpy: list[float]
    """NumPy's global generator: its position, whether it holds a normal number (1 or 0), and that number."""
    python_gauss: float | None
    """Normal number that Python's global generator holds, if it does."""
    updates: int
    """Gradient epochs so far, as stable-baselines3 counts them."""
    episodes: list[Episode]
    """Latest episodes; their mean return is rollout/ep_rew_mean."""
    logged: dict[str, list[Any]]
    """Value and excluded formats of each unwritten number of the logger; texts and figures are not kept."""


def resume_state(
    learner: Learner, environments: SegmentedFootBipedVecEnv
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return a copy of everything that training changes: JSON values as in `Learning`, and arrays by name."""
    ppo = learner.ppo
    normalized = learner.normalized
    assert ppo._last_obs is not None and ppo._last_episode_starts is not None and ppo.ep_info_buffer is not None
    simulation = environments.state()
    json_values = {name: simulation.pop(name) for name in ("generators", FEET) if name in simulation}
    numpy_state = np.random.get_state(legacy=False)  # noqa: NPY002 - SB3 draws from it
    _, python_words, python_gauss = random.getstate()
    arrays = learner.state() | {f"{_SIMULATION}{name}": values for name, values in simulation.items()}
    arrays |= {
        "rollout.observation": np.array(ppo._last_obs),
        "rollout.episode_starts": np.array(ppo._last_episode_starts),
        "rollout.returns": normalized.returns.copy(),
        "random.torch": torch.get_rng_state().numpy().copy(),
        "random.numpy": numpy_state["state"]["key"].copy(),  # type: ignore[index]
        "random.python": np.array(python_words, np.uint32),
    }
    values = {
        **json_values,
        "actions": ppo.action_space.np_random.bit_generator.state,
        "numpy": [int(numpy_state["state"]["pos"]), numpy_state["has_gauss"], numpy_state["gauss"]],  # type: ignore[index]
        "python_gauss": python_gauss,
        "updates": ppo._n_updates,
        "episodes": [{"r": float(episode["r"]), "l": int(episode["l"])} for episode in ppo.ep_info_buffer],
        "logged": {
            name: [float(value), ppo.logger.name_to_excluded[name]]
            for name, value in ppo.logger.name_to_value.items()
            if isinstance(value, (int, float, np.number))
        },
    }
    return values, arrays


def restore_learning(
    learner: Learner,
    environments: SegmentedFootBipedVecEnv,
    values: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray],
) -> None:
    """Bring learner and environments to the state that `resume_state` returned as `values` and `arrays`.

    The entry `logged` is checked and left to the caller. Call it last: nothing may draw random numbers between it and
    the next rollout. Raises `SpringfootError` if the state does not fit this learner.
    """
    ppo = learner.ppo
    normalized = learner.normalized
    learner.restore({name: array for name, array in arrays.items() if name.startswith(_LEARNER)})
    try:
        simulation = {name: array for name, array in arrays.items() if name.startswith(_SIMULATION)}
        simulation = {name.removeprefix(_SIMULATION): array for name, array in simulation.items()}
        json_values = {name: values[name] for name in ("generators", FEET) if name in values}
        environments.restore(simulation | json_values)
        width = len(environments.env.biped.observation_names)
        normalized.returns = _checked_array(arrays, "rollout.returns", (ppo.n_envs,), np.float64)
        ppo._last_obs = _checked_array(arrays, "rollout.observation", (ppo.n_envs, width), np.float32)
        ppo._last_episode_starts = _checked_array(arrays, "rollout.episode_starts", (ppo.n_envs,), np.bool_)
        ppo._n_updates = require_count("updates", values["updates"], 0)
        episodes = ({"r": float(episode["r"]), "l": int(episode["l"])} for episode in values["episodes"])
        ppo.ep_info_buffer = deque(episodes, maxlen=ppo._stats_window_size)
        ppo.ep_success_buffer = deque(maxlen=ppo._stats_window_size)  # these environments report no success
        if not all(  # [value, formats] by name
            len(entry) == 2 and isinstance(entry[1], list) and isfinite(entry[0]) for entry in values["logged"].values()
        ):
            raise ValueError("logged must be values, each with the formats that leave it out")
        position, has_gauss, gauss = values["numpy"]
        ppo.action_space.np_random.bit_generator.state = values["actions"]
        # 3 and MT19937 are the versions of Python's and NumPy's state.
        random.setstate((3, tuple(map(int, arrays["random.python"])), values["python_gauss"]))
        np.random.set_state(("MT19937", arrays["random.numpy"], int(position), int(has_gauss), gauss))  # noqa: NPY002
        torch.set_rng_state(torch.from_numpy(arrays["random.torch"]))
    except SpringfootError:
        raise
    # All that values of another kind raise; RuntimeError is torch's.
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise SpringfootError(f"the training state does not fit its configuration: {reason}") from None


def _checked_array(arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int, ...], kind: type) -> np.ndarray:
    """Return the array `name` of the state `arrays`; raise `ValueError` unless it has this `shape`, numbers of this
    `kind` (a type of NumPy's), and all finite."""
    values = arrays[name]
    if values.shape != shape or values.dtype != kind:
        raise ValueError(f"{name} is {values.dtype} {values.shape}, not {kind.__name__} {shape}")
    if not np.isfinite(values).all():
        raise ValueError(f"{name} must be finite")
    return values
